// StepMemory: stores values of earlier steps, to which step values may refer.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codecs/shared/reference_values.h"
#include "format/format.h"
#include "steps/step_store.h"

namespace shm {

/// Computes the trend, last + (last - before), for each scalar. Integers wrap around. The result of
/// each floating-point operation is rounded. If the result is not finite, the trend is `last`.
/// Precondition: `last` and `before` have the same size.
void go_on(ScalarType type, std::span<const std::byte> last, std::span<const std::byte> before,
           std::vector<std::byte>& out);

/// Stores the values of the one or two most recent steps of an array, and of its base: the most
/// recent step that refers to no other step.
class StepMemory {
 public:
  /// Creates a memory that stores nothing.
  StepMemory() = default;
  /// Creates a memory for steps of `bytes` bytes each. `most` is the highest StepReference that
  /// will be passed to reference(). `store` must outlive the memory.
  StepMemory(StepStore& store, StepReference most, std::uint64_t bytes);

  /// Stores a run of values of a step. The run begins at byte `offset` of the step's values. The
  /// values of a step must be passed in order. `is_base` must be true if the step refers to no
  /// other step.
  Result<void> take(std::uint64_t offset, std::span<const std::byte> values, bool is_base);
  /// Stores all values of the base, if it is not one of the steps that are passed to take().
  Result<void> take_base(std::span<const std::byte> values);
  /// Returns the reference values for `bytes` bytes of a step's values, beginning at byte `offset`.
  /// Must be called before take() for these values. The result is valid until the next call. `info`
  /// describes the array. Precondition: enough steps have been stored, and `kind` is at most
  /// `most`.
  Result<ReferenceValues> reference(StepReference kind, const ArrayInfo& info, std::uint64_t offset,
                                    std::size_t bytes);

 private:
  /// Returns the memory of a step. Steps are stored in the sequences in turn.
  StepBytes& recent_step(std::uint64_t step) {
    return recent_[static_cast<std::size_t>(step % recent_.size())];
  }

  std::vector<StepBytes> recent_;
  std::optional<StepBytes> base_;
  std::uint64_t steps_ = 0;  // number of steps of which take() has stored values
  std::vector<std::byte> trend_;
};

/// Returns the memory for a stepped array with `elements` elements, and a memory that stores
/// nothing for other arrays. `most` is the highest StepReference that the file uses.
StepMemory memory_of(StepStore& store, const ArrayInfo& array, std::uint64_t elements,
                     StepReference most);

}  // namespace shm
