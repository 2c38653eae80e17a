// Indices of floating-point values in the domains that most coordinates have, by loops over all of
// them: the same as those of a ValueTranslator, many times as fast.
// spec: "Value domains"
#pragma once

#include <cstdint>
#include <span>

#include "values/value_domain.h"

namespace shm {

/// Indices of values of a decimal or binary domain, by their bits. False where a value is none of
/// it, or for another domain.
bool linear_indices(ScalarType type, std::span<const std::uint64_t> bits, const ValueDomain& domain,
                    std::span<std::int64_t> indices);

/// Bits of the values of these indices, in their place. False for a domain that is not as simple,
/// and nothing is done.
bool linear_values(ScalarType type, const ValueDomain& domain, std::span<std::uint64_t> words);

}  // namespace shm
