// Reads the boundary surface of a mesh for the commands that draw or export it. If the input is a
// .shm file, only the necessary parts are read. Any other mesh is read completely. If the user
// names an array, the surface has one value for each vertex (point array) or each face (cell
// array).
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
  bool only_points = false;  // true if the mesh has no faces, so that its vertices are shown
  // See Surface::inner_edges. Empty unless find_inner_edges() was called.
  std::vector<std::uint8_t> inner_edges;

  // Finds the edges inside of sides of cells of higher order, which consist of several faces.
  // Precondition: the faces of a side follow each other.
  void find_inner_edges();
  Surface surface() const;  // borrows the boundary
};

struct ShownRequest {
  std::string array;  // value of --array; if empty, no array is shown
  // If set, only cells whose centre is in this half space are included.
  std::optional<HalfSpace> kept;
  // If true, and the mesh has no faces, its vertices are shown (see points_of_mesh()).
  bool points_instead = false;
  unsigned threads = 0;  // number of threads; 0 means one per core
  // Name of the command's next phase, for the progress line. This phase counts as about a tenth of
  // the work.
  std::string next;
};

// Opens the mesh of `in` and returns its boundary surface. `in` must not have been opened before.
// Throws Failure.
ShownBoundary shown_boundary(const CommonOptions& options, ToolInput& in, Spool& spool,
                             ProgressLine& line, const ShownRequest& request);

// Returns one number per vertex if the chosen array is a point array, or one per face if it is a
// cell array: the value of the array, the length of the value if it is a vector, or NaN if there is
// no value. Precondition: an array was chosen. Frees the values stored in `shown`.
std::vector<double> values_of(ShownBoundary& shown);

// Sorts the vertices by their numbers in the mesh, and the faces by cell number and side. Rotates
// the corners of each face so that the lowest vertex number comes first. The result therefore does
// not depend on the order in which vertices and faces were found. Reorders `values`, which may be
// empty, in the same way.
void put_in_mesh_order(BoundarySurface& boundary, bool values_of_points,
                       std::vector<double>& values);

// Returns the JSON object "array" of a report, with the keys name, location, step, least and
// greatest. Returns null if no array was chosen.
Json array_json(const ShownBoundary& shown, const std::optional<ShownRange>& range);

}  // namespace shm::converters
