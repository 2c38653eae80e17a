// Frames: a hexahedron as a cube with axes x y z that are carried from one to the next, its faces
// and edges by corner bits (x + 2y + 4z), and the 48 ways in which its corners may be stored.
// spec: "Frame"
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "surface/hexahedron.h"

namespace shm {

/// Faces by their number in kFaceCorners: axis bit, end of that axis, opposite face.
inline constexpr std::array<std::uint8_t, 6> kAxis = {4, 1, 2, 1, 2, 4};
constexpr bool high(std::uint32_t side) { return side >= 3; }
inline constexpr std::array<std::uint8_t, 6> kOpposite = {5, 3, 4, 1, 2, 0};
constexpr std::uint32_t side_of(std::uint32_t axis_bit, bool at_high) {
  for (std::uint32_t k = 0; k < 6; ++k)
    if (kAxis[k] == axis_bit && high(k) == at_high) return k;
  return 6;
}

/// Corner bits around each face.
inline constexpr auto kQuadBits = [] {
  std::array<std::array<std::uint8_t, 4>, 6> table{};
  for (std::uint32_t k = 0; k < 6; ++k)
    for (std::uint32_t i = 0; i < 4; ++i) table[k][i] = kCornerBits[kFaceCorners[k][i]];
  return table;
}();

/// kEdgeSide[k][i]: the other face at edge i (from corner i to i + 1) of face k.
inline constexpr auto kEdgeSide = [] {
  std::array<std::array<std::uint8_t, 4>, 6> table{};
  for (std::uint32_t k = 0; k < 6; ++k)
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t a = kQuadBits[k][i], b = kQuadBits[k][(i + 1) % 4];
      const std::uint32_t axis = 7u & ~((a ^ b) | kAxis[k]);
      table[k][i] = static_cast<std::uint8_t>(side_of(axis, (a & axis) != 0));
    }
  return table;
}();

/// kWays[k][i]: along which sides the edges from corner i of face k lead, to i + 1 and to i - 1.
inline constexpr auto kWays = [] {
  std::array<std::array<std::array<std::uint8_t, 2>, 4>, 6> table{};
  for (std::uint32_t k = 0; k < 6; ++k)
    for (std::uint32_t i = 0; i < 4; ++i)
      for (std::uint32_t n = 0; n < 2; ++n) {
        const std::uint32_t here = kQuadBits[k][i];
        const std::uint32_t there = kQuadBits[k][(i + (n == 0 ? 1 : 3)) % 4];
        table[k][i][n] = static_cast<std::uint8_t>(side_of(here ^ there, there > here));
      }
  return table;
}();

/// The 12 edges as pairs (face, edge of the face).
struct EdgeFaces {
  std::array<std::uint8_t, 2> face{}, edge{};
};
inline constexpr auto kEdgeFaces = [] {
  std::array<EdgeFaces, 12> table{};
  std::uint32_t count = 0;
  for (std::uint8_t p = 0; p < 6; ++p)
    for (std::uint8_t i = 0; i < 4; ++i) {
      const std::uint8_t q = kEdgeSide[p][i];
      if (q < p) continue;
      for (std::uint8_t j = 0; j < 4; ++j)
        if (kEdgeSide[q][j] == p) table[count++] = {{p, q}, {i, j}};
    }
  return table;
}();

/// Orientation: frame bits to stored bits, all 48 symmetries of the cube.
/// stored = base ^ (a where x is set) ^ (b where y) ^ (c where z); number = base * 6 + axes.
inline constexpr std::array<std::array<std::uint8_t, 3>, 6> kAxes = {
    {{1, 2, 4}, {2, 4, 1}, {4, 1, 2}, {2, 1, 4}, {1, 4, 2}, {4, 2, 1}}};
inline constexpr std::uint8_t kOrientations = 48;
inline constexpr auto kStoredBits = [] {
  std::array<std::array<std::uint8_t, 8>, kOrientations> table{};
  for (std::uint32_t o = 0; o < kOrientations; ++o)
    for (std::uint32_t b = 0; b < 8; ++b) {
      std::uint32_t bits = o / 6;
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        if ((b >> axis & 1) != 0) bits ^= kAxes[o % 6][axis];
      table[o][b] = static_cast<std::uint8_t>(bits);
    }
  return table;
}();
constexpr bool mirrors(std::uint32_t orientation) {
  return ((std::popcount(orientation / 6) & 1) != 0) != (orientation % 6 >= 3);
}
inline constexpr std::uint8_t kMirror = 1 * 6 + 0;  // x runs the other way

constexpr std::uint8_t orientation_number(std::uint32_t base, std::uint32_t x, std::uint32_t y) {
  for (std::uint8_t a = 0; a < 6; ++a)
    if (kAxes[a][0] == x && kAxes[a][1] == y) return static_cast<std::uint8_t>(base * 6 + a);
  return kOrientations;
}

/// The bit of one member of a set of corners or faces.
constexpr std::uint32_t bit(std::uint32_t i) { return 1u << i; }

}  // namespace shm
