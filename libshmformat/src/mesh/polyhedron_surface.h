// PolyhedronSurface: the faces and edges of polyhedra to which no second polyhedron has been
// attached yet. The polyhedra have any number of faces.
//   faces  cycles of vertices that only one polyhedron has used. A face is removed when its first
//          vertex is finalized.
//   edges  edges between live vertices, with the number of polyhedra that have used each edge
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

  /// Occurrence of a vertex: a face, and the position of the vertex in the cycle of the face.
  struct Place {
    std::uint32_t face = kNone, at = 0;
  };
  struct Edge {
    std::uint32_t to = kNone;  ///< slot of the vertex at the other end
    std::uint32_t cells = 0;   ///< number of polyhedra that have used the edge, at most kMostCells
  };

  /// Adds a face of polyhedron `cell`, unless a vertex of the face has kMostFaces faces already.
  /// Must hold: the vertices of the face are all different.
  void add_face(std::span<const std::uint32_t> cycle, std::uint64_t cell);
  void remove_face(std::uint32_t face);
  /// Returns the newest open face with this cycle of vertices in either direction. Returns kNone if
  /// no such face exists.
  std::uint32_t find(std::span<const std::uint32_t> cycle) const;
  std::span<const std::uint32_t> cycle(std::uint32_t face) const { return faces_[face].cycle; }
  std::uint64_t cell_of(std::uint32_t face) const { return faces_[face].cell; }
  /// Counts a use of an edge by a polyhedron. Ignores the edge if it is new and one of its vertices
  /// has kMostEdges edges already.
  void add_edge(std::uint32_t a, std::uint32_t b);
  /// Returns the number of polyhedra that have used the edge between `a` and `b`.
  std::uint32_t cells_at(std::uint32_t a, std::uint32_t b) const;

  /// Returns the faces at a vertex, the newest last.
  std::span<const Place> faces_at(std::uint32_t slot) const {
    return slot < vertices_.size() ? std::span<const Place>(vertices_[slot].faces)
                                   : std::span<const Place>();
  }
  /// Returns the edges at a vertex, the oldest first.
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
    std::vector<std::uint32_t> cycle;  // slots of the vertices around the face
    std::uint64_t cell = 0;            // number of the polyhedron that has added the face
  };

  std::vector<Vertex> vertices_;  // faces and edges at each vertex, by vertex slot
  std::vector<Face> faces_;
  std::vector<std::uint32_t> free_faces_;
};

}  // namespace shm
