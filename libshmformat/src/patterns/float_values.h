// Floating-point values as they are stored, told by what their places among all such numbers differ
// by from those of a reference: by loops without a branch over some hundred of them, the same as
// TermColumn makes one by one.
// spec: "Values by terms"
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/schema.h"

namespace shm {

struct FloatResiduals {
  const std::byte* planes = nullptr;  ///< byte 0 of all residuals; the other bytes so far behind it
  std::size_t distance = 0;
  std::uint32_t width = 0;  ///< how many bytes there are
};

/// Values of one component, `stride` bytes apart, and what they are predicted from.
struct FloatPlaces {
  const std::byte* reference = nullptr;
  std::byte* values = nullptr;
  std::size_t stride = 0;
  std::size_t count = 0;  ///< 1 and more
};

/// `changes`: whether the residual is to what the element before differs by from its reference;
/// `change` is that of the element before, and becomes that of the last one. Returns the place of
/// the last value. Must hold: `type` is of floats.
std::int64_t decode_floats(ScalarType type, const FloatResiduals& residuals, bool changes,
                           std::uint64_t& change, const FloatPlaces& at);

}  // namespace shm
