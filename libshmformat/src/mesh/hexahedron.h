// Hexahedron: tables that describe its corners, faces and edges, and the 48 orders in which its
// corners can be stored. 24 of these orders are rotations.
//
//        7 ------- 6        corner   0 1 2 3 4 5 6 7
//       /|        /|        x        0 1 1 0 0 1 1 0
//      4 ------- 5 |        y        0 0 1 1 0 0 1 1
//      | 3 ------|-2        z        0 0 0 0 1 1 1 1
//      |/        |/
//      0 ------- 1          faces: f0 bottom, f1 x=0, f2 y=0, f3 x=1, f4 y=1, f5 top
//
// spec: "Hexahedron", "Frame"
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace shm {

/// Corners of each face. By the right-hand rule, their order gives a normal that points out of the
/// hexahedron.
inline constexpr std::array<std::array<std::uint8_t, 4>, 6> kFaceCorners = {
    {{0, 3, 2, 1}, {0, 4, 7, 3}, {0, 1, 5, 4}, {1, 2, 6, 5}, {3, 7, 6, 2}, {4, 5, 6, 7}}};

inline constexpr std::array<std::array<std::uint8_t, 2>, 12> kEdgeCorners = {{{0, 1},
                                                                              {1, 2},
                                                                              {2, 3},
                                                                              {3, 0},
                                                                              {4, 5},
                                                                              {5, 6},
                                                                              {6, 7},
                                                                              {7, 4},
                                                                              {0, 4},
                                                                              {1, 5},
                                                                              {2, 6},
                                                                              {3, 7}}};

/// Converts the index of a corner to its bits x + 2y + 4z, and converts these bits to the index.
/// The same table works in both directions.
inline constexpr std::array<std::uint8_t, 8> kCornerBits = {0, 1, 3, 2, 4, 5, 7, 6};

/// Order in which the corners that are not known yet are coded and predicted (paper, Table 1).
inline constexpr std::array<std::uint8_t, 8> kCornerOrder = {0, 1, 2, 3, 4, 7, 5, 6};

/// Three tables, indexed by face: the bit of the axis that is normal to the face, the index of the
/// opposite face, and the bits of the face's corners.
inline constexpr std::array<std::uint8_t, 6> kFaceAxis = {4, 1, 2, 1, 2, 4};
inline constexpr std::array<std::uint8_t, 6> kOppositeFace = {5, 3, 4, 1, 2, 0};
inline constexpr auto kFaceBits = [] {
  std::array<std::array<std::uint8_t, 4>, 6> table{};
  for (std::uint32_t k = 0; k < 6; ++k)
    for (std::uint32_t i = 0; i < 4; ++i) table[k][i] = kCornerBits[kFaceCorners[k][i]];
  return table;
}();

/// The faces at the low end and at the high end of an axis. The first index is the bit of the axis.
inline constexpr std::array<std::array<std::uint8_t, 2>, 5> kFaceAt = {
    {{}, {1, 3}, {2, 4}, {}, {0, 5}}};

/// kAdjacentFace[k][i] is the other face at edge i of face k. Edge i connects corners i and i + 1
/// of the face.
inline constexpr auto kAdjacentFace = [] {
  std::array<std::array<std::uint8_t, 4>, 6> table{};
  for (std::uint32_t k = 0; k < 6; ++k)
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t a = kFaceBits[k][i], b = kFaceBits[k][(i + 1) % 4];
      const std::uint32_t axis = 7u & ~((a ^ b) | kFaceAxis[k]);
      table[k][i] = kFaceAt[axis][(a & axis) != 0];
    }
  return table;
}();

/// Two edges of face k meet at its corner i. kEdgesTowards[k][i] contains, for each of them, the
/// face of the hexahedron towards which the edge leads: first for the edge to corner i + 1, then
/// for the edge to corner i - 1.
inline constexpr auto kEdgesTowards = [] {
  std::array<std::array<std::array<std::uint8_t, 2>, 4>, 6> table{};
  for (std::uint32_t k = 0; k < 6; ++k)
    for (std::uint32_t i = 0; i < 4; ++i)
      for (std::uint32_t n = 0; n < 2; ++n) {
        const std::uint32_t here = kFaceBits[k][i];
        const std::uint32_t there = kFaceBits[k][(i + (n == 0 ? 1 : 3)) % 4];
        table[k][i][n] = kFaceAt[here ^ there][there > here];
      }
  return table;
}();

/// The two faces at an edge, and the index of the edge in each of these faces. kEdgeFaces is the
/// table of the 12 edges.
struct EdgeFaces {
  std::array<std::uint8_t, 2> face{}, edge{};
};
inline constexpr auto kEdgeFaces = [] {
  std::array<EdgeFaces, 12> table{};
  std::uint32_t count = 0;
  for (std::uint8_t p = 0; p < 6; ++p)
    for (std::uint8_t i = 0; i < 4; ++i) {
      const std::uint8_t q = kAdjacentFace[p][i];
      if (q < p) continue;
      for (std::uint8_t j = 0; j < 4; ++j)
        if (kAdjacentFace[q][j] == p) table[count++] = {{p, q}, {i, j}};
    }
  return table;
}();

/// Axes of the orientations. The orientations are the 48 symmetries of the cube. An orientation
/// converts the bits x, y, z of a corner in one frame to its bits in another frame: to = base ^ (a
/// if x is set) ^ (b if y is set) ^ (c if z is set). The index of an orientation is base * 6 + the
/// index of its axes (a b c) in this table.
inline constexpr std::array<std::array<std::uint8_t, 3>, 6> kOrientationAxes = {
    {{1, 2, 4}, {2, 4, 1}, {4, 1, 2}, {2, 1, 4}, {1, 4, 2}, {4, 2, 1}}};
inline constexpr std::uint8_t kOrientationCount = 48;
inline constexpr auto kOrientedBits = [] {
  std::array<std::array<std::uint8_t, 8>, kOrientationCount> table{};
  for (std::uint32_t o = 0; o < kOrientationCount; ++o)
    for (std::uint32_t b = 0; b < 8; ++b) {
      std::uint32_t bits = o / 6;
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        if ((b >> axis & 1) != 0) bits ^= kOrientationAxes[o % 6][axis];
      table[o][b] = static_cast<std::uint8_t>(bits);
    }
  return table;
}();
inline constexpr auto kIsMirrored = [] {
  std::array<bool, kOrientationCount> table{};
  for (std::uint32_t o = 0; o < kOrientationCount; ++o)
    table[o] = ((std::popcount(o / 6) & 1) != 0) != (o % 6 >= 3);
  return table;
}();
// Index of the orientation that reverses x and keeps y and z.
inline constexpr std::uint8_t kMirrorX = 1 * 6 + 0;

/// kOrientationOf[base][x][y] is the orientation with this base that converts the axes x and y to
/// these bits.
inline constexpr auto kOrientationOf = [] {
  std::array<std::array<std::array<std::uint8_t, 5>, 5>, 8> table{};
  for (std::uint32_t o = 0; o < kOrientationCount; ++o)
    table[o / 6][kOrientationAxes[o % 6][0]][kOrientationAxes[o % 6][1]] =
        static_cast<std::uint8_t>(o);
  return table;
}();

inline constexpr std::uint32_t kRotationCount = 24;

/// kRotations[r][i] is the corner at position i after rotation r. Rotations are the orientations
/// without mirroring. They are sorted by the bits of the corner at position 0, then by the axes
/// along the edges 0-1, 0-3 and 0-4.
inline constexpr auto kRotations = [] {
  std::array<std::array<std::uint8_t, 8>, kRotationCount> table{};
  std::uint32_t count = 0;
  for (std::uint32_t origin = 0; origin < 8; ++origin)
    for (std::uint32_t x : {1u, 2u, 4u})
      for (std::uint32_t y : {1u, 2u, 4u}) {
        const std::uint8_t orientation = kOrientationOf[origin][x][y];
        if (x == y || kIsMirrored[orientation]) continue;
        for (std::uint32_t i = 0; i < 8; ++i)
          table[count][i] = kCornerBits[kOrientedBits[orientation][kCornerBits[i]]];
        ++count;
      }
  return table;
}();

/// kRotatedFace[r][k] is the face at position k after rotation r.
inline constexpr auto kRotatedFace = [] {
  std::array<std::array<std::uint8_t, 6>, kRotationCount> table{};
  const auto corners_of = [](std::uint32_t face) {
    std::uint32_t set = 0;
    for (std::uint8_t corner : kFaceCorners[face]) set |= 1u << corner;
    return set;
  };
  for (std::uint32_t r = 0; r < kRotationCount; ++r)
    for (std::uint32_t k = 0; k < 6; ++k) {
      std::uint32_t set = 0;
      for (std::uint8_t corner : kFaceCorners[k]) set |= 1u << kRotations[r][corner];
      for (std::uint8_t f = 0; f < 6; ++f)
        if (corners_of(f) == set) table[r][k] = f;
    }
  return table;
}();

/// Returns the rotation after which the corners `at0`, `at1` and `at3` are at positions 0, 1 and 3.
/// Returns kRotationCount if none exists.
constexpr std::uint32_t rotation_of(std::uint32_t at0, std::uint32_t at1, std::uint32_t at3) {
  for (std::uint32_t r = 0; r < kRotationCount; ++r)
    if (kRotations[r][0] == at0 && kRotations[r][1] == at1 && kRotations[r][3] == at3) return r;
  return kRotationCount;
}

}  // namespace shm
