#include "interface/losses.h"

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

std::string lost_steps(std::uint64_t steps, StepRange kept, const std::string& format) {
  const auto range = [](std::uint64_t first, std::uint64_t end) {
    return std::to_string(first) + (first + 1 == end ? "" : " to " + std::to_string(end - 1));
  };
  std::string text;
  if (kept.first > 0) text = range(0, kept.first);
  if (kept.end < steps) text += (text.empty() ? "" : ", ") + range(kept.end, steps);
  return (steps - kept.size() > 1 ? "time steps " : "time step ") + text + " of " +
         std::to_string(steps) + " (a file of format " + format +
         " holds one step: --step N selects it, a name such as out_%04d writes one file per step)";
}

std::string quoted(std::string_view text) { return " '" + std::string(text) + "'"; }

}  // namespace shm::converters
