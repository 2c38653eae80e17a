#include "random/step_index.h"

#include <algorithm>
#include <string>

#include "base/errors.h"

namespace shm {

using container::IndexEntry;
using container::StepEntry;

namespace {

/// Returns the largest number of elements that the array can have in a group. An array that covers
/// all blocks or all sets has exactly this number.
std::uint64_t most_elements(const IndexedFile& file, std::uint32_t array, std::size_t group) {
  const ArrayInfo& info = file.schema().arrays[array];
  if (!is_on_mesh(info.location)) return group == 0 ? info.elements : 0;
  const IndexEntry& entry = file.groups()[group];
  return info.location == Location::point ? entry.vertices : entry.cells;
}

}  // namespace

Result<StepIndex> StepIndex::of(IndexedFile& file) {
  StepIndex index;
  index.steps_.resize(file.schema().arrays.size());
  if (file.decodable()) {
    if (auto status = index.add_decodable(file); !status) return status.error();
    index.find_keys();
    return index;
  }
  if (auto status = index.count_elements(file); !status) return status.error();
  for (const IndexEntry& entry : file.index().entries) {
    if (!entry.is(container::ChunkKind::step_values)) continue;
    if (entry.offset > file.source().size() || entry.bytes > file.source().size() - entry.offset)
      return file.wrong_index("its step values are beyond the end of the file");
    for (const StepEntry& part : entry.parts)
      if (auto status = part.codec == Codec::bundle ? index.add_bundle(file, entry, part)
                                                    : index.add(file, entry, part);
          !status)
        return status.error();
    index.step_bytes_ += entry.bytes;
  }
  if (auto status = index.expect_complete(file); !status) return status.error();
  index.find_keys();
  file.drop_step_entries();
  return index;
}

Result<void> StepIndex::add_decodable(const IndexedFile& file) {
  elements_.resize(steps_.size());
  for (const DecodableParts::Step& step : file.decodable()->steps) {
    if (step.step >= file.limits().max_steps)
      return over_limit("the limit is " + std::to_string(file.limits().max_steps) + " steps",
                        "step values", step.parts.front().offset);
    const std::size_t begin = parts_.size();
    for (const DecodableParts::Part& part : step.parts)
      parts_.push_back({part.offset, part.bytes, part.values.first, part.values.count,
                        part.values.group, part.values.reference, part.values.codec});
    steps_[step.array].push_back({step.step, step.reference, 0, 0, begin, parts_.size()});
    elements_[step.array] =
        std::max(elements_[step.array], parts_.back().first + parts_.back().count);
  }
  return {};
}

/// Computes the number of elements of stepped arrays from the totals of the index. Fails if the
/// groups in the index do not add up to these totals.
Result<void> StepIndex::count_elements(const IndexedFile& file) {
  const Schema& schema = file.schema();
  const container::Index& totals = file.index();
  if (auto status = file.expect_totals(); !status) return status;
  elements_.resize(schema.arrays.size());
  for (std::uint32_t a = 0; a < elements_.size(); ++a)
    if (schema.arrays[a].per_step) elements_[a] = elements_of(schema, totals, a);
  return {};
}

Result<void> StepIndex::add(const IndexedFile& file, const IndexEntry& entry,
                            const StepEntry& part) {
  const Schema& schema = file.schema();
  if (part.array >= schema.arrays.size() || !schema.arrays[part.array].per_step)
    return file.wrong_index("has step values of an array without steps");
  if (part.step >= file.limits().max_steps)
    return over_limit("the limit is " + std::to_string(file.limits().max_steps) + " steps", "index",
                      entry.offset);
  std::vector<Step>& steps = steps_[part.array];
  const bool goes_on = !parts_.empty() && last_array_ == part.array && !steps.empty() &&
                       steps.back().step == part.step;
  if (!goes_on) {
    if (auto status = expect_complete(file); !status) return status;
    if (!steps.empty() && steps.back().step >= part.step)
      return file.wrong_index("steps of an array do not ascend");
    steps.push_back({part.step, part.reference, 0, 0, parts_.size(), parts_.size()});
  }
  last_array_ = part.array;
  const bool begins = steps.back().begin == parts_.size();
  const std::uint64_t first = begins ? 0 : parts_.back().first + parts_.back().count;
  if (part.group >= file.groups().size() || (!begins && part.group <= parts_.back().group) ||
      part.first != first || part.count == 0 || part.count > elements_[part.array] - first)
    return file.wrong_index("step values are not in order");
  const std::uint64_t most = most_elements(file, part.array, part.group);
  if (part.count > most || (part.count < most && schema.arrays[part.array].blocks.empty()))
    return file.wrong_index(
        "the number of step values of a group differs from the number of its elements");
  if (part.reference != steps.back().reference)
    return file.wrong_index("the parts of a step refer to different steps");
  steps.back().end = parts_.size() + 1;
  parts_.push_back(
      {entry.offset, entry.bytes, part.first, part.count, part.group, part.reference, part.codec});
  return {};
}

/// Adds the steps of the arrays of a bundle. Each array has one part, for all of these steps.
Result<void> StepIndex::add_bundle(const IndexedFile& file, const IndexEntry& entry,
                                   const StepEntry& bundle) {
  if (auto status = expect_complete(file); !status) return status;
  const Schema& schema = file.schema();
  if (bundle.step >= file.limits().max_steps ||
      bundle.steps > file.limits().max_steps - bundle.step)
    return over_limit("the limit is " + std::to_string(file.limits().max_steps) + " steps", "index",
                      entry.offset);
  bundle_pairs_ += bundle.arrays * bundle.steps;
  if (bundle_pairs_ > container::most_bundle_pairs(step_bytes_))
    return corrupt(container::kTooManyBundlePairs, "index", entry.offset);
  for (std::uint32_t a = bundle.array; a - bundle.array < bundle.arrays; ++a) {
    if (a >= schema.arrays.size() || !schema.arrays[a].per_step)
      return file.wrong_index("has step values of an array without steps");
    std::vector<Step>& steps = steps_[a];
    if (!steps.empty() && steps.back().step >= bundle.step)
      return file.wrong_index("steps of an array do not ascend");
    if (bundle.group >= file.groups().size() || bundle.count == 0 || bundle.count != elements_[a] ||
        bundle.count > most_elements(file, a, bundle.group) ||
        bundle.reference != StepReference::nothing)
      return file.wrong_index("a bundle does not contain whole arrays");
    for (std::uint64_t s = 0; s < bundle.steps; ++s)
      steps.push_back({bundle.step + s, bundle.reference, 0, 0, parts_.size(), parts_.size() + 1});
    parts_.push_back(
        {entry.offset, entry.bytes, 0, bundle.count, bundle.group, bundle.reference, bundle.codec});
    last_array_ = a;
  }
  return {};
}

/// Checks that the index lists values for all elements of the most recently added step.
Result<void> StepIndex::expect_complete(const IndexedFile& file) const {
  if (parts_.empty() || parts_.back().first + parts_.back().count == elements_[last_array_])
    return {};
  return file.wrong_index("step values are missing");
}

std::span<const StepIndex::Part> StepIndex::parts(const Step& step, std::size_t first_group,
                                                  std::size_t end_group) const {
  const auto all = std::span(parts_).subspan(step.begin, step.end - step.begin);
  const auto from = [&](std::size_t group) {
    return std::lower_bound(all.begin(), all.end(), group,
                            [](const Part& part, std::size_t g) { return part.group < g; });
  };
  return {from(first_group), from(end_group)};
}

/// Finds the key step and the base of each step. The first step of an array counts as both, even if
/// it refers to other steps.
void StepIndex::find_keys() {
  for (std::vector<Step>& steps : steps_)
    for (std::size_t s = 0; s < steps.size(); ++s) {
      steps[s].key = s == 0 || container::is_key(steps[s].reference) ? s : steps[s - 1].key;
      const bool is_base = s == 0 || steps[s].reference == StepReference::nothing;
      steps[s].base = is_base ? s : steps[s - 1].base;
    }
}

std::vector<std::size_t> StepIndex::chain(std::uint32_t array, std::size_t nth) const {
  const std::vector<Step>& steps = steps_[array];
  std::vector<std::size_t> chain;
  const std::size_t key = steps[nth].key;
  if (steps[key].base != key) chain.push_back(steps[key].base);
  for (std::size_t step = key; step <= nth; ++step) chain.push_back(step);
  return chain;
}

}  // namespace shm
