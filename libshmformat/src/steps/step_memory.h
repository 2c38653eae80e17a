// StepMemory: stores values of earlier steps, to which step values may refer.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "format/format.h"

namespace shm {

/// Largest total size in bytes of the earlier values of all stepped arrays to which step values may
/// refer. Both encoder and decoder store these values in memory.
inline constexpr std::uint64_t kMostReferenceBytes = std::uint64_t{1} << 27;

/// Returns the furthest reference that values in a file may use. `elements` lists the number of
/// elements of each array.
StepReference most_reference(const Schema& schema, std::span<const std::uint64_t> elements);

/// Computes the trend, last + (last - before), for each scalar. Integers wrap around. The result of
/// each floating-point operation is rounded. If the result is not finite, the trend is `last`. Must
/// hold: `last` and `before` have the same size.
void go_on(ScalarType type, std::span<const std::byte> last, std::span<const std::byte> before,
           std::vector<std::byte>& out);

/// Stores the values of the last steps of an array.
class StepMemory {
 public:
  /// Creates a memory. `most` is the furthest reference that will be passed to reference().
  explicit StepMemory(StepReference most = StepReference::nothing) : most_(most) {}

  /// Stores the values of a step that begin at byte `offset`. The values of a step must be passed
  /// in order.
  void take(std::size_t offset, std::span<const std::byte> values);
  /// Returns the reference values for the `bytes` bytes of values that begin at byte `offset`. The
  /// result is valid until the next call. `info` describes the array. Must hold: enough steps have
  /// been stored, and `kind` is at most `most`.
  std::span<const std::byte> reference(StepReference kind, const ArrayInfo& info,
                                       std::size_t offset, std::size_t bytes);

 private:
  StepReference most_;
  std::vector<std::byte> last_, before_last_, trend_;
};

/// Returns a StepMemory for an array of a file whose references go as far as `most`.
StepMemory memory_of(const ArrayInfo& array, StepReference most);

}  // namespace shm
