#include "codecs/patterns/float_values.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <type_traits>

#include "codecs/shared/value_domain.h"

namespace shm {
namespace {

// Number of values per block. A block fits into the first-level cache.
constexpr std::size_t kBlock = 512;
template <class Bits>
using Block = std::array<Bits, kBlock>;

template <class Bits>
void take_residuals(const FloatResiduals& from, std::size_t first, std::size_t count,
                    Block<Bits>& words) {
  words.fill(0);
  for (std::uint32_t b = 0; b < from.width; ++b) {
    const std::byte* const plane = from.planes + b * from.distance + first;
    for (std::size_t i = 0; i < count; ++i)
      words[i] = static_cast<Bits>(words[i] | std::to_integer<Bits>(plane[i]) << 8 * b);
  }
  for (std::size_t i = 0; i < count; ++i)
    words[i] = static_cast<Bits>(words[i] >> 1) ^ static_cast<Bits>(0 - (words[i] & 1));
}

/// Reads `count` floating-point values and stores the index of each value in `places`. An index is
/// the position of the value if all values that the type can represent are in ascending order. The
/// index of a NaN is 0.
template <class Bits>
void take_places(const std::byte* from, std::size_t stride, std::size_t count,
                 Block<Bits>& places) {
  constexpr Bits kInfinity = sizeof(Bits) == 4 ? Bits{0x7f800000} : Bits(0x7ff0000000000000u);
  constexpr Bits kSign = Bits{1} << (8 * sizeof(Bits) - 1);
  if (stride == sizeof(Bits))
    std::memcpy(places.data(), from, count * sizeof(Bits));
  else
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(&places[i], from + i * stride, sizeof(Bits));
  for (std::size_t i = 0; i < count; ++i) {
    const Bits bits = places[i];
    const auto place = static_cast<Bits>(ordered_index_of(bits));
    places[i] = (bits & static_cast<Bits>(~kSign)) > kInfinity ? Bits{0} : place;
  }
}

template <class Bits>
std::int64_t decode(const FloatResiduals& residuals, bool changes, std::uint64_t& change,
                    const FloatPlaces& floats) {
  Block<Bits> words, places;
  auto by = static_cast<Bits>(change);
  for (std::size_t first = 0; first < floats.count; first += kBlock) {
    const std::size_t count = std::min(kBlock, floats.count - first);
    take_residuals(residuals, first, count, words);
    take_places(floats.reference + first * floats.stride, floats.stride, count, places);
    if (changes) {
      for (std::size_t i = 0; i < count; ++i) words[i] = by = static_cast<Bits>(by + words[i]);
    } else {
      by = words[count - 1];
    }
    for (std::size_t i = 0; i < count; ++i)
      words[i] = ordered_bits<Bits>(static_cast<std::int64_t>(places[i] + words[i]));
    std::byte* const to = floats.values + first * floats.stride;
    if (floats.stride == sizeof(Bits))
      std::memcpy(to, words.data(), count * sizeof(Bits));
    else
      for (std::size_t i = 0; i < count; ++i)
        std::memcpy(to + i * floats.stride, &words[i], sizeof(Bits));
  }
  change = by;
  Bits last;
  std::memcpy(&last, floats.values + (floats.count - 1) * floats.stride, sizeof last);
  return ordered_index_of(last);
}

}  // namespace

std::int64_t decode_floats(ScalarType type, const FloatResiduals& residuals, bool changes,
                           std::uint64_t& change, const FloatPlaces& floats) {
  return type == ScalarType::float32 ? decode<std::uint32_t>(residuals, changes, change, floats)
                                     : decode<std::uint64_t>(residuals, changes, change, floats);
}

}  // namespace shm
