// Domain choice: what the numbers of a component may be made of. Encoder only.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "values/scalar_column.h"

namespace shm {

/// Ways to say these values (bits of scalars), the most likely first; never empty.
std::vector<DomainPlan> domain_candidates(const ArrayInfo& info, std::size_t component,
                                          std::span<const std::uint64_t> bits);

/// A domain of all these values, no escapes and no zero negative: an evenly spaced one where that
/// is much smaller than floating-point numbers. Must hold: there are some.
ValueDomain evenly_spaced_domain(const ArrayInfo& info, std::size_t component,
                                 std::span<const std::uint64_t> bits);

/// Whether these values are of a domain, without escapes unless `domain` has them.
bool still_fits(const ArrayInfo& info, std::size_t component, const ValueDomain& domain,
                std::span<const std::uint64_t> bits);

}  // namespace shm
