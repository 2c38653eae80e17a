// The extras of a mesh after time steps of another file have been appended.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/appended_extras.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns the extras of the result. `old` is the mesh before the steps were appended, `more` the
// other file, of the same format, `extras` the extras of `more` in the numbering of `old`, and
// `steps` the steps of `more` that are appended. If `more` contains the old steps too, because its
// writer continued an existing file, its extras replace the old ones. If extras of the format have
// a value for each step, and `more` continues after the end of the old file, the new values are
// appended to the old ones. Throws Failure (unsupported) if the extras cannot be combined.
AppendedExtras appended_extras(const MeshInfo& old, const MeshInfo& more,
                               const std::vector<Extra>& extras,
                               std::span<const std::uint64_t> steps);

}  // namespace shm::converters
