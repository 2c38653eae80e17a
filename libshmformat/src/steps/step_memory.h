// StepMemory: stores values of earlier steps, to which step values may refer.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "format/format.h"

namespace shm {

/// Maximum total size in bytes of the earlier values that the step values of all stepped arrays may
/// refer to. Both encoder and decoder store these values in memory.
inline constexpr std::uint64_t kMostReferenceBytes = std::uint64_t{1} << 27;

/// Returns the highest StepReference that values in a file may use. `elements` lists the number of
/// elements of each array.
StepReference most_reference(const Schema& schema, std::span<const std::uint64_t> elements);

/// Computes the trend, last + (last - before), for each scalar. Integers wrap around. The result of
/// each floating-point operation is rounded. If the result is not finite, the trend is `last`.
/// Precondition: `last` and `before` have the same size.
void go_on(ScalarType type, std::span<const std::byte> last, std::span<const std::byte> before,
           std::vector<std::byte>& out);

/// Stores the values of the one or two most recent steps of an array, and of its base: the most
/// recent step that refers to no other step.
class StepMemory {
 public:
  /// Creates a memory. `most` is the highest StepReference that will be passed to reference().
  explicit StepMemory(StepReference most = StepReference::nothing) : most_(most) {}

  /// Stores a run of values of a step. The run begins at byte `offset` of the step's values. The
  /// values of a step must be passed in order. `is_base` must be true if the step refers to no
  /// other step.
  void take(std::size_t offset, std::span<const std::byte> values, bool is_base);
  /// Stores all values of the base, if it is not one of the steps that are passed to take().
  void take_base(std::span<const std::byte> values);
  /// Returns the reference values for `bytes` bytes of a step's values, beginning at byte `offset`.
  /// The result is valid until the next call. `info` describes the array. Precondition: enough
  /// steps have been stored, and `kind` is at most `most`.
  std::span<const std::byte> reference(StepReference kind, const ArrayInfo& info,
                                       std::size_t offset, std::size_t bytes);

 private:
  StepReference most_;
  std::vector<std::byte> last_, before_last_, base_, trend_;
};

/// Returns a StepMemory for an array. `most` is the highest StepReference that the file uses.
StepMemory memory_of(const ArrayInfo& array, StepReference most);

}  // namespace shm
