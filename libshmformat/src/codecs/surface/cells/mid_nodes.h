// Mid nodes: codes the nodes on the edges, on the faces and inside of cells of higher order. All
// cells that contain an edge or face share the nodes on it; a node inside a cell belongs only to
// that cell. So the expected vertex of a node is the vertex that an earlier cell has at the same
// place of the same edge or face; if no such vertex exists, a new vertex is expected. One decision
// codes whether the expectation is right.
//
// The corners of a cell must be known before its mid nodes are coded. The decisions are symbols of
// the bitstream "connectivity". Encoder and decoder keep the same state: the vertices on live edges
// and faces, and the models.
// spec: "Mid nodes", "Grid nodes"
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

/// Map from places on edges and faces to vertices. Each live vertex has at most one entry.
class MiddleTable {
 public:
  explicit MiddleTable(const ActiveSurface& surface) : surface_(&surface) {}

  enum Kind : std::uint8_t { edge_place, face_place, triangle_place };
  static constexpr std::uint32_t kKinds = 3;

  /// A place on an edge or a face. Two live vertices identify the edge or face, in any order: the
  /// ends of the edge, or opposite corners of the face. Three vertices identify a triangle. `index`
  /// numbers the places on it. It does not depend on the order in which a cell lists the corners.
  struct Place {
    std::uint32_t low = kNone, high = kNone;  ///< slots of the oldest and of the youngest vertex
    Kind kind = edge_place;
    std::uint8_t index = 0;
    std::uint32_t middle = kNone;  ///< triangle: slot of the third vertex
  };
  /// Returns the place on an edge that is `step` of `order` steps from `a` towards `b`.
  Place edge(std::uint32_t a, std::uint32_t b, std::uint32_t step = 1,
             std::uint32_t order = 2) const;
  /// Returns a place on a face. The face is identified by the ends of the diagonal that contains
  /// its oldest vertex. `steps`: of `order` steps, from corners[0] towards corners[1] and towards
  /// corners[3].
  Place face(const std::array<std::uint32_t, 4>& corners,
             const std::array<std::uint8_t, 2>& steps = {1, 1}, std::uint32_t order = 2) const;
  /// Returns a place inside a triangle. `steps`: of `order` steps, from corners[0] towards
  /// corners[1] and towards corners[2].
  Place triangle(const std::array<std::uint32_t, 3>& corners,
                 const std::array<std::uint8_t, 2>& steps, std::uint32_t order) const;

  /// Returns the live vertex at `place`, or kNone if no such vertex exists.
  std::uint32_t find(const Place& place) const;
  /// Stores `slot` as the vertex at `place`. If the same vertex has an entry for a different place,
  /// removes that entry.
  void put(const Place& place, std::uint32_t slot);
  /// Removes the entry of a vertex. Call it before the vertex is finalized.
  void forget(std::uint32_t slot) {
    if (slot < entries_.size() && entries_[slot].is_set) erase(slot);
  }

  /// Each edge has a checksum: the XOR of the signatures of the sides that contain the edge, over
  /// all cells coded so far. A side shared by two cells occurs twice and cancels out. Returns the
  /// checksum of the edge on which the vertex `slot` lies.
  std::uint64_t& open(std::uint32_t slot) { return entries_[slot].open; }

 private:
  struct Entry {
    // Stream numbers of the vertices that identify the edge or face; `middle` is 0 unless it is a
    // triangle
    std::uint64_t key = 0, low = 0, high = 0, middle = 0;
    std::uint64_t open = 0;
    bool is_set = false;
    std::uint8_t map = 0;  // index in by_place_
  };
  /// Slots from this one on do not fit in the key of a triangle. Frozen: part of the format.
  static constexpr std::uint32_t kTriangleSlots = 1u << 21;

  /// Returns false for triangles with slots that do not fit in the key.
  static bool has_key(const Place& place) {
    return place.kind != triangle_place ||
           (place.low < kTriangleSlots && place.middle < kTriangleSlots &&
            place.high < kTriangleSlots);
  }
  static std::uint64_t key_of(const Place& place) {
    if (place.kind == triangle_place)
      return std::uint64_t{place.low} << 42 | std::uint64_t{place.middle} << 21 | place.high;
    return std::uint64_t{place.low} << 32 | place.high;
  }
  static std::uint8_t map_of(const Place& place) {
    return static_cast<std::uint8_t>(kKinds * place.index + place.kind);
  }
  std::uint64_t middle_id(const Place& place) const {
    return place.kind == triangle_place ? surface_->vertex(place.middle).id : 0;
  }
  void erase(std::uint32_t slot);

  const ActiveSurface* surface_;
  // For each vertex on an edge or face, which edge or face this is. Indexed by slot
  std::vector<Entry> entries_;

  // Maps for edges, faces and triangles: one of each for each index of a place. The key consists of
  // the slots of the vertices that identify the edge or face. The value is the vertex there
  std::vector<IdMap> by_place_{kKinds};
};

template <class Coder>
class MidNodes {
 public:
  /// `surface` must outlive this object.
  explicit MidNodes(const ActiveSurface& surface) : surface_(&surface), middles_(surface) {}

  /// Prepares the mid nodes of a cell. Call it before the first mid node and after the corners have
  /// been coded.
  void begin_cell(const CellTopology& cell);
  /// Codes whether the node at `position` is the expected vertex. Encoding: cell.slots contains the
  /// node; kNone means a new vertex. Decoding: if the node is as expected, stores it in cell.slots.
  /// Returns true if the node is as expected.
  bool code(Coder& symbols, CellTopology& cell, const MidNode& node, std::uint32_t position);
  /// Stores which vertex is at `position`.
  void note(const CellTopology& cell, const MidNode& node, std::uint32_t position);
  /// Codes whether this is the last use of the node. Call it after note() has been called for all
  /// nodes of the cell. Do not call it if the vertex also occurs at an earlier position.
  bool code_last_use(Coder& symbols, const CellTopology& cell, const MidNode& node,
                     std::uint32_t position, bool is_last);
  /// Removes a vertex from the map. Call it before the vertex is finalized.
  void forget(std::uint32_t slot) { middles_.forget(slot); }

 private:
  std::uint32_t expected(const CellTopology& cell, const MidNode& node) const;
  MiddleTable::Place place_of(const CellTopology& cell, const MidNode& node) const;
  AdaptiveBit& last_use_model(const CellTopology& cell, const MidNode& node,
                              std::uint32_t position);

  const ActiveSurface* surface_;
  MiddleTable middles_;
  std::array<std::uint64_t, 6> signatures_{};  // signature of each side of the current cell

  // Contexts of the next decisions. For each kind of node, missed_ is 1 if the previous node of
  // this kind was mispredicted
  std::array<std::uint8_t, MidNode::kKinds> missed_{};
  // For each position, ended_ is 1 if the node at this position of the previous cell was marked as
  // last use
  std::vector<std::uint8_t> ended_;

  // Adaptive models of the decisions

  /// Models of the decision whether a node is as expected. The indices are: the kind of node,
  /// whether a known vertex is expected, and whether the previous prediction for this kind was
  /// wrong.
  std::array<std::array<std::array<AdaptiveBit, 2>, 2>, MidNode::kKinds> as_expected_;
  AdaptiveBit body_ends_;
  // Models of the decision whether this is the last use of a mid node, if that is predicted from
  // the corners of its edge or face: one model for edge nodes, one for face nodes
  std::array<AdaptiveBit, 2> ends_with_corner_;
  // Models of the decision whether this is the last use of a face node, by the number of uses and
  // the previous decision at this position
  std::array<std::array<AdaptiveBit, 2>, 3> face_ends_;
  // Models of the decision whether this is the last use of an edge node, by whether the edge is
  // closed, the number of uses, and the previous decision at this position
  std::array<std::array<std::array<AdaptiveBit, 2>, 8>, 2> edge_ends_;
};

extern template class MidNodes<RangeEncoder>;
extern template class MidNodes<RangeDecoder>;

}  // namespace shm
