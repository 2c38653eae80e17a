// Encoder only: which predictors and which domain to use.
//   choose_modes    chooses the modes of the classes of a tile, by trying them on some elements
//   ModeWatch       decides when modes are chosen again
//   estimate_plan   estimates the size of a group in a domain, from a sample of its elements
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/value_predictor.h"

namespace shm {

/// An element of a sample, with all data that a prediction needs.
struct ModeSample {
  std::array<double, kFeatures> state{};
  std::optional<std::int64_t> index;
  std::uint32_t known = 0, of_class = 0;
  bool has_partner = false;
  bool copied = false;   ///< true: a copy of an earlier element, which is not predicted
  double reference = 0;  ///< state of the element's reference
};
/// Samples of a tile or group.
struct ModeSamples {
  std::vector<ModeSample> samples;
  /// Features minus the features of the reference, for all samples; empty if there are no
  /// references
  std::vector<std::array<double, kFeatures>> differences;
};

/// Chooses modes for each class of these samples. `families`: by class. `modes`: by class; contains
/// the current modes on input. `matches`: true if modes may use matches and other components.
template <class Space>
void choose_modes(const Space& space, const ModeSamples& samples,
                  std::span<const std::uint16_t> families, bool matches,
                  std::vector<ClassModes>& modes);

/// Decides when modes are chosen again.
class ModeWatch {
 public:
  /// Returns true if modes must be chosen for the next tile, whose elements have these classes.
  /// With `hurries`, returns true only if a class is new, needs more bits than right after its last
  /// choice, or has had the same modes for several tiles.
  bool begin_tile(std::span<const std::uint16_t> classes, bool hurries);
  /// Records that coding an element of the tile needed `bits` bits.
  void note(std::uint32_t of_class, std::uint32_t bits) {
    records_[of_class].count += 1;
    records_[of_class].bits += bits;
  }

 private:
  struct Record {
    double count = 0, bits = 0;  // number of elements and of bits in the current tile

    // Bits per element just after the last choice of modes; negative: modes were never chosen
    double bits_then = -1;
    std::uint32_t tiles_since = 0;
  };
  bool does_worse(std::span<const std::uint32_t> count, std::size_t elements);

  std::vector<Record> records_;  // records of the classes, by class
};

// --- domains
//
// Rule: domain_candidates() proposes domains. A component uses the candidate with the smallest
// estimated size: the size of about a thousand elements spread over the group, plus the size of the
// table. Nothing is coded for the estimate. The elements are predicted with suitable modes, and the
// estimate adds up the lengths of the residuals, the entropy of these lengths, and the cost of
// marking second modes. Modes are chosen for the first candidate only, and also used for the
// remaining candidates.

/// A sample of the elements of a group, for one component.
struct DomainSample {
  ValueDomain domain;  ///< the domain of the states
  ModeSamples elements;
  std::vector<std::uint64_t> bits;    ///< values, by element
  std::vector<std::uint32_t> places;  ///< by element: its position in the group, ascending

  /// Returns true if the element at `place` in a group of `of` elements belongs to the sample. The
  /// sample has about a thousand elements that are spread without a period.
  static bool takes(std::size_t place, std::size_t of) {
    constexpr std::uint64_t kElements = 1024;
    const std::uint32_t turn = static_cast<std::uint32_t>(place) * 0x9e3779b1u;
    return turn * std::uint64_t{of} < kElements << 32;
  }
};

/// Estimated size of a sample in bits, without its copied elements.
struct DomainEstimate {
  double bits = 0;                     ///< estimated size of the sample
  std::vector<double> by_element;      ///< estimated size by element; 0 if copied
  std::vector<std::uint32_t> lengths;  ///< bit length of the residual, by element; 0 if copied
  std::vector<double> predicted;       ///< predicted value, by element; 0 if copied
};

/// Estimates the size of a sample under a plan. `families`: by class. `matches`: see
/// choose_modes(). `modes`: by class; if `modes` is empty, the function chooses modes and stores
/// them in it.
DomainEstimate estimate_plan(const ArrayInfo& info, std::size_t component, const DomainPlan& plan,
                             const DomainSample& sample, std::span<const std::uint16_t> families,
                             bool matches, std::vector<ClassModes>& modes);

// Costs of decisions in bits. They are computed from integers only, so that encoders make the same
// decisions with every C library.

/// Returns log2(n) in units of 2^-16, rounded down; 0 if n is 0.
constexpr std::uint32_t log2_steps(std::uint32_t n) {
  if (n == 0) return 0;
  const auto whole = static_cast<std::uint32_t>(std::bit_width(n)) - 1;
  // n / 2^whole in units of 2^-31: at least 1, less than 2
  std::uint64_t part = std::uint64_t{n} << (31 - whole);
  std::uint32_t steps = whole << 16;
  for (std::uint32_t bit = 1u << 15; bit != 0; bit >>= 1) {
    part = part * part >> 31;
    if (part >> 32 == 0) continue;
    part >>= 1;
    steps |= bit;
  }
  return steps;
}

/// Returns the cost in bits of an outcome that occurred `count` times in `all` decisions. Must
/// hold: count <= all < 2^32.
constexpr double bits_of_one(std::uint64_t count, std::uint64_t all) {
  if (count == 0) return 0.0;
  return static_cast<double>(log2_steps(static_cast<std::uint32_t>(all)) -
                             log2_steps(static_cast<std::uint32_t>(count))) /
         65536.0;
}

/// Returns the total entropy in bits of `count` binary decisions, of which `taken` were yes. Must
/// hold: taken <= count < 2^32.
constexpr double binary_entropy(std::uint64_t taken, std::uint64_t count) {
  const auto sum = [](std::uint64_t n) { return n * log2_steps(static_cast<std::uint32_t>(n)); };
  const std::uint64_t whole = sum(count), parts = sum(taken) + sum(count - taken);
  return whole > parts ? static_cast<double>(whole - parts) / 65536.0 : 0.0;
}

}  // namespace shm
