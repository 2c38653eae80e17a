// Codec: enumeration of the methods by which bitstreams are coded. The value of each enumerator is
// the id that files store.
#pragma once

#include <cstdint>

namespace shm {

/// Codec ids, registered in spec/registry.md.
enum class Codec : std::uint8_t {
  paper = 1,           ///< codes hexahedra by the published method
  predictive = 2,      ///< predicts numbers from the mesh and codes them by an adaptive range coder
  shuffled_zstd = 4,   ///< sorts the bytes of values by significance and compresses them by zstd
  rows = 6,            ///< predicts each hexahedron from the neighbouring row
  replay = 7,          ///< codes hexahedra and their vertex numbers as repetitions of earlier cells
  mixed = 8,           ///< codes hexahedra like `rows`, but mixes several predictions
  columns = 9,         ///< codes values by selected predictors and an adaptive range coder
  mixed_columns = 10,  ///< codes values like `columns`, but mixes several predictions
  shifts = 11,         ///< codes a cell and its vertex numbers as the previous cell plus a shift
  differences = 12,    ///< predicts values along the vertex numbers of `shifts`; uses zstd
  patterns = 13,  ///< codes a cell by the positions of its vertices in earlier cells; uses zstd
  terms = 14,     ///< predicts values from values of other vertices of the cell; uses zstd
};

/// Returns true if values in this codec are predicted over neighbourhoods.
constexpr bool is_predicted(Codec codec) {
  return codec == Codec::columns || codec == Codec::mixed_columns;
}

}  // namespace shm
