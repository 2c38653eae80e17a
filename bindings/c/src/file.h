// shmf_file: the handle of an open file.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "errors.h"
#include "shm/archive.h"
#include "shm/io.h"
#include "shm/mesh_extract.h"
#include "shm/sets.h"
#include "shmformat.h"

namespace shmf {

/// The selected part of a mesh, which shmf_read() returns, and the counts of its elements.
struct Piece {
  shm::CellSelection cells;
  /// true: the file is undamaged and all cells are selected, so all numbers are the same as in the
  /// file
  bool whole = true;
  bool counted = false;  ///< true: the counts below are known
  std::uint64_t vertex_count = 0, cell_count = 0, corner_count = 0;
  std::vector<std::uint64_t> block_cells;
  /// Numbers, in the file, of the selected vertices and of the selected cells, ascending. Empty if
  /// `whole` is true.
  std::vector<std::uint64_t> vertices, numbers;
};

shm::ReadLimits limits_of(const shmf_open_options& options);
/// Describes the mesh that a schema declares. The schema does not contain counts of elements, so
/// these are 0.
shmf_info info_of(const shm::Schema& schema);
shm::Result<shmf_block> block_of(const shm::Schema& schema, std::uint32_t block);
shm::Result<shmf_array> array_of(const shm::Schema& schema, std::uint32_t array);
shmf_extra extra_of(const shm::Extra& extra);
/// Returns the number of elements of an array. `block_cells` contains the number of cells of each
/// block.
std::uint64_t elements_of(const shm::Schema& schema, std::uint32_t array, std::uint64_t vertices,
                          const std::vector<std::uint64_t>& block_cells);

}  // namespace shmf

struct shmf_file {
  // Keep the order of these members: later members borrow data from earlier members, so they must
  // be destroyed first.
  std::string name;  // name of the file for messages; may be empty
  std::shared_ptr<shm::RandomSource>
      source;  // source of the whole file; if this is a member of an archive, source of the archive
  std::optional<shm::SectionSource> section;  // section of the archive that contains this member
  std::optional<shm::ArchiveReader> archive;
  shm::ReadLimits limits;
  bool damaged = false;
  std::optional<shm::MeshExtractor> mesh;  // the mesh of the file; empty for an archive

  std::optional<std::vector<double>> times;
  std::vector<std::uint64_t> array_steps;
  std::optional<std::vector<shm::Extra>> extras;
  std::optional<std::vector<shm::MeshSet>> sets;
  shmf::Piece piece;
  mutable std::atomic<bool> busy = false;  // true while a call for this file is running

  shm::RandomSource& bytes() {
    return section ? static_cast<shm::RandomSource&>(*section) : *source;
  }
  const shm::Schema& schema() const { return mesh->schema(); }
  shm::Result<void> read_extras();
  shm::Result<void> read_sets();
  shm::Result<void> count_piece(const shmf_run_options& run);
};

namespace shmf {

/// Like guarded(), runs `call` and stores errors in *error, and also adds the name of the file to
/// them. Fails with misuse if the file is an archive, or if another call for this file is still
/// running. The other call may run in another thread, or it may have called a callback that makes
/// this call.
template <class Call>
shmf_status with_mesh(const shmf_file* file, shmf_error* error, Call&& call) noexcept {
  return guarded(error, [&]() -> shm::Result<void> {
    if (file == nullptr) return misuse("the file is NULL");
    if (!file->mesh) return misuse("this is an archive: open one of its members");
    if (file->busy.exchange(true)) return misuse("the file is busy with another call");
    struct Leaving {
      std::atomic<bool>& busy;
      ~Leaving() { busy = false; }
    } leaving{file->busy};
    auto done = call();
    if (done) return {};
    shm::Error why = done.error();
    if (why.file.empty()) why.file = file->name;
    return why;
  });
}

}  // namespace shmf
