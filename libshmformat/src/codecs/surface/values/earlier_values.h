// Encoder only: finds values of a group that repeat earlier values.
//   EarlierValues   decides whether recalled values or partners save enough to be used
//   find_copies     finds elements that equal an earlier element in all components
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shared/neighbourhood.h"
#include "codecs/shared/value_domain.h"

namespace shm {

class EarlierValues {
 public:
  /// `bits`: all values of one component in a group, in coding order. `reference`: their reference
  /// values, or empty. The constructor does not keep either.
  EarlierValues(const ArrayInfo& info, std::size_t component, const ValueDomain& domain,
                std::span<const std::uint64_t> bits, std::span<const std::uint64_t> reference);

  /// Returns false if choose() would certainly set neither `recalls` nor `partners`.
  bool may_help() const;
  /// A value of a sample, and how it would be coded without recalled values and partners.
  struct Value {
    std::uint32_t place = 0;   ///< number of the value in the group
    double predicted = 0;      ///< prediction from the neighbours
    double bits = 0;           ///< estimated cost of the value in bits
    std::uint32_t length = 0;  ///< bit length of its residual
  };
  /// Sets `recalls` and `partners` of the domain according to a sample of the values. `has_table`:
  /// true if the values are coded as ranks in a table. Returns the estimated number of bits saved
  /// in the sample.
  double choose(std::span<const Value> values, bool has_table, ValueDomain& domain) const;

 private:
  /// Bit lengths of the residuals of a value against the best earlier values: as a recalled value
  /// and with a partner.
  struct Missed {
    std::uint8_t recalled, partnered;
    bool follows;  // whether the value continues the sequence of the last recalled value
  };
  static constexpr std::uint8_t kNothing = 255;  // length that means that there is no earlier value

  std::vector<Missed> missed_;             // residual lengths, by value
  std::vector<std::uint64_t> magnitudes_;  // magnitudes, by value

  // Number of values that could be recalled, and number of values that could have a partner
  std::uint64_t recallable_ = 0, partners_ = 0;
};

/// Returns the kind and corner of an element, combined. Copies are searched only among elements
/// with the same kind and corner.
inline std::uint8_t stand_of(const Neighbourhood& item) {
  return static_cast<std::uint8_t>((item.corner | item.kind << 3) & 63);
}

/// Finds, for each element, the distance to an earlier element with the same bits, in the group or
/// in `history`; 0 if there is none within `farthest`. Prefers the distance of the last element
/// with the same kind and corner (`stands`). Otherwise selects the distance that remains valid for
/// the longest run of such elements. `bits`, `history`: by component. `history` contains the
/// elements just before the first element of the group.
std::vector<std::uint32_t> find_copies(std::span<const std::uint8_t> stands,
                                       std::span<const std::vector<std::uint64_t>> bits,
                                       std::span<const std::vector<std::uint64_t>> history,
                                       std::uint32_t farthest);

}  // namespace shm
