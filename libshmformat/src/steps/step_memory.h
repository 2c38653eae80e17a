// The steps before, which step values may refer to.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "container/format.h"

namespace shm {

/// Values may refer to the steps before where these, of all stepped arrays together, take no more
/// than this, since both sides hold them.
inline constexpr std::uint64_t kMostReferenceBytes = std::uint64_t{1} << 27;

/// The most that a file allows. `elements`: how many each array has, by array.
StepReference most_reference(const Schema& schema, std::span<const std::uint64_t> elements);

/// The trend, last + (last - before) for each scalar: integers modulo their range; floating-point
/// numbers as they are rounded, or `last` where that is not finite. Must hold: both of one size.
void go_on(ScalarType type, std::span<const std::byte> last, std::span<const std::byte> before,
           std::vector<std::byte>& out);

/// What is held of the last steps of an array.
class StepMemory {
 public:
  /// `most`: what may be asked of it.
  explicit StepMemory(StepReference most = StepReference::nothing) : most_(most) {}

  /// Takes note of values of a step, from byte `at` on. All of a step come in order.
  void take(std::size_t at, std::span<const std::byte> values);
  /// What the values from byte `at` on may refer to, valid until the next call; `info` is of the
  /// array. Must hold: so many steps have been taken, and are allowed.
  std::span<const std::byte> reference(StepReference kind, const ArrayInfo& info, std::size_t at,
                                       std::size_t bytes);

 private:
  StepReference most_;
  std::vector<std::byte> last_, before_last_, trend_;
};

/// What is to be held of an array of a file that allows `most`.
StepMemory memory_of(const ArrayInfo& array, StepReference most);

}  // namespace shm
