// OpenFaces: the faces and edges that cells of all shapes have left open, in meshes with cells
// other than hexahedra.
//   faces  triangles and quadrilaterals of cells, flat cells among them, that no second cell has
//          closed; also edges of flat cells. Removed with their first finalized vertex.
//   cells  by number; remembered while they have an open face, and for a while longer, so that the
//          neighbour of a cell's neighbour is found
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

/// Positions around a face of a cell, or the two ends of an edge.
struct ShapeFace {
  std::uint8_t size = 0;
  std::array<std::uint8_t, 4> at{};
};

/// Sides of a cell of some shape. A flat cell is itself a face: its first side.
struct CellSides {
  std::span<const ShapeFace> sides;
  bool flat = false;  ///< true: the cell covers the face that it lies on
  bool opens = true;  ///< true: its sides stay open after it
};

class OpenFaces {
 public:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  /// Largest number of nodes, and of sides, that are remembered of a cell.
  static constexpr std::uint32_t kMost = 8;

  struct Face {
    std::array<std::uint32_t, 4> node{};              ///< vertex slots around the face
    std::array<std::uint32_t, 4> next{}, previous{};  ///< list links by place: face * 4 + place
    std::uint32_t cell = kNone;                       ///< index of its owner
    std::uint8_t size = 0;                            ///< 2: an edge
    bool flat = false;                                ///< true: it is a cell itself
    bool covered = false;                             ///< true: a flat cell lies on it
  };
  struct Cell {
    std::uint64_t number = kNever;  ///< its number among cells of all shapes, from 0
    std::uint32_t open = 0;         ///< number of its faces that are open
    std::uint32_t size = 0;
    std::array<std::uint32_t, kMost> node{};  ///< vertex slots, as stored
  };
  struct Vertex {
    std::uint32_t first = kNone;
    std::uint8_t faces = 0, edges = 0, bare = 0;  ///< bare: faces that are not covered
  };

  /// Adds the next cell by its corners. behind() then returns the cells across its sides.
  void add_cell(const CellSides& sides, std::span<const std::uint32_t> corners);
  /// Counts a cell without sides.
  void skip_cell() { ++next_number_; }
  std::uint64_t next_number() const { return next_number_; }
  /// By side of the last cell added, below kMost: number of the cell that had the same face; kNever
  /// if there is none.
  const std::array<std::uint64_t, kMost>& behind() const { return behind_; }
  /// Removes all faces of a vertex that is finalized.
  void forget(std::uint32_t vertex);

  /// Returns the newest open face with this cycle of vertices in either direction, kNone if there
  /// is none.
  std::uint32_t find(std::span<const std::uint32_t> cycle) const;
  const Face& face(std::uint32_t i) const { return faces_[i]; }
  /// Calls visit(face, place) for the faces at a vertex, the newest first.
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
  /// Returns the remembered cell with this number, null if there is none.
  const Cell* cell(std::uint64_t number) const {
    const std::uint32_t place = by_number_.find(number);
    return place == kNone ? nullptr : &cells_[place];
  }
  std::uint64_t number_of(const Face& face) const { return owner(face).number; }
  const Cell& owner(const Face& face) const { return cells_[face.cell]; }

 private:
  /// The limit of the active surface: keeps every search short. Frozen: part of the format.
  static constexpr std::uint32_t kMostAtVertex = 128;
  /// Number of cells without open faces that are still remembered.
  static constexpr std::size_t kResting = 256;

  void add_side(std::uint32_t side, std::span<const std::uint32_t> cycle, const CellSides& sides);
  void add_face(std::span<const std::uint32_t> cycle, std::uint32_t cell, bool flat);
  void remove_face(std::uint32_t face);
  void cover(std::uint32_t face);
  std::uint32_t new_cell();
  Vertex& vertex_at(std::uint32_t slot);

  std::vector<Vertex> vertices_;  // by slot
  std::vector<Face> faces_;
  std::vector<std::uint32_t> free_faces_;
  std::vector<Cell> cells_;
  std::deque<std::uint32_t> resting_;  // indices of cells, the one that has rested longest in front
  IdMap by_number_;
  std::array<std::uint64_t, kMost> behind_{};
  std::uint64_t next_number_ = 0;
  std::uint32_t current_ = kNone;
};

}  // namespace shm
