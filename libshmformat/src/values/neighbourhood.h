// Neighbourhood: which earlier elements a new vertex or cell is predicted from, and the finder that
// sees them. It knows nothing of how connectivity is coded: any codec gives the same neighbourhoods
// for the same cells in the same order.
//
//                        beyond[a]   near[a]   self        along each axis a of the hexahedron:
//          farther[a] ------ o -------- o ------- x        one edge back, across the face behind
//                                       |         |        that, and once more
//                                  diagonal[..] - near[b]
//
// For a vertex the lattice is that of hexahedron corners; for a cell it is that of cells behind
// faces. Nodes of second-order cells that are no corners see those that they lie between instead.
// spec: "Neighbourhoods", "Mid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/cell_topology.h"
#include "surface/hexahedron.h"

namespace shm {

/// Places in Neighbourhood::at; near ones stand first.
inline constexpr std::uint32_t kAtDiagonal = 3, kAtOpposite = 6, kAtBeyond = 7, kAtFarther = 10;

struct Neighbourhood {
  // Bits of `known`: those of `at`, then whether the lattice of a near one was known.
  static constexpr std::uint32_t kNear = 1u, kDiagonal = 1u << 3, kOpposite = 1u << 6,
                                 kBeyond = 1u << 7, kFarther = 1u << 10, kThird = 1u << 13;
  static constexpr std::uint32_t kLattice = 127u;  ///< near, diagonal and opposite all known

  /// midpoint: of an edge: near are nodes of parallel edges, diagonal 3 and 4 the ends. centre: of
  /// a face or a body: near 0 is the node of the opposite face, 3-6 the nodes of the edges of a
  /// quadrilateral around it, 7-10 its corners.
  /// layered: of a wedge; flat: in a quadrilateral; simplex: on a face or edge, whose corners are
  /// near, with opposite behind it; beside: a cell, with cells behind its sides near.
  enum Kind : std::uint8_t { lattice, midpoint, other, centre, layered, flat, simplex, beside };
  static constexpr std::uint32_t kKindShift = 16;  ///< in traits()

  std::uint32_t self = kNone;  ///< slot of the element
  /// Slots: near 0-2 (one step along axis 0, 1, 2), diagonal 3-5 (one step along 0 and 1, 0 and 2,
  /// 1 and 2), opposite 6 (along all three), beyond 7-9 (two steps along one axis), farther 10-12.
  std::array<std::uint32_t, 13> at{};
  std::uint16_t known = 0;
  std::uint8_t corner = 0;  ///< of the vertex in its hexahedron, as stored, in corner bits
  Kind kind = other;

  bool knows(std::uint32_t bits) const { return (known & bits) == bits; }
  bool is_mid_node() const { return kind == midpoint || kind == centre; }
  /// Whether there is a rule that the value may miss by a third.
  bool has_rule() const {
    if (kind == flat) return knows(3 * kNear | kDiagonal);
    if (kind == simplex) return knows(kOpposite);
    return is_mid_node() || knows(kLattice);
  }
  /// Bits of `known` where `counts` of a lattice count, and of mid nodes what they are.
  std::uint32_t traits(std::uint32_t counts = 0xffff) const {
    if (is_mid_node()) return known | std::uint32_t{kind} << kKindShift;
    return (known & counts) | (kind > centre ? std::uint32_t{kind} << kKindShift : 0);
  }
};

/// How far neighbourhoods look.
enum class Reach : std::uint8_t { lattice = 0, beyond = 1, farther = 2 };

class NeighbourFinder {
 public:
  /// `cells`: whether cell() will be called.
  explicit NeighbourFinder(bool cells) : cells_(cells) {}

  /// Begins a cell whose slots are known. `as_stored`: whether its corners are in the source's
  /// order, or else in the coder's frame. `live`: vertices on the surface.
  void begin_cell(const CellTopology& cell, bool as_stored, std::uint64_t live);
  /// Of the new vertex at `position`; it counts as known from then on. Of each new vertex once, as
  /// cells introduce them.
  Neighbourhood vertex(const CellTopology& cell, std::uint32_t position, Reach reach);
  /// Of the cell itself, after its vertices.
  Neighbourhood cell(const CellTopology& cell, Reach reach);
  void end_cell(const CellTopology& cell);
  /// Of an unused vertex: of no cell.
  Neighbourhood unused_vertex(std::uint32_t slot);

 private:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  /// A remembered hexahedron that uses a vertex.
  struct Use {
    std::uint64_t sequence = kNever;  ///< of the cell
    std::uint32_t place = kNone;      ///< of the cell
    std::uint32_t corner = 0;         ///< corner bits
  };
  struct Vertex {
    std::uint64_t introduced = 0;  // sequence of the cell that introduced it
    std::array<Use, 2> uses;       // by that cell, and by the last one that used it
    bool full = false;             // its lattice was known
  };
  /// A remembered cell, by place.
  struct Cell {
    std::uint64_t sequence = kNever;
    std::array<std::uint32_t, 8> corner{};  // slots: of a hexahedron by corner bits
    CellShape shape = CellShape::hexahedron;
    std::uint8_t corners = 8;
  };
  /// What lies behind the sides of a cell, in meshes of several shapes.
  struct Sides {
    static constexpr std::uint32_t kMost = 6;
    std::array<std::uint32_t, kMost> behind{};  // places
  };
  using Cycle = std::span<const std::uint32_t>;  // slots around a side
  /// What cell() remembers besides, by place.
  struct Links {
    std::array<std::uint32_t, 6> behind{};  // places: along axis a down (2 a), up (2 a + 1)
    std::array<std::uint8_t, 6> onward{};   // the side of that cell that leads on straight
    bool full = false;
  };
  /// A vertex in a face of the polyhedron at hand.
  struct FaceCorner {
    std::uint32_t slot = kNone, before = kNone, after = kNone;
    std::uint32_t across = kNone;  ///< in a face of four
  };
  /// A corner of a remembered hexahedron, and the axis that leads on from it.
  struct Found {
    std::uint32_t place = kNone, corner = 0, axis = 0;
    explicit operator bool() const { return place != kNone; }
    /// The side of the hexahedron that the axis leads to.
    std::uint32_t far_side() const { return 2 * axis + ((corner >> axis & 1) != 0 ? 0 : 1); }
  };

  Vertex& vertex_at(std::uint32_t slot);
  std::uint32_t corner_bits(const CellTopology& cell, std::uint32_t position) const {
    return kCornerBits[as_stored_ ? cell.stored_corner[position] : position];
  }
  Found behind(std::uint32_t slot, std::uint32_t one, std::uint32_t two,
               std::uint32_t except) const;
  Found across(std::uint32_t slot, std::uint32_t one, std::uint32_t two, std::uint32_t both) const;
  void look_beyond(Neighbourhood& it, Reach reach) const;
  void look_around_mid_node(Neighbourhood& it, const CellTopology& cell, const MidNode& node) const;
  void look_around_cell(Neighbourhood& it, Reach reach) const;
  // polyhedra told by their faces
  void begin_faces(const CellTopology& cell);
  void look_around_faces(Neighbourhood& it) const;
  void look_beside_polyhedron(Neighbourhood& it, const CellTopology& cell) const;
  std::span<const FaceCorner> faces_at(std::uint32_t slot) const;
  std::uint32_t beside_both(const Neighbourhood& it) const;
  bool is_beside(std::uint32_t a, std::uint32_t b) const;
  bool is_known(std::uint32_t slot) const {
    return slot >= coming_.size() || coming_[slot] != sequence_ + 1;
  }
  // cells that are no hexahedra
  void look_around_corner(Neighbourhood& it, const CellTopology& cell,
                          std::uint32_t position) const;
  void look_along(Neighbourhood& it, std::uint32_t axis, std::uint32_t place, Cycle side) const;
  void look_behind(Neighbourhood& it, const CellTopology& cell, std::uint32_t side) const;
  void look_along_line(Neighbourhood& it) const;
  void look_beside_cell(Neighbourhood& it, const CellTopology& cell) const;
  std::uint32_t place_of(std::uint64_t number) const;
  std::uint32_t far(std::uint32_t place, std::uint32_t slot, Cycle side) const;
  std::uint32_t onward(std::uint32_t place, Cycle side,
                       std::array<std::uint32_t, 4>& far_side) const;
  /// The place behind face `side` of the cell at `place`, kNone when there is none any more.
  std::uint32_t behind_of(std::uint32_t place, std::uint32_t side) const;
  bool is_behind(std::uint32_t place, std::uint32_t other) const;
  std::uint32_t common(std::uint32_t a, std::uint32_t b) const;

  bool cells_;
  std::vector<Vertex> vertices_;
  std::vector<Cell> ring_;
  std::vector<Links> links_;  // where cell() is called
  std::vector<Sides> sides_;  // where there are other cells
  std::uint32_t next_place_ = 0, place_ = 0;
  std::uint64_t sequence_ = 0;

  // the cell at hand
  bool as_stored_ = true;
  std::array<std::uint32_t, 8> corner_{};  // slots, by corner bits
  std::uint64_t known_ = 0;                // positions whose vertices have values
  std::uint32_t known_corners_ = 0;        // the same of a hexahedron's corners, by corner bits
  std::array<Found, 6> found_{};           // behind its faces, for cell()
  std::vector<FaceCorner> around_;         // of a polyhedron, by slot
  std::vector<std::uint64_t> coming_;      // by slot: the cell that introduces it still, and 1
  bool full_ = false;                      // the lattice of the cell itself is known
};

}  // namespace shm
