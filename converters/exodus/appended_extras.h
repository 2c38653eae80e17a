// Computes the extras of an Exodus mesh to which time steps are appended, or of which only some
// time steps are selected.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh/appended_extras.h"
#include "mesh/chosen_steps.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// Returns true if the extras of a mesh state its number of time steps, so that they must change
// when the steps change.
bool counts_steps(const MeshInfo& info);

// Returns the extras of `old` after steps of `more`, another Exodus file, have been appended. If an
// extra has one value per step, the new values are appended to it. The stated number of steps is
// updated. `extras` are the extras of `more`, in which vertex and cell ids have been converted to
// ids of `old`. `steps` lists the steps of `more` to append. Throws Failure (unsupported) if the
// extras cannot be combined.
AppendedExtras joined_extras(const MeshInfo& old, const MeshInfo& more,
                             const std::vector<Extra>& extras,
                             std::span<const std::uint64_t> steps);

// Returns the extras of `old` after `steps` steps have been appended from a file of another format,
// which has no Exodus extras. Throws Failure (unsupported) if an extra has one value per step.
AppendedExtras lengthened_extras(const MeshInfo& old, std::uint64_t steps);

// Returns the extras of a mesh that is reduced to the steps `steps`. Returns nothing if a variable
// with one value per step contains strings, or if some of its values are missing.
std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info, StepRange steps);

}  // namespace shm::converters::exodus
