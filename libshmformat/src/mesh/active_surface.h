// Active surface: the part of the mesh that later cells can still use. Encoder and decoder maintain
// the same active surface.
//   vertices  a vertex is added when a cell first uses it, and removed when it is finalized
//   faces     quadrilaterals of one hexahedron to which no second hexahedron has been attached; a
//             face is removed as soon as one of its vertices is finalized. Across each of its four
//             edges a face has at most one mate: the face at the other end of the fan of hexahedra
//             around that edge.
//   cells     a hexahedron has a slot as long as it has a face on the surface
// Slots are reused, so arrays indexed by slot are only about as large as the largest surface.
// source: paper section 3.1; spec: "Active surface"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "base/lists.h"

namespace shm {

/// Slots of the four vertices around a face. By the right-hand rule, the normal of the face points
/// away from the hexahedron that added the face. If a hexahedron is attached to the face, the four
/// vertices are its corners 0 1 2 3.
using Quad = std::array<std::uint32_t, 4>;

/// Corner of a face: 4 * face slot + position of the vertex in the face's quad. kNone marks the end
/// of a list.
using FaceCorner = std::uint32_t;
/// Edge of a face: 4 * face slot + position of the edge's first vertex in the face's quad. kNone
/// means that the edge has no mate.
using FaceEdge = std::uint32_t;

/// Largest number of faces at a vertex. If one of the vertices of a new face already has this
/// number of faces, the face is not added to the surface. The limit keeps every search short, even
/// in hostile files. Frozen: part of the format.
inline constexpr std::uint32_t kMaxFacesAtVertex = 128;

class ActiveSurface {
 public:
  struct Vertex {
    std::uint64_t id = 0;  ///< stream number
    FaceCorner first_face = kNone;
    std::uint32_t face_count = 0;
    std::uint32_t uses = 0;  ///< number of cells so far that use the vertex
    bool alive = false;
  };
  struct Face {
    Quad quad{};
    /// Links of the lists of faces; each vertex has a list of its faces.
    std::array<FaceCorner, 4> next{}, previous{};
    std::array<FaceEdge, 4> mate{};  ///< mate across the edge from quad[i] to quad[i + 1]
    /// For each edge: number of hexahedra between this face and its mate across this edge; at most
    /// 255.
    std::array<std::uint8_t, 4> fan{};
    /// For each vertex of the face: which corner of the owner it is. The owner is the hexahedron
    /// that added the face.
    std::array<std::uint8_t, 4> owner_corner{};
    std::uint32_t cell = kNone;  ///< cell slot of the owner
    std::uint8_t side = 0;       ///< index of this face in the owner, 0 to 5
    bool alive = false;
  };

  /// Adds a vertex, which is given the next stream number. Returns its slot.
  std::uint32_t add_vertex() {
    const std::uint32_t slot = vertex_slot();
    Vertex& vertex = vertices_[slot];
    vertex = Vertex{};
    vertex.id = next_id_++;
    vertex.alive = true;
    ++active_vertices_;
    introduced_.push_back({vertex.id, slot});
    return slot;
  }
  /// Removes a vertex and every face at the vertex.
  void finalize(std::uint32_t slot) {
    Vertex& vertex = vertices_[slot];
    while (vertex.first_face != kNone) remove_face(vertex.first_face / 4);
    vertex.alive = false;
    --active_vertices_;
    free_vertices_.push_back(slot);
    if (introduced_.size() > 3 * active_vertices_ + 64) sweep_introduced();
  }
  void count_use(std::uint32_t vertex) { ++vertices_[vertex].uses; }

  /// Returns a slot for the current cell. The slot stays valid until end_cell(), and longer if the
  /// cell has active faces. If a cell loses its last face, its slot is not reused before the next
  /// begin_cell().
  std::uint32_t begin_cell();
  void end_cell();
  /// Adds a face of the current cell, without mates. Returns the slot of the face. Precondition:
  /// all vertices of the face are alive.
  std::uint32_t add_face(const Quad& quad, const std::array<std::uint8_t, 4>& owner_corner,
                         std::uint8_t side);
  void remove_face(std::uint32_t face);
  /// Makes two faces mates of each other, at the edges `a` and `b`. `fan`: number of hexahedra
  /// between the two faces.
  void join(FaceEdge a, FaceEdge b, std::uint32_t fan);

  /// Returns an active face whose vertices around the face are a, b, c, d, in either direction. If
  /// there are several, returns the newest. Returns kNone if none exists.
  std::uint32_t find_face(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const;
  /// Finds an active face in which `a` and `c` are the neighbours of `b`, and returns the corner of
  /// this face at `b`. If there are several such faces, uses the newest. Returns kNone if none
  /// exists.
  FaceCorner find_path(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;

  const Vertex& vertex(std::uint32_t slot) const { return vertices_[slot]; }
  const Face& face(std::uint32_t slot) const { return faces_[slot]; }
  FaceCorner next_around(FaceCorner corner) const { return faces_[corner / 4].next[corner % 4]; }
  /// Returns the vertex that comes `steps` positions after `corner` around the same face.
  std::uint32_t around(FaceCorner corner, std::uint32_t steps) const {
    return faces_[corner / 4].quad[(corner + steps) % 4];
  }
  FaceEdge mate(FaceEdge edge) const { return faces_[edge / 4].mate[edge % 4]; }
  std::uint32_t fan(FaceEdge edge) const { return faces_[edge / 4].fan[edge % 4]; }
  /// Returns the slot of the live vertex with stream number `id`, or kNone if no such vertex
  /// exists.
  std::uint32_t slot_of(std::uint64_t id) const;

  std::uint64_t next_id() const { return next_id_; }
  /// Returns the stream number of the oldest live vertex. If no vertex is live, returns next_id().
  std::uint64_t oldest_id() {
    while (oldest_ < introduced_.size() && !alive(introduced_[oldest_])) ++oldest_;
    return oldest_ == introduced_.size() ? next_id_ : introduced_[oldest_].id;
  }
  std::uint64_t active_vertices() const { return active_vertices_; }
  /// Returns the number of calls to remove_face().
  std::uint64_t removed_faces() const { return removed_faces_; }
  std::uint32_t vertex_slots() const { return static_cast<std::uint32_t>(vertices_.size()); }
  std::uint32_t cell_slots() const { return static_cast<std::uint32_t>(cell_faces_.size()); }

 private:
  /// Entry in the list of introduced vertices. From time to time, finalized vertices are removed
  /// from the list.
  struct Introduced {
    std::uint64_t id = 0;
    std::uint32_t slot = 0;
  };
  bool alive(const Introduced& introduced) const {
    return vertices_[introduced.slot].alive && vertices_[introduced.slot].id == introduced.id;
  }
  template <class T>
  static std::uint32_t take_slot(std::vector<T>& slots, std::vector<std::uint32_t>& free) {
    if (free.empty()) {
      slots.emplace_back();
      return static_cast<std::uint32_t>(slots.size() - 1);
    }
    const std::uint32_t slot = free.back();
    free.pop_back();
    return slot;
  }
  /// Returns a slot for a new vertex. If there are more free slots than live vertices, returns the
  /// slot that has been free for the longest time; so data stored by slot remain available for a
  /// while after their vertex was finalized. Otherwise returns a new slot. Frozen: part of the
  /// format.
  std::uint32_t vertex_slot() {
    if (free_vertices_.size() <= active_vertices_ + kRestingSlots) {
      push_tightly(vertices_, Vertex());
      return static_cast<std::uint32_t>(vertices_.size() - 1);
    }
    const std::uint32_t slot = free_vertices_.front();
    free_vertices_.pop_front();
    return slot;
  }
  void unlink(FaceCorner corner);
  void sweep_introduced();

  std::vector<Vertex> vertices_;
  std::vector<Face> faces_;
  std::vector<std::uint8_t> cell_faces_;  // number of active faces of each cell, by cell slot
  static constexpr std::size_t kRestingSlots = 256;
  // Free vertex slots. The slot that has been free for the longest time is the first.
  std::deque<std::uint32_t> free_vertices_;
  std::vector<std::uint32_t> free_faces_, free_cells_;
  std::vector<Introduced> introduced_;
  std::size_t oldest_ = 0;  // index in introduced_; all vertices before this index are finalized
  std::uint64_t next_id_ = 0, active_vertices_ = 0, removed_faces_ = 0;
  std::uint32_t current_cell_ = kNone;
};

}  // namespace shm
