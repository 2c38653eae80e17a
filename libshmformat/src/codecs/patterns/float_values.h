// Decoding of floating-point values from residuals relative to reference values. A residual is a
// difference of two indices (integers in the order of the values). The results are the same as in
// TermColumn's loop over single values, but this code processes blocks of some hundred values
// without branches.
// spec: "Values by terms"
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/schema.h"

namespace shm {

struct FloatResiduals {
  /// Byte 0 of all residuals; each further byte plane begins `distance` bytes after the previous
  /// one
  const std::byte* planes = nullptr;
  std::size_t distance = 0;
  std::uint32_t width = 0;  ///< size of a residual in bytes
};

/// The values of one component and their references, each `stride` bytes apart.
struct FloatPlaces {
  const std::byte* reference = nullptr;
  std::byte* values = nullptr;
  std::size_t stride = 0;
  std::size_t count = 0;  ///< number of values, at least 1
};

/// Decodes values of a floating-point type. `changes`: true if the value's difference from its
/// reference is coded relative to the same difference of the previous element. `change`: on input,
/// the difference of the previous element; on return, that of the last element. Returns the index
/// of the last value. Must hold: `type` is a floating-point type.
std::int64_t decode_floats(ScalarType type, const FloatResiduals& residuals, bool changes,
                           std::uint64_t& change, const FloatPlaces& floats);

}  // namespace shm
