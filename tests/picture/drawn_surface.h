// DrawnSurface: a surface to which tests of the drawing code add faces one at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "picture/surface.h"

namespace shm::converters {

struct DrawnSurface {
  std::vector<double> xyz;
  std::vector<std::uint64_t> face_begin = {0};
  std::vector<std::uint32_t> corners, blocks;

  // The result refers to this object's data.
  Surface surface() const {
    return {ScalarType::float64, std::as_bytes(std::span(xyz)), face_begin, corners, blocks};
  }
  std::uint32_t add_vertex(double x, double y, double z) {
    xyz.insert(xyz.end(), {x, y, z});
    return static_cast<std::uint32_t>(xyz.size() / 3 - 1);
  }
  void add_face(const std::vector<std::uint32_t>& of, std::uint32_t block = 0) {
    corners.insert(corners.end(), of.begin(), of.end());
    face_begin.push_back(corners.size());
    blocks.push_back(block);
  }
  // Adds a sheet of n x n faces that is perpendicular to `axis` at coordinate `at`. `sides`
  // contains the side lengths along x, y and z. The rows and columns of the sheet run along the
  // next two axes in the cyclic order x, y, z, x.
  void add_sheet(std::uint32_t n, std::size_t axis, double at,
                 std::array<double, 3> sides = {1, 1, 1}, std::uint32_t block = 0) {
    const auto first = static_cast<std::uint32_t>(xyz.size() / 3);
    const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (std::uint32_t j = 0; j <= n; ++j)
      for (std::uint32_t i = 0; i <= n; ++i) {
        std::array<double, 3> place{};
        place[axis] = at;
        place[b] = sides[b] * i / n;
        place[c] = sides[c] * j / n;
        add_vertex(place[0], place[1], place[2]);
      }
    for (std::uint32_t j = 0; j < n; ++j)
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t corner = first + j * (n + 1) + i;
        add_face({corner, corner + 1, corner + n + 2, corner + n + 1}, block);
      }
  }
  static DrawnSurface box(std::uint32_t n, std::array<double, 3> sides) {
    DrawnSurface box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.add_sheet(n, axis, 0, sides);
      box.add_sheet(n, axis, sides[axis], sides);
    }
    return box;
  }
};

}  // namespace shm::converters
