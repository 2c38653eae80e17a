// Surface: the drawable parts of a mesh, in the form in which a reader already has them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "shm/schema.h"

namespace shm::converters {

// A surface. All spans are borrowed. Offsets must ascend from 0 to the number of corners, and
// corners must be valid vertices.
struct Surface {
  ScalarType coordinate_type = ScalarType::float64;  // float32 or float64
  std::span<const std::byte> xyz;                    // 3 coordinates per vertex
  std::span<const std::uint64_t>
      face_begin;  // offset of each face in `corners`, then the end; or empty
  std::span<const std::uint32_t> corners;  // vertices of faces; a face with 1 corner is a point,
                                           // with 2 an edge, with 3 or more a polygon
  std::span<const std::uint32_t> blocks;   // block index of each face

  std::size_t faces() const { return blocks.size(); }
  std::size_t vertices() const { return xyz.size() / (3 * scalar_bytes(coordinate_type)); }
  std::span<const std::uint32_t> face(std::size_t f) const {
    const auto begin = static_cast<std::size_t>(face_begin[f]);
    return corners.subspan(begin, static_cast<std::size_t>(face_begin[f + 1]) - begin);
  }
  double coordinate(std::size_t vertex, std::size_t axis) const {
    const std::size_t index = 3 * vertex + axis;
    if (coordinate_type == ScalarType::float32) return number_at<float>(index);
    return number_at<double>(index);
  }

 private:
  template <class T>
  double number_at(std::size_t index) const {
    T number;
    std::memcpy(&number, xyz.data() + index * sizeof(T), sizeof(T));
    return static_cast<double>(number);
  }
};

}  // namespace shm::converters
