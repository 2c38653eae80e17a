// Mid nodes: those of second-order cells that are no corners. A node in the middle of an edge
// belongs to the two vertices at its ends, one in the middle of a face to that face, and one in the
// middle of a cell to no other cell. So each is expected to be the vertex that stood there last,
// or a new one; one decision codes that it is.
// in:    cells whose corners are known       out: symbols for "connectivity"
// keeps: the vertices in the middle of live edges and faces, the models; the same in
//        encoder and decoder
// spec: "Mid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "entropy/models.h"
#include "surface/active_surface.h"
#include "surface/cell_topology.h"
#include "surface/node_layout.h"
#include "surface/number_map.h"

namespace shm {

/// Which vertex is in the middle of which edge or face. At most one entry for each live vertex.
class MiddleTable {
 public:
  explicit MiddleTable(const ActiveSurface& surface) : surface_(&surface) {}

  /// Two live vertices, in any order: the ends of an edge, or opposite corners of a face.
  struct Place {
    std::uint32_t low = kNone, high = kNone;  ///< slots, low: of the older one
    bool is_face = false;
  };
  Place edge(std::uint32_t a, std::uint32_t b) const;
  /// Of its two diagonals the one with the oldest vertex.
  Place face(const std::array<std::uint32_t, 4>& corners) const;

  /// The live vertex there, kNone when there is none.
  std::uint32_t find(const Place& place) const;
  /// `slot` is there from now on, and nowhere else.
  void put(const Place& place, std::uint32_t slot);
  /// Before `slot` is finalized.
  void forget(std::uint32_t slot) {
    if (slot < entries_.size() && entries_[slot].is_set) erase(slot);
  }

  /// What belongs to a vertex in the middle of an edge: faces of cells, each as often as it was
  /// met, modulo 2.
  std::uint64_t& open(std::uint32_t slot) { return entries_[slot].open; }

 private:
  struct Entry {
    std::uint64_t key = 0, low = 0, high = 0;  // low, high: stream numbers
    std::uint64_t open = 0;
    bool is_set = false, is_face = false;
  };
  static std::uint64_t key_of(const Place& place) {
    return std::uint64_t{place.low} << 32 | place.high;
  }
  void erase(std::uint32_t slot);

  const ActiveSurface* surface_;
  std::vector<Entry> entries_;     // by slot of the vertex in the middle
  std::array<IdMap, 2> by_place_;  // of edges, of faces: by slots, to the vertex in the middle
};

template <class Coder>
class MidNodes {
 public:
  /// `surface` is borrowed.
  explicit MidNodes(const ActiveSurface& surface) : surface_(&surface), middles_(surface) {}

  /// Before the first mid node of a cell whose corners are known.
  void begin_cell(const CellTopology& cell);
  /// Whether the node at a position is the expected one, which it then is in the cell: kNone stands
  /// for a new vertex. Encoding: cell.slots has it.
  bool code(Coder& symbols, CellTopology& cell, const MidNode& node, std::uint32_t position);
  /// Takes note of what stands there.
  void note(const CellTopology& cell, const MidNode& node, std::uint32_t position);
  /// Whether the cell is the last one to use its node, which stands at no earlier position. After
  /// note() of all.
  bool code_last_use(Coder& symbols, const CellTopology& cell, const MidNode& node,
                     std::uint32_t position, bool is_last);
  /// Before a vertex is finalized.
  void forget(std::uint32_t slot) { middles_.forget(slot); }

 private:
  std::uint32_t expected(const CellTopology& cell, const MidNode& node) const;
  MiddleTable::Place place_of(const CellTopology& cell, const MidNode& node) const;
  AdaptiveBit& last_use_model(const CellTopology& cell, const MidNode& node,
                              std::uint32_t position);

  const ActiveSurface* surface_;
  MiddleTable middles_;
  std::array<std::uint64_t, 6> signatures_{};  // of the sides of the cell at hand

  // contexts
  std::array<std::uint8_t, MidNode::kKinds> missed_{};  // whether the last one was
  std::array<std::uint8_t, kMostLayoutNodes> ended_{};  // last answer, by position

  // models
  /// By kind, whether a known vertex is expected, whether the last one was missed.
  std::array<std::array<std::array<AdaptiveBit, 2>, 2>, MidNode::kKinds> as_expected_;
  AdaptiveBit body_ends_;
  std::array<AdaptiveBit, 2> ends_with_corner_;          // of edges, of faces
  std::array<std::array<AdaptiveBit, 2>, 3> face_ends_;  // by uses, what ended last here
  std::array<std::array<std::array<AdaptiveBit, 2>, 8>, 2> edge_ends_;  // closed, uses, the same
};

extern template class MidNodes<RangeEncoder>;
extern template class MidNodes<RangeDecoder>;

}  // namespace shm
