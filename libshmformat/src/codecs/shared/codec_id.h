// Codec: the methods by which bitstreams are coded. Files store the value of the enumerator as the
// codec's id.
#pragma once

#include <cstdint>

namespace shm {

/// Codec ids, registered in spec/registry.md.
enum class Codec : std::uint8_t {
  paper = 1,       ///< codes hexahedra by the published method
  predictive = 2,  ///< predicts vertex and cell numbers, and codes the residuals with an adaptive
                   ///< range coder
  shuffled_zstd = 4,   ///< rearranges the bytes of values by significance, and compresses them with
                       ///< zstd
  rows = 6,            ///< predicts each hexahedron from the neighbouring row
  replay = 7,          ///< codes hexahedra and vertex numbers as repetitions of earlier hexahedra
  mixed = 8,           ///< codes hexahedra like `rows`, but mixes several predictions
  columns = 9,         ///< predicts values with selected predictors, and codes residuals with an
                       ///< adaptive range coder
  mixed_columns = 10,  ///< codes values like `columns`, but mixes several predictions of each bit
  shifts = 11,         ///< codes a cell as the previous cell with a shift added to each vertex
                       ///< number
  differences = 12,    ///< for segments coded with `shifts`: predicts a value from elements with
                       ///< smaller numbers; uses zstd
  patterns = 13,  ///< codes a cell by the positions at which its vertices occur in earlier cells;
                  ///< uses zstd
  terms = 14,     ///< predicts values from other vertices of the same cell; uses zstd
  bundle = 15,    ///< codes values of several arrays at several steps together; uses zstd
  weighted = 16,  ///< for step values: predicts a value as a weighted sum of neighbours
};

/// Codec ids from 128 to 191 mean: the codec with this id minus 128, with special values coded
/// apart. Frozen: part of the format.
inline constexpr std::uint8_t kSpecialValues = 0x80;
constexpr bool has_special_values(Codec codec) {
  return (static_cast<std::uint8_t>(codec) & 0xc0) == kSpecialValues;
}
constexpr Codec with_special_values(Codec codec) {
  return static_cast<Codec>(static_cast<std::uint8_t>(codec) | kSpecialValues);
}
constexpr Codec without_special_values(Codec codec) {
  return has_special_values(codec)
             ? static_cast<Codec>(static_cast<std::uint8_t>(codec) - kSpecialValues)
             : codec;
}

/// Returns true if this codec predicts values from neighbourhoods.
constexpr bool is_predicted(Codec codec) {
  const Codec plain = without_special_values(codec);
  return plain == Codec::columns || plain == Codec::mixed_columns;
}

/// Returns true if a decoder of step values with this codec needs the neighbourhoods of elements.
constexpr bool needs_neighbours(Codec codec) {
  return is_predicted(codec) || without_special_values(codec) == Codec::weighted;
}

}  // namespace shm
