// Mid nodes: the nodes of second-order cells that are not corners. A node in the middle of an edge
// belongs to the two vertices at its ends, a node in the middle of a face to that face, and a node
// in the middle of a cell to that cell only. So each node is expected to be the vertex that an
// earlier cell had in the same place, or a new vertex if none exists. One decision codes whether
// the expectation is right.
//
// The coder needs cells whose corners are known, and codes symbols of the bitstream "connectivity".
// Encoder and decoder keep the same state: the vertices in the middle of live edges and faces, and
// the models.
// spec: "Mid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/number_map.h"
#include "entropy/models.h"
#include "mesh/active_surface.h"
#include "mesh/cell_topology.h"
#include "mesh/node_layout.h"

namespace shm {

/// Maps edges and faces to the vertices in their middle. Each live vertex has at most one entry.
class MiddleTable {
 public:
  explicit MiddleTable(const ActiveSurface& surface) : surface_(&surface) {}

  /// Two live vertices, in any order: the ends of an edge, or opposite corners of a face.
  struct Place {
    std::uint32_t low = kNone, high = kNone;  ///< slots; low is the slot of the older vertex
    bool is_face = false;
  };
  Place edge(std::uint32_t a, std::uint32_t b) const;
  /// Returns one of the two diagonals of the face: the diagonal with the oldest vertex of the face.
  Place face(const std::array<std::uint32_t, 4>& corners) const;

  /// Returns the live vertex at `place`; kNone if none exists.
  std::uint32_t find(const Place& place) const;
  /// Stores `slot` as the vertex at `place`, and removes it from any other place.
  void put(const Place& place, std::uint32_t slot);
  /// Removes a vertex. Call it before `slot` is finalized.
  void forget(std::uint32_t slot) {
    if (slot < entries_.size() && entries_[slot].is_set) erase(slot);
  }

  /// Returns the XOR of the signatures of the cell sides around an edge. A side that occurs twice
  /// cancels out. `slot`: the vertex in the middle of the edge.
  std::uint64_t& open(std::uint32_t slot) { return entries_[slot].open; }

 private:
  struct Entry {
    // `low`, `high`: stream numbers of the two vertices of the place
    std::uint64_t key = 0, low = 0, high = 0;
    std::uint64_t open = 0;
    bool is_set = false, is_face = false;
  };
  static std::uint64_t key_of(const Place& place) {
    return std::uint64_t{place.low} << 32 | place.high;
  }
  void erase(std::uint32_t slot);

  const ActiveSurface* surface_;
  std::vector<Entry> entries_;  // entries by slot of the vertex in the middle

  // Maps for edges and for faces: from the slots of a place to the vertex at this place
  std::array<IdMap, 2> by_place_;
};

template <class Coder>
class MidNodes {
 public:
  /// `surface` must outlive this object.
  explicit MidNodes(const ActiveSurface& surface) : surface_(&surface), middles_(surface) {}

  /// Prepares the mid nodes of a cell. Call it before the first mid node, when the corners are
  /// known.
  void begin_cell(const CellTopology& cell);
  /// Codes whether the node at `position` is the expected vertex. If so, stores this vertex in
  /// cell.slots; kNone means a new vertex. When encoding, cell.slots contains the node. Returns
  /// true if the node is as expected.
  bool code(Coder& symbols, CellTopology& cell, const MidNode& node, std::uint32_t position);
  /// Stores which vertex is at `position`.
  void note(const CellTopology& cell, const MidNode& node, std::uint32_t position);
  /// Codes whether the cell is the last to use this node. Call it after note() has been called for
  /// all nodes. Do not call it if the vertex also occurs at an earlier position.
  bool code_last_use(Coder& symbols, const CellTopology& cell, const MidNode& node,
                     std::uint32_t position, bool is_last);
  /// Removes a vertex. Call it before the vertex is finalized.
  void forget(std::uint32_t slot) { middles_.forget(slot); }

 private:
  std::uint32_t expected(const CellTopology& cell, const MidNode& node) const;
  MiddleTable::Place place_of(const CellTopology& cell, const MidNode& node) const;
  AdaptiveBit& last_use_model(const CellTopology& cell, const MidNode& node,
                              std::uint32_t position);

  const ActiveSurface* surface_;
  MiddleTable middles_;
  std::array<std::uint64_t, 6> signatures_{};  // signatures of the sides of the current cell

  // Contexts of the next decisions. missed_, by kind of node: 1 if the last node of the kind was
  // not as expected
  std::array<std::uint8_t, MidNode::kKinds> missed_{};
  // ended_, by position: 1 if the last answer was that the cell is the last to use the node
  std::array<std::uint8_t, kMostLayoutNodes> ended_{};

  // Adaptive models of the decisions

  /// Models of the decision whether a node is as expected, by: kind of node, whether a known vertex
  /// is expected, whether the last expectation was wrong.
  std::array<std::array<std::array<AdaptiveBit, 2>, 2>, MidNode::kKinds> as_expected_;
  AdaptiveBit body_ends_;
  // Models of last uses that are predicted from corners, for edges and for faces
  std::array<AdaptiveBit, 2> ends_with_corner_;
  // Models of last uses of face nodes, by number of uses and last answer at this position
  std::array<std::array<AdaptiveBit, 2>, 3> face_ends_;
  // Models of last uses of edge nodes, by whether the edge is closed, number of uses and last
  // answer at this position
  std::array<std::array<std::array<AdaptiveBit, 2>, 8>, 2> edge_ends_;
};

extern template class MidNodes<RangeEncoder>;
extern template class MidNodes<RangeDecoder>;

}  // namespace shm
