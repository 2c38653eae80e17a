// NumberingSearch: how the vertices and cells of a restored mesh are numbered, by those of its
// source. Guesses, which are then checked like anything else: numbers as they are, or as encoding
// the source again gives them, in each order of cells that fits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/coding_order.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "order/spooled_mesh.h"

namespace shm::converters {

// The source's number of each restored vertex and cell; null: the same.
struct Numbering {
  std::shared_ptr<NumberList> vertices, cells;
};

// The source with other numbers and what is found about it, where it does not fit the memory. Made
// once for all guesses.
struct SpooledSource {
  SpooledSource(MeshSource& source, const Spool& spool, const Progress& progress)
      : memory(spool.memory_budget()),
        mesh_spool(spool.directory(), memory.mesh_bytes),
        table_spool(spool.directory(), memory.table_bytes),
        mesh(source, mesh_spool, memory.sort_bytes, progress) {}

  SpooledSearch memory;
  Spool mesh_spool, table_spool;
  SpooledMesh mesh;
};

class NumberingSearch {
 public:
  // Borrows all but `given_order`, which may be null: the order of cells where it is none of those
  // that are tried. `spooled`: where the source with other numbers is; made where it is needed.
  NumberingSearch(MeshSource& source, MeshSource& restored, Spool& spool, const Progress& progress,
                  const CellSequence* given_order, std::unique_ptr<SpooledSource>& spooled);

  // Whether numbers may differ at all: only the restored mesh is in another order than keep.
  bool is_wanted() const { return wanted_; }
  // Takes up guess number `guess`. Throws Failure where it is no bijection.
  void take(std::size_t guess);
  // After take(): there is another guess.
  bool has_more() const { return has_more_; }

  // The source; after take() perhaps the same mesh with other numbers, which the others mean.
  MeshSource& source() { return *source_; }
  // For what is compared: that of the search, which leaves room for a source with other numbers.
  Spool& spool() { return *spool_; }
  // The source's number of each restored vertex, cell, element of an array; null: the same.
  NumberList* vertices() { return numbering_.vertices.get(); }
  NumberList* cells() { return numbering_.cells.get(); }
  NumberList* elements(std::size_t array);
  // From the source's numbers to restored ones.
  Renumbering to_restored();
  // Whether a restored cell of `block` has the source's corners, turned where that is allowed.
  bool same_corners(std::span<const std::uint64_t> source, std::span<const std::uint64_t> restored,
                    std::uint32_t block);
  // The corners of the restored cell that same_corners was asked about, in the source's numbers.
  const std::vector<std::uint64_t>& mapped_corners() const { return mapped_; }
  // In words, with the numbers that the source came with.
  std::string corners_text(std::span<const std::uint64_t> corners) const;
  // For pages of the source's values.
  std::size_t cache_bytes() const;

  // The guess, in the numbers that the source came with. It lives in `spool`.
  Numbering numbering(Spool& spool) const;

 private:
  bool same_as_they_are();
  bool same_within_blocks();
  void replay(std::size_t guess);
  bool replay_free_order(std::size_t guess);
  void take_up_spooled();
  void follow(std::shared_ptr<NumberList> vertices, std::shared_ptr<NumberList> cells);

  MeshSource* source_;
  MeshSource* restored_;
  Spool* spool_;
  const Progress& progress_;
  const CellSequence* given_order_;
  std::unique_ptr<SpooledSource>& spooled_;
  const SpooledMesh* in_spool_ = nullptr;  // source_ is this one, with numbers of its own
  bool wanted_, has_more_ = false;
  Numbering numbering_;
  std::optional<NumberTable> source_vertex_;       // of a restored vertex
  std::optional<NumberTable> position_of_vertex_;  // of a source vertex; exists: a bijection
  std::optional<NumberTable> position_of_cell_;
  std::unique_ptr<CoveredOrder> covered_;
  std::vector<std::uint64_t> mapped_;
};

}  // namespace shm::converters
