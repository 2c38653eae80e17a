// Computes the extras (typed values with keys) of a mesh to which time steps of another file are
// appended.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/appended_extras.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns the extras of the combined mesh. `old` is the mesh before the steps were appended. `more`
// is the mesh whose steps are appended; both meshes have the same source format. `extras` are the
// extras of `more`, in which vertex and cell ids have been converted to ids of `old`. `steps` are
// the steps of `more` that are appended.
// - If `more` also contains the old steps, because its writer continued an existing file, its
//   extras replace the old ones.
// - If extras have one value per step, and the steps of `more` begin after the final step of `old`,
//   the new values are appended to the old values.
//
// Throws Failure (unsupported) if the extras cannot be combined.
AppendedExtras appended_extras(const MeshInfo& old, const MeshInfo& more, std::vector<Extra> extras,
                               std::span<const std::uint64_t> steps);

}  // namespace shm::converters
