// VertexBuffer: vertices of a segment with their values, from the cell that introduces them to
// their last use, for the cells between these that are wanted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

/// Three coordinates of `type`, as doubles.
std::array<double, 3> point_of(const std::byte* xyz, ScalarType type);
/// Whether all coordinates are finite and in the box, faces included.
bool is_in(const std::array<double, 6>& box, const std::array<double, 3>& point);

class VertexBuffer {
 public:
  struct Vertex {
    std::uint64_t number = 0;
    std::size_t record = 0;
    bool imported = false, in_box = false, given = false;
  };

  /// `schema` is borrowed. `arrays`: the static point arrays whose values are kept; `coordinates`:
  /// whether those are.
  VertexBuffer(const Schema& schema, std::vector<std::uint32_t> arrays, bool coordinates);

  /// Vertex `v` of a block; false where there is one of its number.
  bool add(const MeshBlock& block, std::size_t v, bool in_box);
  /// Null where there is none of that number. Valid until the next call of add().
  Vertex* find(std::uint64_t number);
  void remove(std::uint64_t number);
  void clear();

  /// NaN where coordinates are not kept.
  std::array<double, 3> point(const Vertex& vertex) const;
  /// Appends number, coordinates and values, as far as they are kept.
  void give(const Vertex& vertex, MeshBlock& out) const;
  /// How many of them are in the box.
  std::size_t in_box() const { return in_box_; }
  /// visit(vertex) for all, in no order.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [number, vertex] : vertices_) visit(vertex);
  }

 private:
  const Schema* schema_;
  std::vector<std::uint32_t> arrays_;
  std::vector<std::size_t> strides_;  // of the arrays
  std::size_t xyz_bytes_, record_bytes_;
  std::unordered_map<std::uint64_t, Vertex> vertices_;
  std::vector<std::byte> records_;
  std::vector<std::size_t> free_;  // records
  std::size_t in_box_ = 0;
};

}  // namespace shm
