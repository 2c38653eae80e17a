// Conversion of whole arrays of floating-point values to indices and back, in the domains of most
// coordinates. The results are the same as those of ValueTranslator, but the conversion is many
// times faster.
// spec: "Value domains"
#pragma once

#include <cstdint>
#include <span>

#include "codecs/shared/value_domain.h"

namespace shm {

/// Stores the indices of values in a decimal or binary domain. `bits`: the bits of the values. If
/// several indices represent a value, stores one of them. Returns false if the domain does not
/// contain a value, or the domain is of another kind.
bool linear_indices(ScalarType type, std::span<const std::uint64_t> bits, const ValueDomain& domain,
                    std::span<std::int64_t> indices);

/// Stores the index nearest to each value in a decimal or binary domain. The domain need not
/// contain the value. Returns false if a value is NaN or too large, or if the domain is of another
/// kind.
bool linear_references(ScalarType type, std::span<const std::uint64_t> bits,
                       const ValueDomain& domain, std::span<std::int64_t> nearest);

/// Replaces each index in `words` by the bits of its value. Returns false, without any change, if
/// an index is above 2^50, the domain is of another kind, or its exponent is unusual.
bool linear_values(ScalarType type, const ValueDomain& domain, std::span<std::uint64_t> words);

}  // namespace shm
