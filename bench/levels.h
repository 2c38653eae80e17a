// The compression levels, with the names that they have in the tool.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "shm/writer.h"

namespace shm::bench {

inline constexpr std::array<std::pair<const char*, Level>, 3> kLevels = {
    {{"fast", Level::fast}, {"default", Level::standard}, {"best", Level::best}}};

/// Returns the indices in kLevels of the levels with these names, ascending. If `names` is empty,
/// returns the indices of all levels.
inline std::vector<std::size_t> levels_named(const std::vector<std::string>& names) {
  std::vector<std::size_t> levels;
  for (std::size_t l = 0; l < kLevels.size(); ++l)
    if (names.empty() || std::ranges::find(names, kLevels[l].first) != names.end())
      levels.push_back(l);
  if (levels.empty()) throw std::runtime_error("--level: fast, default or best");
  return levels;
}

}  // namespace shm::bench
