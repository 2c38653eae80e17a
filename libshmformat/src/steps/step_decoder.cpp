#include "steps/step_decoder.h"

#include <algorithm>
#include <utility>

#include "base/errors.h"

namespace shm {

StepDecoder::StepDecoder(const Schema& schema, const ReadLimits& limits, StepTopology& topology,
                         std::vector<std::uint64_t> elements, KeptSteps kept)
    : schema_(&schema),
      limits_(limits),
      mesh_(schema, topology, cover_numbers(schema)),
      elements_(std::move(elements)),
      store_(std::make_unique<StepStore>(std::move(kept))) {
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    last_.push_back(
        {.values = memory_of(*store_, schema.arrays[a], elements_[a], schema.step_references)});
    if (schema.arrays[a].per_step) mesh_.expect(a, elements_[a]);
  }
}

Result<StepPiece> StepDecoder::read(const container::StepHeader& header,
                                    std::span<const std::byte> bytes, std::uint64_t file) {
  if (auto status = begin_part(header, file); !status) return status.error();
  auto values = decode(header, bytes);
  if (!values) return values.error();
  return end_part(header, std::move(*values));
}

Result<StepPiece> StepDecoder::read(const BundleChunk& bundle, std::size_t pair,
                                    std::uint64_t file) {
  const container::StepHeader header = bundle.header(pair);
  if (auto status = begin_part(header, file); !status) return status.error();
  if (header.count != elements_[header.array])
    return wrong_step_values(*schema_, header, "a bundle does not contain the whole array");
  if (auto status = parts_->check_size(header); !status) return status.error();
  return end_part(header, bundle.values(pair));
}

/// Begins a part, and a step if the part is the first one of a step. Checks everything except the
/// values and the reference.
Result<void> StepDecoder::begin_part(const container::StepHeader& header, std::uint64_t file) {
  if (header.array >= schema_->arrays.size() || !schema_->arrays[header.array].per_step)
    return corrupt("belongs to no stepped array", "step values");
  if (header.step >= limits_.max_steps)
    return wrong_step_values(*schema_, header,
                             "the limit is " + std::to_string(limits_.max_steps) + " steps",
                             ErrorCode::over_limit);
  Last& last = last_[header.array];
  if (array_ != header.array || header.step != last.step)
    if (auto status = begin_step(header, file); !status) return status;
  return expect_group(header);
}

Result<StepPiece> StepDecoder::end_part(const container::StepHeader& header,
                                        std::vector<std::byte> values) {
  Last& last = last_[header.array];
  StepPiece piece{header.array, header.step, last.first, std::move(values)};
  if (has_digests_) {
    const auto digest =
        mesh_.digest(header.array, header.step, header.group, last.first, piece.values);
    if (!digest) return digest.error();
    digest_ += *digest;
  }
  if (auto status = last.values.take(last.first * (piece.values.size() / header.count),
                                     piece.values, header.reference == StepReference::nothing);
      !status)
    return status.error();
  last.first += header.count;
  ++last.groups;
  return piece;
}

/// Begins a step of one array. The previous step, of this or another array, must be complete.
Result<void> StepDecoder::begin_step(const container::StepHeader& header, std::uint64_t file) {
  Last& last = last_[header.array];
  if (!is_complete() || (last.begun && header.step <= last.step))
    return wrong_step_values(
        *schema_, header,
        "begins before the previous step is complete, or after the same or a later step");
  if (last.begun) {
    last.step_before = last.step;
    last.run = container::is_key(last.reference) ? 1 : last.run + 1;
    if (last.reference == StepReference::nothing) last.base = last.step;
  }
  last.begun = true;
  last.reference = header.reference;
  last.step = header.step;
  last.first = 0;
  last.groups = 0;
  array_ = header.array;
  parts_.emplace(*schema_, limits_.max_group_bytes, header.array,
                 most_kept_of_steps(limits_.max_column_bytes, file));
  return {};
}

/// Checks that the part belongs to the next group that has elements of the array, and that the
/// header states the number of these elements.
Result<void> StepDecoder::expect_group(const container::StepHeader& header) {
  const Last& last = last_[header.array];
  if (header.count > elements_[header.array] - last.first)
    return wrong_step_values(*schema_, header, "has more values than the mesh has elements");
  if (header.group >= mesh_.groups())
    return wrong_step_values(*schema_, header, "its group does not exist in the mesh");
  const auto next = mesh_.nth_group(header.array, last.groups, header.group);
  if (!next) return next.error();
  if (*next == nullptr || (*next)->group < header.group)
    return wrong_step_values(*schema_, header, "a group is missing or out of order");
  if ((*next)->count != header.count)
    return wrong_step_values(*schema_, header,
                             "the number of values differs from the number of elements");
  return {};
}

/// Checks the reference of the part. A trend needs the two previous steps, and the later of these
/// two must not be a key step. The reason: a reader may have begun at a key step, and then does not
/// have the step before it.
Result<void> StepDecoder::check_reference(const container::StepHeader& header) const {
  const Last& last = last_[header.array];
  const StepReference kind = header.reference;
  if (kind != last.reference)
    return wrong_step_values(*schema_, header,
                             "refers to a different step than the previous group");
  if (kind == StepReference::nothing) return {};
  if (kind == StepReference::base && header.reference_step != last.base)
    return wrong_step_values(*schema_, header,
                             "refers to a step that is not the base of the array");
  if (kind != StepReference::base && (last.run == 0 || header.reference_step != last.step_before ||
                                      (kind == StepReference::trend && last.run < 2)))
    return wrong_step_values(*schema_, header, "refers to a step that is not the previous step");
  if (kind > schema_->step_references)
    return wrong_step_values(*schema_, header,
                             "refers to more earlier steps than the schema allows");
  return {};
}

Result<std::vector<std::byte>> StepDecoder::decode(const container::StepHeader& header,
                                                   std::span<const std::byte> bytes) {
  Last& last = last_[header.array];
  const ArrayInfo& info = schema_->arrays[header.array];
  if (auto status = parts_->check_size(header); !status) return status.error();
  if (auto status = check_reference(header); !status) return status.error();
  ColumnElements elements;
  if (StepParts::may_need_elements(info) && without_special_values(header.codec) != Codec::terms &&
      mesh_.has_neighbourhoods(header.array, header.group)) {
    const auto of_group = mesh_.elements(header.array, header.group);
    if (!of_group) return of_group.error();
    elements = *of_group;
  }
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  const auto reference = last.values.reference(header.reference, info, last.first * stride,
                                               static_cast<std::size_t>(header.count) * stride);
  if (!reference) return reference.error();
  return parts_->decode(header, bytes, mesh_.segment_of(header.group),
                        elements.items != nullptr ? &elements : nullptr, *reference);
}

}  // namespace shm
