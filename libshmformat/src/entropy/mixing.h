// Mixing: computes the probability of a decision as a mix of several predictions, because no single
// prediction is the best in all situations.
//
//   MixedBit     a decision in one context: an AdaptiveBit, and the most recent decisions
//   about()      describes the next decisions by a question and by clues. A clue adds details that
//                contexts do not include. The coder also stores the path of the decisions since
//                this call, so that each bit of a number or a tree has separate predictions.
//   predictions  AdaptiveBits: one for the question and the history, and one for each clue. The
//                latter are looked up by a hash of the clue and the path.
//   mix          the weighted sum of stretch(p) = ln(p / (1 - p)) over all predictions p, converted
//                back to a probability. Each question has separate weights. Every decision changes
//                the weights so that better predictions get larger weights.
//
// The coder uses only integers, and its results do not depend on addresses or memory layout.
// Therefore the results are the same on all machines.
// spec: "Mixing"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "entropy/range_coder.h"

namespace shm {

/// A decision in one context. MixingCoder codes it.
struct MixedBit {
  AdaptiveBit adaptive;
  // A leading 1 bit, followed by the most recent decisions. The newest decision is the lowest bit.
  std::uint8_t history = 1;
};

namespace mixing {

inline constexpr std::uint32_t kHistoryBits = 6;
inline constexpr std::uint32_t kMaxClues = 5;
// Number of depths that have separate weights. The depth of a decision is its position in the path.
inline constexpr std::uint32_t kDepths = 4;
// Binary logarithm of the number of predictions that are stored for clues.
inline constexpr std::uint32_t kTableBits = 16;
// Limit on the decision counts of the predictions for clues. The limit is low, so that these
// predictions adapt fast.
inline constexpr std::uint32_t kClueLimit = 30;
inline constexpr std::int32_t kStretchLimit = 2839;  // largest value of stretch(): 256 ln 65535
inline constexpr std::int32_t kBias = 256;           // constant input of the weighted sum
inline constexpr std::int32_t kOne = 1 << 16;        // fixed-point number for a weight of 1
inline constexpr std::int32_t kMaxWeight = 16 * kOne;

/// Table of squash(x) = 65536 / (1 + e^(-x / 256)) for x = 0..kStretchLimit.
inline constexpr auto kSquash = [] {
  std::array<std::uint16_t, kStretchLimit + 1> table{};
  std::uint64_t power = std::uint64_t{1} << 40;  // e^(-x / 256) with 40 fractional bits
  for (auto& entry : table) {
    const std::uint64_t below = (std::uint64_t{1} << 40) + power;
    const std::uint64_t p = ((std::uint64_t{1} << 56) + below / 2) / below;
    entry = static_cast<std::uint16_t>(p > 65535 ? 65535 : p);
    power = power * 16711808 >>
            24;  // multiply by e^(-1 / 256), given as a fixed-point number with 24 fractional bits
  }
  return table;
}();
/// Returns the probability squash(x) in units of 1/65536. Precondition: -kStretchLimit <= x <=
/// kStretchLimit.
constexpr std::uint32_t squash(std::int32_t x) {
  return x >= 0 ? kSquash[static_cast<std::size_t>(x)]
                : 65536u - kSquash[static_cast<std::size_t>(-x)];
}

/// Table for stretch(). For each q below kNear, and for every 16th q from kNear on, it contains the
/// largest x with squash(x) <= 65536 - q.
struct StretchTable {
  static constexpr std::uint32_t kNear = 2048;
  std::array<std::int16_t, kNear> near{};
  std::array<std::int16_t, 32768 / 16 + 1> far{};
};
inline constexpr StretchTable kStretch = [] {
  StretchTable table;
  std::int32_t x = kStretchLimit;
  const auto find = [&](std::uint32_t q) {
    while (kSquash[static_cast<std::size_t>(x)] > 65536 - q) --x;
    return static_cast<std::int16_t>(x);
  };
  for (std::uint32_t q = 1; q < StretchTable::kNear; ++q) table.near[q] = find(q);
  for (std::uint32_t q = StretchTable::kNear / 16; q < table.far.size(); ++q)
    table.far[q] = find(q * 16);
  return table;
}();
/// Returns about 256 ln(p / (65536 - p)). Precondition: 0 < p < 65536.
constexpr std::int32_t stretch(std::uint32_t p) {
  const std::uint32_t q = p < 32768 ? p : 65536 - p;
  const std::int32_t x = q < StretchTable::kNear ? kStretch.near[q] : kStretch.far[q / 16];
  return p < 32768 ? -x : x;
}

/// Learning rate of the weights. The index is the number of decisions so far; the rate is high at
/// first.
inline constexpr auto kRate = [] {
  std::array<std::uint8_t, 160> rate{};
  for (std::uint32_t n = 0; n < rate.size(); ++n)
    rate[n] = static_cast<std::uint8_t>(std::max(12u, 2048 / (n + 16)));
  return rate;
}();

constexpr std::uint32_t hash(std::uint32_t h, std::uint32_t value) {
  h = (h ^ value) * 0x9e3779b1u;
  return h ^ h >> 15;
}

}  // namespace mixing

/// Returns a clue: a 32-bit hash that combines several numbers.
template <class... Numbers>
constexpr std::uint32_t clue(Numbers... numbers) {
  std::uint32_t h = 0;
  ((h = mixing::hash(h, static_cast<std::uint32_t>(numbers) + 1)), ...);
  return h;
}

/// Codes MixedBits with an engine. If the engine is a RangeEncoder, decisions are written to it; if
/// it is a RangeDecoder, decisions are read from it. use() may replace the engine at any time.
template <class Engine>
class MixingCoder {
 public:
  static constexpr bool kDecodes = Engine::kDecodes;
  static constexpr bool kMixes = true;
  using Bit = MixedBit;

  explicit MixingCoder(std::uint32_t questions)
      : weights_(questions * mixing::kDepths),
        by_history_(questions << (mixing::kHistoryBits + 1)),
        by_clue_(std::size_t{1} << mixing::kTableBits),
        checks_(by_clue_.size()) {}

  /// Sets the engine. The engine must stay valid as long as decisions are coded with it. Call this
  /// function before coding.
  void use(Engine& engine) { engine_ = &engine; }
  /// Returns the engine, with which decisions can be coded without mixing. Precondition: use() has
  /// been called.
  Engine& engine() { return *engine_; }

  /// Describes the next decisions by a question, which selects the weights, and by up to kMaxClues
  /// clues, which select predictions.
  template <class... Clues>
  void about(std::uint32_t question, Clues... clues) {
    static_assert(sizeof...(Clues) <= mixing::kMaxClues);
    question_ = question;
    path_ = 1;
    depth_ = 0;
    clue_count_ = 0;
    ((clues_[clue_count_] = mixing::hash(question * mixing::kMaxClues + clue_count_ + 1, clues),
      ++clue_count_),
     ...);
  }

  bool bit(MixedBit& model, bool value = false);
  std::uint64_t raw(std::uint64_t value, int count) { return engine_->raw(value, count); }

 private:
  static constexpr std::size_t kInputs = 3 + mixing::kMaxClues;
  struct Weights {
    std::array<std::int32_t, kInputs> of = [] {
      std::array<std::int32_t, kInputs> first{};
      first.fill(3 * mixing::kOne / 8);
      first[0] = 5 * mixing::kOne / 8;
      first[2] = 0;
      return first;
    }();
    std::uint32_t count = 0;
  };

  /// Returns the prediction with this hash. It is in one of two slots of the table. If neither slot
  /// contains it, a new prediction takes the place of the prediction with the smaller count.
  AdaptiveBit& find(std::uint32_t hash) {
    std::uint32_t slot = hash >> (32 - mixing::kTableBits);
    const auto check = static_cast<std::uint8_t>(hash);
    if (checks_[slot] == check) return by_clue_[slot];
    if (checks_[slot ^ 1] == check) return by_clue_[slot ^ 1];
    if (by_clue_[slot ^ 1].count() < by_clue_[slot].count()) slot ^= 1;
    checks_[slot] = check;
    return by_clue_[slot] = AdaptiveBit();
  }

  Engine* engine_ = nullptr;
  std::uint32_t question_ = 0, path_ = 1, depth_ = 0, clue_count_ = 0;
  std::array<std::uint32_t, mixing::kMaxClues> clues_{};
  std::vector<Weights> weights_;         // weights by question and depth
  std::vector<AdaptiveBit> by_history_;  // predictions by question and history
  std::vector<AdaptiveBit> by_clue_;
  std::vector<std::uint8_t> checks_;  // for each entry of by_clue_: the low bits of its hash
};

template <class Engine>
bool MixingCoder<Engine>::bit(MixedBit& model, bool value) {
  using namespace mixing;
  std::array<std::int32_t, kInputs> in{};
  AdaptiveBit& by_history = by_history_[question_ << (kHistoryBits + 1) | model.history];
  std::array<AdaptiveBit*, kMaxClues> by_clue{};
  in[0] = stretch(model.adaptive.probability_of_one());
  in[1] = stretch(by_history.probability_of_one());
  in[2] = kBias;
  for (std::uint32_t i = 0; i < clue_count_; ++i) {
    by_clue[i] = &find(hash(clues_[i], path_));
    in[3 + i] = stretch(by_clue[i]->probability_of_one());
  }

  Weights& weights = weights_[question_ * kDepths + std::min(depth_, kDepths - 1)];
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < kInputs; ++i) sum += std::int64_t{weights.of[i]} * in[i];
  const std::uint32_t p = squash(static_cast<std::int32_t>(
      std::clamp<std::int64_t>(sum >> 16, -kStretchLimit, kStretchLimit)));
  value = engine_->decide(p, value);

  const std::int32_t error = (value ? 65535 : 0) - static_cast<std::int32_t>(p);
  const std::int64_t step = std::int64_t{error} * kRate[weights.count];
  if (weights.count + 1 < kRate.size()) ++weights.count;
  for (std::size_t i = 0; i < kInputs; ++i) {
    const auto moved = weights.of[i] + static_cast<std::int32_t>((in[i] * step + (1 << 17)) >> 18);
    weights.of[i] = std::clamp(moved, -kMaxWeight, kMaxWeight);
  }
  model.adaptive.update(value);
  by_history.update(value);
  for (std::uint32_t i = 0; i < clue_count_; ++i) by_clue[i]->update(value, kClueLimit);
  const std::uint32_t history = model.history * 2u + (value ? 1 : 0);
  constexpr std::uint32_t kLead = 1u << kHistoryBits;
  model.history =
      static_cast<std::uint8_t>(history < 2 * kLead ? history : (history & (kLead - 1)) | kLead);
  path_ = path_ * 2 + (value ? 1 : 0);
  ++depth_;
  return value;
}

}  // namespace shm
