// The extras of a mesh after time steps of another file have been appended.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/appended_extras.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns the extras of the result. `old` is the mesh before the steps were appended, and `more`
// the other file, which has the same format. `extras` are the extras of `more` in the numbering of
// `old`. `steps` are the steps of `more` that are appended.
// - If `more` also contains the old steps, because its writer continued an existing file, its
// extras replace the old ones.
// - If extras of the format have a value for each step, and `more` begins after the end of the old
// file, the new values are appended to the old ones.
//
// Throws Failure (unsupported) if the extras cannot be combined.
AppendedExtras appended_extras(const MeshInfo& old, const MeshInfo& more,
                               const std::vector<Extra>& extras,
                               std::span<const std::uint64_t> steps);

}  // namespace shm::converters
