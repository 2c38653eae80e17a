// Values of earlier steps, which step values may refer to.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "format/format.h"

namespace shm {

/// Values may refer to earlier steps if these, of all stepped arrays together, take at most this
/// many bytes, since both encoder and decoder hold them.
inline constexpr std::uint64_t kMostReferenceBytes = std::uint64_t{1} << 27;

/// Returns the most that values in a file may refer to. `elements`: number of elements, by array.
StepReference most_reference(const Schema& schema, std::span<const std::uint64_t> elements);

/// Computes the trend, last + (last - before) for each scalar. Integers wrap around. Floating-point
/// operations are rounded, and `last` is taken if the result is not finite. Must hold: both have
/// the same size.
void go_on(ScalarType type, std::span<const std::byte> last, std::span<const std::byte> before,
           std::vector<std::byte>& out);

/// Values of the last steps of an array.
class StepMemory {
 public:
  /// `most`: the furthest reference that reference() will be asked for.
  explicit StepMemory(StepReference most = StepReference::nothing) : most_(most) {}

  /// Stores values of a step from byte `offset` on. The values of a step come in order.
  void take(std::size_t offset, std::span<const std::byte> values);
  /// Returns the values that those from byte `offset` on refer to, valid until the next call.
  /// `info`: of the array. Must hold: enough steps have been taken, and `kind` is at most `most`.
  std::span<const std::byte> reference(StepReference kind, const ArrayInfo& info,
                                       std::size_t offset, std::size_t bytes);

 private:
  StepReference most_;
  std::vector<std::byte> last_, before_last_, trend_;
};

/// Returns the memory for an array of a file that allows `most`.
StepMemory memory_of(const ArrayInfo& array, StepReference most);

}  // namespace shm
