// Lattice: the points and cells of VTK's structured data sets. Points form rows, rows form layers,
// and layers form a stack. The corners of a cell are neighbouring points. Cells are hexahedra if
// all dimensions exceed 1, quads if one dimension is 1, and lines if two dimensions are 1. A single
// point is a vertex cell. Points and cells are numbered with x fastest.
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
  // Returns the lattice with `dimensions` points along the three axes. Returns nothing if there are
  // more points than a file can have.
  static std::optional<Lattice> of(const std::array<std::uint64_t, 3>& dimensions);

  std::uint64_t dimension(std::size_t axis) const { return dimensions_[axis]; }
  std::uint64_t points() const { return points_; }
  std::uint64_t cells() const { return cells_; }
  // Returns the block that contains all cells of the lattice. Precondition: cells() > 0.
  BlockInfo block() const;
  // Returns the corners of a cell in VTK's order. The returned span is valid until the next call.
  std::span<const std::uint64_t> corners(std::uint64_t cell);

 private:
  std::array<std::uint64_t, 3> dimensions_{}, cell_dimensions_{};
  std::uint64_t points_ = 0, cells_ = 0;
  std::size_t nodes_ = 1;  // nodes per cell

  // For each corner of a cell, its vertex number minus the vertex number of the first corner. The
  // differences are the same for all cells.
  std::array<std::uint64_t, 8> offsets_{};
  std::array<std::uint64_t, 8> corners_{};
};

// Coordinates of the points along one axis: either a list of coordinates, or an unlimited sequence
// of evenly spaced coordinates.
struct Axis {
  std::vector<double> values;  // listed coordinates; empty if the points are evenly spaced
  double origin = 0, spacing = 1;
  std::int64_t first = 0;  // number of the first point on the axis; point 0 is at `origin`
  double operator()(std::uint64_t index) const {
    if (!values.empty()) return values[index];
    // vtkImageData uses the same expression. The values are therefore bit-identical to VTK's.
    return origin + static_cast<double>(first + static_cast<std::int64_t>(index)) * spacing;
  }
};

// The points of rectilinear and image data, which are computed when they are read.
struct LatticePoints {
  std::array<Axis, 3> axes;
  ScalarType type = ScalarType::float64;  // float32 or float64

  // Stores `count` points of `lattice` at `out`, starting with point `first`.
  void read(const Lattice& lattice, std::uint64_t first, std::uint64_t count, std::byte* out) const;
};

// Returns the lattice whose size is stated by `entry`, a line DIMENSIONS or EXTENT of the file.
// Returns nothing if the numbers in this line are invalid.
std::optional<Lattice> lattice_of(const Entry& entry);

// Computes the points of rectilinear or image data from the dimensions and axes in `skeleton`,
// which describes the file without its numbers (see vtk.h). `extra(key)` returns the extra with
// this key, or null if no such extra exists. If dimensions and axes are inconsistent, returns
// nothing and describes the problem in `problem`.
using FindExtra = std::function<const Extra*(const std::string& key)>;
std::optional<LatticePoints> lattice_points_of(const Skeleton& skeleton, const FindExtra& extra,
                                               std::string& problem);

}  // namespace shm::converters::vtk
