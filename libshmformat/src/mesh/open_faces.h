// OpenFaces: the faces and edges of cells to which no second cell has been attached yet, in meshes
// that also have cells other than hexahedra.
//   faces  open triangles and quadrilaterals of cells, including flat cells, and open edges of flat
//          cells. A face is removed when its first vertex is finalized.
//   cells  cells that have an open face or recently had one. They are stored by number, so that the
//          neighbour of a cell's neighbour can be found.
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

/// Positions, in a cell, of the nodes around one of its faces or at the two ends of one of its
/// edges.
struct ShapeFace {
  std::uint8_t size = 0;
  std::array<std::uint8_t, 4> at{};
};

/// Sides of a cell. The first side of a flat cell is the cell itself, as a face.
struct CellSides {
  std::span<const ShapeFace> sides;
  bool flat = false;  ///< true: a flat cell, which covers the face of a solid if it coincides with
                      ///< that face
  /// True: the sides of the cell stay open, so that later cells can be attached.
  bool opens = true;
};

class OpenFaces {
 public:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  /// Largest number of nodes, and of sides, that are stored per cell.
  static constexpr std::uint32_t kMost = 8;

  struct Face {
    std::array<std::uint32_t, 4> node{};  ///< vertex slots around the face
    /// Links of the lists of faces at a vertex: face slot * 4 + position of the vertex in the face.
    std::array<std::uint32_t, 4> next{}, previous{};
    std::uint32_t cell = kNone;  ///< index of the owner, the cell that added the face
    std::uint8_t size = 0;       ///< number of corners; 2 for an edge
    bool flat = false;           ///< true: the face is itself a flat cell
    bool covered = false;        ///< true: a flat cell coincides with the face
  };
  struct Cell {
    /// Number of the cell among cells of all shapes, counted from 0.
    std::uint64_t number = kNever;
    std::uint32_t open = 0;  ///< number of open faces of the cell
    std::uint32_t size = 0;
    std::array<std::uint32_t, kMost> node{};  ///< vertex slots of the nodes, in stored order
  };
  struct Vertex {
    std::uint32_t first = kNone;
    /// Numbers of faces, of edges, and of faces that no flat cell covers (bare), at the vertex.
    std::uint8_t faces = 0, edges = 0, bare = 0;
  };

  /// Adds the next cell. `corners` are the vertex slots of the cell. behind() then returns the
  /// cells across its sides.
  void add_cell(const CellSides& sides, std::span<const std::uint32_t> corners);
  /// Counts a cell without adding any sides.
  void skip_cell() { ++next_number_; }
  std::uint64_t next_number() const { return next_number_; }
  /// Returns, for each side of the last cell added, the number of the cell that had the same face,
  /// or kNever if none exists. Only the first kMost sides are listed.
  const std::array<std::uint64_t, kMost>& behind() const { return behind_; }
  /// Removes all faces of a vertex that is finalized.
  void forget(std::uint32_t vertex);

  /// Returns the newest open face with this cycle of vertices in either direction, or kNone if
  /// no such face exists.
  std::uint32_t find(std::span<const std::uint32_t> cycle) const;
  const Face& face(std::uint32_t i) const { return faces_[i]; }
  /// Calls visit(face, place) for the faces at a vertex, the newest face first.
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
  /// Returns the stored cell with this number, or null if no such cell exists.
  const Cell* cell(std::uint64_t number) const {
    const std::uint32_t place = by_number_.find(number);
    return place == kNone ? nullptr : &cells_[place];
  }
  std::uint64_t number_of(const Face& face) const { return owner(face).number; }
  const Cell& owner(const Face& face) const { return cells_[face.cell]; }

 private:
  /// Largest number of faces at a vertex, the same as in the active surface. The limit keeps every
  /// search short. Frozen: part of the format.
  static constexpr std::uint32_t kMostAtVertex = 128;
  /// Number of cells without open faces that stay stored.
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
  // Indices of stored cells without open faces; the cell that has been there longest is in front.
  std::deque<std::uint32_t> resting_;
  IdMap by_number_;
  std::array<std::uint64_t, kMost> behind_{};
  std::uint64_t next_number_ = 0;
  std::uint32_t current_ = kNone;
};

}  // namespace shm
