// Models of numbers, and of choices among a few symbols. The models consist of adaptive bits. Every
// call has the form `code_x(coder, model, value)`. If the coder is a RangeEncoder, the call encodes
// `value`. If the coder is a RangeDecoder, the call ignores `value`. In both cases the call returns
// the coded value.
// spec: "Models"
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "entropy/range_coder.h"

namespace shm {

/// Model of a symbol of kBits bits. The symbol is coded as a path through a binary tree, beginning
/// with the highest bit.
template <int kBits, class Bit = AdaptiveBit>
struct TreeModel {
  std::array<Bit, std::size_t{1} << kBits> nodes;  // node 0 is unused
};
template <class Coder, int kBits, class Bit>
std::uint32_t code_tree(Coder& coder, TreeModel<kBits, Bit>& model, std::uint32_t value) {
  std::uint32_t node = 1;
  for (int i = kBits - 1; i >= 0; --i)
    node = node << 1 | static_cast<std::uint32_t>(coder.bit(model.nodes[node], value >> i & 1));
  return node - (1u << kBits);
}

/// Model of a non-negative integer. The bit length K (0..64) is coded first, then the bits below
/// the leading 1 bit. Each bit has a model that depends on its position. This suits numbers that
/// repeat exactly.
///   value   0   1   2..3   4..7   8..15  ...
///   K       0   1     2      3      4
template <class Bit>
struct NumberModelOf {
  Bit zero;
  TreeModel<6, Bit> length;  // model of K - 1, where K is the bit length
  // Models of the two bits after the leading 1 bit; the first index is the bit length K minus 1.
  std::array<std::array<Bit, 4>, 64> first;
  std::array<Bit, 64 * 63 / 2> rest;  // models of the further bits, by bit length K and position of
                                      // the bit

  /// Returns the model of a bit in a number whose bit length is k. `left` is the number of bits
  /// below this bit. Precondition: left < k - 1.
  Bit& rest_bit(int k, int left) {
    return rest[static_cast<std::size_t>((k - 1) * (k - 2) / 2 + left)];
  }
};
using NumberModel = NumberModelOf<AdaptiveBit>;
/// Model of a non-negative integer. It differs from NumberModelOf in one point: only the first two
/// bits after the leading 1 bit are modelled; the bits after them are coded without a model. This
/// suits measured values. The model is small, so that many contexts can have one.
template <class Bit>
struct ResidualModelOf {
  Bit zero;
  TreeModel<6, Bit> length;
  std::array<std::array<Bit, 4>, 64> first;
};
using ResidualModel = ResidualModelOf<AdaptiveBit>;
/// Model of a non-negative integer for contexts in which few numbers are coded. It needs a sixth of
/// the memory of NumberModel, since the models of the low bits depend only on the position of the
/// bit and not on the bit length.
struct CompactNumberModel {
  AdaptiveBit zero;
  TreeModel<6> length;  // model of K - 1, where K is the bit length, as in NumberModel
  // Models of the two bits after the leading 1 bit, as in NumberModel.
  std::array<std::array<AdaptiveBit, 4>, 64> first;
  // Models of the further bits. The index is the number of bits below the bit.
  std::array<AdaptiveBit, 64> rest;
  AdaptiveBit& rest_bit(int, int left) { return rest[static_cast<std::size_t>(left)]; }
};

template <class Coder, class Model>
std::uint64_t code_number(Coder& coder, Model& model, std::uint64_t value) {
  const auto length = static_cast<int>(std::bit_width(value));
  if (coder.bit(model.zero, length == 0)) return 0;
  const int k = static_cast<int>(
                    code_tree(coder, model.length, static_cast<std::uint32_t>(length - 1) & 63)) +
                1;
  std::uint64_t result = 1;
  int left = k - 1;
  std::uint32_t node = 1;
  for (int i = 0; i < 2 && left > 0; ++i) {
    --left;
    const bool one =
        coder.bit(model.first[static_cast<std::size_t>(k - 1)][node], value >> left & 1);
    node = node << 1 | static_cast<std::uint32_t>(one);
    result = result << 1 | static_cast<std::uint64_t>(one);
  }
  if constexpr (requires { model.rest; }) {
    while (left > 0) {
      --left;
      const bool one = coder.bit(model.rest_bit(k, left), value >> left & 1);
      result = result << 1 | static_cast<std::uint64_t>(one);
    }
  } else if (left > 0) {
    const std::uint64_t low = value & ((std::uint64_t{1} << left) - 1);
    result = result << left | coder.raw(low, left);
  }
  return result;
}

/// Model of a bit count (0..64) that is probably close to a guess. It codes whether the count
/// equals the guess. If not, it codes whether the count is above or below the guess, and how far
/// away it is. If the guess is good, few decisions are needed.
struct NearModel {
  AdaptiveBit same, above;
  std::array<AdaptiveBit, 16> higher,
      lower;  // models of the decision whether the count is still farther away from the guess
};
template <class Coder>
std::uint32_t code_near(Coder& coder, NearModel& model, std::uint32_t guess, std::uint32_t value) {
  if (coder.bit(model.same, value == guess)) return guess;
  const bool above = guess == 0 || (guess < 64 && coder.bit(model.above, value > guess));
  const std::uint32_t most = above ? 64 - guess : guess;
  const std::uint32_t wanted = above ? value - guess : guess - value;
  auto& farther = above ? model.higher : model.lower;
  std::uint32_t by = 1;
  while (by < most && coder.bit(farther[std::min(by - 1, 15u)], wanted > by)) ++by;
  return above ? guess + by : guess - by;
}

/// Model of a signed integer. The magnitude is coded first, then the sign. The model of the sign
/// depends on the bit length of the magnitude.
template <class Magnitude>
struct SignedModel {
  Magnitude magnitude;
  std::array<decltype(Magnitude::zero), 65> negative;
};
template <class Coder, class Magnitude>
std::int64_t code_signed(Coder& coder, SignedModel<Magnitude>& model, std::int64_t value) {
  const auto bits = static_cast<std::uint64_t>(value);
  const std::uint64_t size = code_number(coder, model.magnitude, value < 0 ? 0 - bits : bits);
  if (size == 0) return 0;
  const bool negative =
      coder.bit(model.negative[static_cast<std::size_t>(std::bit_width(size))], value < 0);
  return static_cast<std::int64_t>(negative ? 0 - size : size);
}

/// Model of an index among `count` candidates. For each candidate, a decision codes whether it is
/// the right one. The last candidate needs no decision. If there are more candidates than bits in
/// the model, the remaining candidates share the last bit. Precondition: index < count.
template <std::size_t kSize, class Bit = AdaptiveBit>
struct ChoiceModel {
  std::array<Bit, kSize> yes;
};
template <class Coder, std::size_t kSize, class Bit>
std::uint32_t code_choice(Coder& coder, ChoiceModel<kSize, Bit>& model, std::uint32_t count,
                          std::uint32_t index) {
  for (std::uint32_t i = 0; i + 1 < count; ++i)
    if (coder.bit(model.yes[i < kSize ? i : kSize - 1], i == index)) return i;
  return count - 1;
}

// A model that is created when it is first used, so that a file needs memory only for the models
// that it uses. A copy of the object copies the model.

template <class Model>
class LazyModel {
 public:
  Model& get() {
    if (held_.empty()) held_.emplace_back();
    return held_.front();
  }

 private:
  std::vector<Model> held_;  // contains the model after its creation; empty before
};

/// Models for up to 65535 contexts, one for each context. A model is created when it is first used.
template <class Model>
class LazyModels {
 public:
  Model& of(std::uint32_t context) {
    if (context >= numbers_.size()) numbers_.resize(context + 1);
    std::uint16_t& number = numbers_[context];
    if (number == 0) {
      held_.emplace_back();
      number = static_cast<std::uint16_t>(held_.size());
    }
    return held_[number - 1u];
  }

 private:
  // For each context: index in held_ of its model, plus 1; 0 if the model has not been created yet.
  std::vector<std::uint16_t> numbers_;
  std::vector<Model> held_;
};

}  // namespace shm
