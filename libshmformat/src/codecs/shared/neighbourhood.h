// Neighbourhood: the earlier elements that a new vertex or cell is predicted from. NeighbourFinder
// finds them. It does not depend on how connectivity is coded: every codec gives the same
// neighbourhoods for the same cells in the same order.
//
//                        beyond[a]   near[a]   self        along each axis a of the hexahedron:
//          farther[a] ------ o -------- o ------- x        near: one edge back; beyond: across the
//                                       |         |        face after that; farther: once more
//                                  diagonal[..] - near[b]
//
// For a vertex, the lattice consists of corners of hexahedra; for a cell, of cells across faces.
// Nodes of second-order cells that are not corners use the nodes of the edge, face or cell in whose
// middle they are.
// spec: "Neighbourhoods", "Mid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/cell_topology.h"
#include "mesh/hexahedron.h"

namespace shm {

/// First places in Neighbourhood::at; the near elements have places 0 to 2.
inline constexpr std::uint32_t kAtDiagonal = 3, kAtOpposite = 6, kAtBeyond = 7, kAtFarther = 10;

struct Neighbourhood {
  // Bits of `known`: one for each place in `at`, then one for each near element whose own lattice
  // was known.
  static constexpr std::uint32_t kNear = 1u, kDiagonal = 1u << 3, kOpposite = 1u << 6,
                                 kBeyond = 1u << 7, kFarther = 1u << 10, kThird = 1u << 13;
  static constexpr std::uint32_t kLattice = 127u;  ///< near, diagonal and opposite all known

  /// The kind selects the rule of prediction.
  /// - lattice: a corner of a hexahedron, or a hexahedron.
  /// - midpoint: a mid node of an edge. near: mid nodes of parallel edges; places 3 and 4: the ends
  ///   of the edge.
  /// - centre: a mid node of a face or a body. Place 0: the node of the opposite face; 3-6: mid
  ///   nodes of the edges of a quadrilateral around it; 7-10: the corners of that quadrilateral.
  /// - layered: a corner of a wedge.
  /// - flat: a corner of a quadrilateral.
  /// - simplex: a corner opposite to a face or edge. near: the corners of that face or edge;
  ///   opposite: the vertex on its other side.
  /// - beside: a cell that is not a hexahedron. near: the cells across its sides.
  /// - other: none of these.
  enum Kind : std::uint8_t { lattice, midpoint, other, centre, layered, flat, simplex, beside };
  static constexpr std::uint32_t kKindShift = 16;  ///< in traits()

  std::uint32_t self = kNone;  ///< slot of the element
  /// Slots: near 0-2 (one step along axis 0, 1, 2), diagonal 3-5 (one step along axes 0 and 1, 0
  /// and 2, 1 and 2), opposite 6 (one step along all three), beyond 7-9 (two steps along one axis),
  /// farther 10-12 (three steps).
  std::array<std::uint32_t, 13> at{};
  std::uint16_t known = 0;
  std::uint8_t corner = 0;  ///< of the vertex in its hexahedron as stored, as corner bits
  Kind kind = other;

  bool knows(std::uint32_t bits) const { return (known & bits) == bits; }
  bool is_mid_node() const { return kind == midpoint || kind == centre; }
  /// Returns true if a lattice rule applies in full, so that its residual is kept as the third.
  bool has_rule() const {
    if (kind == flat) return knows(3 * kNear | kDiagonal);
    if (kind == simplex) return knows(kOpposite);
    return is_mid_node() || knows(kLattice);
  }
  /// Returns the bits of `known` that are in `counts`, with the kind above them. All bits of mid
  /// nodes count.
  std::uint32_t traits(std::uint32_t counts = 0xffff) const {
    if (is_mid_node()) return known | std::uint32_t{kind} << kKindShift;
    return (known & counts) | (kind > centre ? std::uint32_t{kind} << kKindShift : 0);
  }
};

/// How far neighbourhoods extend.
enum class Reach : std::uint8_t { lattice = 0, beyond = 1, farther = 2 };

class NeighbourFinder {
 public:
  /// `cells`: true if cell() will be called.
  explicit NeighbourFinder(bool cells) : cells_(cells) {}

  /// Begins a cell with known slots. `as_stored`: true if corners are numbered as in the source,
  /// false if as in the coder's frame. `live`: number of live vertices.
  void begin_cell(const CellTopology& cell, bool as_stored, std::uint64_t live);
  /// Returns the neighbourhood of the new vertex at `position`, which counts as known from then on.
  /// Call it once for each new vertex, in order of introduction.
  Neighbourhood vertex(const CellTopology& cell, std::uint32_t position, Reach reach);
  /// Returns the neighbourhood of the cell itself. Call it after vertex().
  Neighbourhood cell(const CellTopology& cell, Reach reach);
  void end_cell(const CellTopology& cell);
  /// Returns the neighbourhood of an unused vertex, which no cell uses.
  Neighbourhood unused_vertex(std::uint32_t slot);

 private:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  /// A use of a vertex by a remembered hexahedron.
  struct Use {
    std::uint64_t sequence = kNever;  ///< of the cell
    std::uint32_t place = kNone;      ///< of the cell
    std::uint32_t corner = 0;         ///< corner bits
  };
  struct Vertex {
    std::uint64_t introduced = 0;  // sequence number of the cell that introduced it
    std::array<Use, 2> uses;       // the first hexahedron that used it, and the last
    bool full = false;             // whether its own lattice was known
  };
  /// A remembered cell, by place.
  struct Cell {
    std::uint64_t sequence = kNever;
    std::array<std::uint32_t, 8> corner{};  // slots; of a hexahedron by corner bits
    CellShape shape = CellShape::hexahedron;
    std::uint8_t corners = 8;
  };
  /// The cells across the sides of a cell, in meshes of several shapes.
  struct Sides {
    static constexpr std::uint32_t kMost = 6;
    std::array<std::uint32_t, kMost> behind{};  // places
  };
  using Cycle = std::span<const std::uint32_t>;  // slots around a side
  /// Links between hexahedra, for cell(), by place.
  struct Links {
    // places of the cells across the sides: side 2 a is down axis a, side 2 a + 1 is up
    std::array<std::uint32_t, 6> behind{};
    std::array<std::uint8_t, 6> onward{};  // the side of that cell opposite to the shared one
    bool full = false;
  };
  /// A vertex in a face of the current polyhedron.
  struct FaceCorner {
    std::uint32_t slot = kNone, before = kNone, after = kNone;
    std::uint32_t across = kNone;  ///< the opposite vertex, if the face has four
  };
  /// A corner of a remembered hexahedron, and an axis that leads away from the face it was found
  /// by.
  struct Found {
    std::uint32_t place = kNone, corner = 0, axis = 0;
    explicit operator bool() const { return place != kNone; }
    /// Returns the side of the hexahedron that the axis leads to.
    std::uint32_t far_side() const { return 2 * axis + ((corner >> axis & 1) != 0 ? 0 : 1); }
  };

  Vertex& vertex_at(std::uint32_t slot);
  std::uint32_t corner_bits(const CellTopology& cell, std::uint32_t position) const {
    return kCornerBits[as_stored_ ? cell.stored_corner[position] : position];
  }
  Found behind(std::uint32_t slot, std::uint32_t one, std::uint32_t two,
               std::uint32_t except) const;
  Found across(std::uint32_t slot, std::uint32_t one, std::uint32_t two, std::uint32_t both) const;
  void look_beyond(Neighbourhood& item, Reach reach) const;
  void look_around_mid_node(Neighbourhood& item, const CellTopology& cell,
                            const MidNode& node) const;
  void look_around_cell(Neighbourhood& item, Reach reach) const;
  // polyhedra given by their faces
  void begin_faces(const CellTopology& cell);
  void look_around_faces(Neighbourhood& item) const;
  void look_beside_polyhedron(Neighbourhood& item, const CellTopology& cell) const;
  std::span<const FaceCorner> faces_at(std::uint32_t slot) const;
  std::uint32_t beside_both(const Neighbourhood& item) const;
  bool is_beside(std::uint32_t a, std::uint32_t b) const;
  bool is_known(std::uint32_t slot) const {
    return slot >= coming_.size() || coming_[slot] != sequence_ + 1;
  }
  // cells that are not hexahedra
  void look_around_corner(Neighbourhood& item, const CellTopology& cell,
                          std::uint32_t position) const;
  void look_along(Neighbourhood& item, std::uint32_t axis, std::uint32_t place, Cycle side) const;
  void look_behind(Neighbourhood& item, const CellTopology& cell, std::uint32_t side) const;
  void look_along_line(Neighbourhood& item) const;
  void look_beside_cell(Neighbourhood& item, const CellTopology& cell) const;
  std::uint32_t place_of(std::uint64_t number) const;
  std::uint32_t far(std::uint32_t place, std::uint32_t slot, Cycle side) const;
  std::uint32_t onward(std::uint32_t place, Cycle side,
                       std::array<std::uint32_t, 4>& far_side) const;
  /// Returns the place of the cell across side `side` of the cell at `place`, or kNone if there is
  /// none or it is no longer remembered.
  std::uint32_t behind_of(std::uint32_t place, std::uint32_t side) const;
  bool is_behind(std::uint32_t place, std::uint32_t other) const;
  std::uint32_t common(std::uint32_t a, std::uint32_t b) const;

  bool cells_;
  std::vector<Vertex> vertices_;
  std::vector<Cell> ring_;
  std::vector<Links> links_;  // if cell() is called
  std::vector<Sides> sides_;  // if the mesh has other cells
  std::uint32_t next_place_ = 0, place_ = 0;
  std::uint64_t sequence_ = 0;

  // the current cell
  bool as_stored_ = true;
  std::array<std::uint32_t, 8> corner_{};  // slots, by corner bits
  std::uint64_t known_ = 0;                // bit i: the vertex at position i already has values
  std::uint32_t known_corners_ = 0;  // the same for the corners of a hexahedron, by corner bits
  std::array<Found, 6> found_{};     // hexahedra across its faces, for cell()
  std::vector<FaceCorner> around_;   // corners of the faces of a polyhedron, by slot
  // by slot: number of the cell that is about to introduce it, plus 1
  std::vector<std::uint64_t> coming_;
  bool full_ = false;  // the lattice of the cell itself is known
};

}  // namespace shm
