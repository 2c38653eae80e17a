#include "step_decoder.h"

#include <algorithm>

namespace shm {

StepDecoder::StepDecoder(const Schema& schema, const ReadLimits& limits, TopologyReplay& topology,
                         std::vector<std::uint64_t> elements)
    : schema_(&schema),
      limits_(limits),
      topology_(&topology),
      elements_(std::move(elements)),
      may_refer_(steps_may_refer(schema, elements_)),
      last_(schema.arrays.size()) {}

Error StepDecoder::wrong(const container::StepHeader& header, const std::string& detail,
                         ErrorCode code) const {
  return Error{code,
               "array '" + schema_->arrays[header.array].name + "' at step " +
                   std::to_string(header.step) + ": " + detail,
               "step values",
               kNoOffset,
               {}};
}

Result<StepPiece> StepDecoder::read(const container::StepHeader& header,
                                    std::span<const std::byte> bytes) {
  if (header.array >= schema_->arrays.size() || !schema_->arrays[header.array].per_step)
    return Error{ErrorCode::corrupt, "belongs to no stepped array", "step values", kNoOffset, {}};
  if (header.step >= limits_.max_steps)
    return wrong(header, "the limit is " + std::to_string(limits_.max_steps) + " steps",
                 ErrorCode::over_limit);
  Last& last = last_[header.array];
  if (!last.begun || header.step != last.step)
    if (auto good = begin_step(header); !good) return good.error();
  if (auto good = expect_group(header); !good) return good.error();
  auto values = decode(header, bytes);
  if (!values) return values.error();
  StepPiece piece{header.array, header.step, last.first, std::move(*values)};
  if (may_refer_) {
    const std::size_t at = static_cast<std::size_t>(last.first) * (piece.values.size() / header.count);
    if (at == last.values.size())
      last.values.insert(last.values.end(), piece.values.begin(), piece.values.end());
    else
      std::copy(piece.values.begin(), piece.values.end(),
                last.values.begin() + static_cast<std::ptrdiff_t>(at));
  }
  last.first += header.count;
  last.group = std::size_t{header.group} + 1;
  if (last.first == elements_[header.array]) last.column.reset();
  return piece;
}

/// A step begins when the last one is complete.
Result<void> StepDecoder::begin_step(const container::StepHeader& header) {
  Last& last = last_[header.array];
  if (last.begun && (header.step < last.step || last.first != elements_[header.array]))
    return wrong(header, "begins before another step is complete, or behind a later one");
  last.step_before.reset();
  if (last.begun) last.step_before = last.step;
  last.begun = true;
  last.step = header.step;
  last.first = 0;
  last.group = 0;
  last.column.emplace(*schema_, header.array);
  return {};
}

/// The group must be the next one that has elements of the array, and as many as the header says.
Result<void> StepDecoder::expect_group(const container::StepHeader& header) {
  const Last& last = last_[header.array];
  if (header.count > elements_[header.array] - last.first)
    return wrong(header, "has more values than the mesh has elements");
  if (header.group < last.group || header.group >= topology_->groups())
    return wrong(header, "its group is no later one of the mesh");
  for (std::size_t g = last.group; g <= header.group; ++g) {
    const auto count = topology_->count(header.array, g);
    if (!count) return count.error();
    if (*count != (g == header.group ? header.count : 0))
      return wrong(header, g == header.group ? "has another number of values than elements"
                                             : "a group is missing or out of order");
  }
  return {};
}

Result<std::vector<std::byte>> StepDecoder::decode(const container::StepHeader& header,
                                                   std::span<const std::byte> bytes) {
  using container::Codec;
  Last& last = last_[header.array];
  const ArrayInfo& info = schema_->arrays[header.array];
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  if (header.count > limits_.max_group_bytes / stride)
    return wrong(header, "a group takes more than the limit of " +
                             std::to_string(limits_.max_group_bytes) + " bytes",
                 ErrorCode::over_limit);
  const bool refers = header.reference_step != header.step;
  if (header.codec == Codec::shuffled_zstd) {
    if (refers) return wrong(header, "this codec refers to no other step");
    last.column->forget();
    auto values = decompress_shuffled(info, bytes, header.count);
    if (!values) return wrong(header, "its bytes cannot be unpacked");
    return std::move(*values);
  }
  if (header.codec != Codec::columns || info.components > kMostStepComponents)
    return wrong(header, "its codec is unknown");
  std::span<const std::byte> reference;
  if (refers) {
    if (!may_refer_ || last.step_before != header.reference_step)
      return wrong(header, "refers to a step that is not the one before it, or too large to hold");
    reference = std::span(last.values)
                    .subspan(static_cast<std::size_t>(last.first) * stride,
                             static_cast<std::size_t>(header.count) * stride);
  }
  if (!last.column->begin(topology_->segment_of(header.group), refers))
    return wrong(header, "refers to another step than the group before");
  const auto elements = topology_->elements(header.group);
  if (!elements) return elements.error();
  auto values = last.column->decode(**elements, bytes, reference);
  if (!values) return wrong(header, "its values make no sense");
  return std::move(*values);
}

bool StepDecoder::is_complete() const {
  for (std::size_t a = 0; a < last_.size(); ++a)
    if (last_[a].begun && last_[a].first != elements_[a]) return false;
  return true;
}

}  // namespace shm
