#include "codecs/weighted/weighted_column.h"

#include <bit>

#include "codecs/shared/equal_components.h"
#include "codecs/shifts/difference_values.h"

namespace shm {

EvenSpace EvenSpace::of(const ArrayInfo& info, std::size_t component, const ValueDomain& domain) {
  EvenSpace space;
  if (domain.kind == DomainKind::quantized) {
    if (info.quantization.bits == Quantization::kRelative) return space;
    space.minimum = info.quantization.minimum[component];
    space.down = info.quantization.step();
  } else if (domain.kind != DomainKind::integers) {
    space.down = ValueTranslator(info, component, domain).as_value(1.0);
  }
  space.up = 1 / space.down;
  return space;
}

// --- elements

void WeightedComponent::set_state(const Neighbourhood& item, double state, std::int64_t index,
                                  std::int32_t size) {
  double third = 0;
  if (item.knows(Neighbourhood::kLattice)) {
    const auto of = [&](std::size_t k) { return slots[item.at[k]].state; };
    third = state - (((of(0) + of(1) + of(2)) - (of(3) + of(4) + of(5))) + of(6));
  }
  slots[item.self] = last = {state, third, index, size};
}

std::uint32_t length_context(const WeightedComponent& component, const Neighbourhood& item,
                             std::int32_t scale) {
  std::int32_t sum = 0;
  std::uint32_t known = 0, zeros = 0;
  bool matched = false;
  const auto add = [&](std::int32_t size) {
    ++known;
    if (size == kZeroSize)
      ++zeros;
    else if (size == kMatchedSize)
      matched = true;
    else
      sum += size;
  };
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((item.known >> a & 1) != 0) add(component.slots[item.at[a]].size);
  if (known == 0) add(component.last.size);
  if (matched) return kMatchedLengths;
  if (zeros == known) return kAllZeroLengths;
  const auto count = static_cast<std::int32_t>(known - zeros);
  // The quotient is rounded towards 0; the sum is not negative.
  const std::int32_t mean = count == 1 ? sum : count == 2 ? sum / 2 : sum / 3;
  return static_cast<std::uint32_t>(std::clamp(mean - scale, 0, 64)) +
         (zeros == 0 ? kPlainLengths : kSomeZeroLengths);
}

// --- matched values

void MatchedValues::begin(std::uint32_t axis, std::size_t count) {
  axis_ = axis;
  if (!is_on()) return;
  constexpr int kFewestBits = 8, kMostBits = 17;
  const int bits = std::clamp(static_cast<int>(std::bit_width(2 * count)), kFewestBits, kMostBits);
  shift_ = 64 - bits;
  table_.assign(std::size_t{1} << bits, 0);
}

std::int64_t MatchedValues::find(const Neighbourhood& item, std::span<const WeightedSlot> slots,
                                 bool is_float) {
  is_float_ = is_float;
  has_place_ = (item.known >> axis_ & 1) != 0;
  if (!has_place_) return 0;
  const std::int64_t near = slots[item.at[axis_]].index;
  is_negated_ = near < 0;
  const auto key = static_cast<std::uint64_t>(is_negated_ ? negated_index(near, is_float) : near);
  place_ = static_cast<std::size_t>(key * 0x9e3779b97f4a7c15u >> shift_);
  return is_negated_ ? negated_index(table_[place_], is_float) : table_[place_];
}

void MatchedValues::remember(std::int64_t index) {
  if (has_place_) table_[place_] = is_negated_ ? negated_index(index, is_float_) : index;
}

// --- columns

void WeightedColumn::make_room(std::uint32_t slots) {
  for (WeightedComponent& component : components_)
    if (component.slots.size() < slots) component.slots.resize(slots);
}

std::vector<double> WeightedColumn::reference_of(std::span<const std::byte> values,
                                                 const ValueDomain& domain,
                                                 std::size_t component) const {
  std::vector<double> states;
  if (values.empty()) return states;
  std::vector<std::uint64_t> words(classes_.covered());
  load(values.data() + component * width_, stride(), width_, words);
  states.reserve(words.size());
  for (const std::uint64_t word : words) {
    const double value = scalar_as_double(info_->type, word);
    states.push_back(is_finite(value) ? value : 0.0);
  }
  if (domain.kind == DomainKind::quantized && info_->quantization.bits == Quantization::kRelative) {
    const ValueTranslator translator(*info_, component, domain);
    for (double& value : states) value = translator.from_value(value);
  }
  return states;
}

void WeightedColumn::begin_history(const ReferenceValues& reference, const ValueDomain& domain,
                                   std::size_t c, const std::vector<double>& values) {
  if (reference.last.empty())
    history_.set_values(values, {});
  else
    history_.set_values(reference_of(reference.last, domain, c), values);
}

void WeightedColumn::copy_component(std::size_t from, std::size_t to, const TiledItems& elements) {
  for (const Neighbourhood& item : elements.items)
    components_[to].slots[item.self] = components_[from].slots[item.self];
  components_[to].last = components_[from].last;
}

// --- decoding

bool WeightedDecoder::decode(const TiledItems& elements, std::span<const std::byte> bytes,
                             const ReferenceValues& reference, std::vector<std::byte>& out) {
  classes_.find(elements, blocks_);
  has_neighbours_ = false;
  const std::size_t count = classes_.covered(), offset = out.size();
  ByteReader in(bytes);
  if (in.get_varint() != count || !in.ok()) return false;
  out.resize(offset + count * stride());
  std::vector<std::uint64_t> words(count);
  for (std::size_t c = 0; c < components_.size(); ++c) {
    const std::uint8_t head = in.get_u8();
    if (head == kCopiedComponent) {
      const auto source = get_source(in, c);
      if (!source) return false;
      load(out.data() + offset + *source * width_, stride(), width_, words);
      copy_component(*source, c, elements);
    } else if (!decode_component(in, head, c, elements, reference, words)) {
      return false;
    }
    save(words, out.data() + offset + c * width_, stride(), width_);
  }
  return in.left() == 0;
}

bool WeightedDecoder::decode_component(ByteReader& in, std::uint8_t head, std::size_t c,
                                       const TiledItems& elements, const ReferenceValues& reference,
                                       std::vector<std::uint64_t>& words) {
  const std::int64_t exponent = in.get_signed();
  const std::uint32_t kind = head & 7, axis = head >> 3 & 3;
  const bool has_history = (head & kHistoryBit) != 0;
  if (!in.ok() || kind >= kDomainKinds || head >= 2 * kHistoryBit || exponent < -1074 ||
      exponent > 1074 || (has_history && reference.empty()))
    return false;
  const ValueDomain domain{static_cast<DomainKind>(kind), static_cast<std::int32_t>(exponent)};
  if (!may_be(*info_, domain)) return false;
  std::vector<double> from = reference_of(reference.values, domain, c);
  if (has_history) {
    if (!std::exchange(has_neighbours_, true))
      history_.find_neighbours(classes_, elements, components_[c].slots.size());
    begin_history(reference, domain, c, from);
    if (!read_history(in, from)) return false;
  }
  if (!read_exceptions(in) || !read_weights(in, !reference.empty()) || !lengths_.begin(in))
    return false;
  BitReader bits(in.get_bytes(in.get_varint()));
  if (!in.ok()) return false;
  matches_.begin(axis, words.size());
  auto exception = exceptions_.begin();
  bool is_valid = true;
  with_space(c, domain, [&](const auto& space) {
    walk(space, components_[c], elements, from,
         [&](std::size_t e, std::int64_t predicted, std::uint32_t context, std::int64_t match) {
           if (exception != exceptions_.end() && exception->position == e) {
             ++exception;
             words[e] = static_cast<std::uint64_t>(predicted);
             return Coded{};
           }
           const std::uint32_t length = lengths_.next(context);
           if (length == kMatchedLength) {
             is_valid = is_valid && matches_.is_on();
             words[e] = static_cast<std::uint64_t>(match);
             return Coded{true, 0};
           }
           std::int64_t residual = 0;
           if (length > 0) {
             const std::uint64_t low = bits.get(length);
             const std::uint64_t size = low >> 1 | std::uint64_t{1} << (length - 1);
             residual = static_cast<std::int64_t>((low & 1) != 0 ? 0 - size : size);
           }
           words[e] = static_cast<std::uint64_t>(plus(predicted, residual));
           return Coded{false, residual};
         });
  });
  if (!is_valid || !lengths_.at_end() || !bits.at_end()) return false;
  with_translation(*info_, c, domain, [&](auto&&, auto&& bits_of) {
    for (std::uint64_t& word : words) word = bits_of(static_cast<std::int64_t>(word));
  });
  for (const Exception& it : exceptions_) words[static_cast<std::size_t>(it.position)] = it.bits;
  return true;
}

bool WeightedDecoder::read_exceptions(ByteReader& in) {
  const std::uint64_t count = in.get_varint();
  if (!in.ok() || count > in.left() / (1 + width_)) return false;
  exceptions_.clear();
  std::uint64_t position = 0;
  for (std::uint64_t n = 0; n < count; ++n) {
    const std::uint64_t gap = in.get_varint();
    const auto bytes = in.get_bytes(width_);
    if (!in.ok() || gap >= classes_.covered() - position) return false;
    position += gap;
    Exception& it = exceptions_.emplace_back();
    it.position = position++;
    for (std::size_t b = 0; b < width_; ++b)
      it.bits |= std::to_integer<std::uint64_t>(bytes[b]) << 8 * b;
  }
  return true;
}

/// Reads the weights of the history. Replaces the reference values with the predictions from it.
bool WeightedDecoder::read_history(ByteReader& in, std::vector<double>& reference) {
  std::vector<double> weights;
  for (std::size_t k = 0; k < history_.terms(); ++k) {
    const std::int64_t number = in.get_signed();
    if (number > WeightedHistory::kMostCoded || number < -WeightedHistory::kMostCoded) return false;
    weights.push_back(static_cast<double>(number) / WeightedHistory::kUnit);
  }
  reference = history_.predict(weights);
  return in.ok();
}

/// Reads the weights of each class.
bool WeightedDecoder::read_weights(ByteReader& in, bool has_reference) {
  const std::uint64_t head = in.get_varint(), listed = head >> 1;
  const bool is_zero = (head & 1) != 0;
  weights_.clear();
  for (const std::uint32_t known : classes_.known())
    weights_.push_back(is_zero ? ClassWeights::zero(known) : ClassWeights::usual(known));
  if (!in.ok() || listed > weights_.size()) return false;
  bool is_valid = true;
  const auto get = [&] {
    const std::int64_t number = in.get_signed();
    is_valid = is_valid && number <= kMostCodedWeight && number >= -kMostCodedWeight;
    return static_cast<double>(number) / kWeightUnit;
  };
  std::uint64_t next = 0;
  for (std::uint64_t i = 0; i < listed && is_valid; ++i) {
    const std::uint64_t entry = in.get_varint();
    if (!in.ok() || entry >> 1 >= weights_.size() - next) return false;
    const auto n = static_cast<std::size_t>(next + (entry >> 1));
    const std::uint32_t known = classes_.known()[n];
    next = n + 1;
    ClassWeights& weights = weights_[n];
    if ((entry & 1) == 0) {
      weights = is_zero ? ClassWeights::usual(known) : ClassWeights::zero(known);
      continue;
    }
    weights = ClassWeights::zero(known);
    weights.scale = has_reference ? get() : 1.0;
    for_each_term(known, [&](std::uint32_t k) {
      if (const double weight = get(); weight != 0) weights.add(k, weight);
    });
  }
  return in.ok() && is_valid;
}

}  // namespace shm
