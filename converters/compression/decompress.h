// Decompresses a .shm file to a MeshSource whose data is kept in a spool (temporary storage).
//
// All data is staged (copied to the spool) in coding order, the order in which it arrives. Tables
// convert the numbers of vertices and cells to positions in coding order. A count that the file
// merely states never determines how much memory is allocated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/cell_store.h"
#include "mesh/coding_order.h"
#include "mesh/mesh_source.h"
#include "shm/reader.h"

namespace shm::converters {

class StagedMesh final : public MeshSource {
 public:
  // Reads `source` to its end. Throws the library's error for a bad file, and Failure (corrupt) if
  // the parts of the file contradict each other. `name` is used in errors. `spool` must outlive the
  // mesh.
  StagedMesh(ByteSource& source, const std::string& name, Spool& spool,
             const ReadLimits& limits = {}, const ReadOptions& options = {});

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void seek_cells(std::uint64_t first) override { next_cell_ = first; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  const Totals& totals() const { return totals_; }
  // Numbers of all vertices and of all cells, in coding order.
  NumberList& vertex_order() { return vertex_numbers_; }
  NumberList& cell_order() { return cell_numbers_; }

 private:
  struct Array {
    PagedArray values;  // values of all elements at the first staged step, followed by those at the
                        // second staged step, and so on
    std::map<std::uint64_t, std::uint64_t> steps;  // maps a step to its index among the steps in
                                                   // `values`
    std::uint64_t staged = 0;                      // number of elements staged

    // Position of each element in the coding order. Set only if cells are reordered, and only for
    // cell arrays that do not cover all blocks.
    std::unique_ptr<NumberTable> positions;
  };
  void stage_mesh(const MeshBlock& block);
  void stage_step(const StepPiece& piece);
  void finish();
  void map_partial_arrays();
  // Reads the elements `first` to `first` + `count` - 1 from `values`. Element i is at index `base`
  // + `positions`[i], or `base` + i if `positions` is null.
  void gather(PagedArray& values, std::uint64_t base, std::size_t stride, NumberTable* positions,
              std::uint64_t first, std::uint64_t count, std::byte* out);
  [[noreturn]] void fail(const std::string& section, const std::string& detail) const;

  std::string name_;
  Spool* spool_;
  MeshInfo info_;
  Totals totals_;
  PagedArray points_;
  CellStore cells_;
  NumberList vertex_numbers_, cell_numbers_;  // numbers of vertices and cells, in coding order
  bool vertices_moved_ = false, cells_moved_ = false;
  std::optional<NumberTable> vertex_positions_, cell_positions_;
  std::vector<Array> arrays_;
  std::uint64_t next_cell_ = 0;
  bool mesh_done_ = false;
};

// Returns the limits for reading a file through a spool.
ReadLimits read_limits(const Spool& spool);

// Stages a .shm file of `total` bytes (0: unknown). `name` is used in messages. Decodes with
// `threads` threads; 0 means one per core.
std::unique_ptr<StagedMesh> stage_shm(ByteSource& source, const std::string& name,
                                      std::uint64_t total, Spool& spool, const Progress& progress,
                                      unsigned threads, std::uint64_t bytes_of_file = 0);
// Stages the .shm file at `path`. If `path` is "-", reads standard input. `threads` has the same
// meaning as in stage_shm().
std::unique_ptr<MeshSource> open_shm(const std::string& path, Spool& spool,
                                     const Progress& progress, unsigned threads);
std::unique_ptr<MeshSource> open_shm(const std::string& path, Spool& spool,
                                     const Progress& progress = {});

// Summary of the contents of a .shm file.
struct FileSummary {
  MeshInfo info;
  Totals totals;
};
// Reads the summary from the index and the headers of the chunks. `name` is used in messages.
FileSummary summarize_shm(RandomSource& source, const std::string& name);
FileSummary summarize_shm(const std::string& path);
// Computes the summary of a file that cannot be read at arbitrary offsets, e.g. standard input.
// Reads and checks the whole file.
FileSummary summarize_stream(ByteSource& source, const std::string& name, const Progress& progress);

}  // namespace shm::converters
