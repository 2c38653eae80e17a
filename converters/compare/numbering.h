// NumberingSearch: finds the relation between the numbers of vertices and cells in a restored mesh
// and in its source. It makes guesses, which are then checked. The first guess is that the numbers
// are the same. Each further guess consists of the numbers that result from encoding the source
// again in one of the orders of cells that match the restored mesh.
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

// Number in the source for each restored vertex and cell. Null if the numbers are the same.
struct Numbering {
  std::shared_ptr<NumberList> vertices, cells;
};

// A renumbered copy of the source in a spool, with tables about it. Used if the source does not fit
// in memory, and created once for all guesses.
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
  // Borrows all arguments. `given_order` is an order of cells that is tried in addition to the
  // known orders; it may be null. `spooled` holds the renumbered source, which is created when it
  // is needed.
  NumberingSearch(MeshSource& source, MeshSource& restored, Spool& spool, const Progress& progress,
                  const CellSequence* given_order, std::unique_ptr<SpooledSource>& spooled);

  // Returns true if numbers may differ, i.e. if only the restored mesh has another order than keep.
  bool is_wanted() const { return wanted_; }
  // Adopts guess number `guess`. Throws Failure if the guess is not a bijection.
  void take(std::size_t guess);
  // Returns true if there is another guess. Requires take().
  bool has_more() const { return has_more_; }

  // Returns the source. After take() this may be the renumbered copy. All source numbers below then
  // are numbers of the copy.
  MeshSource& source() { return *source_; }
  // Returns the spool for the comparison. The search uses the same spool, and leaves memory in it
  // for a renumbered source.
  Spool& spool() { return *spool_; }
  // Return the source's number of each restored vertex, cell, or element of an array. Null means
  // that the numbers are the same.
  NumberList* vertices() { return numbering_.vertices.get(); }
  NumberList* cells() { return numbering_.cells.get(); }
  NumberList* elements(std::size_t array);
  // Returns the tables that convert the source's numbers to restored numbers.
  Renumbering to_restored();
  // Returns true if a restored cell of `block` has the corners of the source's cell. If rotations
  // are allowed, the corners may be rotated.
  bool same_corners(std::span<const std::uint64_t> source, std::span<const std::uint64_t> restored,
                    std::uint32_t block);
  // Returns the corners of the restored cell that was passed last to same_corners(), in the
  // source's numbers.
  const std::vector<std::uint64_t>& mapped_corners() const { return mapped_; }
  // Formats corners with the original numbers of the source.
  std::string corners_text(std::span<const std::uint64_t> corners) const;
  // Returns the size in bytes of a cache for the source's values.
  std::size_t cache_bytes() const;

  // Returns the current guess, in the original numbers of the source. The result is stored in
  // `spool`.
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
  const SpooledMesh* in_spool_ = nullptr;  // set if source_ is the renumbered copy
  bool wanted_, has_more_ = false;
  Numbering numbering_;
  std::optional<NumberTable> source_vertex_;  // source's number of each restored vertex

  // Position of each source vertex. If the table exists, the numbering is a bijection.
  std::optional<NumberTable> position_of_vertex_;
  std::optional<NumberTable> position_of_cell_;
  std::unique_ptr<CoveredOrder> covered_;
  std::vector<std::uint64_t> mapped_;
};

}  // namespace shm::converters
