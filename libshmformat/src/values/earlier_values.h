// EarlierValues: encoder only: whether recalled values or partners save enough in a group.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "values/value_domain.h"

namespace shm {

class EarlierValues {
 public:
  /// All values of one component in a group, as bits, and what they refer to, if anything; both are
  /// borrowed. They are looked at in this order.
  EarlierValues(const ArrayInfo& info, std::size_t component, const ValueDomain& domain,
                std::span<const std::uint64_t> bits, std::span<const std::uint64_t> reference);

  /// Whether choose() may choose anything.
  bool may_help() const;
  /// Sets recalls and partners of the domain. `bits`: what a value takes without them.
  /// `has_table`: whether values are ranks of one.
  void choose(double bits, bool has_table, ValueDomain& domain) const;

 private:
  struct Counts {
    std::vector<std::uint64_t> by_length = std::vector<std::uint64_t>(65);  // of what is missed

    std::uint64_t helped() const;
    /// Bits saved where one takes so many besides what it misses.
    double saved(double bits, double besides) const;
  };

  Counts recalled_, followed_, partnered_;  // followed: recalled ones that follow the one before
  std::uint64_t values_ = 0;
};

}  // namespace shm
