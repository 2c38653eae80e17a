// A Hilbert curve through the bounding box of a mesh, with 2^20 grid positions along each axis.
#pragma once

#include <array>
#include <cstdint>

#include "mesh/mesh_source.h"

namespace shm::converters {

using CurvePlace = std::array<std::uint32_t, 3>;

// Returns the position of a grid point along the curve, a number below 2^60.
std::uint64_t along_curve(CurvePlace place);

// A grid over the bounding box of a mesh, with the same spacing along all axes.
class CurveGrid {
 public:
  explicit CurveGrid(MeshSource& mesh);  // reads the points once
  CurvePlace place(const std::array<double, 3>& point) const;

 private:
  std::array<double, 3> low_{};
  double scale_ = 0;
};

}  // namespace shm::converters
