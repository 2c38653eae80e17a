// ReferenceValues: values of earlier steps, to which the values of a step refer.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <span>

namespace shm {

struct ReferenceValues {
  /// The reference value of each element; empty if there are none.
  std::span<const std::byte> values;
  /// The values at the step before, if the reference values are the trend; otherwise empty.
  std::span<const std::byte> last;

  bool empty() const { return values.empty(); }
};

}  // namespace shm
