// Chooses the modes with which the classes of a tile are predicted.
//   look_ahead      computes the inputs of predictions before the values are coded
//   choose_modes    chooses modes by trying them on some elements
//   ModeWatch       decides when modes are chosen again
//   TilePlanner     plans how one component of a tile is coded; uses all of the above
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/column_coder.h"
#include "codecs/surface/values/column_state.h"
#include "codecs/surface/values/value_predictor.h"

namespace shm {

/// Computes the data from which the value of element `i` of a tile is predicted. Then stores the
/// state of the value, so that the next element can be processed. `known`: bit mask of the
/// neighbours that may be used (bits of Neighbourhood::known). `bits`: the bits of the value.
/// `differences`: null if the component has no reference values.
template <class Space>
void look_ahead(ColumnState& state, const Space& space, std::uint32_t known, const ColumnTile& tile,
                std::size_t i, std::uint64_t bits, ElementInputs& inputs,
                std::array<double, kFeatures>* differences) {
  const Neighbourhood& item = tile.items[i];
  TileElement element{tile, i};
  state.find_matches(element);
  inputs.known = item.traits(known);
  inputs.of_class = element.of_class();
  if (state.has_reference()) state.find_partner(element, tile.reference[i]);
  inputs.has_partner = element.partner.is;
  state.features(element, inputs.known, inputs.state);
  const auto at = [&](std::uint32_t feature) { return inputs.state[feature]; };
  const double lattice = Predictor(inputs.known, at).lattice();
  inputs.copied = element.back() > 0;
  inputs.index = inputs.copied ? std::nullopt : index_in(space, state.translator(), bits);
  const double value = inputs.copied  ? state_of_copy(space, state, bits, lattice)
                       : inputs.index ? state_of(space, *inputs.index, lattice)
                                      : substitute(space, lattice);
  if (state.has_reference()) {
    inputs.reference = state.reference_state(tile.reference[i]);
    for (std::uint32_t f = 0; f < kFeatures; ++f)
      if (f >= kFLast || (inputs.known >> f & 1) != 0)
        (*differences)[f] = inputs.state[f] - state.reference_feature(item, f, inputs.reference);
    (*differences)[kFPartner] = element.partner.state - element.partner.then;
    state.keep_reference(item, inputs.reference);
  }
  state.keep(element, value, lattice);
}

/// Chooses the modes of each class of these elements. `families`: for each class, the number of its
/// family (a group of similar classes). `modes`: the modes of each class; on input, the current
/// modes. `matches`: true if modes may use matches and other components.
template <class Space>
void choose_modes(const Space& space, const InputsOfElements& elements,
                  std::span<const std::uint16_t> families, bool matches,
                  std::vector<ClassModes>& modes);

/// Decides when modes are chosen again.
class ModeWatch {
 public:
  /// Returns true if modes must be chosen for the next tile. `classes`: the classes of the tile's
  /// elements. `hurries`: if false, modes are chosen for every tile. If true, they are chosen only
  /// if a class is new, needs more bits than just after its modes were chosen, or has had the same
  /// modes for several tiles.
  bool begin_tile(std::span<const std::uint16_t> classes, bool hurries);
  /// Returns the counts of residuals in the current tile, by class. The coder updates these counts.
  std::span<CodedResiduals> coded() { return coded_; }

 private:
  struct Record {
    // Bits per element just after modes were most recently chosen; negative if modes have not been
    // chosen yet
    double bits_then = -1;
    std::uint32_t tiles_since = 0;
  };
  bool does_worse(std::span<const std::uint32_t> count, std::size_t elements);

  std::vector<Record> records_;  // by class
  std::vector<CodedResiduals> coded_;
};

/// Plans how one component of a tile is coded. All plans use the same memory.
class TilePlanner {
 public:
  /// Returns the plan for a tile. Call it after component.begin_tile(tile). `bits`: the bits of the
  /// values. `watch`: decides whether modes are chosen or kept; if it is null, modes are chosen.
  /// `hurries`: see ModeWatch::begin_tile(). If modes are chosen, the call also updates the states
  /// of the component, as coding the tile would. The plan is valid until the next call.
  TilePlan plan(ComponentCoder<SplitEncoder>& component, const ColumnTile& tile,
                std::span<const std::uint64_t> bits, ModeWatch* watch, bool hurries);

 private:
  InputsOfElements inputs_;
  std::vector<ClassModes> modes_;
};

// Costs of decisions in bits. All computations use integers, so that encoders make the same
// decisions with every C library.

/// Returns log2(n) in units of 2^-16, rounded down; 0 if n is 0.
constexpr std::uint32_t log2_steps(std::uint32_t n) {
  if (n == 0) return 0;
  const auto whole = static_cast<std::uint32_t>(std::bit_width(n)) - 1;
  // n / 2^whole in units of 2^-31. The quotient is at least 1 and less than 2
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

/// Returns the cost in bits of coding an outcome once, if this outcome occurs `count` times among
/// `all` decisions. Precondition: count <= all < 2^32.
constexpr double bits_of_one(std::uint64_t count, std::uint64_t all) {
  if (count == 0) return 0.0;
  return static_cast<double>(log2_steps(static_cast<std::uint32_t>(all)) -
                             log2_steps(static_cast<std::uint32_t>(count))) /
         65536.0;
}

/// Returns the total entropy in bits of `count` binary decisions, if the answer was yes in `taken`
/// of them. Precondition: taken <= count < 2^32.
constexpr double binary_entropy(std::uint64_t taken, std::uint64_t count) {
  const auto sum = [](std::uint64_t n) { return n * log2_steps(static_cast<std::uint32_t>(n)); };
  const std::uint64_t whole = sum(count), parts = sum(taken) + sum(count - taken);
  return whole > parts ? static_cast<double>(whole - parts) / 65536.0 : 0.0;
}

}  // namespace shm
