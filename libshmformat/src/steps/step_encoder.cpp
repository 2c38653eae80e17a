#include "steps/step_encoder.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/errors.h"
#include "codecs/shared/shuffled_zstd.h"
#include "format/schema.h"

namespace shm {
namespace {

// Zstd compression level for arrays that have too many components for the codec `columns`.
constexpr int kWideArrayZstdLevel = 9;

/// The values of a group at one step, coded with `terms`. `refers` is true if any value is
/// predicted from the reference values.
struct StepTerms {
  bool refers = false;
  EncodedColumn column;
};
StepTerms encode_terms(const ArrayInfo& info, std::span<const std::byte> values,
                       std::span<const std::byte> reference, TermScratch& scratch) {
  TermColumn column(info, true);
  TermColumn::Elements elements;
  elements.count = values.size() / column.element_bytes();
  elements.reference = reference;
  auto bytes = column.encode_terms(elements, values.data(), column.element_bytes(), scratch);
  return {column.refers(), {Codec::terms, std::move(bytes)}};
}

}  // namespace

EncodedColumn StepColumnEncoder::encode(const ColumnElements& elements,
                                        std::span<const std::byte> values, Level level,
                                        std::span<const std::byte> reference) {
  column_->make_room(elements.slots, elements.all_slots);
  return column_->encode(*elements.items, values.data(),
                         scalar_bytes(info().type) * info().components, level,
                         reference.empty() ? nullptr : reference.data());
}

StepEncoder::StepEncoder(const Schema& schema, StepTopology& topology,
                         std::vector<std::uint64_t> elements, std::uint32_t key_steps, Level level,
                         Sink sink)
    : schema_(&schema),
      mesh_(schema, topology, cover_numbers(schema)),
      elements_(std::move(elements)),
      key_steps_(key_steps),
      level_(level),
      most_(key_steps > 1 ? most_reference(schema, elements_) : StepReference::nothing),
      sink_(std::move(sink)) {
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    before_.push_back(Before{0, 0, memory_of(schema.arrays[a], most_)});
    if (schema.arrays[a].per_step) mesh_.expect(a, elements_[a]);
  }
}

void StepEncoder::begin_part(Part part) {
  if (most_ != StepReference::nothing) most_ = most_reference(*schema_, part.all);
  before_.assign(before_.size(), Before{0, 0, StepMemory(most_)});
  part_ = std::move(part);
}

Result<void> StepEncoder::begin(std::uint32_t array, std::uint64_t step) {
  if (array_ == array && step_ == step) return {};
  if (auto status = end_step(); !status) return status;
  return begin_step(array, step);
}

Result<void> StepEncoder::add(std::uint32_t array, std::uint64_t step,
                              std::span<const std::byte> values) {
  if (auto status = begin(array, step); !status) return status;
  while (!values.empty()) {
    if (count_ == 0)
      if (auto status = begin_group(); !status) return status;
    const std::size_t wanted = static_cast<std::size_t>(count_) * stride();
    const auto head = values.first(std::min(wanted - pending_.size(), values.size()));
    pending_.insert(pending_.end(), head.begin(), head.end());
    values = values.subspan(head.size());
    if (pending_.size() == wanted)
      if (auto status = end_group(); !status) return status;
  }
  return {};
}

void StepEncoder::go_on(std::uint32_t array, std::uint64_t last_step, std::uint32_t run) {
  before_[array].next_step = last_step + 1;
  before_[array].run = run;
  steps_ = std::max(steps_, last_step + 1);
}

/// Returns the highest StepReference that the next step of the array may use.
StepReference StepEncoder::most_next(std::uint32_t array) const {
  // The encoder cannot use a reference for a quantized array: it knows only the original values,
  // but a reader has the restored values.
  if (schema_->arrays[array].quantization.lossy()) return StepReference::nothing;
  const std::uint32_t run = before_[array].run;
  if (run == 0 || run >= key_steps_) return StepReference::nothing;
  return run == 1 ? std::min(most_, StepReference::before) : most_;
}

Result<void> StepEncoder::begin_step(std::uint32_t array, std::uint64_t step) {
  Before& before = before_[array];
  if (step < before.next_step) return misuse("steps of an array must ascend", "steps");
  // Number of the previous step; not used if the new step may not refer to other steps.
  reference_step_ = before.next_step - 1;
  most_here_ = most_next(array);
  before.next_step = step + 1;
  // A step of an array without elements stores nothing in the file.
  if (elements_[array] > 0) steps_ = std::max(steps_, step + 1);
  array_ = array;
  step_ = step;
  first_ = 0;
  groups_ = 0;
  count_ = 0;
  reference_ = std::exchange(given_reference_, std::nullopt);
  has_referred_ = false;
  if (reference_ && *reference_ > most_here_ && elements_[array] > 0)
    return misuse("a step cannot refer to steps that were not added", "steps");
  column_.emplace(*schema_, array);
  return {};
}

/// Begins the next group that has elements of the array.
Result<void> StepEncoder::begin_group() {
  if (first_ == elements_[*array_])
    return misuse("array '" + schema_->arrays[*array_].name + "' got more than its " +
                      std::to_string(first_) + " elements at step " + std::to_string(step_),
                  "steps");
  const auto next = mesh_.nth_group(*array_, groups_, mesh_.groups() - 1);
  if (!next) return next.error();
  if (*next == nullptr) return misuse("the mesh has fewer elements than its groups state", "steps");
  ++groups_;
  group_ = (*next)->group;
  count_ = (*next)->count;
  return {};
}

Result<void> StepEncoder::end_group() {
  auto coded = encode();
  if (!coded) return coded.error();
  container::StepHeader header;
  header.array = *array_;
  header.step = header.reference_step = step_;
  header.group = static_cast<std::uint32_t>(group_);
  header.count = count_;
  header.codec = coded->codec;
  if (*reference_ != StepReference::nothing) {
    header.reference_step = reference_step_;
    header.trend = *reference_ == StepReference::trend;
    has_referred_ = true;
  }
  if (part_) header.group += part_->first_group;
  const std::uint64_t first = first_ + (part_ ? part_->first[*array_] : 0);
  if (auto status = sink_(header, first, coded->bytes); !status) return status;
  before_[*array_].values.take(static_cast<std::size_t>(first_) * stride(), pending_);
  first_ += count_;
  count_ = 0;
  pending_.clear();
  return {};
}

/// Encodes the pending values of the current group.
Result<EncodedColumn> StepEncoder::encode() {
  const ArrayInfo& info = schema_->arrays[*array_];
  if (info.components > kMostStepComponents) {
    reference_ = StepReference::nothing;
    return EncodedColumn{
        Codec::shuffled_zstd,
        pack_shuffled(shuffled(pending_, scalar_bytes(info.type)), kWideArrayZstdLevel)};
  }
  if (level_ == Level::fast || !mesh_.has_neighbourhoods(group_)) return encode_in_terms();
  const auto elements = mesh_.elements(*array_, group_);
  if (!elements) return elements.error();
  if (!reference_ && most_here_ != StepReference::nothing) return choose_reference(*elements);
  if (!reference_) reference_ = StepReference::nothing;
  column_->begin(mesh_.segment_of(group_), *reference_);
  return column_->encode(*elements, pending_, level_, reference(*reference_));
}

/// Chooses the reference for all groups of a step. Encodes the first group with each permitted
/// reference, and chooses the reference with the smallest result.
EncodedColumn StepEncoder::choose_reference(const ColumnElements& elements) {
  EncodedColumn best;
  for (const StepReference kind :
       {StepReference::nothing, StepReference::before, StepReference::trend}) {
    if (kind > most_here_) break;
    Column column(*schema_, *array_);
    column.begin(mesh_.segment_of(group_), kind);
    auto coded = column.encode(elements, pending_, level_, reference(kind));
    if (reference_ && coded.bytes.size() >= best.bytes.size()) continue;
    reference_ = kind;
    best = std::move(coded);
    column_ = std::move(column);
  }
  return best;
}

EncodedColumn StepEncoder::encode_in_terms() {
  if (!reference_ && most_here_ != StepReference::nothing) return choose_terms();
  if (!reference_) reference_ = StepReference::nothing;
  return encode_terms(schema_->arrays[*array_], pending_, reference(*reference_), scratch_).column;
}

/// Chooses the reference for all groups of a step that is coded with the codec `terms`, by encoding
/// the first group. Keeps the reference of the previous step, unless the first group now needs over
/// 25 % more bytes than it needed when that reference was chosen.
EncodedColumn StepEncoder::choose_terms() {
  Before& before = before_[*array_];
  const auto with = [&](StepReference kind) {
    return encode_terms(schema_->arrays[*array_], pending_, reference(kind), scratch_);
  };
  if (before.liked_bytes > 0 && before.liked <= most_here_) {
    StepTerms coded = with(before.liked);
    if (coded.column.bytes.size() <= before.liked_bytes + before.liked_bytes / 4) {
      reference_ = coded.refers ? before.liked : StepReference::nothing;
      return std::move(coded.column);
    }
  }
  StepTerms best = with(StepReference::before);
  before.liked = StepReference::before;
  if (most_here_ >= StepReference::trend) {
    StepTerms trend = with(StepReference::trend);
    if (trend.column.bytes.size() < best.column.bytes.size()) {
      best = std::move(trend);
      before.liked = StepReference::trend;
    }
  }
  // If one of the kinds of references was not allowed at this step, the next step compares all
  // kinds again.
  before.liked_bytes = most_here_ == most_ ? best.column.bytes.size() : 0;
  reference_ = best.refers ? before.liked : StepReference::nothing;
  return std::move(best.column);
}

Result<void> StepEncoder::end_step() {
  if (!array_) return {};
  const ArrayInfo& info = schema_->arrays[*array_];
  const std::uint64_t got = first_ + pending_.size() / stride();
  if (got != elements_[*array_])
    return misuse("array '" + info.name + "' got " + std::to_string(got) + " elements at step " +
                      std::to_string(step_) + ", the mesh has " +
                      std::to_string(elements_[*array_]),
                  "steps");
  Before& before = before_[*array_];
  before.run = has_referred_ ? before.run + 1 : 1;
  array_.reset();
  column_.reset();
  return {};
}

}  // namespace shm
