// Translates whole arrays of floating-point values to indices and back, for the domains that most
// coordinates have. Gives the results of ValueTranslator, many times faster.
// spec: "Value domains"
#pragma once

#include <cstdint>
#include <span>

#include "codecs/shared/value_domain.h"

namespace shm {

/// Stores the indices of values, given as bits, in a decimal or binary domain. If several indices
/// fit a value, it stores one of them. Returns false if a value is not in the domain, or the domain
/// is of another kind.
bool linear_indices(ScalarType type, std::span<const std::uint64_t> bits, const ValueDomain& domain,
                    std::span<std::int64_t> indices);

/// Stores the index nearest to each value in a decimal or binary domain, which need not contain the
/// value. Returns false if a value is NaN or too large, or the domain is of another kind.
bool linear_references(ScalarType type, std::span<const std::uint64_t> bits,
                       const ValueDomain& domain, std::span<std::int64_t> nearest);

/// Replaces indices by the bits of their values. Returns false, without any change, if an index is
/// above 2^50 or the domain is not simple enough.
bool linear_values(ScalarType type, const ValueDomain& domain, std::span<std::uint64_t> words);

}  // namespace shm
