#include "codecs/shifts/difference_column.h"

#include <algorithm>
#include <cstring>

#include "base/binary.h"
#include "codecs/shared/equal_components.h"
#include "codecs/shared/shuffled_zstd.h"
#include "codecs/shared/value_domain.h"
#include "codecs/shifts/difference_choice.h"
#include "codecs/shifts/difference_values.h"

namespace shm {
namespace {

constexpr int kPlaneZstdLevel = 1;

}  // namespace

DifferenceColumn::DifferenceColumn(const ArrayInfo& info, bool may_differ)
    : info_(std::make_shared<ArrayInfo>(info)),
      may_differ_(may_differ),
      width_(scalar_bytes(info.type)),
      components_(info.components) {}

/// Begins a group of `count` elements that is coded with the codec `differences`.
void DifferenceColumn::begin(std::span<const Factor> factors, std::span<const ValueDomain> domains,
                             std::uint64_t count) {
  bool goes_on = remembers_;
  for (std::size_t c = 0; c < components_.size(); ++c) {
    goes_on = goes_on && components_[c].domain == domains[c];
    components_[c].domain = domains[c];
  }
  if (!goes_on) {
    known_.clear(places_for(count));
    // The word 0 represents the number 0 in all value types
    ring_.assign(known_.places() * ring_stride(), 0);
    last_.assign(components_.size(), 0);
  }
  remembers_ = true;
  taps_ = taps_of(factors);
}

template <class Code>
void DifferenceColumn::for_each_value(std::span<const std::uint64_t> numbers, Code&& code) {
  with_differences(info_->type, components_[0].domain.kind, [&](const auto& differences) {
    switch (components_.size()) {
      case 1: return walk<1>(differences, numbers, code);
      case 3: return walk<3>(differences, numbers, code);
      default: return walk<0>(differences, numbers, code);
    }
  });
}

/// Predicts all elements and calls `code`, in the same way as for_each_value() does. kComponents:
/// the number of components if it is known at compile time, otherwise 0.
template <std::size_t kComponents, class Differences, class Code>
void DifferenceColumn::walk(const Differences& differences, std::span<const std::uint64_t> numbers,
                            Code& code) {
  using Sum = typename Differences::Sum;
  // number of words in the ring for each element
  constexpr std::size_t kLanes = kComponents == 3 ? 4 : kComponents;
  const std::size_t count = kComponents > 0 ? kComponents : components_.size();
  const std::size_t lanes = kComponents > 0 ? kLanes : count;
  std::vector<Sum> buffer(kComponents > 0 ? 0 : count);
  std::array<Sum, std::max<std::size_t>(kLanes, 1)> few;
  Sum* const sums = kComponents > 0 ? few.data() : buffer.data();
  std::uint64_t* const ring = ring_.data();
  std::uint64_t* const last = last_.data();
  struct Weighed {
    std::uint64_t back;
    Sum weight;
  };
  std::vector<Weighed> taps;
  for (const Tap& tap : taps_) taps.push_back({tap.back, Differences::weight(tap.count)});
  for (std::size_t e = 0; e < numbers.size(); ++e) {
    const std::uint64_t number = numbers[e];
    // Check only the farthest tap. If the element of another tap is unknown, the prediction uses
    // the contents of that element's place in the ring, whatever they are.
    if (!taps.empty() && known_.has(number - taps[0].back)) {
      for (std::size_t c = 0; c < lanes; ++c) sums[c] = Sum{};
      for (const Weighed& tap : taps) {
        const std::uint64_t* const remembered = ring + known_.place(number - tap.back) * lanes;
        for (std::size_t c = 0; c < lanes; ++c)
          sums[c] = Differences::add(sums[c], tap.weight, remembered[c]);
      }
    } else {
      for (std::size_t c = 0; c < count; ++c) sums[c] = Differences::sum_of(last[c]);
    }
    std::uint64_t* const self = ring + known_.place(number) * lanes;
    for (std::size_t c = 0; c < count; ++c)
      self[c] = last[c] = differences.remember(code(differences, e, c, differences.index(sums[c])));
    known_.add(number);
  }
}

// --- encoding

/// Returns a domain for each component. All components must use the same kind of prediction, so
/// either all domains are evenly spaced, or all are `narrow` (values that are exact as float32), or
/// all are `floats`.
std::vector<ValueDomain> DifferenceColumn::choose_domains(
    std::span<const std::vector<std::uint64_t>> bits) const {
  std::vector<ValueDomain> domains;
  for (std::size_t c = 0; c < bits.size(); ++c) {
    if (const std::size_t source = components_[c].source; source != c) {
      domains.push_back(domains[source]);
      continue;
    }
    const ValueDomain& before = components_[c].domain;
    const bool keeps = remembers_ && info_->quantization.bits == 0 &&
                       before.kind != DomainKind::floats && still_fits(*info_, c, before, bits[c]);
    domains.push_back(keeps ? before : evenly_spaced_domain(*info_, c, bits[c]));
    if (domains[c].kind == DomainKind::floats) return std::vector<ValueDomain>(bits.size());
    if (!predicted_alike(domains[c].kind, domains[0].kind)) {
      const ValueDomain narrow{DomainKind::narrow};
      const bool all = std::all_of(bits.begin(), bits.end(), [&](const auto& component) {
        return still_fits(*info_, 0, narrow, component);
      });
      return std::vector<ValueDomain>(bits.size(), all ? narrow : ValueDomain());
    }
  }
  return domains;
}

/// Rounds values of a quantized array. If some values of a component cannot be quantized, the
/// domain of the component is not `quantized`; this function then rounds the remaining values.
void DifferenceColumn::round_to_quantized(std::span<const ValueDomain> domains,
                                          std::span<std::vector<std::uint64_t>> bits) const {
  for (std::size_t c = 0; c < bits.size(); ++c) {
    if (domains[c].kind == DomainKind::quantized) continue;
    const ValueTranslator translator(*info_, c, {DomainKind::quantized});
    for (std::uint64_t& word : bits[c])
      if (const auto index = translator.index(word)) word = translator.bits(*index);
  }
}

std::vector<std::byte> DifferenceColumn::encode_differences(std::span<const std::uint64_t> numbers,
                                                            std::span<const std::uint32_t> lags,
                                                            DifferenceScratch& scratch,
                                                            ZstdCompressor& zstd) {
  // `words` first contains the bits of the values, then their indices, and finally the residuals.
  const std::span words = std::span(scratch.words).first(components_.size());
  const std::vector<ValueDomain> domains = choose_domains(words);
  if (info_->quantization.bits > 0) round_to_quantized(domains, words);
  begin({}, domains, numbers.size());
  for (std::size_t c = 0; c < words.size(); ++c)
    with_translation(*info_, c, domains[c], [&](auto&& index_of, auto&&) {
      for (std::uint64_t& word : words[c]) word = static_cast<std::uint64_t>(index_of(word));
    });
  const std::vector<Factor> factors = choose_factors(
      info_->type, domains[0].kind, {numbers, words, ring_, ring_stride()}, known_, lags);
  begin(factors, domains, numbers.size());
  for_each_value(
      numbers, [&](const auto& differences, std::size_t e, std::size_t c, std::int64_t predicted) {
        const auto index = static_cast<std::int64_t>(words[c][e]);
        words[c][e] = differences.residual(index, predicted);
        return index;
      });

  ByteWriter out;
  out.put_varint(numbers.size());
  out.put_u8(static_cast<std::uint8_t>(factors.size()));
  for (const Factor& factor : factors) {
    out.put_varint(factor.lag);
    out.put_u8(static_cast<std::uint8_t>(factor.order));
  }
  std::vector<std::byte>& planes = scratch.planes;
  planes.clear();
  for (std::size_t c = 0; c < components_.size(); ++c) {
    if (components_[c].source != c) {
      put_copy(out, components_[c].source);
      continue;
    }
    std::uint64_t largest = 0;
    for (std::uint64_t word : words[c]) largest |= word;
    const std::uint32_t width = bytes_for(largest);
    out.put_u8(static_cast<std::uint8_t>(domains[c].kind));
    out.put_signed(domains[c].exponent);
    out.put_u8(static_cast<std::uint8_t>(width));
    const std::size_t offset = planes.size();
    planes.resize(offset + width * numbers.size());
    for (std::uint32_t b = 0; b < width; ++b)
      for (std::size_t e = 0; e < numbers.size(); ++e)
        planes[offset + b * numbers.size() + e] = static_cast<std::byte>(words[c][e] >> 8 * b);
  }
  out.put_bytes(zstd.compress(planes, kPlaneZstdLevel));
  return std::move(out.bytes);
}

auto DifferenceColumn::encode(std::span<const std::uint64_t> numbers, const std::byte* values,
                              std::size_t stride, std::span<const std::uint32_t> lags,
                              DifferenceScratch& scratch, ZstdCompressor& zstd) -> Encoded {
  scratch.words.resize(std::max(scratch.words.size(), components_.size()));
  for (std::size_t c = 0; c < components_.size(); ++c) {
    scratch.words[c].resize(numbers.size());
    load(values + c * width_, stride, width_, scratch.words[c]);
    components_[c].source = equal_component(*info_, values, stride, numbers.size(), c).value_or(c);
  }
  Encoded differences;
  if (may_differ_) {
    differences.bytes = encode_differences(numbers, lags, scratch, zstd);
    if (is_float(info_->type)) return differences;
  }
  // Also try shuffled_zstd: the integers may be material numbers or similar ids, which repeat often
  // but are hard to predict.
  const std::vector<std::byte> packed = restored_values(*info_, values, stride, numbers.size());
  Encoded shuffled{Codec::shuffled_zstd,
                   pack_shuffled(shm::shuffled(packed, width_), kPlaneZstdLevel)};
  if (may_differ_ && differences.bytes.size() <= shuffled.bytes.size()) return differences;
  remembers_ = false;
  return shuffled;
}

// --- decoding

bool DifferenceColumn::begin_group(Codec codec, std::span<const std::byte> bytes,
                                   std::uint64_t limit, ZstdDecompressor& zstd) {
  codec_ = codec;
  next_ = 0;
  const std::size_t element = components_.size() * width_;
  if (codec == Codec::differences) return read_differences(bytes, limit / element, zstd);
  remembers_ = false;
  auto unpacked = unpack_shuffled(bytes, width_, limit);
  if (!unpacked || unpacked->size() % element != 0) return false;
  unpacked_ = std::move(*unpacked);
  count_ = unpacked_.size() / element;
  return true;
}

bool DifferenceColumn::read_differences(std::span<const std::byte> bytes, std::uint64_t most,
                                        ZstdDecompressor& zstd) {
  ByteReader in(bytes);
  count_ = in.get_varint();
  if (!in.ok() || count_ == 0 || count_ > most) return false;
  std::vector<Factor> factors(in.get_u8());
  if (factors.size() > kMostFactors) return false;
  for (Factor& factor : factors) {
    factor.lag = in.get_varint32();
    factor.order = in.get_u8();
    if (factor.lag == 0 || factor.order == 0 || factor.order > kMostOrder) return false;
  }
  std::vector<ValueDomain> domains(components_.size());
  std::uint64_t planes = 0;
  for (std::size_t c = 0; c < components_.size(); ++c) {
    components_[c].source = c;
    const std::uint8_t kind = in.get_u8();
    if (kind == kCopiedComponent) {
      const auto source = get_source(in, c);
      if (!source) return false;
      components_[c].source = *source;
      components_[c].width = 0;
      domains[c] = domains[*source];
      continue;
    }
    const std::int64_t exponent = in.get_signed();
    const std::uint8_t width = in.get_u8();
    if (!in.ok() || kind >= kDomainKinds || exponent < -1074 || exponent > 1074) return false;
    domains[c].kind = static_cast<DomainKind>(kind);
    domains[c].exponent = static_cast<std::int32_t>(exponent);
    if (!may_be(*info_, domains[c]) || width > most_bytes(info_->type, domains[c].kind))
      return false;
    if (!predicted_alike(domains[c].kind, domains[0].kind)) return false;
    components_[c].width = width;
    components_[c].planes = static_cast<std::size_t>(planes);
    planes += width * count_;
  }
  if (!zstd.decompress(in.get_bytes(in.left()), planes, unpacked_)) return false;
  begin(factors, domains, count_);
  return true;
}

bool DifferenceColumn::decode(std::span<const std::uint64_t> numbers, std::vector<std::byte>& out,
                              DifferenceScratch& scratch) {
  if (numbers.size() > count_ - next_) return false;
  if (numbers.empty()) return true;
  const std::size_t bytes = components_.size() * width_;
  const std::size_t offset = out.size();
  if (codec_ == Codec::shuffled_zstd) {
    const auto from = unpacked_.begin() + static_cast<std::ptrdiff_t>(next_ * bytes);
    out.insert(out.end(), from, from + static_cast<std::ptrdiff_t>(numbers.size() * bytes));
  } else {
    out.resize(offset + numbers.size() * bytes);
    scratch.words.resize(std::max(scratch.words.size(), components_.size()));
    const std::span words = std::span(scratch.words).first(components_.size());
    for (std::size_t c = 0; c < words.size(); ++c) {
      words[c].resize(numbers.size());
      read_residuals(c, words[c]);
    }
    for_each_value(numbers, [&](const auto& differences, std::size_t e, std::size_t c,
                                std::int64_t predicted) {
      const std::size_t source = components_[c].source;
      const std::int64_t index = source != c ? static_cast<std::int64_t>(words[source][e])
                                             : differences.value(words[c][e], predicted);
      words[c][e] = static_cast<std::uint64_t>(index);
      return index;
    });
    for (std::size_t c = 0; c < words.size(); ++c) {
      if (components_[c].source != c)
        words[c] = words[components_[c].source];
      else
        with_translation(*info_, c, components_[c].domain, [&](auto&&, auto&& bits_of) {
          for (std::uint64_t& word : words[c]) word = bits_of(static_cast<std::int64_t>(word));
        });
      save(words[c], out.data() + offset + c * width_, bytes, width_);
    }
  }
  next_ += numbers.size();
  return true;
}

/// Reads the residuals of component `c` for the next out.size() elements.
void DifferenceColumn::read_residuals(std::size_t c, std::span<std::uint64_t> out) const {
  std::fill(out.begin(), out.end(), 0);
  if (components_[c].width == 0) return;  // in this case unpacked_ may be empty
  const std::byte* plane = unpacked_.data() + components_[c].planes + next_;
  for (std::uint32_t b = 0; b < components_[c].width; ++b, plane += count_)
    for (std::size_t e = 0; e < out.size(); ++e)
      out[e] |= std::to_integer<std::uint64_t>(plane[e]) << 8 * b;
}

}  // namespace shm
