// Linear indices: converts arrays of floating-point values to indices and back. It supports the
// domains that most coordinates use. The results are the same as those of ValueTranslator, but the
// conversion is many times faster.
// spec: "Value domains"
#pragma once

#include <cstdint>
#include <span>

#include "codecs/shared/value_domain.h"

namespace shm {

/// Stores in `indices` the index that each value has in a decimal or binary domain. `bits`: the
/// bits of the values. If a value has several indices, stores one of them. Returns false if the
/// domain does not contain all of the values, or if the domain is neither decimal nor binary.
bool linear_indices(ScalarType type, std::span<const std::uint64_t> bits, const ValueDomain& domain,
                    std::span<std::int64_t> indices);

/// For each value, stores in `nearest` the index of the nearest value of a decimal or binary
/// domain. The domain need not contain the value itself. Returns false if a value is NaN or too
/// large, or if the domain is neither decimal nor binary.
bool linear_references(ScalarType type, std::span<const std::uint64_t> bits,
                       const ValueDomain& domain, std::span<std::int64_t> nearest);

/// Replaces each index in `words` with the bits of its value. Returns false and changes nothing if
/// an index is above 2^50, if the domain is neither decimal nor binary, or if this function does
/// not support the exponent of the domain.
bool linear_values(ScalarType type, const ValueDomain& domain, std::span<std::uint64_t> words);

}  // namespace shm
