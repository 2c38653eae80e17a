// The difference of any two meshes, of whatever formats: what differs, by how much, and where.
// Numbers of vertices, cells, steps and components count from 0, as in the files.
//
// Of one format, all is compared. Between formats, what both can say: coordinates, cells, fields
// (a vector also against its components apart), strings of legacy VTK and VTU, times, ids of blocks
// where VTK has them as an array; what only one of them knows (number maps, sets, titles, field
// data) is not, and other scalar types are a note, no difference. A format without steps is taken
// to hold the last one.
//
// Memory: bounded; with `match`, see mesh_match.h.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/lossy.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct DiffOptions {
  // Tolerances: lossless (exact), absolute or relative. Coordinates, fields, and those by name.
  Lossy tolerance;
  bool match = false;                // vertices and cells may be in any order
  bool with_roles = true;            // arrays that only one format knows: number maps, attributes
  bool with_extras = true;           // sets, titles, field data, ...
  std::vector<std::string> only;     // of the arrays, only these; empty: all
  std::vector<std::string> ignored;  // arrays, "coordinates", extras (also all below a path)
  std::uint64_t limit = 3;           // places told of one difference
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

// Throws misuse for names that fit nothing in either mesh.
MeshDiff diff_meshes(MeshSource& a, MeshSource& b, const DiffOptions& options, Spool& spool,
                     const Progress& progress = {});

}  // namespace shm::converters
