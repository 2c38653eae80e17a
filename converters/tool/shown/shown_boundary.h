// The boundary surface that commands show, of whatever they are given: a .shm file, read for what
// is needed alone, or any other mesh; with one number for each vertex, or for each face, of the
// array that the user names.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/spool.h"
#include "picture/shown_range.h"
#include "picture/surface.h"
#include "shm/boundary_surface.h"
#include "shm/schema.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/shown/array_choice.h"
#include "tool/shown/boundary.h"
#include "tool/support.h"

namespace shm::converters {

struct ShownBoundary {
  Schema schema;
  BoundarySurface boundary;
  std::optional<ArrayChoice> array;
  bool only_points = false;  // vertices, since there is no face

  Surface surface() const;  // borrows the boundary
};

struct ShownRequest {
  std::string array;              // as --array has it; empty: none
  std::optional<HalfSpace> kept;  // cells there alone
  bool points_instead = false;  // where there is no face the vertices, as points_of_mesh() has them
  unsigned threads = 0;         // one for each core
  std::string next;             // what the command does with it, a tenth of the work
};

// `in` is not opened yet. Throws Failure.
ShownBoundary shown_boundary(const CommonOptions& options, ToolInput& in, Spool& spool,
                             ProgressLine& line, const ShownRequest& request);

// Of its array a number for each vertex, or for each face: of vectors the length, NaN where there
// is none. Must hold: there is an array. Frees its values.
std::vector<double> values_of(ShownBoundary& shown);

// Vertices by their numbers in the mesh, faces by those of their cells and by side, and corners of
// sides from the least number on, in whichever order they were found; and with them `values`, which
// may be empty.
void put_in_mesh_order(BoundarySurface& boundary, bool values_of_points,
                       std::vector<double>& values);

// "array" of a report: name, location, step, least, greatest; or null.
Json array_json(const ShownBoundary& shown, const std::optional<ShownRange>& range);

}  // namespace shm::converters
