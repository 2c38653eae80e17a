// Implements the option --order free (Order::free): searches for the order of cells that results in
// the smallest file. The search encodes a sample of the mesh in the original order and in every
// order of cell_orders.h. The order in which all data of the sample needs the fewest bytes is used
// for the whole mesh. The search needs 115 bytes of memory per cell, 8 bytes per vertex, and memory
// for the sample with its values. After the search, the cells and their order need 36 bytes per
// hexahedron. If the memory limit is too low for this, all tables are stored in a spool (see
// spooled_mesh.h). The spool does not affect the resulting order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "base/progress.h"
#include "mesh/cell_table.h"
#include "mesh/mesh_source.h"
#include "order/cell_graph.h"
#include "order/cell_orders.h"
#include "shm/writer.h"

namespace shm::converters {

// A method that determines an order of cells.
struct CellOrdering {
  enum class Kind : std::uint8_t { stored, breadth_first, swept, enclosed_first, hilbert };
  Kind kind = Kind::stored;
  std::uint8_t layers_along = 0;  // argument of swept_order(); used only by Kind::swept
  bool within_blocks = false;     // if true, cells of different blocks do not count as neighbours
};

// Returns all orderings that should be tried for these cells. The first is the original order.
std::vector<CellOrdering> cell_orderings(const Cells& cells);

// Memory limits of the search.
struct SearchRoom {
  // Spool for the resulting orders. If it is null, all tables are kept in memory, without a memory
  // limit.
  Spool* spool = nullptr;
  std::size_t memory = 0;  // limit in bytes for temporary tables outside of `spool`
};

// Computes orders of the cells of one mesh. Request the orderings with `within_blocks` after all
// others, because returning to an ordering without `within_blocks` requires a new cell graph.
class CellOrderer {
 public:
  // Borrows `cells` and `mesh`. The vertices of `mesh` must be numbered as in `cells`.
  CellOrderer(const Cells& cells, MeshSource& mesh, Progress progress = {},
              const SearchRoom& room = {})
      : cells_(&cells), mesh_(&mesh), progress_(std::move(progress)), room_(room) {}
  CellList operator()(const CellOrdering& ordering);
  const CellGraph& graph() { return graph(false); }

 private:
  const CellGraph& graph(bool within_blocks);
  CellList order(const CellOrdering& ordering, Spool* scratch);

  const Cells* cells_;
  MeshSource* mesh_;
  Progress progress_;
  SearchRoom room_;
  std::unique_ptr<Spool> graph_spool_;
  std::optional<CellGraph> graph_;
  bool cut_ = false;
};

// Encodes `part`, a sample of a mesh with all arrays of the mesh. Returns the sizes of the encoded
// data.
using TrialCoder = std::function<SizeReport(MeshSource& part)>;

// Returns the best order of the cells of `mesh`, or nothing if that is the original order. `cells`
// contains the same cells, but may number cells and vertices differently. `located` provides the
// positions of the vertices: it must have the vertices of `mesh`, numbered as in `cells`, and may
// be `mesh` itself.
std::optional<CellList> find_free_order(MeshSource& mesh, const Cells& cells, MeshSource& located,
                                        const TrialCoder& code, const Progress& progress = {},
                                        const SearchRoom& room = {});

// Calls `code` to encode a sample of the mesh in the best order, and `code_as_is` to encode the
// sample in the original order. Returns the size of the first result divided by that of the second.
double share_in_free_order(MeshSource& mesh, const CellTable& cells, const TrialCoder& code,
                           const TrialCoder& code_as_is);

}  // namespace shm::converters
