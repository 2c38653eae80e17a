// OpenFaces: the faces and edges that only one cell has used so far. It is used for meshes that
// have cells other than hexahedra.
//   faces  open triangles and quadrilaterals of cells (including flat cells), and open edges of
//          flat cells. A face is removed as soon as one of its vertices is finalized.
//   cells  cells that have an open face or recently had one. They are stored by cell number, so
//   that
//          the neighbours of a cell's neighbours can be found.
// spec: "Corners of other cells"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "base/lists.h"
#include "base/number_map.h"

namespace shm {

/// Local node indices within a cell: the nodes around one of its faces, or the two ends of one of
/// its edges.
struct ShapeFace {
  std::uint8_t size = 0;
  std::array<std::uint8_t, 4> at{};
};

/// Sides of a cell. For a flat cell, the first side is the cell itself.
struct CellSides {
  std::span<const ShapeFace> sides;
  bool flat = false;  ///< true if the cell is flat. A flat cell covers a solid cell's face that has
                      ///< the same vertices
  /// True if the sides of the cell become open faces that later cells can share.
  bool opens = true;
};

class OpenFaces {
 public:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  /// Maximum number of nodes stored per cell, and maximum number of sides recorded per cell.
  static constexpr std::uint32_t kMost = 8;

  struct Face {
    std::array<std::uint32_t, 4> node{};  ///< vertex slots around the face
    /// Links of the doubly linked lists of faces, one list per vertex. A link is 4 * face slot +
    /// position of the vertex in the face.
    std::array<std::uint32_t, 4> next{}, previous{};
    std::uint32_t cell = kNone;  ///< index of the owner, which is the cell that added the face
    std::uint8_t size = 0;       ///< number of corners; 2 for an edge
    bool flat = false;           ///< true if the face itself is a flat cell
    bool covered = false;        ///< true if a flat cell covers the face (has the same vertices)
  };
  struct Cell {
    /// Number of the cell, counted from 0 across cells of all shapes.
    std::uint64_t number = kNever;
    std::uint32_t open = 0;  ///< number of open faces of the cell
    std::uint32_t size = 0;
    std::array<std::uint32_t, kMost> node{};  ///< vertex slots of the cell's nodes, in stored order
  };
  struct Vertex {
    std::uint32_t first = kNone;
    /// Counts of faces, edges and bare faces at the vertex. A face is bare if no flat cell covers
    /// it.
    std::uint8_t faces = 0, edges = 0, bare = 0;
  };

  /// Adds the next cell. `corners`: vertex slots of the cell's corners. After this call, behind()
  /// returns the neighbours across the sides of this cell.
  void add_cell(const CellSides& sides, std::span<const std::uint32_t> corners);
  /// Counts a cell without adding any sides.
  void skip_cell() { ++next_number_; }
  std::uint64_t next_number() const { return next_number_; }
  /// Returns one entry for each side of the most recently added cell: the number of the earlier
  /// cell that has the same face, or kNever if none exists. Only the first kMost sides have an
  /// entry.
  const std::array<std::uint64_t, kMost>& behind() const { return behind_; }
  /// Removes all faces at a vertex. Call it when the vertex is finalized.
  void forget(std::uint32_t vertex);

  /// Returns an open face with this cycle of vertices in either direction. If there are several,
  /// returns the newest. Returns kNone if none exists.
  std::uint32_t find(std::span<const std::uint32_t> cycle) const;
  const Face& face(std::uint32_t i) const { return faces_[i]; }
  /// Calls visit(face, place) for each face at a vertex, beginning with the newest face. `place` is
  /// the position of the vertex in the face.
  template <class Visit>
  void around(std::uint32_t vertex, Visit&& visit) const {
    if (vertex >= vertices_.size()) return;
    for (std::uint32_t corner = vertices_[vertex].first; corner != kNone;
         corner = faces_[corner / 4].next[corner % 4])
      visit(faces_[corner / 4], corner % 4);
  }
  Vertex vertex(std::uint32_t slot) const {
    return slot < vertices_.size() ? vertices_[slot] : Vertex();
  }
  /// Returns the stored cell with this number, or null if it is not stored.
  const Cell* cell(std::uint64_t number) const {
    const std::uint32_t place = by_number_.find(number);
    return place == kNone ? nullptr : &cells_[place];
  }
  std::uint64_t number_of(const Face& face) const { return owner(face).number; }
  const Cell& owner(const Face& face) const { return cells_[face.cell]; }

 private:
  /// Maximum number of faces at a vertex, equal to kMaxFacesAtVertex in active_surface.h. The limit
  /// keeps every search short. Frozen: part of the format.
  static constexpr std::uint32_t kMostAtVertex = 128;
  /// Maximum number of cells without open faces that remain stored.
  static constexpr std::size_t kResting = 256;

  void add_side(std::uint32_t side, std::span<const std::uint32_t> cycle, const CellSides& sides);
  void add_face(std::span<const std::uint32_t> cycle, std::uint32_t cell, bool flat);
  void remove_face(std::uint32_t face);
  void cover(std::uint32_t face);
  std::uint32_t new_cell();
  Vertex& vertex_at(std::uint32_t slot);

  std::vector<Vertex> vertices_;  // faces at each vertex, by vertex slot
  std::vector<Face> faces_;
  std::vector<std::uint32_t> free_faces_;
  std::vector<Cell> cells_;
  // Indices of the stored cells without open faces, oldest entry first.
  std::deque<std::uint32_t> resting_;
  IdMap by_number_;
  std::array<std::uint64_t, kMost> behind_{};
  std::uint64_t next_number_ = 0;
  std::uint32_t current_ = kNone;
};

}  // namespace shm
