// Surface: what there is to draw of a mesh, as its reader has it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "shm/schema.h"

namespace shm::converters {

// Borrowed. Must hold: offsets ascend from 0 to the number of corners, and corners are vertices.
struct Surface {
  ScalarType coordinate_type = ScalarType::float64;  // float32 or float64
  std::span<const std::byte> xyz;                    // 3 coordinates of each vertex
  std::span<const std::uint64_t> face_begin;         // faces + 1 offsets into corners; or empty
  std::span<const std::uint32_t> corners;  // 1: a point, 2: an edge, 3 and more: a polygon
  std::span<const std::uint32_t> blocks;   // of each face, by index

  std::size_t faces() const { return blocks.size(); }
  std::size_t vertices() const { return xyz.size() / (3 * scalar_bytes(coordinate_type)); }
  std::span<const std::uint32_t> face(std::size_t f) const {
    const auto begin = static_cast<std::size_t>(face_begin[f]);
    return corners.subspan(begin, static_cast<std::size_t>(face_begin[f + 1]) - begin);
  }
  double coordinate(std::size_t vertex, std::size_t axis) const {
    const std::size_t at = 3 * vertex + axis;
    if (coordinate_type == ScalarType::float32) return number_at<float>(at);
    return number_at<double>(at);
  }

 private:
  template <class T>
  double number_at(std::size_t at) const {
    T number;
    std::memcpy(&number, xyz.data() + at * sizeof(T), sizeof(T));
    return static_cast<double>(number);
  }
};

}  // namespace shm::converters
