// PolyhedronSurface: the faces and edges that polyhedra of any number of faces have left open.
//   faces  cycles of vertices of one polyhedron that no second one has closed. Removed with their
//          first finalized vertex.
//   edges  between live vertices, with the number of polyhedra that had each
// spec: "Polyhedra"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/lists.h"

namespace shm {

class PolyhedronSurface {
 public:
  /// Limits that keep every search short, also in hostile files. Frozen: part of the format.
  static constexpr std::size_t kMostFaces = 64, kMostEdges = 32;
  static constexpr std::uint32_t kMostCells = 255;

  /// A face, and the position of a vertex in its cycle.
  struct Place {
    std::uint32_t face = kNone, at = 0;
  };
  struct Edge {
    std::uint32_t to = kNone;  ///< slot of the other end
    std::uint32_t cells = 0;   ///< number of polyhedra that had it, at most kMostCells
  };

  /// Adds a face of polyhedron `cell`, unless one of its vertices has too many faces. Must hold:
  /// its vertices are all different.
  void add_face(std::span<const std::uint32_t> cycle, std::uint64_t cell);
  void remove_face(std::uint32_t face);
  /// Returns the newest open face with this cycle of vertices in either direction, kNone if there
  /// is none.
  std::uint32_t find(std::span<const std::uint32_t> cycle) const;
  std::span<const std::uint32_t> cycle(std::uint32_t face) const { return faces_[face].cycle; }
  std::uint64_t cell_of(std::uint32_t face) const { return faces_[face].cell; }
  /// Counts an edge of a polyhedron, unless one of its vertices has too many other edges.
  void add_edge(std::uint32_t a, std::uint32_t b);
  /// Returns how many polyhedra had the edge.
  std::uint32_t cells_at(std::uint32_t a, std::uint32_t b) const;

  /// Faces at a vertex, the newest last.
  std::span<const Place> faces_at(std::uint32_t slot) const {
    return slot < vertices_.size() ? std::span<const Place>(vertices_[slot].faces)
                                   : std::span<const Place>();
  }
  /// Edges at a vertex, the oldest first.
  std::span<const Edge> edges_at(std::uint32_t slot) const {
    return slot < vertices_.size() ? std::span<const Edge>(vertices_[slot].edges)
                                   : std::span<const Edge>();
  }
  /// Removes all faces and edges of a vertex that is finalized.
  void forget(std::uint32_t slot);

 private:
  struct Vertex {
    std::vector<Place> faces;
    std::vector<Edge> edges;
  };

  struct Face {
    std::vector<std::uint32_t> cycle;  // of slots
    std::uint64_t cell = 0;            // the polyhedron that has it
  };

  std::vector<Vertex> vertices_;  // by slot
  std::vector<Face> faces_;
  std::vector<std::uint32_t> free_faces_;
};

}  // namespace shm
