// StepParts: the values of one stepped array at one step out of its parts, for whoever knows
// where these stand and what they refer to. spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "steps/step_values.h"

namespace shm {

/// An error in the step values with this header, of an array that there is; names no place.
Error wrong_step_values(const Schema& schema, const container::StepHeader& header,
                        const std::string& detail, ErrorCode code = ErrorCode::corrupt);

class StepParts {
 public:
  /// `schema` is checked and borrowed. `most_bytes`: of the values of a group.
  StepParts(const Schema& schema, std::uint64_t most_bytes, std::uint32_t array)
      : schema_(&schema), most_bytes_(most_bytes), column_(schema, array) {}

  /// Whether values of this array may be predicted over the mesh: of any codec but terms.
  static bool may_need_elements(const ArrayInfo& info) {
    return info.components <= kMostStepComponents;
  }
  /// Before anything is made for the values: whether a group of so many is allowed.
  Result<void> check_size(const container::StepHeader& header) const;
  /// The values of the next part, of a group of `segment`. `elements`: of the group; null where
  /// no part of the segment at this step is predicted over the mesh. `reference`: what its values
  /// refer to.
  Result<std::vector<std::byte>> decode(const container::StepHeader& header,
                                        std::span<const std::byte> bytes, std::uint32_t segment,
                                        const ColumnElements* elements,
                                        std::span<const std::byte> reference);

 private:
  const Schema* schema_;
  std::uint64_t most_bytes_;
  StepColumn<SplitDecoder> column_;
  TermScratch scratch_;
};

}  // namespace shm
