#include "transfer/losses.h"

#include <algorithm>

namespace shm::converters {

LossList losses_by_key(const MeshInfo& info, const Keys& used,
                       std::span<const std::string_view> known) {
  LossList losses;
  for (const Extra& extra : info.extras) {
    const bool is_known = std::any_of(known.begin(), known.end(), [&](std::string_view start) {
      return extra.key.starts_with(start);
    });
    if (!is_known && !used.contains(extra.key)) losses.push_back("extra" + quoted(extra.key));
  }
  return losses;
}

std::string quoted(std::string_view text) { return " '" + std::string(text) + "'"; }

}  // namespace shm::converters
