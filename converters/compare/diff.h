// Options and results of a comparison of two meshes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "accuracy/lossy.h"

namespace shm::converters {

struct DiffOptions {
  // Tolerances for coordinates, for fields, and for single items by name. A tolerance is lossless
  // (exact comparison), absolute or relative.
  Lossy tolerance;
  bool match = false;       // true: match vertices and cells, whatever their order
  bool with_roles = true;   // true: also compare arrays with a format-specific role, such as number
                            // maps and attributes
  bool with_extras = true;  // true: also compare sets, titles, field data, ...
  std::vector<std::string> only;  // names of the arrays to compare; empty: all arrays

  // Names of items to ignore: arrays, "coordinates", keys of extras, or paths that mean all
  // extras below them.
  std::vector<std::string> ignored;
  std::uint64_t limit = 3;  // maximum number of places listed per difference
};

// A vertex, cell, value or step at which the two meshes differ.
struct DiffPlace {
  std::string element;                // kind of element: "vertex", "cell", "value", "step"
  std::optional<std::uint64_t> a, b;  // index of the element in each mesh

  // Coordinates of the vertex in A, or the mean of the corners of the cell in A.
  std::optional<std::array<double, 3>> where;
  std::optional<std::uint64_t> step_a, step_b;
  std::optional<double> time;
  std::optional<std::uint32_t> component;
  std::string value_a, value_b;
  // Distance between the two values. Infinite if at least one value is not finite.
  std::optional<double> distance;
};

struct Finding {
  // Kind of the difference: "format", "count", "block", "type", "array", "steps", "times",
  // "coordinates", "cells", "values", "extra", "only_in_a", "only_in_b", "unmatched" or
  // "not_compared".
  std::string kind;
  std::string what;  // item that differs: "vertices", "coordinates", "array 'point/T'", "extra
                     // 'vtk/skeleton'", ...
  std::string a, b;  // descriptions of the item in A and in B; may be empty

  // Number of compared items and number of different items. Used only for values, cells, times and
  // extras.
  std::uint64_t compared = 0, different = 0;
  double largest = 0;              // largest distance
  std::optional<double> relative;  // `largest` divided by the range of A's values

  // Some of the places where the meshes differ. The place of the largest difference is first. The
  // others are the first places that were found.
  std::vector<DiffPlace> places;
};

struct MeshDiff {
  std::vector<Finding> differences, notes;
  // Count of compared values, and count of different values, in coordinates and arrays.
  std::uint64_t values_compared = 0, values_different = 0;
  struct Counts {
    std::uint64_t vertices = 0, cells = 0, blocks = 0, arrays = 0, steps = 0;
    std::string format;
  } a, b;
  std::optional<std::uint64_t> matched_vertices, matched_cells;
  bool equal() const { return differences.empty(); }
};

}  // namespace shm::converters
