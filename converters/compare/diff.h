// What a comparison of two meshes is asked for, and what it finds.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/lossy.h"

namespace shm::converters {

struct DiffOptions {
  // Tolerances: lossless (exact), absolute or relative. Coordinates, fields, and those by name.
  Lossy tolerance;
  bool match = false;                // vertices and cells may be in any order
  bool with_roles = true;            // arrays that only one format knows: number maps, attributes
  bool with_extras = true;           // sets, titles, field data, ...
  std::vector<std::string> only;     // of the arrays, only these; empty: all
  std::vector<std::string> ignored;  // arrays, "coordinates", extras (also all below a path)
  std::uint64_t limit = 3;           // places listed of one difference
};

// One place where two things differ.
struct DiffPlace {
  std::string element;                         // "vertex", "cell", "value", "step"
  std::optional<std::uint64_t> a, b;           // its number in each mesh
  std::optional<std::array<double, 3>> where;  // in A; of a cell: mean of its corners
  std::optional<std::uint64_t> step_a, step_b;
  std::optional<double> time;
  std::optional<std::uint32_t> component;
  std::string value_a, value_b;
  std::optional<double> distance;  // infinity: not both finite
};

struct Finding {
  // "format", "count", "block", "type", "array", "steps", "times", "coordinates", "cells",
  // "values", "extra", "only_in_a", "only_in_b", "unmatched", "not_compared"
  std::string kind;
  std::string what;  // "vertices", "coordinates", "array 'point/T'", "extra 'vtk/skeleton'", ...
  std::string a, b;  // of both, in words; may be empty
  // Values, cells, times, extras:
  std::uint64_t compared = 0, different = 0;
  double largest = 0;              // distance
  std::optional<double> relative;  // the same as a part of the range of A's values
  std::vector<DiffPlace> places;   // the largest distance first, then the first ones
};

struct MeshDiff {
  std::vector<Finding> differences, notes;
  std::uint64_t values_compared = 0, values_different = 0;  // coordinates and arrays
  struct Counts {
    std::uint64_t vertices = 0, cells = 0, blocks = 0, arrays = 0, steps = 0;
    std::string format;
  } a, b;
  std::optional<std::uint64_t> matched_vertices, matched_cells;
  bool equal() const { return differences.empty(); }
};

}  // namespace shm::converters
