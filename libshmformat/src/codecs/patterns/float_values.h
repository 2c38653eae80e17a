// Float values: decodes floating-point values from residuals. A residual is the difference between
// the index of a value and the index of its reference value. (Indices are integers in the order of
// the values.) TermColumn contains a loop that decodes one value at a time. This code gives the
// same results, but processes blocks of a few hundred values without branches.
// spec: "Values by terms"
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/schema.h"

namespace shm {

struct FloatResiduals {
  /// Pointer to the byte plane with the least significant byte of each residual. Each further byte
  /// plane begins `distance` bytes after the previous plane.
  const std::byte* planes = nullptr;
  std::size_t distance = 0;
  std::uint32_t width = 0;  ///< size of a residual in bytes
};

/// The values of one component and their reference values. `stride`: number of bytes from one value
/// or reference value to the next.
struct FloatPlaces {
  const std::byte* reference = nullptr;
  std::byte* values = nullptr;
  std::size_t stride = 0;
  std::size_t count = 0;  ///< number of values, at least 1
};

/// Decodes values of the floating-point type `type`. The difference of an element is the index of
/// its value minus the index of its reference value. `changes`: if false, each residual is a
/// difference; if true, each residual is a difference minus that of the previous element. `change`:
/// on input, the difference of the element before the first one; on return, the difference of the
/// final element. Returns the index of the final value. Precondition: `type` is a floating-point
/// type.
std::int64_t decode_floats(ScalarType type, const FloatResiduals& residuals, bool changes,
                           std::uint64_t& change, const FloatPlaces& floats);

}  // namespace shm
