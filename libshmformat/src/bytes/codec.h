// Codec: how the bitstreams of a file are coded, each under the id that names it there.
#pragma once

#include <cstdint>

namespace shm {

/// Codec ids (registered in spec/registry.md).
enum class Codec : std::uint8_t {
  paper = 1,           ///< cells: hexahedra by the published scheme
  predictive = 2,      ///< numbers predicted from the mesh, adaptive range coder
  shuffled_zstd = 4,   ///< byte planes under zstd
  rows = 6,            ///< cells: hexahedra predicted from the neighbouring row
  replay = 7,          ///< cells: hexahedra repeated from cells before, with their numbers
  mixed = 8,           ///< cells: as rows, with a mix of predictions
  columns = 9,         ///< values: chosen predictors, adaptive range coder
  mixed_columns = 10,  ///< values: as columns, with a mix of predictions
  shifts = 11,         ///< cells: the cell before, moved; with their numbers
  differences = 12,    ///< values: along the numbers of shifts, under zstd
  patterns = 13,       ///< cells: where in the cells before their vertices stand, under zstd
  terms = 14,          ///< values: from others of the cell, under zstd; with patterns
};

/// Whether values in this codec are predicted over neighbourhoods.
constexpr bool is_predicted(Codec codec) {
  return codec == Codec::columns || codec == Codec::mixed_columns;
}

}  // namespace shm
