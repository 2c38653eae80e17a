// Encoder only: what of a group has been there before.
//   EarlierValues   whether recalled values or partners save enough
//   find_copies     elements that are as an earlier one in all components
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "values/neighbourhood.h"
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

/// Of each element how far back one with the same bits stands, in the group or before it: as far as
/// at the last like element, where that is possible, or else where that goes on for longest. 0: at
/// most `farthest` back there is none. `bits`, `history`: by component; `history` ends where the
/// group begins.
std::vector<std::uint32_t> find_copies(std::span<const Neighbourhood> items,
                                       std::span<const std::vector<std::uint64_t>> bits,
                                       std::span<const std::vector<std::uint64_t>> history,
                                       std::uint32_t farthest);

}  // namespace shm
