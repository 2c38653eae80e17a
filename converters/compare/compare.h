// Comparison of two meshes, piece by piece, in bounded memory.
// A restored mesh must equal its source bit for bit (NaN payloads and the sign of zero included),
// except where its values were quantized: there the error is measured and must stay within
// the promise, and values that are not finite must still be equal.
// A mesh in Order::stream is equal to its source when a renumbering of vertices and cells (and,
// unless it promises corner order, a rotation of each hexahedron) makes it so; the comparison
// finds that renumbering by encoding the source again, and then checks it without trusting it.
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
  std::string what;     // "coordinates", "array 'T'", or "array 'point/T'" where T is not alone
  double largest = 0;   // |restored - source|
  double promised = 0;  // the bound that the file gives
};

struct CompareReport {
  std::uint64_t differences = 0;
  std::vector<std::string> first;       // the first of them in words
  std::vector<MeasuredError> measured;  // of what is quantized
  bool equal() const { return differences == 0; }
};

inline constexpr std::size_t kDifferencesInWords = 10;

// `cell_order`, may be null: the order that the cells of `source` were put in for Order::free,
// where it is none of those that are tried.
CompareReport compare_meshes(MeshSource& source, MeshSource& restored, Spool& spool,
                             const Progress& progress = {},
                             const CellSequence* cell_order = nullptr);

// The same of what does not change with time: all but time steps, values at these, and extras.
// `numbering`: how the restored mesh is numbered, where it is equal.
CompareReport compare_without_steps(MeshSource& source, MeshSource& restored, Spool& spool,
                                    const Progress& progress, const CellSequence* cell_order,
                                    Numbering& numbering);

}  // namespace shm::converters
