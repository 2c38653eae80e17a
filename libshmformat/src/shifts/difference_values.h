// Values of a component as words, and as indices of a domain without escapes: what differences are
// made between.
// spec: "Values as differences"
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "shifts/differences.h"
#include "values/value_domain.h"

namespace shm {

/// Values of one component, `stride` bytes apart, in host order, as bits in the low bytes.
template <class Bits>
void load_as(const std::byte* values, std::size_t stride, std::span<std::uint64_t> bits) {
  for (std::uint64_t& word : bits) {
    Bits value;
    std::memcpy(&value, values, sizeof value);
    word = value;
    values += stride;
  }
}
inline void load(const std::byte* values, std::size_t stride, std::size_t width,
                 std::span<std::uint64_t> bits) {
  switch (width) {
    case 1: return load_as<std::uint8_t>(values, stride, bits);
    case 2: return load_as<std::uint16_t>(values, stride, bits);
    case 4: return load_as<std::uint32_t>(values, stride, bits);
    default: return load_as<std::uint64_t>(values, stride, bits);
  }
}

template <class Bits>
void save_as(std::span<const std::uint64_t> bits, std::byte* to, std::size_t stride) {
  for (std::uint64_t word : bits) {
    const auto value = static_cast<Bits>(word);
    std::memcpy(to, &value, sizeof value);
    to += stride;
  }
}
inline void save(std::span<const std::uint64_t> bits, std::byte* to, std::size_t stride,
                 std::size_t width) {
  switch (width) {
    case 1: return save_as<std::uint8_t>(bits, to, stride);
    case 2: return save_as<std::uint16_t>(bits, to, stride);
    case 4: return save_as<std::uint32_t>(bits, to, stride);
    default: return save_as<std::uint64_t>(bits, to, stride);
  }
}

/// Indices of values and back. Unlike a ValueTranslator it has one for every integer; of the other
/// domains all values must have one.
template <class Work>
decltype(auto) with_translation(const ArrayInfo& info, std::size_t component,
                                const ValueDomain& domain, Work&& work) {
  if (domain.kind == DomainKind::integers)
    return work([whole = WholeDifferences::of(info.type)](
                    std::uint64_t bits) { return whole.within(bits); },
                [](std::int64_t index) { return static_cast<std::uint64_t>(index); });
  if (domain.kind == DomainKind::floats && info.type == ScalarType::float32)
    return work(
        [](std::uint64_t bits) { return ordered_index_of(static_cast<std::uint32_t>(bits)); },
        [](std::int64_t index) -> std::uint64_t { return ordered_bits<std::uint32_t>(index); });
  if (domain.kind == DomainKind::floats)
    return work([](std::uint64_t bits) { return ordered_index_of(bits); },
                [](std::int64_t index) { return ordered_bits<std::uint64_t>(index); });
  const ValueTranslator translator(info, component, domain);
  return work([&translator](std::uint64_t bits) { return translator.index(bits).value_or(0); },
              [&translator](std::int64_t index) { return translator.bits(index); });
}

/// Whether all values of an array may be of a domain without escapes. A quantized one may hold
/// values that would be: then all are coded as they are stored.
inline bool may_be(const ArrayInfo& info, const ValueDomain& domain) {
  return domain.kind != DomainKind::digits &&
         (domain.fits(info) || (is_float(info.type) && domain == ValueDomain()));
}

/// Whether components of these domains are predicted alike, as those of an array must be.
inline bool predicted_alike(DomainKind a, DomainKind b) {
  const auto is_float = [](DomainKind kind) {
    return kind == DomainKind::floats || kind == DomainKind::narrow;
  };
  return is_float(a) || is_float(b) ? a == b : true;
}

/// Most bytes of a residual.
inline std::uint32_t most_bytes(ScalarType type, DomainKind kind) {
  if (kind == DomainKind::narrow) return 4;
  const bool as_stored = kind == DomainKind::floats || kind == DomainKind::integers;
  return as_stored ? static_cast<std::uint32_t>(scalar_bytes(type)) : 8;
}

/// Bytes of the largest residual.
inline std::uint32_t bytes_for(std::uint64_t residuals) {
  return static_cast<std::uint32_t>((std::bit_width(residuals) + 7) / 8);
}

}  // namespace shm
