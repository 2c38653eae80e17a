// Options and results of a comparison of two meshes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/lossy.h"

namespace shm::converters {

struct DiffOptions {
  // Tolerances for coordinates, for fields, and by name: lossless (exact), absolute or relative.
  Lossy tolerance;
  bool match = false;       // vertices and cells may be in any order
  bool with_roles = true;   // compare arrays that only one format knows: number maps, attributes
  bool with_extras = true;  // compare sets, titles, field data, ...
  std::vector<std::string> only;     // compare only these arrays; empty: all
  std::vector<std::string> ignored;  // arrays, "coordinates", extras (also everything below a path)
  std::uint64_t limit = 3;           // maximum number of places listed per difference
};

// A place at which the two meshes differ.
struct DiffPlace {
  std::string element;                         // "vertex", "cell", "value", "step"
  std::optional<std::uint64_t> a, b;           // its number in each mesh
  std::optional<std::array<double, 3>> where;  // point in A; for a cell: mean of its corners
  std::optional<std::uint64_t> step_a, step_b;
  std::optional<double> time;
  std::optional<std::uint32_t> component;
  std::string value_a, value_b;
  std::optional<double> distance;  // infinity: at least one value is not finite
};

struct Finding {
  // "format", "count", "block", "type", "array", "steps", "times", "coordinates", "cells",
  // "values", "extra", "only_in_a", "only_in_b", "unmatched", "not_compared"
  std::string kind;
  std::string what;  // "vertices", "coordinates", "array 'point/T'", "extra 'vtk/skeleton'", ...
  std::string a, b;  // descriptions of both sides; may be empty
  // For values, cells, times and extras:
  std::uint64_t compared = 0, different = 0;
  double largest = 0;              // largest distance
  std::optional<double> relative;  // largest distance as a fraction of the range of A's values
  std::vector<DiffPlace> places;   // the largest distance first, then the first ones found
};

struct MeshDiff {
  std::vector<Finding> differences, notes;
  std::uint64_t values_compared = 0, values_different = 0;  // values of coordinates and arrays
  struct Counts {
    std::uint64_t vertices = 0, cells = 0, blocks = 0, arrays = 0, steps = 0;
    std::string format;
  } a, b;
  std::optional<std::uint64_t> matched_vertices, matched_cells;
  bool equal() const { return differences.empty(); }
};

}  // namespace shm::converters
