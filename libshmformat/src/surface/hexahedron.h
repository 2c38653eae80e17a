// The hexahedron: its corners, faces, edges and 24 rotations, as tables.
//
//        7 ------- 6        corner   0 1 2 3 4 5 6 7
//       /|        /|        x        0 1 1 0 0 1 1 0
//      4 ------- 5 |        y        0 0 1 1 0 0 1 1
//      | 3 ------|-2        z        0 0 0 0 1 1 1 1
//      |/        |/
//      0 ------- 1          faces: f0 bottom, f1 x=0, f2 y=0, f3 x=1, f4 y=1, f5 top
//
// spec: "Hexahedron"
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace shm {

/// Corners of each face; the right-hand normal points out of the hexahedron.
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

/// Corner to bits x + 2y + 4z and back (the same table both ways).
inline constexpr std::array<std::uint8_t, 8> kCornerBits = {0, 1, 3, 2, 4, 5, 7, 6};

/// The order in which unknown corners are said and predicted (paper, Table 1).
inline constexpr std::array<std::uint8_t, 8> kCornerOrder = {0, 1, 2, 3, 4, 7, 5, 6};

inline constexpr std::uint32_t kRotationCount = 24;

/// kRotations[r][i]: which corner stands at position i after rotation r. Ordered by the corner at
/// position 0 (as bits), then by the axes that edges 0-1, 0-3 and 0-4 run along.
inline constexpr auto kRotations = [] {
  std::array<std::array<std::uint8_t, 8>, kRotationCount> table{};
  std::uint32_t count = 0;
  for (std::uint32_t origin = 0; origin < 8; ++origin)
    for (std::uint32_t a = 0; a < 3; ++a)
      for (std::uint32_t b = 0; b < 3; ++b) {
        if (a == b) continue;
        const std::uint32_t c = 3 - a - b;
        const bool odd_axes = (b + 3 - a) % 3 == 2;  // (a b c) is an odd permutation
        const bool odd_flips = std::popcount(origin) % 2 == 1;
        if (odd_axes != odd_flips) continue;  // a reflection
        for (std::uint32_t i = 0; i < 8; ++i) {
          const std::uint32_t bits = kCornerBits[i];
          const std::uint32_t moved =
              origin ^ (bits & 1) << a ^ (bits >> 1 & 1) << b ^ (bits >> 2) << c;
          table[count][i] = kCornerBits[moved];
        }
        ++count;
      }
  return table;
}();

/// kRotatedFace[r][k]: which face stands at position k after rotation r.
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

/// The rotation that puts these corners at positions 0, 1 and 3; kRotationCount when none does.
constexpr std::uint32_t rotation_of(std::uint32_t at0, std::uint32_t at1, std::uint32_t at3) {
  for (std::uint32_t r = 0; r < kRotationCount; ++r)
    if (kRotations[r][0] == at0 && kRotations[r][1] == at1 && kRotations[r][3] == at3) return r;
  return kRotationCount;
}

}  // namespace shm
