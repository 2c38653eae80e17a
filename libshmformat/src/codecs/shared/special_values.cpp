#include "codecs/shared/special_values.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/packing.h"
#include "codecs/shared/value_domain.h"

namespace shm {
namespace {

constexpr std::size_t kMostDifferent = 255;

void put_scalar(ByteWriter& out, std::uint64_t bits, std::size_t width) {
  for (std::size_t i = 0; i < width; ++i) out.put_u8(static_cast<std::uint8_t>(bits >> (8 * i)));
}

std::uint64_t get_scalar(ByteReader& in, std::size_t width) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < width; ++i) bits |= std::uint64_t{in.get_u8()} << (8 * i);
  return bits;
}

/// Returns true if any of the scalars is not finite. This loop is fast, because most arrays contain
/// only finite values.
template <class Bits>
bool any_not_finite(const std::byte* values, std::size_t stride, std::size_t components,
                    std::size_t count) {
  constexpr Bits kExponent =
      sizeof(Bits) == 4 ? Bits{0x7f800000} : static_cast<Bits>(0x7ff0000000000000);
  Bits any = 0;
  if (stride == components * sizeof(Bits)) {
    count *= components;
    components = 1;
    stride = sizeof(Bits);
  }
  for (std::size_t i = 0; i < count; ++i, values += stride)
    for (std::size_t c = 0; c < components; ++c) {
      Bits bits = 0;
      std::memcpy(&bits, values + c * sizeof(Bits), sizeof bits);
      any |= (bits & kExponent) == kExponent ? Bits{1} : Bits{0};
    }
  return any != 0;
}

}  // namespace

SpecialTest::SpecialTest(const ArrayInfo& info)
    : exponent_(info.type == ScalarType::float32 ? 0x7f800000 : 0x7ff0000000000000) {
  for (const double fill : info.fills)
    fills_.push_back(info.type == ScalarType::float32
                         ? std::bit_cast<std::uint32_t>(static_cast<float>(fill))
                         : std::bit_cast<std::uint64_t>(fill));
}

void replace_special(const ArrayInfo& info, std::span<std::byte> values) {
  const SpecialTest is_special(info);
  const std::size_t width = scalar_bytes(info.type), stride = width * info.components;
  for (std::size_t c = 0; c < stride; c += width) {
    // The elements before the first value that is not special receive that value.
    std::size_t first = c;
    while (first < values.size() && is_special(load_scalar(values.data() + first, width)))
      first += stride;
    std::uint64_t last = first < values.size() ? load_scalar(values.data() + first, width) : 0;
    for (std::size_t i = c; i < values.size(); i += stride) {
      std::byte* at = values.data() + i;
      if (i < first || is_special(load_scalar(at, width)))
        store_scalar(at, last, width);
      else
        last = load_scalar(at, width);
    }
  }
}

// --- encoder

std::optional<SpecialValues> SpecialValues::find(const ArrayInfo& info, const std::byte* values,
                                                 std::size_t stride, std::size_t count) {
  if (!is_float(info.type) || count == 0) return std::nullopt;
  const std::size_t width = scalar_bytes(info.type);
  const bool any = width == 4
                       ? any_not_finite<std::uint32_t>(values, stride, info.components, count)
                       : any_not_finite<std::uint64_t>(values, stride, info.components, count);
  if (!any && info.fills.empty()) return std::nullopt;
  const SpecialTest is_special(info);
  SpecialValues found;
  found.width_ = width;
  std::uint64_t gap = 0;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < info.components; ++c) {
      const std::uint64_t bits = load_scalar(values + i * stride + c * width, width);
      if (!is_special(bits)) {
        ++gap;
        continue;
      }
      if (gap == 0 && !found.runs_.empty() && found.values_[found.runs_.back().value] == bits) {
        ++found.runs_.back().length;
        continue;
      }
      const auto known = std::find(found.values_.begin(), found.values_.end(), bits);
      const auto value = static_cast<std::size_t>(known - found.values_.begin());
      if (known == found.values_.end()) {
        if (value == kMostDifferent) return std::nullopt;
        found.values_.push_back(bits);
      }
      found.runs_.push_back({gap, 1, static_cast<std::uint8_t>(value)});
      gap = 0;
    }
  if (found.runs_.empty()) return std::nullopt;
  return found;
}

std::vector<std::byte> plain_values(const ArrayInfo& info, const std::byte* values,
                                    std::size_t stride, std::size_t count) {
  const std::size_t bytes = scalar_bytes(info.type) * info.components;
  std::vector<std::byte> plain(count * bytes);
  for (std::size_t i = 0; i < count; ++i)
    std::copy_n(values + i * stride, bytes, plain.data() + i * bytes);
  replace_special(info, plain);
  return plain;
}

void SpecialValues::put_runs(ByteWriter& out) const {
  out.put_u8(static_cast<std::uint8_t>(values_.size()));
  for (const std::uint64_t bits : values_) put_scalar(out, bits, width_);
  ByteWriter gaps, lengths;
  for (const Run& run : runs_) gaps.put_varint(run.gap), lengths.put_varint(run.length);
  out.put_varint(runs_.size());
  out.put_varint(gaps.bytes.size());
  out.put_varint(lengths.bytes.size());
  out.put_bytes(gaps.bytes);
  out.put_bytes(lengths.bytes);
  if (values_.size() > 1)
    for (const Run& run : runs_) out.put_u8(run.value);
}

std::vector<std::byte> SpecialValues::encode(bool are_those_of_reference) const {
  ByteWriter blob, bytes, out;
  if (are_those_of_reference)
    blob.put_u8(0);
  else
    put_runs(blob);
  put_packed(bytes, blob.bytes, Packing::bounded);
  out.put_varint(bytes.bytes.size());
  out.put_bytes(bytes.bytes);
  return std::move(out.bytes);
}

ReferenceValues PlainReference::of(const ArrayInfo& info, const ReferenceValues& reference) {
  values_.assign(reference.values.begin(), reference.values.end());
  last_.assign(reference.last.begin(), reference.last.end());
  replace_special(info, values_);
  replace_special(info, last_);
  return {values_, last_};
}

// --- decoder

std::optional<SpecialValuesDecoder> SpecialValuesDecoder::read(
    const ArrayInfo& info, std::span<const std::byte>& bytes, std::uint64_t scalars,
    std::span<const std::byte> reference) {
  if (!is_float(info.type)) return std::nullopt;
  ByteReader in(bytes);
  ByteReader head(in.get_bytes(in.get_varint()));
  if (!in.ok()) return std::nullopt;
  bytes = bytes.last(to_size(in.left()));
  SpecialValuesDecoder decoder;
  decoder.width_ = scalar_bytes(info.type);
  // Every scalar may be a run of its own, with a gap of 0 and an index.
  const std::uint64_t most = std::min(4096 + 4 * scalars, kMostUnpackedEach * head.left());
  auto unpacked = get_packed(head, most);
  if (!unpacked || head.left() != 0) return std::nullopt;
  decoder.unpacked_ = std::move(*unpacked);
  ByteReader blob(decoder.unpacked_);
  if (!reference.empty() && blob.left() == 1) {
    const std::size_t stride = decoder.width_ * info.components;
    const auto found =
        SpecialValues::find(info, reference.data(), stride, reference.size() / stride);
    if (!found || blob.get_u8() != 0) return std::nullopt;
    ByteWriter runs;
    found->put_runs(runs);
    decoder.unpacked_ = std::move(runs.bytes);
    blob = ByteReader(decoder.unpacked_);
  }
  if (!decoder.read_runs(blob)) return std::nullopt;
  return decoder;
}

bool SpecialValuesDecoder::read_runs(ByteReader& in) {
  const std::size_t different = in.get_u8();
  for (std::size_t i = 0; i < different; ++i) values_.push_back(get_scalar(in, width_));
  runs_ = in.get_varint();
  const std::uint64_t gaps = in.get_varint(), lengths = in.get_varint();
  const std::uint64_t indices = different > 1 ? runs_ : 0;
  if (!in.ok() || different == 0 || runs_ == 0) return false;
  if (gaps > in.left() || lengths > in.left() - gaps || in.left() - gaps - lengths != indices)
    return false;
  gap_at_ = unpacked_.size() - to_size(in.left());
  gap_end_ = length_at_ = gap_at_ + to_size(gaps);
  length_end_ = value_at_ = length_at_ + to_size(lengths);
  return next_run();
}

/// Reads the next run. Precondition: `runs_` is above 0.
bool SpecialValuesDecoder::next_run() {
  const auto get = [&](std::size_t& at) {
    ByteReader in(std::span<const std::byte>(unpacked_).subspan(at));
    const std::uint64_t number = in.get_varint();
    at = unpacked_.size() - to_size(in.left());
    return in.ok() ? number : ~std::uint64_t{0};
  };
  to_run_ = get(gap_at_);
  in_run_ = get(length_at_);
  std::size_t value = 0;
  if (values_.size() > 1) value = std::to_integer<std::size_t>(unpacked_[value_at_++]);
  constexpr std::uint64_t kMost = std::uint64_t{1} << 48;
  if (to_run_ > kMost || in_run_ > kMost || in_run_ == 0 || value >= values_.size()) return false;
  if (runs_ == 1 && (gap_at_ != gap_end_ || length_at_ != length_end_)) return false;
  bits_ = values_[value];
  return true;
}

bool SpecialValuesDecoder::restore(std::span<std::byte> values) {
  std::uint64_t left = values.size() / width_;
  std::byte* at = values.data();
  while (runs_ > 0 && left > 0) {
    const std::uint64_t skipped = std::min(left, to_run_);
    to_run_ -= skipped, left -= skipped, at += skipped * width_;
    const std::uint64_t restored = std::min(left, in_run_);
    if (to_run_ > 0 || restored == 0) break;
    for (std::uint64_t i = 0; i < restored; ++i, at += width_) store_scalar(at, bits_, width_);
    in_run_ -= restored, left -= restored;
    if (in_run_ == 0 && --runs_ > 0 && !next_run()) return false;
  }
  return true;
}

}  // namespace shm
