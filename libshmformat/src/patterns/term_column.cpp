#include "patterns/term_column.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "patterns/byte_planes.h"
#include "patterns/float_values.h"
#include "patterns/linear_indices.h"
#include "shifts/difference_values.h"
#include "surface/number_map.h"
#include "values/shuffled_zstd.h"

namespace shm {
namespace {

constexpr int kShuffledZstdLevel = 1;
/// One element in so many is looked at where predictors are compared.
constexpr std::size_t kSampleStep = 8;
/// Elements among which values are looked for that come again, and how many in so many must.
constexpr std::size_t kDomainSamples = 512;
constexpr std::size_t kRepeatSamples = 2048, kRepeatShare = 8;
/// Where values come again a table is tried if there are so many, and a residual takes so many
/// bits.
constexpr std::size_t kTableCount = 16;
constexpr std::uint64_t kTableBits = 8;

/// Bytes of planes for which there is room before they have come.
constexpr std::uint64_t kMostReserved = std::uint64_t{4} << 20;

// A head: kind, predictor, whether there is a table.
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

/// What is kept of an index. Of a NaN, whose bits not all machines keep, it is 0.
template <class Differences>
std::uint64_t state_of(const Differences& differences, std::int64_t index) {
  const std::uint64_t state = differences.remember(index);
  if constexpr (std::is_same_v<decltype(differences.sum_of(0)), double>)
    if (std::isnan(std::bit_cast<double>(state))) return 0;
  return state;
}

/// Numbers of `width` bytes from as many planes, each so far behind the one before.
void get_words(const std::byte* planes, std::size_t distance, std::uint32_t width,
               std::span<std::uint64_t> words) {
  std::uint64_t* const to = words.data();
  const std::size_t count = words.size();
  std::fill_n(to, count, 0);
  for (std::uint32_t b = 0; b < width; b += 2) {  // half as many passes as one by one
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

/// How many entries are below the index.
std::uint64_t rank_of(std::span<const std::int64_t> table, std::int64_t index) {
  return static_cast<std::uint64_t>(std::lower_bound(table.begin(), table.end(), index) -
                                    table.begin());
}

/// Each that occurs, once; nothing where they are more than `most`.
std::vector<std::int64_t> distinct(std::span<const std::int64_t> indices, std::size_t most) {
  const Scatter place_of;
  std::vector<std::int64_t> found;
  // Place in `found` + 1, open addressing; 0: none.
  std::vector<std::uint32_t> table(std::bit_ceil(std::clamp<std::size_t>(2 * most, 64, 16384)));
  const auto place = [&](std::int64_t index) -> std::uint32_t& {
    const std::size_t mask = table.size() - 1;
    std::size_t at = static_cast<std::size_t>(place_of(static_cast<std::uint64_t>(index))) & mask;
    while (table[at] != 0 && found[table[at] - 1] != index) at = (at + 1) & mask;
    return table[at];
  };
  for (const std::int64_t index : indices) {
    std::uint32_t& its = place(index);
    if (its != 0) continue;
    if (found.size() == most) return {};
    found.push_back(index);
    its = static_cast<std::uint32_t>(found.size());
    if (2 * found.size() < table.size()) continue;
    table.assign(2 * table.size(), 0);
    for (std::uint32_t i = 0; i < found.size(); ++i) place(found[i]) = i + 1;
  }
  return found;
}

/// Whether a sample says that many values come again.
bool values_repeat(std::span<const std::int64_t> indices) {
  if (indices.size() < kTableCount) return false;
  const std::size_t step = std::max<std::size_t>(indices.size() / kRepeatSamples, 1);
  std::vector<std::int64_t> sample;
  for (std::size_t i = 0; i < indices.size(); i += step) sample.push_back(indices[i]);
  const std::size_t different = distinct(sample, sample.size()).size();
  return (sample.size() - different) * kRepeatShare > sample.size();
}

/// All values that occur; nothing where they are too many.
std::vector<std::int64_t> table_of(std::span<const std::int64_t> indices) {
  std::vector<std::int64_t> table = distinct(indices, indices.size() / 4 * 3);
  std::sort(table.begin(), table.end());
  return table;
}

/// Entries as one of them, then the gaps.
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

/// What predictions are made of in a group without a table: states.
template <class D>
class TermColumn::Direct {
 public:
  using Differences = D;
  /// `states`: of the component, so far apart.
  Direct(const Differences& differences, Component& component, std::uint64_t* states,
         std::size_t apart)
      : differences_(differences), component_(&component), states_(states), apart_(apart) {}

  const Differences& differences() const { return differences_; }
  std::uint64_t last() const { return component_->last; }
  void set_last(std::uint64_t of) { component_->last = of; }
  std::uint64_t term(std::uint32_t slot) const { return states_[slot * apart_]; }
  void set(std::uint32_t slot, std::uint64_t of) { states_[slot * apart_] = of; }

 private:
  Differences differences_;
  Component* component_;
  std::uint64_t* states_;
  std::size_t apart_;
};

/// With a table: ranks. That of a vertex of an earlier group is found where it is first asked for.
template <class Differences_>
class TermColumn::Ranked {
 public:
  using Differences = WholeDifferences;
  Ranked(const Differences_& of_states, Component& component, std::uint64_t* states,
         std::size_t apart, std::uint32_t group)
      : of_states_(of_states),
        component_(&component),
        states_(states),
        apart_(apart),
        group_(std::uint64_t{group} << 32) {}

  Differences differences() const { return {}; }
  std::uint64_t last() const { return rank(component_->last); }
  void set_last(std::uint64_t of) { component_->last = state(of); }
  std::uint64_t term(std::uint32_t slot) {
    std::uint64_t& its = component_->ranks[slot];
    if ((its & ~std::uint64_t{0xffffffff}) != group_) its = group_ | rank(states_[slot * apart_]);
    return its & 0xffffffff;
  }
  void set(std::uint32_t slot, std::uint64_t of) {
    component_->ranks[slot] = group_ | of;
    states_[slot * apart_] = state(of);
  }

 private:
  std::uint64_t state(std::uint64_t of) const {
    return state_of(of_states_, component_->table[static_cast<std::size_t>(of)]);
  }
  std::uint64_t rank(std::uint64_t of) const {
    return rank_of(component_->table, of_states_.index(of_states_.sum_of(of)));
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
  const std::size_t apart = components_.size();
  with_differences(info_->type, component.domain.kind, [&](const auto& differences) {
    using Differences = std::remove_cvref_t<decltype(differences)>;
    if (component.table.empty())
      walk(Direct<Differences>(differences, component, states, apart), component.predictor,
           elements, references, component.change, code);
    else
      walk(Ranked<Differences>(differences, component, states, apart, group_), component.predictor,
           elements, references, component.change, code);
  });
}

/// Of a vertex that has terms, by component; term(slot, component) is what is kept of one.
template <class Differences, std::size_t kCount, class Term>
auto sums_of_terms(const VertexTerms& it, const Term& term) {
  std::array<typename Differences::Sum, kCount> sums;
  for (std::size_t c = 0; c < kCount; ++c) sums[c] = Differences::sum_of(term(it.slots[0], c));
  const auto add = [&](std::int64_t weight, std::uint32_t t) {
    for (std::size_t c = 0; c < kCount; ++c)
      sums[c] = Differences::add(sums[c], Differences::weight(weight), term(it.slots[t], c));
  };
  switch (it.count) {
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
    // Of nothing and of a reference the state says what the index says, and elements do not wait
    // for each other.
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
        // What an index differs by from its reference, as that of the element before did.
        std::uint64_t by = change;
        for (std::size_t e = 0; e < elements.count; ++e) {
          const auto its = static_cast<std::uint64_t>(references[e]);
          index = code(differences, e, static_cast<std::int64_t>(its + by));
          by = static_cast<std::uint64_t>(index) - its;
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
    const VertexTerms& it = elements.vertices[e];
    Sum sum = differences.sum_of(predictor == Predictor::nothing ? 0 : last);
    if (predictor == Predictor::terms && it.count > 0)
      sum = sums_of_terms<Differences, 1>(
          it, [&](std::uint32_t slot, std::size_t) { return known.term(slot); })[0];
    take(e, sum);
    known.set(it.slot, last);
  }
  if (elements.count > 0) known.set_last(last);
}

/// Indices of the reference, or ranks where there is a table.
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
      for (std::size_t e = 0; e < words.size(); ++e)
        references[e] = (words[e] & ~sign) > infinity ? 0 : index_of(words[e]);  // of a NaN 0
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
  for (std::int64_t& it : references) it = static_cast<std::int64_t>(rank_of(component.table, it));
}

void TermColumn::make_room_for_slots(const Elements& elements) {
  if (elements.slots == 0) return;
  make_room_soon(states_, std::size_t{elements.slots} * components_.size() - 1);
  for (Component& component : components_)
    if (!component.table.empty()) make_room_soon(component.ranks, elements.slots - 1);
}

// --- encoding

/// The domain of all these values, and their indices. Where some of quantized values cannot be
/// quantized, the others take their rounded values all the same.
ValueDomain TermColumn::choose_domain(std::size_t c, std::span<std::uint64_t> words,
                                      std::span<std::int64_t> indices) const {
  const bool lossless = info_->quantization.bits == 0;
  if (is_float(info_->type) && lossless) {
    if (linear_indices(info_->type, words, components_[c].domain, indices))
      return components_[c].domain;
    // What a sample is, all are; or else it is looked at again.
    std::vector<std::uint64_t> sample;
    const std::size_t step = std::max<std::size_t>(words.size() / kDomainSamples, 1);
    for (std::size_t i = 0; i < words.size(); i += step) sample.push_back(words[i]);
    const ValueDomain guess = evenly_spaced_domain(*info_, c, sample);
    if (guess.is_linear() && linear_indices(info_->type, words, guess, indices)) return guess;
  }
  const ValueDomain domain = evenly_spaced_domain(*info_, c, words);
  if (!lossless && domain.kind != DomainKind::quantized) {
    const ValueTranslator translator(*info_, c, {DomainKind::quantized});
    for (std::uint64_t& it : words)
      if (const auto index = translator.index(it)) it = translator.bits(*index);
  }
  with_translation(*info_, c, domain, [&](auto&& index_of, auto&&) {
    for (std::size_t e = 0; e < words.size(); ++e) indices[e] = index_of(words[e]);
  });
  return domain;
}

/// Another predictor, where residuals of a sample take fewer bits with it than with that of the
/// component, which are the words. `bits`: of the residuals.
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
  std::vector<std::uint64_t>& words = scratch.words;
  std::vector<std::int64_t>& indices = scratch.indices;
  words.resize(elements.count);
  indices.resize(elements.count);
  load(values + c * width_, stride, width_, words);
  component.domain = choose_domain(c, words, indices);
  component.table.clear();
  if (!elements.reference.empty()) refer(c, elements, scratch.references, words);

  const auto residuals_with = [&](Predictor predictor, std::span<const std::int64_t> of) {
    component.predictor = predictor;
    component.change = 0;
    for_each_value(c, elements, scratch.references,
                   [&](const auto& differences, std::size_t e, std::int64_t predicted) {
                     words[e] = differences.residual(of[e], predicted);
                     return of[e];
                   });
  };
  const bool may_have_table = values_repeat(indices);
  const std::uint64_t last = component.last;
  // Slots are used again within a group.
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
  for (Component& component : components_) component.table.clear();
  make_room_for_slots(elements);
  ByteWriter heads, planes;
  heads.put_varint(elements.count);
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
  // Whole numbers may be names of materials: which repeat, and are not evenly spaced.
  std::vector<std::byte> packed(elements.count * element_bytes());
  for (std::size_t e = 0; e < elements.count; ++e)
    std::memcpy(packed.data() + e * element_bytes(), values + e * stride, element_bytes());
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
  next_ = 0;
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
  if (!read_heads(in)) return false;
  unpacked_.clear();
  std::uint64_t planes = 0;
  for (const Component& component : components_) planes += component.width * count_;
  unpacked_.reserve(to_size(std::min(planes, kMostReserved)));  // or it would double
  for (Component& component : components_) {
    if (!component.table.empty() && !read_table(in, component.table, scratch)) return false;
    component.planes = unpacked_.size();
    for (std::uint32_t b = 0; b < component.width; ++b) {
      if (!get_plane(in, count_, scratch.bytes, scratch.unpacking)) return false;
      unpacked_.insert(unpacked_.end(), scratch.bytes.begin(), scratch.bytes.end());
    }
  }
  return in.ok() && in.left() == 0;
}

/// A table that is to come gets one entry.
bool TermColumn::read_heads(ByteReader& in) {
  for (Component& component : components_) {
    const std::uint8_t head = in.get_u8();
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
    component.change = 0;
    component.table.clear();
    if (!may_be(*info_, component.domain)) return false;
    if ((head & kTableBit) != 0) component.table.push_back(0);
    if (width > (component.table.empty() ? most_bytes(info_->type, component.domain.kind) : 8))
      return false;
  }
  return true;
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
  const std::size_t count = elements.count, bytes = element_bytes(), at = out.size();
  if (count > count_ - next_) return false;
  if (count == 0) return true;
  if (may_have_terms_) make_room_for_slots(elements);
  if (codec_ == Codec::shuffled_zstd) {
    const auto from = unpacked_.begin() + static_cast<std::ptrdiff_t>(next_ * bytes);
    out.insert(out.end(), from, from + static_cast<std::ptrdiff_t>(count * bytes));
  } else {
    out.resize(at + count * bytes);
    if (can_decode_together(elements)) {
      decode_together(elements, out.data() + at, scratch);
    } else {
      for (std::size_t c = 0; c < components_.size(); ++c)
        if (!decode_component(c, elements, out.data() + at + c * width_, scratch)) return false;
    }
  }
  next_ += count;
  return true;
}

bool TermColumn::decode_component(std::size_t c, const Elements& elements, std::byte* out,
                                  TermScratch& scratch) {
  Component& component = components_[c];
  std::vector<std::uint64_t>& words = scratch.words;
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
  bool within = true;
  for_each_value(c, elements, scratch.references,
                 [&](const auto& differences, std::size_t e, std::int64_t predicted) {
                   words[e] = static_cast<std::uint64_t>(differences.value(words[e], predicted));
                   if (entries > 0 && words[e] >= entries) {
                     within = false;
                     words[e] = 0;
                   }
                   return static_cast<std::int64_t>(words[e]);
                 });
  if (!within) return false;
  if (entries > 0)
    for (std::uint64_t& it : words)
      it = static_cast<std::uint64_t>(component.table[static_cast<std::size_t>(it)]);
  save_values(c, words, out);
  return true;
}

/// The same of floats as they are stored, which are most of those of steps. Must hold: there is a
/// reference, and no table.
void TermColumn::decode_floats(std::size_t c, const Elements& elements, std::byte* out) {
  Component& component = components_[c];
  // Of no width there may be no bytes at all.
  const FloatResiduals residuals{
      component.width == 0 ? nullptr : unpacked_.data() + component.planes + next_,
      static_cast<std::size_t>(count_), component.width};
  const std::int64_t last = shm::decode_floats(
      info_->type, residuals, component.predictor == Predictor::change, component.change,
      {elements.reference.data() + c * width_, out, element_bytes(), elements.count});
  with_differences(info_->type, component.domain.kind,
                   [&](const auto& differences) { component.last = state_of(differences, last); });
}

/// Whether components of vertices do alike, by terms alone.
bool TermColumn::can_decode_together(const Elements& elements) const {
  const bool narrow = components_[0].domain.kind == DomainKind::narrow;
  const bool floats = components_[0].domain.kind == DomainKind::floats;
  return !elements.vertices.empty() && components_.size() == kTogether && is_float(info_->type) &&
         std::all_of(components_.begin(), components_.end(), [&](const Component& it) {
           return it.predictor == Predictor::terms && it.table.empty() &&
                  (it.domain.kind == DomainKind::narrow) == narrow &&
                  (it.domain.kind == DomainKind::floats) == floats;
         });
}

/// What decode_component() does, of all of them in one pass: they have the same terms.
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
      const VertexTerms& it = elements.vertices[e];
      std::array<typename Differences::Sum, kTogether> sums;
      if (it.count == 0)
        for (std::size_t c = 0; c < kTogether; ++c) sums[c] = Differences::sum_of(last[c]);
      else
        sums = sums_of_terms<Differences, kTogether>(it, [&](std::uint32_t slot, std::size_t c) {
          return states[std::size_t{slot} * kTogether + c];
        });
      for (std::size_t c = 0; c < kTogether; ++c) {
        const std::int64_t index = differences.value(words[c][e], differences.index(sums[c]));
        words[c][e] = static_cast<std::uint64_t>(index);
        states[std::size_t{it.slot} * kTogether + c] = last[c] = state_of(differences, index);
      }
    }
    for (std::size_t c = 0; c < kTogether; ++c) components_[c].last = last[c];
  });
  for (std::size_t c = 0; c < kTogether; ++c) save_values(c, words[c], out + c * width_);
}

void TermColumn::take_residuals(const Component& component, std::span<std::uint64_t> words) const {
  // Of no width there may be no bytes at all.
  const std::byte* const planes =
      component.width == 0 ? nullptr : unpacked_.data() + component.planes + next_;
  get_words(planes, static_cast<std::size_t>(count_), component.width, words);
}

/// `indices` become the bits of the values.
void TermColumn::save_values(std::size_t c, std::span<std::uint64_t> indices,
                             std::byte* out) const {
  const ValueDomain& domain = components_[c].domain;
  if (!linear_values(info_->type, domain, indices))
    with_translation(*info_, c, domain, [&](auto&&, auto&& bits_of) {
      for (std::uint64_t& it : indices) it = bits_of(static_cast<std::int64_t>(it));
    });
  save(indices, out, element_bytes(), width_);
}

}  // namespace shm
