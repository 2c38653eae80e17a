// NumberingSearch: finds the renumbering between the vertices and cells of a source and those of
// the restored mesh. It proposes candidates, which the caller checks. If both meshes have the same
// cells in the same order, in the whole mesh or in each block, the first candidate uses this order.
// Each further candidate results from encoding the source again, in one of the known cell orders
// that match the restored mesh.
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

// For each restored vertex and cell, its number in the source. A list is null if the numbers are
// equal in both meshes.
struct Numbering {
  std::shared_ptr<NumberList> vertices, cells;
};

// A renumbered copy of the source in a spool (temporary storage, on disk if large), and a second
// spool for tables. Used if the source does not fit in memory. All candidates use the same object,
// which is created once.
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
  // Borrows all arguments. If `given_order` is not null, the source is encoded again only with its
  // cells in this order. Otherwise all known orders of the cells are tried. `spooled` receives the
  // renumbered source, which is created when it is first needed.
  NumberingSearch(MeshSource& source, MeshSource& restored, Spool& spool, const Progress& progress,
                  const CellSequence* given_order, std::unique_ptr<SpooledSource>& spooled);

  // Returns true if the source and the restored mesh may number their vertices and cells
  // differently. This is the case if the restored mesh was encoded in an order other than `keep`,
  // and the source was not.
  bool is_wanted() const { return wanted_; }
  // Adopts the candidate with index `guess`. Throws Failure if the candidate is not a bijection.
  void take(std::size_t guess);
  // Returns true if there may be another candidate. Precondition: take() has been called.
  bool has_more() const { return has_more_; }

  // Returns the source. After take(), this may be the renumbered copy. In this case, the functions
  // below use the vertex and cell numbers of the copy as numbers of the source.
  MeshSource& source() { return *source_; }
  // Returns the spool (temporary storage) that the comparison should use. The search for the
  // renumbering uses it too. If there is a renumbered copy of the source, this spool has a smaller
  // memory budget.
  Spool& spool() { return *spool_; }
  // Return a list that contains, for each restored vertex, cell, or array element, its number in
  // the source. Null means that the numbers are equal in both meshes.
  NumberList* vertices() { return numbering_.vertices.get(); }
  NumberList* cells() { return numbering_.cells.get(); }
  NumberList* elements(std::size_t array);
  // Returns the tables that convert the source's numbers to restored numbers.
  Renumbering to_restored();
  // Returns true if a restored cell of `block` has the same corners as a cell of the source. If the
  // mesh allows rotations, the corners may be rotated.
  bool same_corners(std::span<const std::uint64_t> source, std::span<const std::uint64_t> restored,
                    std::uint32_t block);
  // Returns the corners of the restored cell that was most recently passed to same_corners(), as
  // vertex numbers of the source.
  const std::vector<std::uint64_t>& mapped_corners() const { return mapped_; }
  // Returns a list of corners as text, with the original vertex numbers of the source.
  std::string corners_text(std::span<const std::uint64_t> corners) const;
  // Returns the size in bytes that a cache for values of the source should have.
  std::size_t cache_bytes() const;

  // Returns the current candidate, with the original numbers of the source. Its lists are stored in
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

  // Restored number of each vertex of the source. The table exists only if the renumbering has been
  // checked to be a bijection.
  std::optional<NumberTable> position_of_vertex_;
  std::optional<NumberTable> position_of_cell_;
  std::unique_ptr<CoveredOrder> covered_;
  std::vector<std::uint64_t> mapped_;
};

}  // namespace shm::converters
