#include "exodus/appended_extras.h"

#include <netcdf.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "exodus/layout.h"

namespace shm::converters::exodus {
namespace {

constexpr const char* kSkeletonKey = "exodus/skeleton";
constexpr const char* kStepDimension = "time_step";

using ByKey = std::map<std::string, const Extra*>;
ByKey by_key(const std::vector<Extra>& extras) {
  ByKey map;
  for (const Extra& extra : extras) map.emplace(extra.key, &extra);
  return map;
}

// Returns all rows of a variable, which are stored in one or several extras. Returns nothing if any
// of these extras is missing.
std::optional<std::vector<std::byte>> rows_of(const ByKey& extras, const Skeleton& skeleton,
                                              const Variable& variable) {
  const std::string key = extra_key(variable.name);
  const std::size_t parts = rows_of_parts(skeleton, variable).size() - 1;
  std::vector<std::byte> rows;
  for (std::size_t part = 0; part < parts; ++part) {
    const auto found = extras.find(part_key(key, part));
    if (found == extras.end()) return std::nullopt;
    rows.insert(rows.end(), found->second->data.begin(), found->second->data.end());
  }
  const std::uint64_t bytes = skeleton.size(variable) * scalar_bytes(scalar_of(variable.type));
  if (rows.size() != bytes) does_not_fit(key, "is not as large as its variable");
  return rows;
}

// Updates the extras of an Exodus mesh when its time steps change. Either appends the values of
// another Exodus file at new steps, or keeps the values at only some of the steps.
class StepJoiner {
 public:
  explicit StepJoiner(const MeshInfo& old) : old_(old), old_keys_(by_key(old.extras)) {
    old_skeleton_ = skeleton_of(old_keys_);
    if (old_skeleton_.length_of(kStepDimension) != old.step_times.size())
      does_not_fit(kSkeletonKey,
                   "states a number of steps that differs from the number of step times");
  }

  AppendedExtras join(const MeshInfo& more, const std::vector<Extra>& extras,
                      std::span<const std::uint64_t> steps) {
    new_keys_ = by_key(extras);
    new_skeleton_ = skeleton_of(new_keys_);
    if (new_skeleton_.length_of(kStepDimension) != more.step_times.size())
      does_not_fit(kSkeletonKey,
                   "states a number of steps that differs from the step times in SOURCE");
    set_steps(old_.step_times.size() + steps.size());
    for (const Variable& variable : old_skeleton_.variables)
      if (has_steps(old_skeleton_, variable)) grow(variable, steps);
    AppendedExtras out = result();
    add_losses(out.losses);
    return out;
  }

  // Returns the extras of the old file with values only at the steps `steps`. Returns nothing if a
  // variable with one value per step contains strings, or if some of its values are missing.
  std::optional<std::vector<Extra>> chosen(StepRange steps) {
    set_steps(steps.size());
    for (const Variable& variable : old_skeleton_.variables) {
      const std::string key = extra_key(variable.name);
      if (!has_steps(old_skeleton_, variable) || !old_keys_.contains(key)) continue;
      const auto rows =
          variable.type == NC_STRING ? std::nullopt : rows_of(old_keys_, old_skeleton_, variable);
      if (!rows) return std::nullopt;
      const std::size_t row = rows->size() / old_skeleton_.length_of(kStepDimension);
      cut_into_parts(variable, key, row,
                     std::vector(rows->begin() + static_cast<std::ptrdiff_t>(steps.first * row),
                                 rows->begin() + static_cast<std::ptrdiff_t>(steps.end * row)));
    }
    return result().extras;
  }

  AppendedExtras lengthened(std::uint64_t steps) {
    for (const Variable& variable : old_skeleton_.variables) {
      const std::string key = extra_key(variable.name);
      if (has_steps(old_skeleton_, variable) && old_keys_.contains(key))
        does_not_fit(key, "has a value for each step, but SOURCE has no such values");
    }
    set_steps(old_.step_times.size() + steps);
    return result();
  }

 private:
  void set_steps(std::uint64_t steps) {
    grown_ = old_skeleton_;
    const int dimension = grown_.find_dimension(kStepDimension);
    if (dimension < 0) does_not_fit(kSkeletonKey, "has no time steps");
    grown_.dimensions[static_cast<std::size_t>(dimension)].length = steps;
  }

  // Returns the old extras, but with the new skeleton, and with new extras for each variable whose
  // steps have changed.
  AppendedExtras result() {
    AppendedExtras out;
    out.changed = true;
    for (const Extra& extra : old_.extras) {
      const auto grown = grown_parts_.find(extra.key);
      if (extra.key == kSkeletonKey) {
        out.extras.push_back(with_text(extra, to_text(grown_)));
      } else if (grown == grown_parts_.end()) {
        out.extras.push_back(extra);
      } else {
        for (Extra& part : grown->second) out.extras.push_back(std::move(part));
      }
    }
    return out;
  }

  static Skeleton skeleton_of(const ByKey& extras) {
    const auto found = extras.find(kSkeletonKey);
    if (found == extras.end()) does_not_fit(kSkeletonKey, "is missing");
    const auto& text = found->second->data;
    return from_text({reinterpret_cast<const char*>(text.data()), text.size()},
                     {"", ErrorCode::corrupt});
  }
  static Extra with_text(Extra extra, const std::string& text) {
    extra.shape = {text.size()};
    const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
    extra.data.assign(bytes, bytes + text.size());
    return extra;
  }
  static bool has_steps(const Skeleton& skeleton, const Variable& variable) {
    return !variable.dimensions.empty() && skeleton.dimension_name(variable, 0) == kStepDimension;
  }

  // Appends the values at the new steps to a variable that is stored as an extra.
  void grow(const Variable& variable, std::span<const std::uint64_t> steps) {
    const std::string key = extra_key(variable.name);
    if (!old_keys_.contains(key)) {
      // The variable is not an extra of the old file. It is an array of the mesh, contains the step
      // times, or has no rows yet.
      if (new_keys_.contains(key)) does_not_fit(key, "has values at the new steps only");
      return;
    }
    const int index = new_skeleton_.find_variable(variable.name);
    if (index < 0 || variable.type == NC_STRING)
      does_not_fit(key, "has no values at the new steps");
    const Variable& other = new_skeleton_.variables[static_cast<std::size_t>(index)];
    const auto old_shape = old_skeleton_.shape(variable), shape = new_skeleton_.shape(other);
    if (other.type != variable.type || !has_steps(new_skeleton_, other) ||
        !std::equal(shape.begin() + 1, shape.end(), old_shape.begin() + 1, old_shape.end()))
      does_not_fit(key, "has another type or shape at the new steps");
    auto rows = rows_of(old_keys_, old_skeleton_, variable);
    const auto more = rows_of(new_keys_, new_skeleton_, other);
    if (!rows || !more) does_not_fit(key, "has no values at the new steps");
    const std::size_t row = shape[0] > 0 ? more->size() / shape[0] : 0;
    for (const std::uint64_t step : steps) {
      const auto begin = more->begin() + static_cast<std::ptrdiff_t>(step * row);
      rows->insert(rows->end(), begin, begin + static_cast<std::ptrdiff_t>(row));
    }
    cut_into_parts(variable, key, row, *rows);
  }

  void cut_into_parts(const Variable& variable, const std::string& key, std::size_t row,
                      const std::vector<std::byte>& rows) {
    const Extra& first = *old_keys_.at(key);
    const auto begins = rows_of_parts(grown_, variable);
    std::vector<Extra>& parts = grown_parts_[key];
    for (std::size_t p = 0; p + 1 < begins.size(); ++p) {
      Extra part{part_key(key, p), first.type, first.refers, first.shape, {}};
      part.shape[0] = begins[p + 1] - begins[p];
      part.data.assign(rows.begin() + static_cast<std::ptrdiff_t>(begins[p] * row),
                       rows.begin() + static_cast<std::ptrdiff_t>(begins[p + 1] * row));
      parts.push_back(std::move(part));
    }
    for (std::size_t p = 1; old_keys_.contains(part_key(key, p)); ++p)
      // All new extras replace the extra of the first part, and contain the values of all parts. An
      // empty list removes the extra of each further part.
      grown_parts_[part_key(key, p)];
    for (std::size_t p = 0; new_keys_.contains(part_key(key, p)); ++p)
      joined_.insert(part_key(key, p));
  }

  void add_losses(std::vector<std::string>& losses) {
    Skeleton other = new_skeleton_;
    const int dimension = other.find_dimension(kStepDimension);
    other.dimensions[static_cast<std::size_t>(dimension)].length =
        old_skeleton_.length_of(kStepDimension);
    if (other != old_skeleton_) losses.push_back("a different title, or different structure");
    for (const auto& [key, extra] : new_keys_) {
      if (key == kSkeletonKey || joined_.contains(key)) continue;
      const auto found = old_keys_.find(key);
      if (found == old_keys_.end() || *found->second != *extra)
        losses.push_back("a different '" + key + "'");
    }
  }

  const MeshInfo& old_;
  ByKey old_keys_, new_keys_;
  Skeleton old_skeleton_, new_skeleton_, grown_;
  // The key is the key of an old extra; the value contains the new extras that replace it.
  std::map<std::string, std::vector<Extra>> grown_parts_;
  std::set<std::string> joined_;  // keys of extras whose values have been appended
};

}  // namespace

bool counts_steps(const MeshInfo& info) {
  return std::any_of(info.extras.begin(), info.extras.end(),
                     [](const Extra& extra) { return extra.key == kSkeletonKey; });
}

AppendedExtras joined_extras(const MeshInfo& old, const MeshInfo& more,
                             const std::vector<Extra>& extras,
                             std::span<const std::uint64_t> steps) {
  return StepJoiner(old).join(more, extras, steps);
}

std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info, StepRange steps) {
  if (!counts_steps(info)) return info.extras;
  return StepJoiner(info).chosen(steps);
}

AppendedExtras lengthened_extras(const MeshInfo& old, std::uint64_t steps) {
  return StepJoiner(old).lengthened(steps);
}

}  // namespace shm::converters::exodus
