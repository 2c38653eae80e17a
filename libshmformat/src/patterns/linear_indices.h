// Indices of floating-point values in the domains that most coordinates have, by loops over all of
// them: what a ValueTranslator does for each, many times as fast.
// spec: "Value domains"
#pragma once

#include <cstdint>
#include <span>

#include "values/value_domain.h"

namespace shm {

/// Indices of values of a decimal or binary domain, by their bits; where a value has several,
/// either one. False where a value is none of it, or for another domain.
bool linear_indices(ScalarType type, std::span<const std::uint64_t> bits, const ValueDomain& domain,
                    std::span<std::int64_t> indices);

/// Whole numbers that values are nearest to in a decimal or binary domain, of which they need not
/// be. False where one is too large for that, or no number, or for another domain.
bool linear_references(ScalarType type, std::span<const std::uint64_t> bits,
                       const ValueDomain& domain, std::span<std::int64_t> nearest);

/// Bits of the values of these indices, in their place. False where one is above 2^50, and for a
/// domain that is not as simple: nothing is done.
bool linear_values(ScalarType type, const ValueDomain& domain, std::span<std::uint64_t> words);

}  // namespace shm
