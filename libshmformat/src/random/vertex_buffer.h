// VertexBuffer: stores vertices of a segment with their values. The buffer stores a vertex until
// the last cell that uses it has been read. Vertices of requested cells are copied from the buffer
// to the piece (the requested part of the mesh).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "shm/blocks.h"
#include "shm/schema.h"

namespace shm {

/// Converts three coordinates of type `type` to double.
std::array<double, 3> point_of(const std::byte* xyz, ScalarType type);
/// Returns true if all coordinates of the point are finite and the point is inside the box or on
/// its faces.
bool is_in(const std::array<double, 6>& box, const std::array<double, 3>& point);

class VertexBuffer {
 public:
  struct Vertex {
    std::uint64_t number = 0;
    std::size_t record = 0;
    bool imported = false, in_box = false, given = false;
  };

  /// Creates an empty buffer. `schema` is borrowed. `arrays` lists the static point arrays whose
  /// values are stored. If `coordinates` is true, coordinates are stored, too.
  VertexBuffer(const Schema& schema, std::vector<std::uint32_t> arrays, bool coordinates);

  /// Adds vertex `v` of a block. Returns false if the buffer already contains a vertex with the
  /// same number.
  bool add(const MeshBlock& block, std::size_t v, bool in_box);
  /// Returns the vertex with this number, or null if no such vertex exists. The pointer is valid
  /// until the next call to add().
  Vertex* find(std::uint64_t number);
  void remove(std::uint64_t number);
  void clear();

  /// Returns the coordinates of a vertex; NaN if coordinates are not stored.
  std::array<double, 3> point(const Vertex& vertex) const;
  /// Appends the vertex to `out`: its number, and its coordinates and values if these are stored.
  void give(const Vertex& vertex, MeshBlock& out) const;
  /// Returns the number of stored vertices that are in the box.
  std::size_t in_box() const { return in_box_; }
  /// Calls visit(vertex) for all vertices, in no particular order.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [number, vertex] : vertices_) visit(vertex);
  }

 private:
  const Schema* schema_;
  std::vector<std::uint32_t> arrays_;
  std::vector<std::size_t> strides_;  // number of bytes per vertex of each array in arrays_
  std::size_t xyz_bytes_, record_bytes_;
  std::unordered_map<std::uint64_t, Vertex> vertices_;
  std::vector<std::byte> records_;
  std::vector<std::size_t> free_;  // offsets of unused records in records_
  std::size_t in_box_ = 0;
};

}  // namespace shm
