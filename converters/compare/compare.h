// Comparison of two meshes, piece by piece, in bounded memory.
//
// A restored mesh must equal its source bit for bit, including NaN payloads and the sign of zero.
// Quantized values are the exception: their error is measured and must not exceed the promised
// bound, and values that are not finite must still be equal. A mesh in Order::stream equals its
// source if a renumbering of vertices and cells makes them equal (and, unless the mesh promises
// corner order, a rotation of each hexahedron). The comparison finds this renumbering by encoding
// the source again. It does not trust the renumbering but checks it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "compare/numbering.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"

namespace shm::converters {

struct MeasuredError {
  std::string what;     // "coordinates" or "array 'T'"; "array 'point/T'" if several are called T
  double largest = 0;   // largest |restored - source|
  double promised = 0;  // error bound stated in the file
};

struct CompareReport {
  std::uint64_t differences = 0;
  std::vector<std::string> first;       // descriptions of the first differences
  std::vector<MeasuredError> measured;  // errors of quantized values
  bool equal() const { return differences == 0; }
};

inline constexpr std::size_t kDifferencesInWords = 10;

// Compares all data of two meshes. `cell_order` is the order in which the cells of `source` were
// encoded in Order::free, for orders that the comparison does not try itself; may be null.
CompareReport compare_meshes(MeshSource& source, MeshSource& restored, Spool& spool,
                             const Progress& progress = {},
                             const CellSequence* cell_order = nullptr);

// Compares only data that does not change with time: everything except time steps, their values,
// and extras. If the meshes are equal, stores the numbering of the restored mesh in `numbering`.
CompareReport compare_without_steps(MeshSource& source, MeshSource& restored, Spool& spool,
                                    const Progress& progress, const CellSequence* cell_order,
                                    Numbering& numbering);

}  // namespace shm::converters
