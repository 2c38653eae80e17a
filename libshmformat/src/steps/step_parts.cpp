#include "steps/step_parts.h"

#include <utility>

#include "codecs/shared/shuffled_zstd.h"
#include "codecs/shared/special_values.h"
#include "format/schema.h"

namespace shm {

Error wrong_step_values(const Schema& schema, const container::StepHeader& header,
                        const std::string& detail, ErrorCode code) {
  return Error{code,
               "array '" + schema.arrays[header.array].name + "' at step " +
                   std::to_string(header.step) + ": " + detail,
               "step values"};
}

Result<void> StepParts::check_size(const container::StepHeader& header) const {
  const ArrayInfo& info = schema_->arrays[header.array];
  if (header.count <= most_bytes_ / (scalar_bytes(info.type) * info.components)) return {};
  return wrong_step_values(
      *schema_, header,
      "a group needs more than the limit of " + std::to_string(most_bytes_) + " bytes",
      ErrorCode::over_limit);
}

Result<std::vector<std::byte>> StepParts::decode(const container::StepHeader& header,
                                                 std::span<const std::byte> bytes,
                                                 std::uint32_t segment,
                                                 const ColumnElements* elements,
                                                 const ReferenceValues& reference) {
  if (!has_special_values(header.codec))
    return decode_plain(header, header.codec, bytes, segment, elements, reference);
  const ArrayInfo& info = schema_->arrays[header.array];
  auto special =
      SpecialValuesDecoder::read(info, bytes, header.count * info.components, reference.values);
  if (!special) return wrong_step_values(*schema_, header, "its special values are invalid");
  auto values = decode_plain(header, without_special_values(header.codec), bytes, segment, elements,
                             plain_reference_.of(info, reference));
  if (values && (!special->restore(*values) || !special->at_end()))
    return wrong_step_values(*schema_, header, "its special values are invalid");
  return values;
}

/// Decodes the values of a part without its special values.
Result<std::vector<std::byte>> StepParts::decode_plain(
    const container::StepHeader& header, Codec codec, std::span<const std::byte> bytes,
    std::uint32_t segment, const ColumnElements* elements, const ReferenceValues& reference) {
  const auto wrong = [&](const std::string& detail) {
    return wrong_step_values(*schema_, header, detail);
  };
  const ArrayInfo& info = schema_->arrays[header.array];
  const std::uint64_t size = header.count * scalar_bytes(info.type) * info.components;
  const StepReference kind = header.reference;
  if (!needs_neighbours(codec) && codec != Codec::shuffled_zstd && codec != Codec::terms)
    return wrong("its codec is unknown");
  if (info.components > kMostStepComponents &&
      (codec != Codec::shuffled_zstd || kind != StepReference::nothing))
    return wrong("has too many components for its codec");
  if (codec == Codec::terms) {
    auto values = decode_terms(info, bytes, header.count, reference.values, scratch_);
    if (!values) return wrong("its values are invalid");
    return std::move(*values);
  }
  if (!may_need_elements(info) || elements == nullptr) {
    if (codec != Codec::shuffled_zstd) return wrong("its codec differs from the expected codec");
    auto values = unpack_shuffled(bytes, scalar_bytes(info.type), size);
    if (!values || values->size() != size) return wrong("its bytes cannot be unpacked");
    return std::move(*values);
  }
  if (codec == Codec::mixed_columns && info.components > kMostTableComponents)
    return wrong("has too many components for its codec");
  const bool is_weighted = codec == Codec::weighted;
  if (!(is_weighted ? weighted_.begin(segment, kind) : column_.begin(segment, kind)))
    return wrong("refers to a different step than the previous group");
  bool is_out_of_memory = is_weighted && weighted_.exceeds_limit(*elements);
  std::optional<std::vector<std::byte>> values;
  if (is_weighted) {
    if (!is_out_of_memory) values = weighted_.decode(*elements, bytes, reference);
  } else {
    values = column_.decode(*elements, codec, bytes, size, reference.values);
    is_out_of_memory = column_.is_out_of_memory();
  }
  if (is_out_of_memory)
    return wrong_step_values(*schema_, header,
                             "data of active vertices and cells needs more memory than the limit",
                             ErrorCode::over_limit);
  if (!values || values->size() != size) return wrong("its values are invalid");
  return std::move(*values);
}

}  // namespace shm
