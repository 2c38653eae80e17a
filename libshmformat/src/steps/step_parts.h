// StepParts: the values of one stepped array at one step out of its parts, for whoever knows
// where these stand and what they refer to. spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bytes/binary.h"
#include "steps/step_values.h"

namespace shm {

/// An error in the step values with this header, of an array that there is; names no place.
Error wrong_step_values(const Schema& schema, const container::StepHeader& header,
                        const std::string& detail, ErrorCode code = ErrorCode::corrupt);

/// What of this limit (ReadLimits::max_column_bytes) is there for columns of steps in a file of so
/// many bytes.
inline std::uint64_t most_kept_of_steps(std::uint64_t limit, std::uint64_t file) {
  constexpr std::uint64_t kMoreForEachByte = 256;
  return limit_with(limit, kMoreForEachByte, file);
}

class StepParts {
 public:
  /// `schema` is checked and borrowed. `most_bytes`: of the values of a group. `most_kept`: of
  /// what is kept of active vertices and cells.
  StepParts(const Schema& schema, std::uint64_t most_bytes, std::uint32_t array,
            std::uint64_t most_kept)
      : schema_(&schema), most_bytes_(most_bytes), column_(schema, array, most_kept) {}

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
