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
  /// One of the values as it would be coded without.
  struct Value {
    std::uint32_t place = 0;   ///< which one of all it is
    double predicted = 0;      ///< by the elements around it
    double bits = 0;           ///< that it takes
    std::uint32_t length = 0;  ///< of its residual
  };
  /// Sets recalls and partners of the domain by some of the values. `has_table`: whether values are
  /// ranks of one. Returns how many of their bits are saved, about.
  double choose(std::span<const Value> values, bool has_table, ValueDomain& domain) const;

 private:
  /// What is missed at a value by an earlier one, in bits.
  struct Missed {
    std::uint8_t recalled, partnered;
    bool follows;  // the one that was recalled before
  };
  static constexpr std::uint8_t kNothing = 255;  // there is no earlier one

  std::vector<Missed> missed_;                   // by value
  std::vector<std::uint64_t> magnitudes_;        // by value
  std::uint64_t recallable_ = 0, partners_ = 0;  // values that may be helped
};

/// How an element stands: at which corner, of what kind.
inline std::uint8_t stand_of(const Neighbourhood& it) {
  return static_cast<std::uint8_t>((it.corner | it.kind << 3) & 63);
}

/// Of each element how far back one with the same bits stands, in the group or before it: as far as
/// at the last one that stands alike, where that is possible, or else where that goes on for
/// longest. 0: at most `farthest` back there is none. `bits`, `history`: by component; `history`
/// ends where the group begins.
std::vector<std::uint32_t> find_copies(std::span<const std::uint8_t> stands,
                                       std::span<const std::vector<std::uint64_t>> bits,
                                       std::span<const std::vector<std::uint64_t>> history,
                                       std::uint32_t farthest);

}  // namespace shm
