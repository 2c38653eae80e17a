// Order::free, the writer's side: which order of the cells is smallest, found by trying.
// A sample of the mesh is coded in the order it came in and in every other one that is known; the
// order with the fewest bytes, all data counted, is taken for the whole mesh.
// Memory, while orders are made: 115 bytes a cell, 8 a vertex, and the sample with its values.
// Afterwards: the cells and their order, 36 bytes a hexahedron. Where that is too much all of it is
// in a spool, in which the order found is the same; see spooled_mesh.h.
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

// A way to order cells.
struct CellOrdering {
  enum class Kind : std::uint8_t { stored, breadth_first, swept, enclosed_first, hilbert };
  Kind kind = Kind::stored;
  std::uint8_t layers_along = 0;  // swept only
  bool within_blocks = false;     // connected parts of one block are kept together
};

// All that are worth a trial for these cells; the order they come in is the first.
std::vector<CellOrdering> cell_orderings(const Cells& cells);

// Where orders are searched for.
struct SearchRoom {
  Spool* spool = nullptr;  // takes the orders found; null: all is in memory, whatever that takes
  std::size_t memory = 0;  // beside the spool, for spools of what an order is made with
};

// Makes orders of one mesh. Those `within_blocks` should be asked for last.
class CellOrderer {
 public:
  // Borrows both. `mesh`: with the vertices that the cells know.
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

// Encodes a mesh that has the arrays of the source; how large it is.
using TrialCoder = std::function<SizeReport(MeshSource& part)>;

// The order found; nothing: the one that the cells came in. `cells`: those of `mesh`, by its
// numbers or others; `located`: the mesh with the vertices that they know, perhaps the same.
std::optional<CellList> find_free_order(MeshSource& mesh, const Cells& cells, MeshSource& located,
                                        const TrialCoder& code, const Progress& progress = {},
                                        const SearchRoom& room = {});

// Bytes of a sample in the order found, by those that `code_as_is` needs.
double share_in_free_order(MeshSource& mesh, const CellTable& cells, const TrialCoder& code,
                           const TrialCoder& code_as_is);

}  // namespace shm::converters
