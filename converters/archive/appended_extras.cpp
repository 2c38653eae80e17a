#include "archive/appended_extras.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include "accuracy/block_bounds.h"
#include "base/failure.h"
#include "formats/formats.h"
#include "interface/format.h"

namespace shm::converters {
namespace {

bool same_times(std::span<const double> a, std::span<const double> b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

// Returns true if the step times of `more` are exactly the step times of `old`, followed by the
// times of `steps`.
bool goes_on_from_the_start(const MeshInfo& old, const MeshInfo& more,
                            std::span<const std::uint64_t> steps) {
  std::vector<double> times = old.step_times;
  for (const std::uint64_t step : steps) times.push_back(more.step_times[step]);
  return same_times(times, more.step_times);
}

// Checks that each of `extras` equals the old extra with the same key; throws Failure if one does
// not. Returns an empty result, which means that the new file has the extras of the old file.
AppendedExtras same_extras(const MeshInfo& old, const std::vector<Extra>& extras) {
  std::map<std::string, const Extra*> by_key;
  for (const Extra& extra : old.extras) by_key.emplace(extra.key, &extra);
  for (const Extra& extra : extras) {
    const auto found = by_key.find(extra.key);
    if (found == by_key.end() || *found->second != extra)
      does_not_fit(extra.key,
                   "differs from the extra with this key in FILE; append a file that contains both "
                   "the existing and the new steps instead");
  }
  return {};
}

// Does the same as appended_extras(), for `extras` without bounds of blocks.
AppendedExtras extras_of_source(const MeshInfo& old, const MeshInfo& more,
                                const std::vector<Extra>& extras,
                                std::span<const std::uint64_t> steps) {
  const SourceFormat& format = source_format(old);
  if (!format.counts_steps(old) && old.extras == extras) return {};
  if (goes_on_from_the_start(old, more, steps)) return {true, extras, {}};
  if (auto joined = format.joined_extras(old, more, extras, steps)) return std::move(*joined);
  return same_extras(old, extras);
}

bool is_about_bounds(const Extra& extra) { return is_block_bounds(extra.key); }

}  // namespace

AppendedExtras appended_extras(const MeshInfo& old, const MeshInfo& more, std::vector<Extra> extras,
                               std::span<const std::uint64_t> steps) {
  std::erase_if(extras, is_about_bounds);
  AppendedExtras appended = extras_of_source(old, more, extras, steps);
  // The new steps are rounded within the same bounds as the old steps.
  std::erase_if(appended.extras, is_about_bounds);
  if (appended.changed)
    std::copy_if(old.extras.begin(), old.extras.end(), std::back_inserter(appended.extras),
                 is_about_bounds);
  return appended;
}

}  // namespace shm::converters
