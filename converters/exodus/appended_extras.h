// The extras of an Exodus mesh after time steps have been appended, or after a selection of its
// steps.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh/appended_extras.h"
#include "mesh/chosen_steps.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// Returns true if the extras contain the number of steps.
bool counts_steps(const MeshInfo& info);

// Returns the extras of `old` after the steps of a file `more` have been appended: values for each
// step are appended to the old values, and the number of steps grows. `extras` are the extras of
// `more` in the numbering of `old`. `steps` lists the steps of `more` that are appended. Throws
// Failure (unsupported) if the extras cannot be combined.
AppendedExtras joined_extras(const MeshInfo& old, const MeshInfo& more,
                             const std::vector<Extra>& extras,
                             std::span<const std::uint64_t> steps);

// Returns the extras of `old` after `steps` steps have been appended from a file without such
// extras.
AppendedExtras lengthened_extras(const MeshInfo& old, std::uint64_t steps);

// Returns the extras for a selection of steps. Returns nothing if values at steps are not numbers.
std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info, StepRange steps);

}  // namespace shm::converters::exodus
