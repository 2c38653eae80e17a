// Surface: the parts of a mesh that can be drawn, i.e. points, edges and polygons. It refers to
// arrays that a reader has already filled.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "shm/schema.h"

namespace shm::converters {

// All spans are borrowed. The offsets in `face_begin` must ascend from 0 to the number of corners,
// and all corners must be valid vertex numbers.
struct Surface {
  ScalarType coordinate_type = ScalarType::float64;  // float32 or float64
  std::span<const std::byte> xyz;                    // 3 coordinates per vertex
  // Offset of each face in `corners`, followed by the size of `corners`. May be empty if there are
  // no faces.
  std::span<const std::uint64_t> face_begin;
  // Vertex numbers of the corners of all faces. A face with 1 corner is a point, a face with 2
  // corners an edge, and a face with 3 or more corners a polygon.
  std::span<const std::uint32_t> corners;
  std::span<const std::uint32_t> blocks;  // block index of each face
  // For each corner: 1 if the edge to the next corner is inside a side of a cell, where no outline
  // is drawn. May be empty if there are no such edges.
  std::span<const std::uint8_t> inner_edges;

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
