#include "access/step_index.h"

#include <algorithm>
#include <string>

namespace shm {

using container::IndexEntry;

Result<StepIndex> StepIndex::of(IndexedFile& file) {
  StepIndex index;
  index.steps_.resize(file.schema().arrays.size());
  if (file.decodable()) {
    if (auto good = index.add_decodable(file); !good) return good.error();
    index.find_keys();
    return index;
  }
  if (auto good = index.count_elements(file); !good) return good.error();
  for (const IndexEntry& entry : file.take_entries())
    if (entry.kind == static_cast<std::uint8_t>(container::ChunkKind::step_values))
      if (auto good = index.add(file, entry); !good) return good.error();
  if (auto good = index.expect_complete(file); !good) return good.error();
  index.find_keys();
  return index;
}

Result<void> StepIndex::add_decodable(const IndexedFile& file) {
  elements_.resize(steps_.size());
  for (const DecodableParts::Step& step : file.decodable()->steps) {
    if (step.step >= file.limits().max_steps)
      return IndexedFile::wrong(
          "the limit is " + std::to_string(file.limits().max_steps) + " steps", "step values",
          step.chunks.front().offset, ErrorCode::over_limit);
    const std::size_t begin = chunks_.size();
    for (const IndexEntry& chunk : step.chunks)
      chunks_.push_back({chunk.offset, chunk.bytes, chunk.first, chunk.count, chunk.group,
                         chunk.reference, chunk.codec});
    steps_[step.array].push_back({step.step, step.refers, 0, begin, chunks_.size()});
    elements_[step.array] =
        std::max(elements_[step.array], chunks_.back().first + chunks_.back().count);
  }
  return {};
}

/// By the totals of the index, which its groups must add up to.
Result<void> StepIndex::count_elements(const IndexedFile& file) {
  const Schema& schema = file.schema();
  const container::Index& totals = file.index();
  if (auto good = file.expect_totals(); !good) return good;
  elements_.resize(schema.arrays.size());
  for (std::size_t a = 0; a < elements_.size(); ++a) {
    if (!schema.arrays[a].per_step) continue;
    const ArrayInfo& array = schema.arrays[a];
    elements_[a] = array.location == Location::point ? totals.vertices
                   : array.blocks.empty()            ? totals.cells
                                                     : 0;
    if (array.location == Location::cell)
      for (const std::uint32_t b : array.blocks) elements_[a] += totals.block_cells[b];
  }
  return {};
}

Result<void> StepIndex::add(const IndexedFile& file, const IndexEntry& entry) {
  const Schema& schema = file.schema();
  if (entry.array >= schema.arrays.size() || !schema.arrays[entry.array].per_step)
    return file.wrong_index("has step values of no stepped array");
  if (entry.step >= file.limits().max_steps)
    return IndexedFile::wrong("the limit is " + std::to_string(file.limits().max_steps) + " steps",
                              "index", entry.offset, ErrorCode::over_limit);
  std::vector<Step>& steps = steps_[entry.array];
  const bool goes_on = !chunks_.empty() && last_array_ == entry.array && !steps.empty() &&
                       steps.back().step == entry.step;
  if (!goes_on) {
    if (auto good = expect_complete(file); !good) return good;
    if (!steps.empty() && steps.back().step >= entry.step)
      return file.wrong_index("steps of an array do not ascend");
    steps.push_back({entry.step, false, 0, chunks_.size(), chunks_.size()});
  }
  last_array_ = entry.array;
  const bool begins = steps.back().begin == chunks_.size();
  const std::uint64_t first = begins ? 0 : chunks_.back().first + chunks_.back().count;
  if (entry.group >= file.groups().size() || (!begins && entry.group <= chunks_.back().group) ||
      entry.first != first || entry.count == 0 || entry.count > elements_[entry.array] - first)
    return file.wrong_index("step values are not in order");
  const IndexEntry& group = file.groups()[entry.group];
  const ArrayInfo& info = schema.arrays[entry.array];
  const bool of_points = info.location == Location::point;
  const std::uint64_t most = of_points ? group.vertices : group.cells;
  if (entry.count > most || (entry.count < most && info.blocks.empty()))
    return file.wrong_index("a group has another number of step values than elements");
  steps.back().refers = steps.back().refers || entry.reference != StepReference::nothing;
  steps.back().end = chunks_.size() + 1;
  chunks_.push_back({entry.offset, entry.bytes, entry.first, entry.count, entry.group,
                     entry.reference, entry.codec});
  return {};
}

/// The step that began last must have all its elements.
Result<void> StepIndex::expect_complete(const IndexedFile& file) const {
  if (chunks_.empty() || chunks_.back().first + chunks_.back().count == elements_[last_array_])
    return {};
  return file.wrong_index("step values are missing");
}

std::span<const StepIndex::Chunk> StepIndex::chunks(const Step& step, std::size_t first_group,
                                                    std::size_t end_group) const {
  const auto all = std::span(chunks_).subspan(step.begin, step.end - step.begin);
  const auto from = [&](std::size_t group) {
    return std::lower_bound(all.begin(), all.end(), group,
                            [](const Chunk& it, std::size_t g) { return it.group < g; });
  };
  return {from(first_group), from(end_group)};
}

/// The first step of an array is taken for one, whatever it refers to.
void StepIndex::find_keys() {
  for (std::vector<Step>& steps : steps_)
    for (std::size_t at = 0; at < steps.size(); ++at)
      steps[at].key = at > 0 && steps[at].refers ? steps[at - 1].key : at;
}

}  // namespace shm
