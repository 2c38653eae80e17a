#include "codecs/weighted/weighted_encoder.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "codecs/shared/equal_components.h"
#include "codecs/shifts/difference_values.h"
#include "codecs/weighted/length_encoder.h"

namespace shm {
namespace {

/// Weights are fitted to one in kRowStep elements of a class, but to all elements of a class of at
/// most kWholeClass elements. Classes with fewer than kFewestRows elements get the usual weights.
constexpr std::uint32_t kRowStep = 8, kWholeClass = 512;
constexpr std::size_t kFewestRows = 24;
/// Number of times that weights are fitted. After the first time, rows with large errors count
/// less.
constexpr int kFits = 2;
/// Errors below the mean error divided by kSmallErrors count as small.
constexpr double kSmallErrors = 16;
/// Approximate number of bits of an entry in the list of classes, without weights.
constexpr double kBitsOfEntry = 12;
/// The domain of rounded values is used if at most one in kExceptionShare values is not in it.
constexpr std::size_t kExceptionShare = 16;
/// Matched values are tried if the values need more than kBitsToMatch bits each without them.
constexpr std::size_t kBitsToMatch = 4;
/// Values are matched if at least one in kMatchShare values is a matched value.
constexpr std::size_t kMatchShare = 16;

/// Largest number of unknowns: the weights of a class, or those of a history.
constexpr std::size_t kMostUnknowns =
    std::max<std::size_t>(kWeightedTerms + 1, WeightedHistory::kMostTerms);

/// The normal equations of a least-squares problem.
class NormalEquations {
 public:
  using Vector = std::array<double, kMostUnknowns>;

  explicit NormalEquations(std::size_t unknowns) : n_(unknowns) {}

  void add(const Vector& x, double target, double weight) {
    for (std::size_t i = 0; i < n_; ++i) {
      const double by = x[i] * weight;
      for (std::size_t j = 0; j <= i; ++j) a_[i][j] += by * x[j];
      b_[i] += by * target;
    }
  }
  /// Solves the equations with the decomposition L D L^T. An unknown that depends on those before
  /// it becomes 0.
  Vector solve() {
    constexpr double kTiny = 1e-9;
    Vector d{}, y{}, w{};
    for (std::size_t i = 0; i < n_; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        for (std::size_t k = 0; k < j; ++k) a_[i][j] -= a_[i][k] * a_[j][k] * d[k];
        a_[i][j] = d[j] > 0 ? a_[i][j] / d[j] : 0;
      }
      const double whole = a_[i][i];
      d[i] = whole;
      for (std::size_t k = 0; k < i; ++k) d[i] -= a_[i][k] * a_[i][k] * d[k];
      if (!(d[i] > whole * kTiny)) d[i] = 0;
      y[i] = b_[i];
      for (std::size_t k = 0; k < i; ++k) y[i] -= a_[i][k] * y[k];
    }
    for (std::size_t i = n_; i-- > 0;) {
      if (d[i] <= 0) continue;
      w[i] = y[i] / d[i];
      for (std::size_t k = i + 1; k < n_; ++k) w[i] -= a_[k][i] * w[k];
    }
    return w;
  }

 private:
  std::size_t n_;
  std::array<Vector, kMostUnknowns> a_{};
  Vector b_{};
};

double magnitude(double v) { return v < 0 ? -v : v; }

/// Fits the weights of terms to values.
class TermFit {
 public:
  using Vector = NormalEquations::Vector;

  /// `terms`: number of terms. `rows`: number of rows that will be added.
  TermFit(std::size_t terms, std::size_t rows) : terms_(terms) { rows_.reserve(rows); }
  /// Adds a row: its terms, and the value that their weighted sum predicts. Ignores a row that is
  /// not finite.
  void add(const Vector& x, double target) {
    double sum = target;
    for (std::size_t k = 0; k < terms_; ++k) sum += magnitude(x[k]);
    if (is_finite(sum)) rows_.push_back({x, target});
  }
  /// Fits the weights once more. After the first time, rows with large errors count less. Returns
  /// false if the weights are exact already.
  bool improve() {
    double mean = 0;
    std::vector<double> errors;
    if (has_weights_) {
      for (const Row& row : rows_) {
        double error = row.target;
        for (std::size_t k = 0; k < terms_; ++k) error -= weights_[k] * row.x[k];
        errors.push_back(magnitude(error));
        mean += errors.back();
      }
      mean /= static_cast<double>(rows_.size());
      if (!(mean > 0)) return false;
    }
    NormalEquations equations(terms_);
    for (std::size_t r = 0; r < rows_.size(); ++r)
      equations.add(rows_[r].x, rows_[r].target,
                    has_weights_ ? 1 / (errors[r] + mean / kSmallErrors) : 1.0);
    weights_ = equations.solve();
    has_weights_ = true;
    return true;
  }
  /// Returns a weight as a multiple of 1 / `unit`, of magnitude `most` or less.
  std::int64_t number(std::size_t term, std::int64_t unit, std::int64_t most) const {
    return std::clamp(nearest_integer(weights_[term] * static_cast<double>(unit)), -most, most);
  }

 private:
  struct Row {
    Vector x;
    double target;
  };
  std::size_t terms_;
  std::vector<Row> rows_;
  Vector weights_{};
  bool has_weights_ = false;
};

/// Returns the number of bits of an svarint.
double bits_of(std::int64_t number) { return 8 * (1 + bit_length(number) / 7); }

/// Returns true for one in kRowStep numbers, at irregular intervals.
bool is_in_sample(std::size_t number) {
  return static_cast<std::uint32_t>(number) * 0x9e3779b1u < 0xffffffffu / kRowStep;
}

}  // namespace

std::vector<std::byte> WeightedEncoder::encode(const TiledItems& elements,
                                               std::span<const std::byte> values,
                                               const ReferenceValues& reference) {
  classes_.find(elements, blocks_);
  if (may_have_history(reference))
    history_.find_neighbours(classes_, elements, components_[0].slots.size());
  ByteWriter out;
  out.put_varint(classes_.covered());
  for (std::size_t c = 0; c < components_.size(); ++c) {
    if (const auto source =
            equal_component(*info_, values.data(), stride(), classes_.covered(), c)) {
      put_copy(out, *source);
      copy_component(*source, c, elements);
    } else {
      encode_component(values_of(values, c), c, elements, reference, out);
    }
  }
  return std::move(out.bytes);
}

auto WeightedEncoder::values_of(std::span<const std::byte> values, std::size_t c) const -> Values {
  Values of;
  of.words.resize(classes_.covered());
  of.indices.resize(classes_.covered());
  load(values.data() + c * width_, stride(), width_, of.words);
  if (info_->quantization.lossy()) {
    of.domain.kind = DomainKind::quantized;
    const ValueTranslator translator(*info_, c, of.domain);
    for (std::size_t e = 0; e < of.words.size(); ++e) {
      const auto index = translator.index(of.words[e]);
      if (!index) of.exceptions.push_back(e);
      of.indices[e] = index.value_or(0);
    }
    if (of.exceptions.size() <= of.words.size() / kExceptionShare) return of;
    of.exceptions.clear();
    round_quantized(*info_, c, of.words);
    of.domain = {};
  } else {
    of.domain = evenly_spaced_domain(*info_, c, of.words);
  }
  with_translation(*info_, c, of.domain, [&](auto&& index_of, auto&&) {
    for (std::size_t e = 0; e < of.words.size(); ++e) of.indices[e] = index_of(of.words[e]);
  });
  return of;
}

void WeightedEncoder::encode_component(const Values& values, std::size_t c,
                                       const TiledItems& elements,
                                       const ReferenceValues& reference_values, ByteWriter& out) {
  std::vector<double> reference = reference_of(reference_values.values, values.domain, c);
  ByteWriter exceptions, history;
  exceptions.put_varint(values.exceptions.size());
  std::size_t next = 0;
  for (const std::size_t e : values.exceptions) {
    exceptions.put_varint(e - next);
    for (std::size_t b = 0; b < width_; ++b)
      exceptions.put_u8(static_cast<std::uint8_t>(values.words[e] >> 8 * b));
    next = e + 1;
  }
  with_space(c, values.domain, [&](const auto& space) {
    const StateOf state_of = [&](std::int64_t index) { return space.state(index); };
    const IndexOf index_of = [&](double prediction) { return space.index(prediction); };
    const auto choose = [&](std::span<const double> from) {
      return choose_weights(index_of, sample(state_of, values, c, elements, from), !from.empty());
    };
    ChosenWeights chosen = choose(reference);
    if (may_have_history(reference_values)) {
      begin_history(reference_values, values.domain, c, reference);
      std::vector<double> predicted = history_.predict(fit_history(state_of, values, history));
      ChosenWeights others = choose(predicted);
      if (others.bits + 8 * static_cast<double>(history.bytes.size()) < chosen.bits) {
        chosen = std::move(others);
        reference = std::move(predicted);
      } else {
        history.bytes.clear();
      }
    }
    weights_ = std::move(chosen.weights);
    std::uint32_t axis = MatchedValues::kNoAxis;
    const WeightedComponent before = components_[c];
    std::vector<std::byte> coded = encode_residuals(space, values, c, elements, reference, axis);
    if (8 * coded.size() > kBitsToMatch * values.words.size()) axis = choose_axis(values, elements);
    if (axis != MatchedValues::kNoAxis) {
      WeightedComponent after = std::exchange(components_[c], before);
      auto matched = encode_residuals(space, values, c, elements, reference, axis);
      if (matched.size() < coded.size()) {
        coded = std::move(matched);
      } else {
        axis = MatchedValues::kNoAxis;
        components_[c] = std::move(after);
      }
    }
    const bool has_history = !history.bytes.empty();
    out.put_u8(static_cast<std::uint8_t>(static_cast<unsigned>(values.domain.kind) | axis << 3 |
                                         (has_history ? kHistoryBit : 0u)));
    out.put_signed(values.domain.exponent);
    out.put_bytes(history.bytes);
    out.put_bytes(exceptions.bytes);
    out.put_bytes(chosen.bytes);
    out.put_bytes(coded);
  });
}

/// Encodes the residuals of a component with the current weights.
template <class Space>
std::vector<std::byte> WeightedEncoder::encode_residuals(const Space& space, const Values& values,
                                                         std::size_t c, const TiledItems& elements,
                                                         std::span<const double> reference,
                                                         std::uint32_t axis) {
  std::vector<LengthInContext> lengths;
  lengths.reserve(values.words.size());
  BitWriter bits;
  auto exception = values.exceptions.begin();
  matches_.begin(axis, values.words.size());
  walk(space, components_[c], elements, reference,
       [&](std::size_t e, std::int64_t predicted, std::uint32_t context, std::int64_t match) {
         if (exception != values.exceptions.end() && *exception == e) {
           ++exception;
           return Coded{};
         }
         const std::int64_t residual = minus(values.indices[e], predicted);
         const bool is_matched = residual != 0 && matches_.is_on() && match == values.indices[e];
         const std::uint32_t length = is_matched ? kMatchedLength : bit_length(residual);
         lengths.push_back({static_cast<std::uint8_t>(context), static_cast<std::uint8_t>(length)});
         if (is_matched) return Coded{true, 0};
         // The highest bit of the magnitude is not stored, because it is 1.
         const bool negative = residual < 0;
         const auto size = static_cast<std::uint64_t>(negative ? minus(0, residual) : residual);
         if (length > 0)
           bits.put((size ^ std::uint64_t{1} << (length - 1)) << 1 | (negative ? 1u : 0u), length);
         return Coded{false, residual};
       });
  ByteWriter out;
  put_lengths(out, lengths);
  const auto low = bits.finish();
  out.put_varint(low.size());
  out.put_bytes(low);
  return std::move(out.bytes);
}

/// Returns the axis along which most values are matched; kNoAxis if few are.
std::uint32_t WeightedEncoder::choose_axis(const Values& values, const TiledItems& elements) const {
  // First, counts repeated magnitudes among the values, in a table without chains.
  const bool is_float = !values.domain.is_linear();
  const std::size_t fewest = values.indices.size() / kMatchShare + 1;
  std::vector<std::int64_t> seen(std::bit_ceil(2 * values.indices.size()));
  const int shift = 64 - std::countr_zero(seen.size());
  std::size_t repeated = 0;
  std::int64_t last = 0;
  for (const std::int64_t index : values.indices) {
    const std::int64_t size = index < 0 ? negated_index(index, is_float) : index;
    const std::uint64_t hash = static_cast<std::uint64_t>(size) * 0x9e3779b97f4a7c15u >> shift;
    std::int64_t& entry = seen[static_cast<std::size_t>(hash)];
    if (entry == size && size != last) ++repeated;
    entry = last = size;
  }
  if (repeated < fewest) return MatchedValues::kNoAxis;

  std::uint32_t best = MatchedValues::kNoAxis;
  std::size_t most = fewest;
  std::vector<WeightedSlot> slots;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    slots.assign(components_[0].slots.size(), {});
    MatchedValues matches;
    matches.begin(axis, values.indices.size());
    std::size_t matched = 0;
    classes_.for_each(
        elements, [](const Neighbourhood&) {},
        [&](const Neighbourhood& item, std::uint32_t, std::size_t e) {
          const std::int64_t index = values.indices[e];
          const bool has_near = (item.known >> axis & 1) != 0;
          if (matches.find(item, slots, is_float) == index && has_near &&
              slots[item.at[axis]].index != index)
            ++matched;
          matches.remember(index);
          slots[item.self].index = index;
        });
    if (matched > most) {
      most = matched;
      best = axis;
    }
  }
  return best;
}

/// Returns the rows of the sample, by class.
auto WeightedEncoder::sample(const StateOf& state_of, const Values& values, std::size_t c,
                             const TiledItems& elements, std::span<const double> reference) const
    -> Sample {
  WeightedComponent component = components_[c];
  Sample rows(classes_.counts().size());
  std::vector<std::uint32_t> seen(rows.size());
  auto exception = values.exceptions.begin();
  classes_.for_each(
      elements, [&](const Neighbourhood& item) { component.skip(item); },
      [&](const Neighbourhood& item, std::uint32_t of_class, std::size_t e) {
        const double from = reference.empty() ? 0.0 : reference[e];
        if (exception != values.exceptions.end() && *exception == e) {
          ++exception;
          return component.set_state(item, component.last.state, 0, 0);
        }
        const double state = state_of(values.indices[e]) - from;
        if (classes_.counts()[of_class] <= kWholeClass || is_in_sample(seen[of_class]++)) {
          const std::uint32_t known = classes_.known()[of_class];
          Row& row = rows[of_class].emplace_back();
          row.target = state;
          row.reference = from;
          row.index = values.indices[e];
          row.x[0] = component.base(ClassWeights::zero(known), item);
          for_each_term(known,
                        [&](std::uint32_t k) { row.x[k + 1] = component.term(k, item, row.x[0]); });
        }
        component.set_state(item, state, 0, 0);
      });
  return rows;
}

/// Fits the weights of the history to a sample of the values. Writes and returns them.
std::vector<double> WeightedEncoder::fit_history(const StateOf& state_of, const Values& values,
                                                 ByteWriter& out) const {
  const bool uses_all = values.indices.size() <= kWholeClass;
  TermFit fit(history_.terms(), uses_all ? kWholeClass : values.indices.size() / kRowStep);
  NormalEquations::Vector x{};
  auto exception = values.exceptions.begin();
  for (std::size_t e = 0; e < values.indices.size(); ++e) {
    if (exception != values.exceptions.end() && *exception == e) {
      ++exception;
    } else if (uses_all || is_in_sample(e)) {
      std::ranges::copy(history_.terms_of(e), x.begin());
      fit.add(x, state_of(values.indices[e]) - history_.last(e));
    }
  }
  for (int n = 0; n < kFits; ++n)
    if (!fit.improve()) break;
  std::vector<double> weights;
  for (std::size_t k = 0; k < history_.terms(); ++k) {
    const std::int64_t number = fit.number(k, WeightedHistory::kUnit, WeightedHistory::kMostCoded);
    out.put_signed(number);
    weights.push_back(static_cast<double>(number) / WeightedHistory::kUnit);
  }
  return weights;
}

/// Chooses the weights of each class. With reference values, the scale of the base is fitted too.
/// Otherwise it is 1, so that constant values are predicted exactly. `index_of` converts a
/// prediction to an index.
auto WeightedEncoder::choose_weights(const IndexOf& index_of, const Sample& sample,
                                     bool has_reference) const -> ChosenWeights {
  struct Choice {
    double usual = 0, zero = 0;  // bits of the residuals with the weights that are not coded
    FittedWeights fitted;
  };
  std::vector<Choice> choices(sample.size());
  double usual = 0, zero = 0;
  for (std::size_t n = 0; n < sample.size(); ++n) {
    const std::uint32_t known = classes_.known()[n];
    const double share = static_cast<double>(classes_.counts()[n]) /
                         static_cast<double>(std::max<std::size_t>(sample[n].size(), 1));
    const BitsWith bits_with = [&](const ClassWeights& weights) {
      std::uint64_t bits = 0;
      for (const Row& row : sample[n])
        bits += bit_length(minus(row.index, index_of(row.reference + row.predict(weights))));
      return static_cast<double>(bits) * share;
    };
    Choice& it = choices[n];
    usual += it.usual = bits_with(ClassWeights::usual(known));
    it.zero = has_reference ? bits_with(ClassWeights::zero(known)) : it.usual;
    zero += it.zero;
    it.fitted = fit(sample[n], known, has_reference, std::min(it.usual, it.zero), bits_with);
  }

  // Most classes have the usual weights, or most have the weights 0. The others are listed.
  const bool is_zero = zero < usual;
  ByteWriter list;
  std::uint64_t listed = 0;
  std::size_t next = 0;
  ChosenWeights chosen;
  for (std::size_t n = 0; n < choices.size(); ++n) {
    const Choice& it = choices[n];
    const std::uint32_t known = classes_.known()[n];
    const double unlisted = is_zero ? it.zero : it.usual, other = is_zero ? it.usual : it.zero;
    const bool is_coded = it.fitted.bits + kBitsOfEntry < std::min(unlisted, other + kBitsOfEntry);
    const bool is_other = !is_coded && other + kBitsOfEntry < unlisted;
    chosen.weights.push_back(is_coded              ? it.fitted.weights
                             : is_zero != is_other ? ClassWeights::zero(known)
                                                   : ClassWeights::usual(known));
    chosen.bits += is_coded ? it.fitted.bits : is_other ? other : unlisted;
    if (!is_coded && !is_other) continue;
    chosen.bits += kBitsOfEntry;
    ++listed;
    list.put_varint((n - next) << 1 | (is_coded ? 1u : 0u));
    if (is_coded)
      for (const std::int64_t number : it.fitted.numbers) list.put_signed(number);
    next = n + 1;
  }
  ByteWriter out;
  out.put_varint(listed << 1 | (is_zero ? 1u : 0u));
  out.put_bytes(list.bytes);
  chosen.bytes = std::move(out.bytes);
  return chosen;
}

/// Fits weights to the rows of a class. Returns those with the fewest bits: with bits_with(weights)
/// bits of residuals, and the bits of the weights. If none has fewer than `least` bits, the number
/// of bits in the result is `least`.
auto WeightedEncoder::fit(std::span<const Row> rows, std::uint32_t known, bool has_reference,
                          double least, const BitsWith& bits_with) -> FittedWeights {
  FittedWeights best{least, {}, {}};
  if (rows.size() < kFewestRows) return best;
  std::vector<std::uint32_t> unknowns;  // indices in Row::x
  if (has_reference) unknowns.push_back(0);
  for_each_term(known, [&](std::uint32_t k) { unknowns.push_back(k + 1); });
  TermFit fit(unknowns.size(), rows.size());
  for (const Row& row : rows) {
    NormalEquations::Vector x{};
    for (std::size_t i = 0; i < unknowns.size(); ++i) x[i] = row.x[unknowns[i]];
    fit.add(x, has_reference ? row.target : row.target - row.x[0]);
  }
  for (int n = 0; n < kFits && best.bits > 0 && fit.improve(); ++n) {
    FittedWeights fitted{0, ClassWeights::zero(known), {}};
    fitted.weights.scale = 1;
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      const std::int64_t number = fit.number(i, kWeightUnit, kMostCodedWeight);
      fitted.numbers.push_back(number);
      fitted.bits += bits_of(number);
      const double weight = static_cast<double>(number) / kWeightUnit;
      if (unknowns[i] == 0)
        fitted.weights.scale = weight;
      else if (number != 0)
        fitted.weights.add(unknowns[i] - 1, weight);
    }
    fitted.bits += bits_with(fitted.weights);
    if (fitted.bits < best.bits) best = std::move(fitted);
  }
  return best;
}

}  // namespace shm
