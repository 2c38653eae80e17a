#include "step_encoder.h"

#include <algorithm>
#include <string>
#include <utility>

namespace shm {
namespace {

Error misuse(std::string detail) {
  return Error{ErrorCode::misuse, std::move(detail), "steps", kNoOffset, {}};
}

}  // namespace

StepEncoder::StepEncoder(const Schema& schema, TopologyReplay& topology,
                         std::vector<std::uint64_t> elements, std::uint32_t key_steps, Sink sink)
    : schema_(&schema),
      topology_(&topology),
      elements_(std::move(elements)),
      key_steps_(key_steps),
      may_refer_(key_steps > 1 && steps_may_refer(schema, elements_)),
      sink_(std::move(sink)),
      before_(schema.arrays.size()) {}

Result<void> StepEncoder::add(std::uint32_t array, std::uint64_t step,
                              std::span<const std::byte> values) {
  if (array_ != array || step_ != step) {
    if (auto good = end_step(); !good) return good;
    if (auto good = begin_step(array, step); !good) return good;
  }
  while (!values.empty()) {
    if (count_ == 0)
      if (auto good = begin_group(); !good) return good;
    const std::size_t wanted = static_cast<std::size_t>(count_) * stride();
    const auto head = values.first(std::min(wanted - pending_.size(), values.size()));
    pending_.insert(pending_.end(), head.begin(), head.end());
    values = values.subspan(head.size());
    if (pending_.size() == wanted)
      if (auto good = end_group(); !good) return good;
  }
  return {};
}

Result<void> StepEncoder::begin_step(std::uint32_t array, std::uint64_t step) {
  Before& before = before_[array];
  if (step < before.next_step) return misuse("steps of an array must ascend");
  reference_step_.reset();
  if (!before.values.empty() && before.run < key_steps_) reference_step_ = before.next_step - 1;
  before.next_step = step + 1;
  steps_ = std::max(steps_, step + 1);
  array_ = array;
  step_ = step;
  first_ = 0;
  group_ = 0;
  count_ = 0;
  refers_.reset();
  has_referred_ = false;
  column_.emplace(*schema_, array);
  return {};
}

/// Goes to the next group that has elements of the array.
Result<void> StepEncoder::begin_group() {
  if (first_ == elements_[*array_])
    return misuse("array '" + schema_->arrays[*array_].name + "' got more than its " +
                  std::to_string(first_) + " elements at step " + std::to_string(step_));
  for (; count_ == 0; ++group_) {
    const auto count = topology_->count(*array_, group_);
    if (!count) return count.error();
    count_ = *count;
  }
  return {};
}

Result<void> StepEncoder::end_group() {
  const std::size_t group = group_ - 1;
  Before& before = before_[*array_];
  std::span<const std::byte> reference;
  if (reference_step_)
    reference = std::span(before.values)
                    .subspan(static_cast<std::size_t>(first_) * stride(), pending_.size());
  auto coded = encode(reference);
  if (!coded) return coded.error();
  container::StepHeader header;
  header.array = *array_;
  header.step = header.reference_step = step_;
  header.group = static_cast<std::uint32_t>(group);
  header.count = count_;
  header.codec = coded->codec;
  if (coded->codec == container::Codec::columns && *refers_) {
    header.reference_step = *reference_step_;
    has_referred_ = true;
  }
  if (auto good = sink_(header, first_, coded->bytes); !good) return good;
  if (may_refer_) {
    const std::size_t at = static_cast<std::size_t>(first_) * stride();
    if (at == before.values.size())
      before.values.insert(before.values.end(), pending_.begin(), pending_.end());
    else
      std::copy(pending_.begin(), pending_.end(),
                before.values.begin() + static_cast<std::ptrdiff_t>(at));
  }
  first_ += count_;
  count_ = 0;
  pending_.clear();
  return {};
}

/// What is pending, the smaller way.
Result<StepBytes> StepEncoder::encode(std::span<const std::byte> reference) {
  const ArrayInfo& info = schema_->arrays[*array_];
  StepBytes packed{container::Codec::shuffled_zstd, shuffle_and_compress(info, pending_)};
  if (info.components > kMostStepComponents) return packed;
  const std::size_t group = group_ - 1;
  const auto elements = topology_->elements(group);
  if (!elements) return elements.error();
  StepBytes predicted;
  if (!refers_ && !reference.empty()) {
    predicted.bytes = choose_reference(**elements, reference);
  } else {
    if (!refers_) refers_ = false;
    column_->begin(topology_->segment_of(group), *refers_);
    predicted.bytes = column_->encode(**elements, pending_,
                                      *refers_ ? reference : std::span<const std::byte>());
  }
  if (packed.bytes.empty() || predicted.bytes.size() <= packed.bytes.size()) return predicted;
  column_->forget();
  return packed;
}

/// The first group of a step says whether all of them refer to the step before.
std::vector<std::byte> StepEncoder::choose_reference(const GroupElements& elements,
                                                     std::span<const std::byte> reference) {
  const std::uint32_t segment = topology_->segment_of(group_ - 1);
  Column with(*schema_, *array_);
  column_->begin(segment, false);
  with.begin(segment, true);
  auto alone = column_->encode(elements, pending_, {});
  auto referring = with.encode(elements, pending_, reference);
  refers_ = referring.size() < alone.size();
  if (!*refers_) return alone;
  column_ = std::move(with);
  return referring;
}

Result<void> StepEncoder::end_step() {
  if (!array_) return {};
  const ArrayInfo& info = schema_->arrays[*array_];
  const std::uint64_t got = first_ + pending_.size() / stride();
  if (got != elements_[*array_])
    return misuse("array '" + info.name + "' got " + std::to_string(got) + " elements at step " +
                  std::to_string(step_) + ", the mesh has " +
                  std::to_string(elements_[*array_]));
  Before& before = before_[*array_];
  before.run = has_referred_ ? before.run + 1 : 1;
  array_.reset();
  column_.reset();
  return {};
}

}  // namespace shm
