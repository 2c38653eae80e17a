// Connectivity: codes the vertices of each cell, and codes which of these vertices the cell
// finalizes. It codes cells in coding order as symbols of the bitstreams "connectivity" and "corner
// order". Encoder and decoder keep the same state: the active surface, a coder for hexahedra, and
// the models.
// spec: "Connectivity stream", "Corner order stream"
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "codecs/paper/paper_hexahedra.h"
#include "codecs/surface/cells/cell_corners.h"
#include "codecs/surface/cells/mid_nodes.h"
#include "codecs/surface/cells/mixed_rows.h"
#include "codecs/surface/cells/polyhedra.h"
#include "codecs/surface/cells/replay_hexahedra.h"
#include "codecs/surface/cells/row_hexahedra.h"
#include "entropy/models.h"
#include "mesh/active_surface.h"
#include "mesh/cell_topology.h"
#include "shm/schema.h"

namespace shm {

/// Coders of hexahedra that find vertices by number. These coders need the number of each vertex.
/// They do not add cells to the active surface. They code the last uses together with the corners.
template <class Hexahedra>
concept FindsByNumber = requires(Hexahedra& hexahedra, std::uint32_t slot) {
  hexahedra.set_number(slot, std::uint64_t{});
  hexahedra.forget(slot);
};
/// Coders of hexahedra that have their own models for the last uses of corners.
template <class Hexahedra, class Coder>
concept CodesLastUse = requires(Hexahedra& hexahedra, Coder& symbols, CellTopology& cell) {
  hexahedra.code_last_use(symbols, cell);
};

template <class Coder>
class Connectivity {
 public:
  /// `schema` must outlive this object.
  explicit Connectivity(const Schema& schema);
  Connectivity(const Connectivity&) = delete;  // the coders contain pointers to the surface
  Connectivity& operator=(const Connectivity&) = delete;

  /// Sets the codec of hexahedra. Call it before the first cell. The default is the codec `rows`.
  /// Precondition: `codec` is neither automatic nor shifts nor patterns.
  void set_codec(ConnectivityCodec codec);

  /// Codes one cell. Encoding: `stored` is the cell. Decoding: `stored` is not read. In both cases
  /// the function sets `cell` and introduces the cell's new vertices. Returns false only when
  /// decoding damaged data. Call finish_cell() after it.
  bool code_cell(Coder& symbols, Coder& corner_order, const StoredCell& stored, CellTopology& cell);
  /// Like code_cell(), for decoders.
  bool decode_cell(Coder& symbols, Coder& corner_order, CellTopology& cell) {
    return code_cell(symbols, corner_order, nothing_, cell);
  }
  /// Finalizes the vertices that no later cell uses. Until this call, all vertices and neighbours
  /// of the cell are valid.
  void finish_cell(const CellTopology& cell);

  /// Returns true if the numbers of a hexahedron's corners are coded together with the hexahedron.
  /// In this case the encoder reads StoredCell::original, and encoder and decoder set
  /// CellTopology::original.
  bool codes_numbers() const { return schema_->order == Order::keep && finds_by_number_; }
  /// Sets the number of a new vertex. Call it for vertices that are not corners of a hexahedron.
  /// Precondition: codes_numbers().
  void set_number(std::uint32_t slot, std::uint64_t number);

  /// Introduces a vertex that no cell uses. Call remove_unused_vertex() to finalize it.
  std::uint32_t add_unused_vertex() { return surface_.add_vertex(); }
  void remove_unused_vertex(std::uint32_t slot) { surface_.finalize(slot); }

  const ActiveSurface& surface() const { return surface_; }

 private:
  struct NodeModel {
    std::array<AdaptiveBit, 2> is_new;
    AdaptiveBit repeated;
    SignedModel<NumberModel> step;
    NumberModel repeat;
  };
  /// Calls use(coder) with the coder of hexahedra.
  template <class Use>
  auto with_hexahedra(Use&& use) {
    return std::visit([&](auto& hexahedra) { return use(*hexahedra); }, hexahedra_);
  }

  bool code_block(Coder& symbols, CellTopology& cell);
  bool code_count(Coder& symbols, CellTopology& cell);
  bool code_polyhedron(Coder& symbols, const StoredCell& stored, CellTopology& cell);
  bool code_hexahedron(Coder& symbols, Coder& corner_order, const StoredCell& stored,
                       CellTopology& cell);
  bool code_nodes(Coder& symbols, const StoredCell& stored, CellTopology& cell,
                  std::uint32_t first_position);
  /// Returns true if the stored order of the corners is coded for the hexahedra of this block.
  bool order_matters(const BlockInfo& block) const {
    return schema_->corner_order || block.nodes_per_cell != 8;
  }
  bool code_node(Coder& symbols, const StoredCell& stored, CellTopology& cell, std::uint32_t rank,
                 std::uint64_t& shift);
  void add_vertex(const StoredCell& stored, CellTopology& cell, std::uint32_t position);
  void begin_layout(CellTopology& cell);
  static std::uint32_t earlier_rank(const StoredCell& stored, const CellTopology& cell,
                                    std::uint32_t rank);
  void sort_numbers(const StoredCell& stored);
  void fill_farther_repeats(const StoredCell& stored, CellTopology& cell, std::uint32_t position);
  void code_last_use(Coder& symbols, CellTopology& cell);
  std::size_t code_last_use_of_corners(Coder& symbols, CellTopology& cell);

  const Schema* schema_;
  std::vector<LayoutOfBlock> layouts_;  // by block
  const StoredCell nothing_;            // passed when decoding
  ActiveSurface surface_;
  std::variant<std::unique_ptr<RowHexahedra<Coder>>, std::unique_ptr<MixedRows<Coder>>,
               std::unique_ptr<ReplayHexahedra<Coder>>, std::unique_ptr<PaperHexahedra<Coder>>>
      hexahedra_;
  bool has_codec_ = false;
  bool finds_by_number_ = false;  // true if the coder in hexahedra_ finds vertices by number

  // Null if all cells are hexahedra
  std::unique_ptr<CellCorners<Coder>> others_;
  std::optional<MidNodes<Coder>> mid_nodes_;     // empty unless there are second-order cells
  std::unique_ptr<Polyhedra<Coder>> polyhedra_;  // null if no polyhedra are stored by faces

  // Contexts of the next decisions
  std::uint32_t last_block_ = 0;
  std::array<std::uint8_t, 8> last_finalized_{};
  /// For each block: the vertex ids of its most recent cell, in the order of the nodes.
  std::map<std::uint32_t, std::vector<std::uint64_t>> node_ids_;
  bool last_new_ = false;

  // Encoding: positions sorted by number
  std::vector<std::pair<std::uint64_t, std::uint32_t>> positions_;

  // Adaptive models of the decisions
  AdaptiveBit same_block_;
  NumberModel block_number_, node_count_;
  std::vector<std::unique_ptr<NodeModel>> nodes_;
  /// Models of the decision whether this is the last use of a vertex. The indices are: whether the
  /// vertex is a corner of a hexahedron, the number of active faces at the vertex, the number of
  /// cells so far that use it, and the previous decision at this position.
  std::array<std::array<std::array<std::array<AdaptiveBit, 2>, 9>, 6>, 2> last_use_;
};

extern template class Connectivity<RangeEncoder>;
extern template class Connectivity<RangeDecoder>;

}  // namespace shm
