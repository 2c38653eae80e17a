// The boundary surface that commands show. Of a .shm file only the necessary parts are read; any
// other mesh is read completely. If the user names an array, the surface has one number for each
// vertex, or for each face.
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
  bool only_points = false;  // the faces are vertices, since the mesh has no faces

  Surface surface() const;  // borrows the boundary
};

struct ShownRequest {
  std::string array;              // value of --array; empty: no array is shown
  std::optional<HalfSpace> kept;  // include only cells whose centre is in this half space
  bool points_instead = false;    // show vertices, as points_of_mesh() does, if no faces exist
  unsigned threads = 0;           // number of threads; 0: one per core
  std::string next;  // name of the command's next phase, which is about a tenth of the work
};

// Opens the mesh `in`, which must not be open yet, and returns its boundary surface. Throws
// Failure.
ShownBoundary shown_boundary(const CommonOptions& options, ToolInput& in, Spool& spool,
                             ProgressLine& line, const ShownRequest& request);

// Returns a number for each vertex, or for each face, from the chosen array: the length if the
// value is a vector, NaN if no value exists. Requires that an array was chosen. Frees the values
// stored in `shown`.
std::vector<double> values_of(ShownBoundary& shown);

// Sorts vertices by their numbers in the mesh, and faces by cell number and side. Rotates the
// corners of sides so that the least number comes first. The result does not depend on the order in
// which vertices and faces were found. Reorders `values`, which may be empty, accordingly.
void put_in_mesh_order(BoundarySurface& boundary, bool values_of_points,
                       std::vector<double>& values);

// Returns the JSON object "array" of a report: name, location, step, least, greatest. Returns null
// if no array exists.
Json array_json(const ShownBoundary& shown, const std::optional<ShownRange>& range);

}  // namespace shm::converters
