// Neighbourhood: the earlier elements from which a new vertex or cell is predicted. NeighbourFinder
// finds them. The result does not depend on the codec of the connectivity: for the same cells in
// the same order, all codecs find the same neighbourhoods.
//
//                        beyond[a]   near[a]   self        along each axis a of the hexahedron:
//          farther[a] ------ o -------- o ------- x        near: one edge back; beyond: across the
//                                       |         |        face after that; farther: once more
//                                  diagonal[..] - near[b]
//
// For a vertex, the lattice consists of the corners of hexahedra. For a cell, it consists of the
// cells across faces. A mid node (a node of a second-order cell that is not a corner) uses the
// nodes of the edge, face or cell whose middle it is.
// spec: "Neighbourhoods", "Mid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/cell_topology.h"
#include "mesh/hexahedron.h"

namespace shm {

/// First index of each type of neighbour in Neighbourhood::at; near elements have indices 0 to 2.
inline constexpr std::uint32_t kAtDiagonal = 3, kAtOpposite = 6, kAtBeyond = 7, kAtFarther = 10;

struct Neighbourhood {
  // Bits of `known`: one for each entry of `at`, then one for each near element whose own lattice
  // was known.
  static constexpr std::uint32_t kNear = 1u, kDiagonal = 1u << 3, kOpposite = 1u << 6,
                                 kBeyond = 1u << 7, kFarther = 1u << 10, kThird = 1u << 13;
  /// The near, diagonal and opposite elements are all known
  static constexpr std::uint32_t kLattice = 127u;

  /// The kind of neighbourhood. It selects the prediction rule.
  /// - lattice: a corner of a hexahedron, or a hexahedron.
  /// - midpoint: a mid node of an edge. near: mid nodes of parallel edges; entries 3 and 4: the
  ///   ends of the edge.
  /// - centre: a mid node of a face or a body. Entry 0: the node of the opposite face; entries 3-6:
  ///   mid nodes of the edges of a quadrilateral around it; entries 7-10: the corners of that
  ///   quadrilateral.
  /// - layered: a corner of a wedge.
  /// - flat: a corner of a quadrilateral.
  /// - simplex: a corner opposite to a face or edge. near: the corners of that face or edge;
  ///   opposite: the vertex on the other side of that face or edge.
  /// - beside: a cell that is not a hexahedron. near: the cells across its sides.
  /// - other: none of these.
  enum Kind : std::uint8_t { lattice, midpoint, other, centre, layered, flat, simplex, beside };
  /// Number of bits by which traits() shifts the kind
  static constexpr std::uint32_t kKindShift = 16;

  std::uint32_t self = kNone;  ///< slot of the element

  /// Slots: near 0-2 (one step along axis 0, 1, 2), diagonal 3-5 (one step along axes 0 and 1, 0
  /// and 2, 1 and 2), opposite 6 (one step along all three), beyond 7-9 (two steps along one axis),
  /// farther 10-12 (three steps).
  std::array<std::uint32_t, 13> at{};
  std::uint16_t known = 0;
  /// For a vertex: its corner in the hexahedron as stored, as corner bits
  std::uint8_t corner = 0;
  Kind kind = other;

  bool knows(std::uint32_t bits) const { return (known & bits) == bits; }
  bool is_mid_node() const { return kind == midpoint || kind == centre; }
  /// Returns true if all neighbours that a lattice rule needs are known; the residual of the
  /// element is then stored as its third residual.
  bool has_rule() const {
    if (kind == flat) return knows(3 * kNear | kDiagonal);
    if (kind == simplex) return knows(kOpposite);
    return is_mid_node() || knows(kLattice);
  }
  /// Returns the bits of `known` that are set in `counts`, with the kind in the bits above them.
  /// For mid nodes, returns all bits of `known`.
  std::uint32_t traits(std::uint32_t counts = 0xffff) const {
    if (is_mid_node()) return known | std::uint32_t{kind} << kKindShift;
    return (known & counts) | (kind > centre ? std::uint32_t{kind} << kKindShift : 0);
  }
};

/// The largest distance at which neighbours are searched.
enum class Reach : std::uint8_t { lattice = 0, beyond = 1, farther = 2 };

class NeighbourFinder {
 public:
  /// `cells`: true if cell() will be called.
  explicit NeighbourFinder(bool cells) : cells_(cells) {}

  /// Begins a cell whose slots are known. `as_stored`: true if corners are numbered as in the
  /// source mesh, false if they are numbered in the coder's frame. `live`: number of live vertices.
  void begin_cell(const CellTopology& cell, bool as_stored, std::uint64_t live);
  /// Returns the neighbourhood of the new vertex at `position`. From then on this vertex counts as
  /// known. Call it once for each new vertex, in order of introduction.
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
    std::uint64_t sequence = kNever;  ///< sequence number of the cell
    std::uint32_t place = kNone;      ///< index of the cell in the ring of remembered cells
    std::uint32_t corner = 0;         ///< the vertex's corner in the cell, as corner bits
  };
  struct Vertex {
    std::uint64_t introduced = 0;  // sequence number of the cell that introduced the vertex
    // The first hexahedron that used the vertex, and the last hexahedron that used it
    std::array<Use, 2> uses;
    bool full = false;  // true: all neighbours in the vertex's own lattice were known
  };
  /// A remembered cell, stored at its place in the ring.
  struct Cell {
    std::uint64_t sequence = kNever;
    // Vertex slots of the corners; for a hexahedron, by corner bits
    std::array<std::uint32_t, 8> corner{};
    CellShape shape = CellShape::hexahedron;
    std::uint8_t corners = 8;
  };
  /// The cells across the sides of a cell, used in meshes with several cell shapes.
  struct Sides {
    static constexpr std::uint32_t kMost = 6;
    std::array<std::uint32_t, kMost> behind{};  // positions of these cells in the ring
  };
  using Cycle = std::span<const std::uint32_t>;  // slots of the vertices around a side

  /// Links of a hexahedron to its neighbours, by place in the ring; used by cell().
  struct Links {
    // Places of the cells across the sides. Side 2 a is towards the lower end of axis a, side 2 a +
    // 1 towards the upper end.
    std::array<std::uint32_t, 6> behind{};
    // For each cell of `behind`: its side opposite to the shared side
    std::array<std::uint8_t, 6> onward{};
    bool full = false;
  };
  /// A vertex in a face of the current polyhedron, with its neighbours around that face.
  struct FaceCorner {
    std::uint32_t slot = kNone, before = kNone, after = kNone;
    std::uint32_t across = kNone;  ///< the opposite vertex, if the face has four
  };
  /// A corner of a remembered hexahedron, and the axis that leads from this corner away from the
  /// face by which the hexahedron was found.
  struct Found {
    std::uint32_t place = kNone, corner = 0, axis = 0;
    explicit operator bool() const { return place != kNone; }
    /// Returns the side of the hexahedron to which the axis leads.
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
  // Functions for polyhedra, which are given by their faces
  void begin_faces(const CellTopology& cell);
  void look_around_faces(Neighbourhood& item) const;
  void look_beside_polyhedron(Neighbourhood& item, const CellTopology& cell) const;
  std::span<const FaceCorner> faces_at(std::uint32_t slot) const;
  std::uint32_t beside_both(const Neighbourhood& item) const;
  bool is_beside(std::uint32_t a, std::uint32_t b) const;
  bool is_known(std::uint32_t slot) const {
    return slot >= coming_.size() || coming_[slot] != sequence_ + 1;
  }
  // Functions for cells that are not hexahedra
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
  /// Returns the position of the cell across side `side` of the cell at `place`. Returns kNone if
  /// no such cell exists or the finder no longer remembers it.
  std::uint32_t behind_of(std::uint32_t place, std::uint32_t side) const;
  bool is_behind(std::uint32_t place, std::uint32_t other) const;
  std::uint32_t common(std::uint32_t a, std::uint32_t b) const;

  bool cells_;
  std::vector<Vertex> vertices_;
  std::vector<Cell> ring_;
  std::vector<Links> links_;  // empty unless cell() is called
  std::vector<Sides> sides_;  // empty unless the mesh has cells that are not hexahedra
  std::uint32_t next_place_ = 0, place_ = 0;
  std::uint64_t sequence_ = 0;

  // Data of the current cell
  bool as_stored_ = true;
  std::array<std::uint32_t, 8> corner_{};  // vertex slots of the corners, by corner bits
  std::uint64_t known_ = 0;          // bit i is set if the vertex at position i already has values
  std::uint32_t known_corners_ = 0;  // known corners of a hexahedron, as a bit set by corner bits
  std::array<Found, 6> found_{};     // hexahedra across the faces of the current cell, for cell()
  std::vector<FaceCorner> around_;   // corners of the faces of a polyhedron, by slot

  // For each slot: sequence number, plus 1, of the cell that is about to introduce the vertex.
  std::vector<std::uint64_t> coming_;
  bool full_ = false;  // true: the lattice around the current cell is known completely
};

}  // namespace shm
