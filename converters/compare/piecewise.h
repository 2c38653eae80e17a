// Shared by compare.h and mesh_diff.h: the number of elements per piece of a comparison, the size
// of caches, and the text of a cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace shm::converters {

inline constexpr std::uint64_t kPieceElements = 16384;
inline constexpr std::size_t kCacheBytes = std::size_t{32} << 20;

/// Returns the text of a list of corners, such as "(3 4 8 7)". At most 32 corners are listed.
inline std::string corners_text(std::span<const std::uint64_t> corners) {
  constexpr std::size_t kMost = 32;
  std::string text;
  for (std::size_t i = 0; i < corners.size() && i < kMost; ++i)
    text += (i > 0 ? " " : "") + std::to_string(corners[i]);
  return "(" + text + (corners.size() > kMost ? " ...)" : ")");
}

}  // namespace shm::converters
