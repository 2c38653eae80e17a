// The structured data sets of VTK: points in rows, layers and a stack of them, cells between
// neighbours. Cells are hexahedra; where one or two dimensions are 1, quads or lines; a single
// point is a vertex. Points run x fastest, cells too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

class Lattice {
 public:
  // Points along each axis. Nothing when there are more points than a file can have.
  static std::optional<Lattice> of(const std::array<std::uint64_t, 3>& dimensions);

  std::uint64_t dimension(std::size_t axis) const { return dimensions_[axis]; }
  std::uint64_t points() const { return points_; }
  std::uint64_t cells() const { return cells_; }
  // The one block of its cells. Must not be called when there are none.
  BlockInfo block() const;
  // The corners of a cell in VTK's order. Valid until the next call.
  std::span<const std::uint64_t> corners(std::uint64_t cell);

 private:
  std::array<std::uint64_t, 3> dimensions_{}, cell_dimensions_{};
  std::uint64_t points_ = 0, cells_ = 0;
  std::size_t nodes_ = 1;                   // of a cell
  std::array<std::uint64_t, 8> offsets_{};  // of its corners from the first one
  std::array<std::uint64_t, 8> corners_{};
};

// Coordinates along one axis: given one by one, or evenly spaced ones without end.
struct Axis {
  std::vector<double> values;  // empty: evenly spaced
  double origin = 0, spacing = 1;
  std::int64_t first = 0;  // number of the first point, counted from `origin`
  double operator()(std::uint64_t index) const {
    if (!values.empty()) return values[index];
    // As vtkImageData does it.
    return origin + static_cast<double>(first + static_cast<std::int64_t>(index)) * spacing;
  }
};

// Points of rectilinear and image data, made when they are asked for.
struct LatticePoints {
  std::array<Axis, 3> axes;
  ScalarType type = ScalarType::float64;  // float32 or float64
  // Fills `out` with `count` points of `lattice` from `first` on.
  void read(const Lattice& lattice, std::uint64_t first, std::uint64_t count, std::byte* out) const;
};

// What DIMENSIONS or EXTENT of a skeleton states; nothing when it is not possible.
std::optional<Lattice> lattice_of(const Entry& entry);

// The points that a skeleton of rectilinear or image data states. `extra` finds an extra by its
// key, null when it is absent. Nothing, and what is wrong in `problem`, when they do not fit.
using FindExtra = std::function<const Extra*(const std::string& key)>;
std::optional<LatticePoints> lattice_points_of(const Skeleton& skeleton, const FindExtra& extra,
                                               std::string& problem);

}  // namespace shm::converters::vtk
