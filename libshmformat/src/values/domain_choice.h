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

/// Whether these values are of a domain, none odd but those of `domain` allows.
bool still_fits(const ArrayInfo& info, std::size_t component, const ValueDomain& domain,
                std::span<const std::uint64_t> bits);

}  // namespace shm
