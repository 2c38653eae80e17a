// Conversions for values that are coded as differences: from the values of a component to 64-bit
// words with the same bits, and from these bits to integer indices in a value domain. Differences
// are computed from the indices. The domain must contain all values, since escapes (values outside
// the domain) are not possible.
// spec: "Values as differences"
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "codecs/shared/value_domain.h"
#include "codecs/shifts/differences.h"

namespace shm {

/// Loads the values of one component as words. The low bytes of each word contain the bits of a
/// value. The values are in host byte order. `stride`: number of bytes from a value to the next.
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

/// Converts words back to values of one component, and stores the values at `to`. `stride`: number
/// of bytes from a value to the next.
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

/// Calls work(index_of, bits_of) with the conversion functions of a domain: index_of() converts the
/// bits of a value to its index, bits_of() converts an index back to bits. Unlike
/// ValueTranslator::index(), index_of() always returns an index. Precondition: the domain contains
/// all values.
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

/// Returns true if this domain is allowed for an array whose values are coded as differences.
/// Differences have no escapes. For a quantized array, the domain `floats` is therefore also
/// allowed: it contains every value, whereas the domain `quantized` may lack some values.
inline bool may_be(const ArrayInfo& info, const ValueDomain& domain) {
  return domain.kind != DomainKind::digits &&
         (domain.fits(info) || (is_float(info.type) && domain == ValueDomain()));
}

/// Returns true if values in the domains `a` and `b` are predicted in the same way. This must hold
/// for the domains of all components of an array.
inline bool predicted_alike(DomainKind a, DomainKind b) {
  const auto is_float = [](DomainKind kind) {
    return kind == DomainKind::floats || kind == DomainKind::narrow;
  };
  return is_float(a) || is_float(b) ? a == b : true;
}

/// Returns the largest possible size in bytes of a residual in a domain of this kind.
inline std::uint32_t most_bytes(ScalarType type, DomainKind kind) {
  if (kind == DomainKind::narrow) return 4;
  const bool as_stored = kind == DomainKind::floats || kind == DomainKind::integers;
  return as_stored ? static_cast<std::uint32_t>(scalar_bytes(type)) : 8;
}

/// Returns the number of bytes needed for each residual. `residuals`: the bitwise OR of all
/// residuals.
inline std::uint32_t bytes_for(std::uint64_t residuals) {
  return static_cast<std::uint32_t>((std::bit_width(residuals) + 7) / 8);
}

}  // namespace shm
