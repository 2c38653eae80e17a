// PolyhedronSurface: the faces that only one polyhedron has used so far, and the edges of the
// polyhedra. The polyhedra have any number of faces.
//   faces  cycles of vertices that only one polyhedron has used. A face is removed as soon as one
//          of its vertices is finalized.
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
  /// Limits that keep every search short, even in hostile files. Frozen: part of the format.
  static constexpr std::size_t kMostFaces = 64, kMostEdges = 32;
  static constexpr std::uint32_t kMostCells = 255;

  /// Occurrence of a vertex in a face: the face, and the position of the vertex in the face's
  /// cycle.
  struct Place {
    std::uint32_t face = kNone, at = 0;
  };
  struct Edge {
    std::uint32_t to = kNone;  ///< slot of the vertex at the other end of the edge
    std::uint32_t cells = 0;   ///< number of polyhedra with this edge, at most kMostCells
  };

  /// Adds a face of polyhedron `cell`. Does nothing if one of the vertices already has kMostFaces
  /// faces. Precondition: the vertices of the face are all different.
  void add_face(std::span<const std::uint32_t> cycle, std::uint64_t cell);
  void remove_face(std::uint32_t face);
  /// Returns an open face with this cycle of vertices in either direction. If there are several,
  /// returns the newest. Returns kNone if none exists.
  std::uint32_t find(std::span<const std::uint32_t> cycle) const;
  std::span<const std::uint32_t> cycle(std::uint32_t face) const { return faces_[face].cycle; }
  std::uint64_t cell_of(std::uint32_t face) const { return faces_[face].cell; }
  /// Increments the number of polyhedra that use an edge. Does nothing if the edge is new and one
  /// of its vertices already has kMostEdges edges.
  void add_edge(std::uint32_t a, std::uint32_t b);
  /// Returns how many of the polyhedra added so far have the edge between `a` and `b`.
  std::uint32_t cells_at(std::uint32_t a, std::uint32_t b) const;

  /// Returns the faces at a vertex, from the oldest to the newest.
  std::span<const Place> faces_at(std::uint32_t slot) const {
    return slot < vertices_.size() ? std::span<const Place>(vertices_[slot].faces)
                                   : std::span<const Place>();
  }
  /// Returns the edges at a vertex, from the oldest to the newest.
  std::span<const Edge> edges_at(std::uint32_t slot) const {
    return slot < vertices_.size() ? std::span<const Edge>(vertices_[slot].edges)
                                   : std::span<const Edge>();
  }
  /// Removes all faces and edges at a vertex. Call it when the vertex is finalized.
  void forget(std::uint32_t slot);

 private:
  struct Vertex {
    std::vector<Place> faces;
    std::vector<Edge> edges;
  };

  struct Face {
    std::vector<std::uint32_t> cycle;  // slots of the vertices around the face
    std::uint64_t cell = 0;            // number of the polyhedron that added the face
  };

  std::vector<Vertex> vertices_;  // faces and edges at each vertex, by vertex slot
  std::vector<Face> faces_;
  std::vector<std::uint32_t> free_faces_;
};

}  // namespace shm
