// Order::free in the writer: finds, by trials, the order of cells with the smallest file. It codes
// a sample of the mesh in the original order and in every other known order. The order in which all
// data of the sample needs the fewest bytes is used for the whole mesh. While orders are computed,
// 115 bytes per cell, 8 per vertex, and the sample with its values are in memory. Afterwards the
// cells and their order are in memory, 36 bytes per hexahedron. If that exceeds the limit, all
// tables are in a spool, and the resulting order is the same; see spooled_mesh.h.
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
  std::uint8_t layers_along = 0;  // axis along which layers are stacked; used by swept orders only
  bool within_blocks = false;     // true: keeps connected parts of a block together
};

// Returns all orderings that are worth a trial for these cells. The first one is the original
// order.
std::vector<CellOrdering> cell_orderings(const Cells& cells);

// Memory for the search.
struct SearchRoom {
  // Spool for the resulting orders; null: all tables are in memory, without a limit.
  Spool* spool = nullptr;
  std::size_t memory = 0;  // bytes for spools of temporary tables, in addition to `spool`
};

// Computes orders of one mesh. Orderings `within_blocks` must be requested last.
class CellOrderer {
 public:
  // Borrows `cells` and `mesh`. `mesh`: mesh that has the vertices in the numbering of `cells`.
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

// Encodes a mesh that has the arrays of the source. Returns the sizes of the encoded data.
using TrialCoder = std::function<SizeReport(MeshSource& part)>;

// Returns the best order, or nothing if that is the original order. `cells`: the cells of `mesh`,
// in its own or another numbering. `located`: mesh that has the vertices in the numbering of
// `cells`; may be `mesh` itself.
std::optional<CellList> find_free_order(MeshSource& mesh, const Cells& cells, MeshSource& located,
                                        const TrialCoder& code, const Progress& progress = {},
                                        const SearchRoom& room = {});

// Returns the size of a sample in the best order, divided by its size when it is coded by
// `code_as_is`.
double share_in_free_order(MeshSource& mesh, const CellTable& cells, const TrialCoder& code,
                           const TrialCoder& code_as_is);

}  // namespace shm::converters
