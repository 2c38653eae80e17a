#include "codecs/patterns/term_column.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "base/number_map.h"
#include "codecs/patterns/byte_planes.h"
#include "codecs/patterns/float_values.h"
#include "codecs/patterns/linear_indices.h"
#include "codecs/shared/equal_components.h"
#include "codecs/shared/shuffled_zstd.h"
#include "codecs/shifts/difference_values.h"

namespace shm {
namespace {

constexpr int kShuffledZstdLevel = 1;
/// Sampling interval: predictors are compared on every kSampleStep-th element.
constexpr std::size_t kSampleStep = 8;
/// Sample sizes in values: kDomainSamples for the choice of a domain, kRepeatSamples for counting
/// repeated values. The encoder tries a table of values if more than one in kRepeatShare sampled
/// values repeats an earlier value.
constexpr std::size_t kDomainSamples = 512;
constexpr std::size_t kRepeatSamples = 2048, kRepeatShare = 8;
/// The encoder tries a table only if there are at least kTableCount values, and if each residual
/// without a table needs at least kTableBits bits.
constexpr std::size_t kTableCount = 16;
constexpr std::uint64_t kTableBits = 8;

/// Maximum number of bytes to reserve for planes before the planes are unpacked.
constexpr std::uint64_t kMostReserved = std::uint64_t{4} << 20;

// Layout of the first byte of a component: the low bits (kKinds) contain the kind of the domain,
// the bits from kPredictorShift on contain the predictor, and kTableBit is set if the component has
// a table.
constexpr std::uint8_t kKinds = 7, kPredictorShift = 3, kTableBit = 0x40;

std::uint64_t gap(std::int64_t above, std::int64_t below) {
  return static_cast<std::uint64_t>(above) - static_cast<std::uint64_t>(below);
}

std::uint64_t table_bits(std::span<const std::int64_t> table) {
  std::uint64_t bits = 64;
  for (std::size_t i = 1; i < table.size(); ++i)
    bits += static_cast<std::uint64_t>(std::bit_width(gap(table[i], table[i - 1])));
  return bits;
}

std::uint64_t residual_bits(std::span<const std::uint64_t> residuals) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < residuals.size(); i += kSampleStep)
    bits += static_cast<std::uint64_t>(std::bit_width(residuals[i]));
  return bits * kSampleStep;
}

/// Returns the state that belongs to an index. Later values are predicted from states. If the state
/// would be a NaN, returns 0, since some machines do not preserve the bits of a NaN.
template <class Differences>
std::uint64_t state_of(const Differences& differences, std::int64_t index) {
  const std::uint64_t state = differences.remember(index);
  if constexpr (std::is_same_v<decltype(differences.sum_of(0)), double>)
    if (std::isnan(std::bit_cast<double>(state))) return 0;
  return state;
}

/// Reads words of `width` bytes that are stored as byte planes. `distance`: number of bytes from
/// the beginning of a plane to the beginning of the next plane.
void get_words(const std::byte* planes, std::size_t distance, std::uint32_t width,
               std::span<std::uint64_t> words) {
  std::uint64_t* const to = words.data();
  const std::size_t count = words.size();
  std::fill_n(to, count, 0);
  // Process two planes per pass, which halves the number of passes over `words`
  for (std::uint32_t b = 0; b < width; b += 2) {
    const std::byte* const low = planes + b * distance;
    const std::byte* const high = b + 1 < width ? low + distance : nullptr;
    if (high == nullptr)
      for (std::size_t e = 0; e < count; ++e)
        to[e] |= std::to_integer<std::uint64_t>(low[e]) << 8 * b;
    else
      for (std::size_t e = 0; e < count; ++e)
        to[e] |=
            (std::to_integer<std::uint64_t>(low[e]) | std::to_integer<std::uint64_t>(high[e]) << 8)
            << 8 * b;
  }
}

/// Returns the rank of `index`: the number of table entries that are less than `index`.
std::uint64_t rank_of(std::span<const std::int64_t> table, std::int64_t index) {
  return static_cast<std::uint64_t>(std::lower_bound(table.begin(), table.end(), index) -
                                    table.begin());
}

/// Returns the distinct values in `indices`; returns nothing if there are more than `most`.
std::vector<std::int64_t> distinct(std::span<const std::int64_t> indices, std::size_t most) {
  const Scatter place_of;
  std::vector<std::int64_t> found;
  // Hash table with open addressing. Each entry is a position in `found` plus 1, or 0 if the entry
  // is free.
  std::vector<std::uint32_t> table(std::bit_ceil(std::clamp<std::size_t>(2 * most, 64, 16384)));
  const auto place = [&](std::int64_t index) -> std::uint32_t& {
    const std::size_t mask = table.size() - 1;
    std::size_t position =
        static_cast<std::size_t>(place_of(static_cast<std::uint64_t>(index))) & mask;
    while (table[position] != 0 && found[table[position] - 1] != index)
      position = (position + 1) & mask;
    return table[position];
  };
  for (const std::int64_t index : indices) {
    std::uint32_t& entry = place(index);
    if (entry != 0) continue;
    if (found.size() == most) return {};
    found.push_back(index);
    entry = static_cast<std::uint32_t>(found.size());
    if (2 * found.size() < table.size()) continue;
    table.assign(2 * table.size(), 0);
    for (std::uint32_t i = 0; i < found.size(); ++i) place(found[i]) = i + 1;
  }
  return found;
}

/// Returns true if many values in a sample of `indices` are repetitions.
bool values_repeat(std::span<const std::int64_t> indices) {
  if (indices.size() < kTableCount) return false;
  const std::size_t step = std::max<std::size_t>(indices.size() / kRepeatSamples, 1);
  std::vector<std::int64_t> sample;
  for (std::size_t i = 0; i < indices.size(); i += step) sample.push_back(indices[i]);
  const std::size_t different = distinct(sample, sample.size()).size();
  return (sample.size() - different) * kRepeatShare > sample.size();
}

/// Returns the distinct values in `indices` in ascending order. Returns nothing if there are too
/// many distinct values.
std::vector<std::int64_t> table_of(std::span<const std::int64_t> indices) {
  std::vector<std::int64_t> table = distinct(indices, indices.size() / 4 * 3);
  std::sort(table.begin(), table.end());
  return table;
}

/// Writes a table: the number of entries, the first entry, and the differences between consecutive
/// entries.
void put_table(ByteWriter& out, std::span<const std::int64_t> table, TermScratch& scratch) {
  std::vector<std::uint64_t> gaps;
  for (std::size_t i = 1; i < table.size(); ++i) gaps.push_back(gap(table[i], table[i - 1]));
  const std::uint32_t width = plane_count(std::span<const std::uint64_t>(gaps));
  out.put_varint(table.size());
  out.put_signed(table[0]);
  out.put_u8(static_cast<std::uint8_t>(width));
  put_planes(out, std::span<const std::uint64_t>(gaps), width, scratch.bytes, scratch.packing);
}

}  // namespace

TermColumn::TermColumn(const ArrayInfo& info, bool may_have_terms)
    : info_(std::make_shared<ArrayInfo>(info)),
      may_have_terms_(may_have_terms),
      width_(scalar_bytes(info.type)),
      components_(info.components) {
  for (Component& component : components_)
    if (!is_float(info.type)) component.domain.kind = DomainKind::integers;
}

bool TermColumn::refers() const {
  return std::any_of(components_.begin(), components_.end(), [](const Component& component) {
    return component.predictor >= Predictor::reference;
  });
}

// --- predictions

/// Access to the states of vertices. If the component has no table of values, values are predicted
/// from these states.
template <class D>
class TermColumn::Direct {
 public:
  using Differences = D;
  /// `states`: the states of the component. `stride`: number of words from one state to the next.
  Direct(const Differences& differences, Component& component, std::uint64_t* states,
         std::size_t stride)
      : differences_(differences), component_(&component), states_(states), apart_(stride) {}

  const Differences& differences() const { return differences_; }
  std::uint64_t last() const { return component_->last; }
  void set_last(std::uint64_t value) { component_->last = value; }
  std::uint64_t term(std::uint32_t slot) const { return states_[slot * apart_]; }
  void set(std::uint32_t slot, std::uint64_t value) { states_[slot * apart_] = value; }

 private:
  Differences differences_;
  Component* component_;
  std::uint64_t* states_;
  std::size_t apart_;
};

/// Access to the ranks of vertices (positions of their values in the table of values). If the
/// component has such a table, ranks are predicted from earlier ranks. The rank of a vertex of an
/// earlier group is computed when it is first needed.
template <class Differences_>
class TermColumn::Ranked {
 public:
  using Differences = WholeDifferences;
  Ranked(const Differences_& of_states, Component& component, std::uint64_t* states,
         std::size_t stride, std::uint32_t group)
      : of_states_(of_states),
        component_(&component),
        states_(states),
        apart_(stride),
        group_(std::uint64_t{group} << 32) {}

  Differences differences() const { return {}; }
  std::uint64_t last() const { return rank(component_->last); }
  void set_last(std::uint64_t rank) { component_->last = state(rank); }
  std::uint64_t term(std::uint32_t slot) {
    std::uint64_t& ranked = component_->ranks[slot];
    if ((ranked & ~std::uint64_t{0xffffffff}) != group_)
      ranked = group_ | rank(states_[slot * apart_]);
    return ranked & 0xffffffff;
  }
  void set(std::uint32_t slot, std::uint64_t rank) {
    component_->ranks[slot] = group_ | rank;
    states_[slot * apart_] = state(rank);
  }

 private:
  std::uint64_t state(std::uint64_t rank) const {
    return state_of(of_states_, component_->table[static_cast<std::size_t>(rank)]);
  }
  std::uint64_t rank(std::uint64_t state) const {
    return rank_of(component_->table, of_states_.index(of_states_.sum_of(state)));
  }

  Differences_ of_states_;
  Component* component_;
  std::uint64_t* states_;
  std::size_t apart_;
  std::uint64_t group_;
};

template <class Code>
void TermColumn::for_each_value(std::size_t c, const Elements& elements,
                                std::span<const std::int64_t> references, Code&& code) {
  Component& component = components_[c];
  std::uint64_t* const states = states_.empty() ? nullptr : states_.data() + c;
  const std::size_t stride = components_.size();
  with_differences(info_->type, component.domain.kind, [&](const auto& differences) {
    using Differences = std::remove_cvref_t<decltype(differences)>;
    if (component.table.empty())
      walk(Direct<Differences>(differences, component, states, stride), component.predictor,
           elements, references, component.change, code);
    else
      walk(Ranked<Differences>(differences, component, states, stride, group_), component.predictor,
           elements, references, component.change, code);
  });
}

/// Returns the sum that predicts each component of the value of `vertex`. The sum is computed from
/// the states of the terms. term(slot, component) returns the state of a vertex.
template <class Differences, std::size_t kCount, class Term>
auto sums_of_terms(const VertexTerms& vertex, const Term& term) {
  std::array<typename Differences::Sum, kCount> sums;
  for (std::size_t c = 0; c < kCount; ++c) sums[c] = Differences::sum_of(term(vertex.slots[0], c));
  const auto add = [&](std::int64_t weight, std::uint32_t t) {
    for (std::size_t c = 0; c < kCount; ++c)
      sums[c] = Differences::add(sums[c], Differences::weight(weight), term(vertex.slots[t], c));
  };
  switch (vertex.count) {
    case 7: add(1, 1), add(1, 2), add(-1, 3), add(-1, 4), add(-1, 5), add(1, 6); break;
    case 3: add(1, 1), add(-1, 2); break;
    case 2:
      add(1, 1);
      for (auto& sum : sums) sum = Differences::half(sum);
      break;
    default: break;
  }
  return sums;
}

template <class Known, class Code>
void TermColumn::walk(Known known, Predictor predictor, const Elements& elements,
                      std::span<const std::int64_t> references, std::uint64_t& change, Code& code) {
  const auto differences = known.differences();
  using Differences = typename Known::Differences;
  using Sum = typename Differences::Sum;
  std::uint64_t last = known.last();
  const auto take = [&](std::size_t e, Sum sum) {
    last = state_of(differences, code(differences, e, differences.index(sum)));
  };
  if (elements.vertices.empty()) {
    // The first three predictors depend only on indices, not on the state of the previous element.
    // Therefore the processor can work on consecutive elements in parallel.
    std::int64_t index = 0;
    switch (predictor) {
      case Predictor::nothing:
        for (std::size_t e = 0; e < elements.count; ++e) index = code(differences, e, 0);
        break;
      case Predictor::reference:
        for (std::size_t e = 0; e < elements.count; ++e)
          index = code(differences, e, references[e]);
        break;
      case Predictor::change: {
        // Prediction: the difference between index and reference is the same as for the previous
        // element.
        std::uint64_t by = change;
        for (std::size_t e = 0; e < elements.count; ++e) {
          const auto reference = static_cast<std::uint64_t>(references[e]);
          index = code(differences, e, static_cast<std::int64_t>(reference + by));
          by = static_cast<std::uint64_t>(index) - reference;
        }
        change = by;
        break;
      }
      default:
        for (std::size_t e = 0; e < elements.count; ++e) take(e, differences.sum_of(last));
    }
    if (predictor == Predictor::nothing || predictor >= Predictor::reference)
      last = state_of(differences, index);
  }
  for (std::size_t e = 0; e < elements.vertices.size(); ++e) {
    const VertexTerms& vertex = elements.vertices[e];
    Sum sum = differences.sum_of(predictor == Predictor::nothing ? 0 : last);
    if (predictor == Predictor::terms && vertex.count > 0)
      sum = sums_of_terms<Differences, 1>(
          vertex, [&](std::uint32_t slot, std::size_t) { return known.term(slot); })[0];
    take(e, sum);
    known.set(vertex.slot, last);
  }
  if (elements.count > 0) known.set_last(last);
}

/// Stores the indices of the reference values in `references`. If the component has a table, stores
/// the ranks of these indices instead.
void TermColumn::refer(std::size_t c, const Elements& elements,
                       std::vector<std::int64_t>& references,
                       std::vector<std::uint64_t>& words) const {
  const Component& component = components_[c];
  words.resize(elements.count);
  references.resize(elements.count);
  load(elements.reference.data() + c * width_, element_bytes(), width_, words);
  if (component.domain.kind == DomainKind::integers) {
    const auto whole = WholeDifferences::of(info_->type);
    for (std::size_t e = 0; e < words.size(); ++e) references[e] = whole.within(words[e]);
  } else if (component.domain.kind == DomainKind::floats) {
    with_translation(*info_, c, component.domain, [&](auto&& index_of, auto&&) {
      const bool narrow = info_->type == ScalarType::float32;
      const std::uint64_t infinity = narrow ? 0x7f800000 : 0x7ff0000000000000;
      const std::uint64_t sign = narrow ? 0x80000000 : 0x8000000000000000;
      // The index of a NaN is 0
      for (std::size_t e = 0; e < words.size(); ++e)
        references[e] = (words[e] & ~sign) > infinity ? 0 : index_of(words[e]);
    });
  } else if (!linear_references(info_->type, words, component.domain, references)) {
    const ValueTranslator translator(*info_, c, component.domain);
    with_differences(info_->type, component.domain.kind, [&](const auto& differences) {
      for (std::size_t e = 0; e < words.size(); ++e) {
        const double value = scalar_as_double(info_->type, words[e]);
        if constexpr (std::is_same_v<decltype(differences.sum_of(0)), double>)
          references[e] = differences.index(value);
        else
          references[e] = static_cast<std::int64_t>(translator.from_value(value));
      }
    });
  }
  if (component.table.empty()) return;
  for (std::int64_t& reference : references)
    reference = static_cast<std::int64_t>(rank_of(component.table, reference));
}

void TermColumn::make_room_for_slots(const Elements& elements) {
  if (elements.slots == 0) return;
  make_room_soon(states_, std::size_t{elements.slots} * components_.size() - 1);
  for (Component& component : components_)
    if (!component.table.empty()) make_room_soon(component.ranks, elements.slots - 1);
}

// --- encoding

/// Chooses the domain for the values of a component, and stores the index of each value. In a
/// quantized array, a few values may be impossible to quantize; the remaining values are still
/// rounded.
/// Gives the component the states of its source for these elements.
void TermColumn::copy_component(std::size_t c, const Elements& elements) {
  const std::size_t source = *components_[c].source;
  for (const VertexTerms& vertex : elements.vertices) {
    std::uint64_t* const states = states_.data() + std::size_t{vertex.slot} * components_.size();
    states[c] = states[source];
  }
  components_[c].last = components_[source].last;
}

ValueDomain TermColumn::choose_domain(std::size_t c, std::span<std::uint64_t> words,
                                      std::span<std::int64_t> indices) const {
  const bool lossless = info_->quantization.bits == 0;
  if (is_float(info_->type) && lossless) {
    if (linear_indices(info_->type, words, components_[c].domain, indices))
      return components_[c].domain;
    // First try the domain that suits a sample of the values. If it does not contain all values,
    // determine a domain from all of them.
    std::vector<std::uint64_t> sample;
    const std::size_t step = std::max<std::size_t>(words.size() / kDomainSamples, 1);
    for (std::size_t i = 0; i < words.size(); i += step) sample.push_back(words[i]);
    const ValueDomain guess = evenly_spaced_domain(*info_, c, sample);
    if (guess.is_linear() && linear_indices(info_->type, words, guess, indices)) return guess;
  }
  const ValueDomain domain = evenly_spaced_domain(*info_, c, words);
  if (!lossless && domain.kind != DomainKind::quantized) round_quantized(*info_, c, words);
  with_translation(*info_, c, domain, [&](auto&& index_of, auto&&) {
    for (std::size_t e = 0; e < words.size(); ++e) indices[e] = index_of(words[e]);
  });
  return domain;
}

/// Returns the predictor whose residuals need the fewest bits in a sample. On input, scratch.words
/// contains the residuals for the component's current predictor. `bits` receives the estimated size
/// in bits of the residuals for the returned predictor.
auto TermColumn::choose_predictor(const Component& component, const Elements& elements,
                                  const TermScratch& scratch, std::uint64_t& bits) const
    -> Predictor {
  Predictor best = component.predictor;
  const std::span<const std::int64_t> indices = scratch.indices, references = scratch.references;
  bits = residual_bits(scratch.words);
  for (const Predictor other :
       {Predictor::nothing, Predictor::last, Predictor::reference, Predictor::change}) {
    if (other == component.predictor) continue;
    if (other >= Predictor::reference && elements.reference.empty()) continue;
    std::uint64_t sum = 0;
    with_differences(info_->type, component.domain.kind, [&](const auto& differences) {
      for (std::size_t e = kSampleStep; e < indices.size(); e += kSampleStep) {
        std::int64_t from = 0;
        if (other == Predictor::last)
          from = differences.index(differences.sum_of(state_of(differences, indices[e - 1])));
        if (other >= Predictor::reference) from = references[e];
        if (other == Predictor::change)
          from = static_cast<std::int64_t>(static_cast<std::uint64_t>(from) +
                                           static_cast<std::uint64_t>(indices[e - 1]) -
                                           static_cast<std::uint64_t>(references[e - 1]));
        sum += static_cast<std::uint64_t>(std::bit_width(differences.residual(indices[e], from)));
      }
    });
    if (sum * kSampleStep >= bits) continue;
    bits = sum * kSampleStep;
    best = other;
  }
  return best;
}

void TermColumn::encode_component(std::size_t c, const Elements& elements, const std::byte* values,
                                  std::size_t stride, ByteWriter& heads, ByteWriter& planes,
                                  TermScratch& scratch) {
  Component& component = components_[c];
  component.source = equal_component(*info_, values, stride, elements.count, c);
  if (component.source) {
    component.domain = components_[*component.source].domain;
    put_copy(heads, *component.source);
    copy_component(c, elements);
    return;
  }
  std::vector<std::uint64_t>& words = scratch.words;
  std::vector<std::int64_t>& indices = scratch.indices;
  words.resize(elements.count);
  indices.resize(elements.count);
  load(values + c * width_, stride, width_, words);
  component.domain = choose_domain(c, words, indices);
  component.table.clear();
  if (!elements.reference.empty()) refer(c, elements, scratch.references, words);

  const auto residuals_with = [&](Predictor predictor, std::span<const std::int64_t> targets) {
    component.predictor = predictor;
    component.change = 0;
    for_each_value(c, elements, scratch.references,
                   [&](const auto& differences, std::size_t e, std::int64_t predicted) {
                     words[e] = differences.residual(targets[e], predicted);
                     return targets[e];
                   });
    copies_.clear_copies(words);
  };
  const bool may_have_table = values_repeat(indices);
  const std::uint64_t last = component.last;
  // Coding the values overwrites states, because slots are reused within a group. If the values are
  // coded twice, the second pass must therefore begin with a copy of the original states.
  const auto states = may_have_table ? states_ : std::vector<std::uint64_t>();
  const Predictor first = !elements.vertices.empty()    ? Predictor::terms
                          : !elements.reference.empty() ? Predictor::reference
                                                        : Predictor::last;
  residuals_with(first, indices);
  std::uint64_t bits = 0;
  const Predictor best = choose_predictor(component, elements, scratch, bits);
  if (best != first) {
    component.last = last;
    residuals_with(best, indices);
  }
  std::vector<std::int64_t> table;
  if (may_have_table && bits > kTableBits * elements.count) table = table_of(indices);
  if (!table.empty()) {
    std::vector<std::int64_t> ranks(elements.count);
    for (std::size_t e = 0; e < ranks.size(); ++e)
      ranks[e] = static_cast<std::int64_t>(rank_of(table, indices[e]));
    ++group_;
    component.table = std::move(table);
    make_room_for_slots(elements);
    component.last = last;
    states_ = states;
    if (!elements.reference.empty()) refer(c, elements, scratch.references, words);
    residuals_with(first, ranks);
    if (residual_bits(words) + table_bits(component.table) >= bits) {
      component.table.clear();
      component.last = last;
      states_ = states;
      if (!elements.reference.empty()) refer(c, elements, scratch.references, words);
      residuals_with(best, indices);
    }
  }

  copies_.remove_copies(words);
  const bool with_table = !component.table.empty();
  component.width = plane_count(std::span<const std::uint64_t>(words));
  heads.put_u8(
      static_cast<std::uint8_t>(static_cast<unsigned>(component.domain.kind) |
                                static_cast<unsigned>(component.predictor) << kPredictorShift |
                                (with_table ? kTableBit : 0u)));
  heads.put_signed(component.domain.exponent);
  heads.put_u8(static_cast<std::uint8_t>(component.width));
  if (with_table) put_table(planes, component.table, scratch);
  put_planes(planes, std::span<const std::uint64_t>(words), component.width, scratch.bytes,
             scratch.packing);
}

std::vector<std::byte> TermColumn::encode_terms(const Elements& elements, const std::byte* values,
                                                std::size_t stride, TermScratch& scratch) {
  copies_.clear();
  if (!elements.vertices.empty() && components_.size() > 1)
    copies_.find(values, stride, element_bytes(), elements.count);
  if (copies_.empty()) return encode_components(elements, values, stride, scratch);
  TermColumn without = *this;
  without.copies_.clear();
  auto bytes = encode_components(elements, values, stride, scratch);
  auto other = without.encode_components(elements, values, stride, scratch);
  if (bytes.size() <= other.size()) return bytes;
  *this = std::move(without);
  return other;
}

std::vector<std::byte> TermColumn::encode_components(const Elements& elements,
                                                     const std::byte* values, std::size_t stride,
                                                     TermScratch& scratch) {
  for (Component& component : components_) component.table.clear();
  make_room_for_slots(elements);
  ByteWriter heads, planes;
  heads.put_varint(elements.count);
  if (!copies_.empty()) copies_.put(heads, scratch.bytes, scratch.packing);
  for (std::size_t c = 0; c < components_.size(); ++c)
    encode_component(c, elements, values, stride, heads, planes, scratch);
  heads.put_bytes(planes.bytes);
  return std::move(heads.bytes);
}

auto TermColumn::encode(const Elements& elements, const std::byte* values, std::size_t stride,
                        TermScratch& scratch) -> Encoded {
  Encoded terms;
  std::vector<Component> before;
  std::vector<std::uint64_t> states_before;
  if (may_have_terms_) {
    if (!is_float(info_->type)) {
      before = components_;
      states_before = states_;
    }
    terms.bytes = encode_terms(elements, values, stride, scratch);
    if (is_float(info_->type)) return terms;
  }
  // Also try shuffled_zstd: the integers may be material numbers or similar ids, which repeat often
  // but are hard to predict.
  const std::vector<std::byte> packed = restored_values(*info_, values, stride, elements.count);
  Encoded shuffled{Codec::shuffled_zstd,
                   pack_shuffled(shm::shuffled(packed, width_), kShuffledZstdLevel)};
  if (may_have_terms_ && terms.bytes.size() <= shuffled.bytes.size()) return terms;
  if (may_have_terms_) {
    components_ = std::move(before);
    states_ = std::move(states_before);
  }
  return shuffled;
}

// --- decoding

bool TermColumn::begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit,
                             TermScratch& scratch) {
  codec_ = codec;
  next_ = next_own_ = 0;
  copies_.clear();
  if (codec == Codec::terms) return read_terms(bytes, limit / element_bytes(), scratch);
  auto unpacked = unpack_shuffled(bytes, width_, limit);
  if (!unpacked || unpacked->size() % element_bytes() != 0) return false;
  unpacked_ = std::move(*unpacked);
  count_ = unpacked_.size() / element_bytes();
  return true;
}

bool TermColumn::read_terms(std::span<const std::byte> bytes, std::uint64_t most,
                            TermScratch& scratch) {
  ByteReader in(bytes);
  count_ = in.get_varint();
  if (!in.ok() || count_ == 0 || count_ > most) return false;
  ++group_;
  if (!read_heads(in, scratch)) return false;
  unpacked_.clear();
  std::uint64_t planes = 0;
  for (const Component& component : components_) planes += component.width * own_count_;
  // Without reserve(), the vector would double its capacity
  unpacked_.reserve(to_size(std::min(planes, kMostReserved)));
  for (Component& component : components_) {
    if (!component.table.empty() && !read_table(in, component.table, scratch)) return false;
    component.planes = unpacked_.size();
    for (std::uint32_t b = 0; b < component.width; ++b) {
      if (!get_plane(in, own_count_, scratch.bytes, scratch.unpacking)) return false;
      unpacked_.insert(unpacked_.end(), scratch.bytes.begin(), scratch.bytes.end());
    }
  }
  return in.ok() && in.left() == 0;
}

/// Reads the list of copied vertices, if the group has one, and the header of each component.
bool TermColumn::read_heads(ByteReader& in, TermScratch& scratch) {
  own_count_ = count_;
  std::uint8_t head = in.get_u8();
  if (head == kCopiedVertices) {
    if (!copies_.get(in, count_, scratch.bytes, scratch.unpacking)) return false;
    own_count_ = copies_.count_own(0, to_size(count_));
    head = in.get_u8();
  }
  for (std::size_t c = 0; c < components_.size(); ++c)
    if (!read_head(in, c, c == 0 ? head : in.get_u8())) return false;
  return true;
}

/// Reads the header of a component: domain, predictor and size of a residual. If the component has
/// a table, the function adds a placeholder entry to the table. `head`: the first byte of the
/// header.
bool TermColumn::read_head(ByteReader& in, std::size_t c, std::uint8_t head) {
  Component& component = components_[c];
  component.source.reset();
  component.table.clear();
  component.width = 0;
  component.change = 0;
  component.recent.resize(copies_.empty() ? 0
                                          : std::bit_ceil(to_size(std::min<std::uint64_t>(
                                                count_, CopiedVertices::kFarthest))));
  if (head == kCopiedComponent) {
    component.source = get_source(in, c);
    if (!component.source) return false;
    component.domain = components_[*component.source].domain;
    component.predictor = Predictor::nothing;
    return true;
  }
  const std::int64_t exponent = in.get_signed();
  const std::uint8_t width = in.get_u8();
  const std::uint32_t kind = head & kKinds;
  const std::uint32_t predictor = head >> kPredictorShift & 7u;
  if (!in.ok() || kind >= kDomainKinds || predictor >= kPredictors || head >= 2 * kTableBit ||
      exponent < -1074 || exponent > 1074)
    return false;
  component.domain = {static_cast<DomainKind>(kind), static_cast<std::int32_t>(exponent)};
  component.predictor = static_cast<Predictor>(predictor);
  component.width = width;
  if (!may_be(*info_, component.domain)) return false;
  if ((head & kTableBit) != 0) component.table.push_back(0);
  return width <= (component.table.empty() ? most_bytes(info_->type, component.domain.kind) : 8);
}

bool TermColumn::read_table(ByteReader& in, std::vector<std::int64_t>& table,
                            TermScratch& scratch) const {
  const std::uint64_t entries = in.get_varint();
  table[0] = in.get_signed();
  const std::uint8_t width = in.get_u8();
  if (!in.ok() || entries == 0 || entries > count_ || width > 8) return false;
  std::vector<std::uint64_t> gaps(to_size(entries - 1));
  if (!get_planes(in, width, std::span(gaps), scratch.bytes, scratch.unpacking)) return false;
  for (const std::uint64_t gap : gaps) {
    const std::int64_t next = plus(table.back(), static_cast<std::int64_t>(gap));
    if (next <= table.back()) return false;
    table.push_back(next);
  }
  return true;
}

bool TermColumn::decode(const Elements& elements, std::vector<std::byte>& out,
                        TermScratch& scratch) {
  const std::size_t count = elements.count, bytes = element_bytes(), offset = out.size();
  if (count > count_ - next_) return false;
  if (count == 0) return true;
  if (!copies_.empty() && elements.vertices.empty()) return false;
  if (may_have_terms_) make_room_for_slots(elements);
  if (codec_ == Codec::shuffled_zstd) {
    const auto from = unpacked_.begin() + static_cast<std::ptrdiff_t>(next_ * bytes);
    out.insert(out.end(), from, from + static_cast<std::ptrdiff_t>(count * bytes));
  } else {
    out.resize(offset + count * bytes);
    if (can_decode_together(elements)) {
      decode_together(elements, out.data() + offset, scratch);
    } else {
      for (std::size_t c = 0; c < components_.size(); ++c)
        if (!decode_component(c, elements, out.data() + offset + c * width_, scratch)) return false;
    }
  }
  next_own_ += count_own(count);
  next_ += count;
  return true;
}

bool TermColumn::decode_component(std::size_t c, const Elements& elements, std::byte* out,
                                  TermScratch& scratch) {
  Component& component = components_[c];
  std::vector<std::uint64_t>& words = scratch.words;
  if (component.source) {
    words.resize(elements.count);
    load(out - (c - *component.source) * width_, element_bytes(), width_, words);
    save(words, out, element_bytes(), width_);
    copy_component(c, elements);
    return true;
  }
  if (component.predictor >= Predictor::reference) {
    if (elements.reference.empty()) return false;
    if (component.table.empty() && component.domain.kind == DomainKind::floats) {
      decode_floats(c, elements, out);
      return true;
    }
    refer(c, elements, scratch.references, words);
  }
  words.resize(elements.count);
  take_residuals(component, words);
  const std::uint64_t entries = component.table.size();
  const bool has_copies = !copies_.empty();
  bool within = true;
  for_each_value(c, elements, scratch.references,
                 [&](const auto& differences, std::size_t e, std::int64_t predicted) {
                   words[e] = static_cast<std::uint64_t>(differences.value(words[e], predicted));
                   if (has_copies) copy_vertex(component, e, words[e]);
                   if (entries > 0 && words[e] >= entries) {
                     within = false;
                     words[e] = 0;
                   }
                   return static_cast<std::int64_t>(words[e]);
                 });
  if (!within) return false;
  if (entries > 0)
    for (std::uint64_t& word : words)
      word = static_cast<std::uint64_t>(component.table[static_cast<std::size_t>(word)]);
  save_values(c, words, out);
  return true;
}

/// Decodes floating-point values in the domain `floats`, which is the most frequent domain of
/// stepped values. Precondition: the elements have reference values, and the component has no
/// table.
void TermColumn::decode_floats(std::size_t c, const Elements& elements, std::byte* out) {
  Component& component = components_[c];
  // If the residuals have 0 bytes each, unpacked_ may be empty and must not be indexed.
  const FloatResiduals residuals{
      component.width == 0 ? nullptr : unpacked_.data() + component.planes + next_,
      static_cast<std::size_t>(count_), component.width};
  const std::int64_t last = shm::decode_floats(
      info_->type, residuals, component.predictor == Predictor::change, component.change,
      {elements.reference.data() + c * width_, out, element_bytes(), elements.count});
  with_differences(info_->type, component.domain.kind,
                   [&](const auto& differences) { component.last = state_of(differences, last); });
}

/// Returns true if all components can be decoded in one pass: there are kTogether components with
/// the same kind of domain, and each is predicted only from terms, without a table.
bool TermColumn::can_decode_together(const Elements& elements) const {
  const bool narrow = components_[0].domain.kind == DomainKind::narrow;
  const bool floats = components_[0].domain.kind == DomainKind::floats;
  return !elements.vertices.empty() && copies_.empty() && components_.size() == kTogether &&
         is_float(info_->type) &&
         std::all_of(components_.begin(), components_.end(), [&](const Component& component) {
           return component.predictor == Predictor::terms && component.table.empty() &&
                  (component.domain.kind == DomainKind::narrow) == narrow &&
                  (component.domain.kind == DomainKind::floats) == floats;
         });
}

/// Does the same as decode_component() for each component, but in one pass, since the components
/// have the same terms.
void TermColumn::decode_together(const Elements& elements, std::byte* out, TermScratch& scratch) {
  const std::size_t count = elements.count;
  scratch.words.resize(kTogether * count);
  std::array<std::span<std::uint64_t>, kTogether> words;
  for (std::size_t c = 0; c < kTogether; ++c) {
    words[c] = std::span(scratch.words).subspan(c * count, count);
    take_residuals(components_[c], words[c]);
  }
  with_differences(info_->type, components_[0].domain.kind, [&](const auto& differences) {
    using Differences = std::remove_cvref_t<decltype(differences)>;
    std::uint64_t* const states = states_.data();
    std::array<std::uint64_t, kTogether> last;
    for (std::size_t c = 0; c < kTogether; ++c) last[c] = components_[c].last;
    for (std::size_t e = 0; e < count; ++e) {
      const VertexTerms& vertex = elements.vertices[e];
      std::array<typename Differences::Sum, kTogether> sums;
      if (vertex.count == 0)
        for (std::size_t c = 0; c < kTogether; ++c) sums[c] = Differences::sum_of(last[c]);
      else
        sums =
            sums_of_terms<Differences, kTogether>(vertex, [&](std::uint32_t slot, std::size_t c) {
              return states[std::size_t{slot} * kTogether + c];
            });
      for (std::size_t c = 0; c < kTogether; ++c) {
        const std::int64_t index = differences.value(words[c][e], differences.index(sums[c]));
        words[c][e] = static_cast<std::uint64_t>(index);
        states[std::size_t{vertex.slot} * kTogether + c] = last[c] = state_of(differences, index);
      }
    }
    for (std::size_t c = 0; c < kTogether; ++c) components_[c].last = last[c];
  });
  for (std::size_t c = 0; c < kTogether; ++c) save_values(c, words[c], out + c * width_);
}

/// Returns how many of the next `count` elements are not copied vertices.
std::size_t TermColumn::count_own(std::size_t count) const {
  return copies_.empty() ? count : copies_.count_own(to_size(next_), count);
}

void TermColumn::take_residuals(const Component& component, std::span<std::uint64_t> words) const {
  const std::size_t own = count_own(words.size());
  // If the residuals have 0 bytes each, unpacked_ may be empty and must not be indexed.
  const std::byte* const planes =
      component.width == 0 ? nullptr : unpacked_.data() + component.planes + next_own_;
  get_words(planes, to_size(own_count_), component.width, words.first(own));
  if (!copies_.empty()) copies_.insert_copies(to_size(next_), words);
}

/// Stores in `word` the index (or rank) of element `e` of the current block: that of the source if
/// the element is a copy, `word` itself otherwise. Remembers it for later copies.
void TermColumn::copy_vertex(Component& component, std::size_t e, std::uint64_t& word) const {
  const std::size_t vertex = to_size(next_) + e, mask = component.recent.size() - 1;
  const std::uint32_t back = copies_.back(vertex);
  if (back > 0) word = component.recent[(vertex - back) & mask];
  component.recent[vertex & mask] = word;
}

/// Replaces each index with the bits of its value, and stores the values in `out`.
void TermColumn::save_values(std::size_t c, std::span<std::uint64_t> indices,
                             std::byte* out) const {
  const ValueDomain& domain = components_[c].domain;
  if (!linear_values(info_->type, domain, indices))
    with_translation(*info_, c, domain, [&](auto&&, auto&& bits_of) {
      for (std::uint64_t& word : indices) word = bits_of(static_cast<std::int64_t>(word));
    });
  save(indices, out, element_bytes(), width_);
}

}  // namespace shm
