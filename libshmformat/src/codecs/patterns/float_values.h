// Decodes floating-point values from residuals of their indices against those of a reference. Gives
// the same values as TermColumn's loop over single values, but processes blocks of some hundred
// values without branches.
// spec: "Values by terms"
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/schema.h"

namespace shm {

struct FloatResiduals {
  /// byte 0 of all residuals, then the other bytes, `distance` apart
  const std::byte* planes = nullptr;
  std::size_t distance = 0;
  std::uint32_t width = 0;  ///< number of bytes of a residual
};

/// The values of one component, `stride` bytes apart, and their references.
struct FloatPlaces {
  const std::byte* reference = nullptr;
  std::byte* values = nullptr;
  std::size_t stride = 0;
  std::size_t count = 0;  ///< at least 1
};

/// Decodes values of a floating-point type. `changes`: true if a residual is the change of the
/// difference from the reference, compared with the previous element. `change`: that difference of
/// the previous element; set to that of the last element. Returns the index of the last value. Must
/// hold: `type` is a floating-point type.
std::int64_t decode_floats(ScalarType type, const FloatResiduals& residuals, bool changes,
                           std::uint64_t& change, const FloatPlaces& floats);

}  // namespace shm
