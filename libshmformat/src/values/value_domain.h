// ValueDomain: which numbers a component of an array is made of, in one group: what its indices
// mean. Found by the encoder, written to the stream. spec: "Value domains"
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "shm/schema.h"
#include "values/value_space.h"

namespace shm {

enum class DomainKind : std::uint8_t {
  floats = 0,     ///< every bit pattern of the stored type
  narrow = 1,     ///< doubles that are float32
  binary = 2,     ///< d * 2^-exponent
  decimal = 3,    ///< d / 10^exponent, or d * 10^-exponent
  digits = 4,     ///< `exponent` significant decimal digits
  integers = 5,   ///< whole numbers: integer types
  quantized = 6,  ///< minimum + d * step of the schema
};
inline constexpr std::uint32_t kDomainKinds = 7;

struct ValueDomain {
  DomainKind kind = DomainKind::floats;
  std::int32_t exponent = 0;
  bool negative_zero = false;  ///< whether a zero may be -0.0 (binary, decimal, digits)
  bool escapes = false;        ///< whether some values are none of the domain, and stored in full
  bool operator==(const ValueDomain&) const = default;

  bool is_linear() const {
    return kind == DomainKind::binary || kind == DomainKind::decimal ||
           kind == DomainKind::integers || kind == DomainKind::quantized;
  }
  /// Whether a value has the same state in both.
  bool has_states_of(const ValueDomain& other) const {
    return kind == other.kind && exponent == other.exponent;
  }
  /// Whether kind and exponent can be of values of this type.
  bool fits(const ArrayInfo& info) const;
};

/// Translates the bits of scalars of one component to indices and back.
class ValueTranslator {
 public:
  ValueTranslator(const ArrayInfo& info, std::size_t component, const ValueDomain& domain);

  /// The index of a value (bits in the low bytes); nothing where the domain has none for it. The
  /// sign of a zero is lost where negative_zero is set.
  std::optional<std::int64_t> index(std::uint64_t bits) const;
  /// Bits of the value.
  std::uint64_t bits(std::int64_t index) const;

  /// The state that an index of another domain stands for here; any number, the same everywhere.
  double as_value(double state) const;    ///< state of this domain -> value
  double from_value(double value) const;  ///< value -> state of this domain

 private:
  double linear_value(std::int64_t index) const;

  ScalarType type_;
  ValueDomain domain_;
  double minimum_ = 0, step_ = 1, max_error_ = 0;
};

/// A value as a double: what as_value would give.
double scalar_as_double(ScalarType type, std::uint64_t bits);

/// Bits of -0.0.
constexpr std::uint64_t negative_zero(ScalarType type) {
  return type == ScalarType::float32 ? 0x80000000u : std::uint64_t{1} << 63;
}

// --- encoder: what the numbers of a component may be made of

/// How a group's values of one component are to be coded. Made by the encoder.
struct DomainPlan {
  ValueDomain domain;
  std::vector<std::int64_t> table;  ///< what occurs, ascending; empty: no ranks
};

/// How these values (bits of scalars) may be coded, the most likely plan first; never empty.
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
