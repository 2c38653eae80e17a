// Encoder only.
//   choose_modes    with which predictors the classes of a tile are coded: it looks at elements of
//   the
//                   tile before any is coded
//   ModeWatch       when they are chosen anew
//   estimate_plan   what a group would take in a domain, by some of its elements
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "values/value_domain.h"
#include "values/value_predictor.h"

namespace shm {

/// An element as the encoder sees it.
struct ModeSample {
  std::array<double, kFeatures> state{};
  std::optional<std::int64_t> index;
  std::uint32_t known = 0, of_class = 0;
  bool has_partner = false;
  bool copied = false;   ///< not predicted at all
  double reference = 0;  ///< state of the reference
};
/// The elements of a tile.
struct ModeSamples {
  std::vector<ModeSample> samples;
  /// From the states of the reference; of all samples or of none.
  std::vector<std::array<double, kFeatures>> differences;
};

/// How each class of these elements is best predicted. `families`: by class. `modes`, by class: as
/// it is predicted now, on input. `matches`: whether modes may look at matches and other
/// components.
template <class Space>
void choose_modes(const Space& space, const ModeSamples& samples,
                  std::span<const std::uint16_t> families, bool matches,
                  std::vector<ClassModes>& modes);

/// Knows when to choose anew.
class ModeWatch {
 public:
  /// Before each tile, of elements of these classes: whether modes are to be chosen for it. If it
  /// `hurries`, only where a class is new, has done worse than when its modes were chosen, or has
  /// kept them for long.
  bool begin_tile(std::span<const std::uint16_t> classes, bool hurries);
  /// An element of the tile took so many bits.
  void note(std::uint32_t of_class, std::uint32_t bits) {
    records_[of_class].count += 1;
    records_[of_class].bits += bits;
  }

 private:
  struct Record {
    double count = 0, bits = 0;  // elements and bits in the tile at hand
    double bits_then = -1;       // an element, when the modes were chosen; negative: never
    std::uint32_t tiles_since = 0;
  };
  bool does_worse(std::span<const std::uint32_t> count, std::size_t elements);

  std::vector<Record> records_;  // by class
};

// --- domains
//
// The rule: of the domains that come into question (domain_candidates()) a component takes the one
// in which some thousand elements, spread over the group, would take the fewest bits, with the
// table where there is one. None of them is coded: they are predicted in the modes that suit them,
// and the lengths of what these miss, their entropy and the marks of second modes are counted.
// Modes are chosen in the first domain alone; they suit the others.

/// Some elements of a group as one component sees them.
struct DomainSample {
  ValueDomain domain;  ///< whose numbers the states are
  ModeSamples elements;
  std::vector<std::uint64_t> bits;    ///< values, by element
  std::vector<std::uint32_t> places;  ///< by element: which one of the group it is; they ascend

  /// Whether one element of a group of so many is taken: some thousand of them, spread over all
  /// without a period.
  static bool takes(std::size_t place, std::size_t of) {
    constexpr std::uint64_t kElements = 1024;
    const std::uint32_t turn = static_cast<std::uint32_t>(place) * 0x9e3779b1u;
    return turn * std::uint64_t{of} < kElements << 32;
  }
};

/// About the bits of the elements of a sample, without the ones that are copied.
struct DomainEstimate {
  double bits = 0;                     ///< in sum
  std::vector<double> by_element;      ///< of copied ones 0
  std::vector<std::uint32_t> lengths;  ///< of the residuals, by element; of copied ones 0
  std::vector<double> predicted;  ///< value that its class predicts, by element; of copied ones 0
};

/// Where the values are coded by such a plan. `families`: by class; `matches`: as in
/// choose_modes(); `modes`: by class, or empty: then they are chosen.
DomainEstimate estimate_plan(const ArrayInfo& info, std::size_t component, const DomainPlan& plan,
                             const DomainSample& sample, std::span<const std::uint16_t> families,
                             bool matches, std::vector<ClassModes>& modes);

// Bits that yes/no decisions take, from integers only: what an encoder decides by them is the same
// with every C library.

/// log2(n) in steps of 2^-16, rounded down; 0 for 0.
constexpr std::uint32_t log2_steps(std::uint32_t n) {
  if (n == 0) return 0;
  const auto whole = static_cast<std::uint32_t>(std::bit_width(n)) - 1;
  std::uint64_t part = std::uint64_t{n} << (31 - whole);  // 1 <= part / 2^31 < 2
  std::uint32_t steps = whole << 16;
  for (std::uint32_t bit = 1u << 15; bit != 0; bit >>= 1) {
    part = part * part >> 31;
    if (part >> 32 == 0) continue;
    part >>= 1;
    steps |= bit;
  }
  return steps;
}

/// Bits of a decision that came `count` times among `all`. Must hold: count <= all < 2^32.
constexpr double bits_of_one(std::uint64_t count, std::uint64_t all) {
  if (count == 0) return 0.0;
  return static_cast<double>(log2_steps(static_cast<std::uint32_t>(all)) -
                             log2_steps(static_cast<std::uint32_t>(count))) /
         65536.0;
}

/// Bits of `taken` yes among `count` decisions. Must hold: taken <= count < 2^32.
constexpr double binary_entropy(std::uint64_t taken, std::uint64_t count) {
  const auto sum = [](std::uint64_t n) { return n * log2_steps(static_cast<std::uint32_t>(n)); };
  const std::uint64_t whole = sum(count), parts = sum(taken) + sum(count - taken);
  return whole > parts ? static_cast<double>(whole - parts) / 65536.0 : 0.0;
}

}  // namespace shm
