// Neighbourhood: the earlier elements from which a new vertex or cell is predicted. NeighbourFinder
// finds these elements. Given the same cells in the same order, all connectivity codecs that use
// NeighbourFinder find the same neighbourhoods.
//
//                        beyond[a]   near[a]   self        along each axis a of the hexahedron:
//          farther[a] ------ o -------- o ------- x        near[a] is one step back from self,
//                                       |         |        beyond[a] two steps,
//                                  diagonal[..] - near[b]  and farther[a] three steps
//
// The neighbours of a vertex are corners of hexahedra. The neighbours of a cell are cells across
// its faces. A mid node is a node of a second-order cell that is not a corner; it lies in the
// middle of an edge, a face or a cell. The neighbours of a mid node are other nodes of that edge,
// face or cell. The neighbours of a node of a grid are the earlier nodes of the rows of its cell.
// spec: "Neighbourhoods", "Mid nodes", "Grid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/cell_topology.h"
#include "mesh/hexahedron.h"

namespace shm {

/// First index in Neighbourhood::at of each type of neighbour. The near elements have the indices 0
/// to 2.
inline constexpr std::uint32_t kAtDiagonal = 3, kAtOpposite = 6, kAtBeyond = 7, kAtFarther = 10;

struct Neighbourhood {
  // Bits of `known`. For each entry of `at`, there is a bit that is set if the entry is known.
  // Three more bits (kThird) belong to the three near elements. Such a bit is set if the near,
  // diagonal and opposite neighbours of that near element were all known.
  static constexpr std::uint32_t kNear = 1u, kDiagonal = 1u << 3, kOpposite = 1u << 6,
                                 kBeyond = 1u << 7, kFarther = 1u << 10, kThird = 1u << 13;
  /// Bits of the near, diagonal and opposite elements
  static constexpr std::uint32_t kLattice = 127u;

  /// The kind of neighbourhood. It depends on the kind of element, and selects the prediction rule.
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
  /// - grid_node: a node of a cell of order 3 or higher that is not a corner. All its neighbours
  ///   are nodes of this cell. If all of them are on one edge, entry 0 is near, and entry 3 is the
  ///   end of the edge.
  /// - other: none of these.
  enum Kind : std::uint8_t {
    lattice,
    midpoint,
    other,
    centre,
    layered,
    flat,
    simplex,
    beside,
    grid_node
  };
  /// Number of bits by which traits() shifts the kind to the left
  static constexpr std::uint32_t kKindShift = 16;

  std::uint32_t self = kNone;  ///< slot of the element

  /// Slots of the neighbours. Entries 0-2 are near (one step along axis 0, 1, 2), entries 3-5 are
  /// diagonal (one step along axes 0 and 1, 0 and 2, 1 and 2), entry 6 is opposite (one step along
  /// all three axes), entries 7-9 are beyond (two steps along one axis), entries 10-12 are farther
  /// (three steps along one axis).
  std::array<std::uint32_t, 13> at{};
  std::uint16_t known = 0;
  /// For a vertex of a hexahedron: which corner of the stored hexahedron it is (x + 2y + 4z). For a
  /// node of a grid: the axes along which its row ends with it (bit a for axis a), or the number of
  /// steps to the end of its edge, at most 7.
  std::uint8_t corner = 0;
  Kind kind = other;

  bool knows(std::uint32_t bits) const { return (known & bits) == bits; }
  bool is_mid_node() const { return kind == midpoint || kind == centre; }
  /// Returns true if all neighbours that the prediction rule needs are known. In this case, the
  /// difference between the element's value and its prediction is stored, because later elements
  /// are predicted from it. The code calls this difference `third`.
  bool has_rule() const {
    if (kind == flat) return knows(3 * kNear | kDiagonal);
    if (kind == simplex) return knows(kOpposite);
    return is_mid_node() || knows(kLattice);
  }
  /// Combines `known` and the kind into one number, with the kind in the higher bits. The bits of
  /// `known` are masked with `counts`, except for a mid node.
  std::uint32_t traits(std::uint32_t counts = 0xffff) const {
    if (is_mid_node()) return known | std::uint32_t{kind} << kKindShift;
    return (known & counts) | (kind > centre ? std::uint32_t{kind} << kKindShift : 0);
  }
};

/// The farthest type of neighbour that is searched.
enum class Reach : std::uint8_t { lattice = 0, beyond = 1, farther = 2 };

class NeighbourFinder {
 public:
  /// `cells`: true if cell() will be called.
  explicit NeighbourFinder(bool cells) : cells_(cells) {}

  /// Begins a cell whose slots are known. `as_stored`: true if corners are numbered as in the
  /// source mesh, false if they are numbered along the axes that the coder has chosen for the cell.
  /// `live`: number of live vertices.
  void begin_cell(const CellTopology& cell, bool as_stored, std::uint64_t live);
  /// Returns the neighbourhood of the new vertex at `position`, and marks this vertex as known.
  /// Call it once for each new vertex of the cell, in order of introduction.
  Neighbourhood vertex(const CellTopology& cell, std::uint32_t position, Reach reach);
  /// Returns the neighbourhood of the current cell. Call it after the calls to vertex().
  Neighbourhood cell(const CellTopology& cell, Reach reach);
  void end_cell(const CellTopology& cell);
  /// Returns the neighbourhood of a vertex that no cell uses.
  Neighbourhood unused_vertex(std::uint32_t slot);

 private:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  /// A use of a vertex: a remembered hexahedron, and the corner at which the hexahedron has the
  /// vertex.
  struct Use {
    std::uint64_t sequence = kNever;  ///< sequence number of the cell
    std::uint32_t place = kNone;      ///< index of the cell in the ring of remembered cells
    std::uint32_t corner = 0;         ///< which corner of the cell the vertex is: x + 2y + 4z
  };
  struct Vertex {
    std::uint64_t introduced = 0;  // sequence number of the cell that introduced the vertex
    // The first and the most recent hexahedron that used the vertex
    std::array<Use, 2> uses;
    bool full = false;  // true if the vertex's near, diagonal and opposite neighbours were all
                        // known
  };
  /// A remembered cell. It is an entry of the ring.
  struct Cell {
    std::uint64_t sequence = kNever;
    // Vertex slots of the corners. Indexed by corner bits (x + 2y + 4z) for a hexahedron, and by
    // position for other cells
    std::array<std::uint32_t, 8> corner{};
    CellShape shape = CellShape::hexahedron;
    std::uint8_t corners = 8;
  };
  /// The neighbouring cells across the sides of a cell. Used only if the mesh has cells that are
  /// not hexahedra.
  struct Sides {
    static constexpr std::uint32_t kMost = 6;
    std::array<std::uint32_t, kMost> behind{};  // positions of these cells in the ring
  };
  using Cycle = std::span<const std::uint32_t>;  // slots of the vertices around a side

  /// Links from a hexahedron to its neighbours, as positions in the ring. Used only by cell().
  struct Links {
    // Positions in the ring of the neighbouring cells. Side 2 * a is at the lower end of axis a,
    // side 2 * a + 1 at the upper end.
    std::array<std::uint32_t, 6> behind{};
    // For each cell in `behind`: the side of that cell that is opposite to the shared side
    std::array<std::uint8_t, 6> onward{};
    bool full = false;
  };
  /// A corner of a face of the current polyhedron: the vertex, and the vertices before and after it
  /// around the face.
  struct FaceCorner {
    std::uint32_t slot = kNone, before = kNone, after = kNone;
    std::uint32_t across = kNone;  ///< the opposite vertex, if the face has four vertices
  };
  /// A hexahedron that was found across a face: its position in the ring, one of its corners on the
  /// face, and the axis that leads away from the face.
  struct Found {
    std::uint32_t place = kNone, corner = 0, axis = 0;
    explicit operator bool() const { return place != kNone; }
    /// Returns the side of the hexahedron at the far end of the axis.
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
  void look_along_rows(Neighbourhood& item, const CellTopology& cell, std::uint32_t position) const;
  void look_around_cell(Neighbourhood& item, Reach reach) const;
  // Functions for polyhedra, which are described by lists of faces
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
  /// Returns the position in the ring of the cell across side `side` of the cell at `place`.
  /// Returns kNone if no such cell exists or if it is no longer in the ring.
  std::uint32_t behind_of(std::uint32_t place, std::uint32_t side) const;
  bool is_behind(std::uint32_t place, std::uint32_t other) const;
  std::uint32_t common(std::uint32_t a, std::uint32_t b) const;

  bool cells_;
  std::vector<Vertex> vertices_;
  std::vector<Cell> ring_;
  std::vector<Links> links_;  // empty unless cell() is called
  std::vector<Sides> sides_;  // empty if all cells of the mesh are hexahedra
  std::uint32_t next_place_ = 0, place_ = 0;
  std::uint64_t sequence_ = 0;

  // Data of the current cell
  bool as_stored_ = true;
  std::array<std::uint32_t, 8> corner_{};  // vertex slots of the corners, indexed by x + 2y + 4z
  std::uint64_t known_ = 0;          // bit i: 1 if the vertex at position i already has values
  std::uint32_t known_corners_ = 0;  // bit mask of the known corners of a hexahedron: bit x + 2y +
                                     // 4z for the corner at x, y, z
  std::array<Found, 6> found_{};     // hexahedra across the faces of the current cell; used by
                                     // cell()
  std::vector<FaceCorner> around_;   // corners of all faces of a polyhedron, sorted by slot

  // For each slot: the sequence number, plus 1, of the most recent cell that introduced a vertex in
  // this slot.
  std::vector<std::uint64_t> coming_;
  bool full_ = false;  // true if the current cell's near, diagonal and opposite neighbours are all
                       // known
};

}  // namespace shm
