// Codec: the methods by which bitstreams are coded. The enumerators have the ids that files store.
#pragma once

#include <cstdint>

namespace shm {

/// Codec ids, registered in spec/registry.md.
enum class Codec : std::uint8_t {
  paper = 1,          ///< cells: hexahedra by the published method
  predictive = 2,     ///< numbers predicted from the mesh, coded by an adaptive range coder
  shuffled_zstd = 4,  ///< values: bytes sorted by significance, compressed by zstd
  rows = 6,           ///< cells: hexahedra predicted from the neighbouring row
  replay = 7,   ///< cells: hexahedra coded as repetitions of earlier cells, together with their
                ///< vertex numbers
  mixed = 8,    ///< cells: as `rows`, with several predictions mixed
  columns = 9,  ///< values: by selected predictors, coded by an adaptive range coder
  mixed_columns = 10,  ///< values: as `columns`, with several predictions mixed
  shifts = 11,       ///< cells: as the previous cell plus a shift, together with the vertex numbers
  differences = 12,  ///< values: predicted along the vertex numbers of `shifts`, compressed by zstd
  patterns = 13,     ///< cells: as positions of their vertices in earlier cells, compressed by zstd
  terms = 14,  ///< values: predicted from other values of the cell, compressed by zstd; used with
               ///< `patterns`
};

/// Returns true if values in this codec are predicted over neighbourhoods.
constexpr bool is_predicted(Codec codec) {
  return codec == Codec::columns || codec == Codec::mixed_columns;
}

}  // namespace shm
