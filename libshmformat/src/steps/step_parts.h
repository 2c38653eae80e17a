// StepParts: decodes the parts of one stepped array at one step. The caller finds the parts and
// provides the values to which the parts refer.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/binary.h"
#include "steps/step_values.h"

namespace shm {

/// Returns an error about the step values with this header. Precondition: the array exists. The
/// error contains no offset.
Error wrong_step_values(const Schema& schema, const container::StepHeader& header,
                        const std::string& detail, ErrorCode code = ErrorCode::corrupt);

/// Returns the memory limit in bytes for the decoders of step values. `file` is the size of the
/// file in bytes. `limit` is ReadLimits::max_column_bytes.
inline std::uint64_t most_kept_of_steps(std::uint64_t limit, std::uint64_t file) {
  constexpr std::uint64_t kMoreForEachByte = 256;
  return limit_with(limit, kMoreForEachByte, file);
}

class StepParts {
 public:
  /// Creates an object for the parts of `array`. `schema` must have passed check_schema() and must
  /// outlive this object. `most_bytes` limits the size in bytes of the values of a group.
  /// `most_kept` limits the size in bytes of the data of active vertices and cells.
  StepParts(const Schema& schema, std::uint64_t most_bytes, std::uint32_t array,
            std::uint64_t most_kept)
      : schema_(&schema),
        most_bytes_(most_bytes),
        column_(schema, array, most_kept),
        weighted_(schema, array, most_kept) {}

  /// Returns true if values of this array may be predicted from neighbours in the mesh. This is
  /// impossible if the array is neither on points nor on cells, or has more than
  /// kMostStepComponents components.
  static bool may_need_elements(const ArrayInfo& info) {
    return is_on_mesh(info.location) && info.components <= kMostStepComponents;
  }
  /// Checks that a group may have the number of values that the header states. Must be called
  /// before memory for these values is allocated.
  Result<void> check_size(const container::StepHeader& header) const;
  /// Decodes the values of the next part, which belongs to a group in `segment`. `elements` are the
  /// elements of the group; the pointer may be null if no part of the segment at this step is
  /// predicted from neighbours in the mesh. `reference` contains the values to which the part
  /// refers.
  Result<std::vector<std::byte>> decode(const container::StepHeader& header,
                                        std::span<const std::byte> bytes, std::uint32_t segment,
                                        const ColumnElements* elements,
                                        const ReferenceValues& reference);

 private:
  Result<std::vector<std::byte>> decode_plain(const container::StepHeader& header, Codec codec,
                                              std::span<const std::byte> bytes,
                                              std::uint32_t segment, const ColumnElements* elements,
                                              const ReferenceValues& reference);

  const Schema* schema_;
  std::uint64_t most_bytes_;
  StepColumnDecoder column_;
  StepWeightedDecoder weighted_;
  TermScratch scratch_;
  PlainReference plain_reference_;
};

}  // namespace shm
