// Compares a restored mesh with its source, piece by piece, in bounded memory.
//
// A restored mesh must equal its source bit for bit, including NaN payloads and the sign of zero.
// Quantized values are an exception: their error is measured, and must not exceed the error bound
// stated in the file. Quantized values that are not finite must still be equal. A mesh in
// Order::stream or Order::free equals its source if a renumbering of vertices and cells makes the
// two equal. Unless the mesh keeps the order of corners, each hexahedron may also be rotated. The
// comparison encodes the source again to find this renumbering, and then checks that the
// renumbering is correct.
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
  std::string what;     // "coordinates" or "array 'T'"; "array 'point/T'" if several arrays are
                        // called T
  double largest = 0;   // largest |restored - source|
  double promised = 0;  // error bound stated in the file; infinite if it is relative to each value
  // Largest |restored - source| / |source|, and its bound; 0 unless the bound is relative to each
  // value.
  double largest_relative = 0, promised_relative = 0;
  // Number, range, and sum of squared errors of the finite values that are not fill values
  std::uint64_t values = 0;
  double minimum = 0, maximum = 0, squares = 0;

  double rms() const;  // root mean square of the errors
  // Peak signal-to-noise ratio in decibels; infinite if all errors are 0.
  double psnr() const;
};

struct CompareReport {
  std::uint64_t differences = 0;
  std::vector<std::string> first;       // descriptions of the first differences
  std::vector<MeasuredError> measured;  // errors of quantized values
  bool equal() const { return differences == 0; }
};

inline constexpr std::size_t kDifferencesInWords = 10;

// Compares all data of two meshes. If the cells of `source` were encoded in Order::free,
// `cell_order` may state the order in which they were encoded. It may be null if this order is one
// of those that the comparison tries itself.
CompareReport compare_meshes(MeshSource& source, MeshSource& restored, Spool& spool,
                             const Progress& progress = {},
                             const CellSequence* cell_order = nullptr);

// Compares only data that does not change with time: everything except time steps, their values,
// and extras. If the meshes are equal, sets `numbering` to the map from restored vertices and cells
// to vertices and cells of the source.
CompareReport compare_without_steps(MeshSource& source, MeshSource& restored, Spool& spool,
                                    const Progress& progress, const CellSequence* cell_order,
                                    Numbering& numbering);

}  // namespace shm::converters
