// The extras of an Exodus mesh that gets more time steps, or is left with some of them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh/appended_extras.h"
#include "mesh/chosen_steps.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// Whether extras have the number of steps.
bool counts_steps(const MeshInfo& info);

// Of a file that goes on from where the mesh `old` ended: what has a value for each step goes
// behind, and the number of steps grows. `extras`: those of `more`, in the numbers of `old`.
// `steps`: of `more`, that come behind. Throws Failure (unsupported) where that cannot be.
AppendedExtras joined_extras(const MeshInfo& old, const MeshInfo& more,
                             const std::vector<Extra>& extras,
                             std::span<const std::uint64_t> steps);

// With `steps` more of a file that has nothing of this kind.
AppendedExtras lengthened_extras(const MeshInfo& old, std::uint64_t steps);

// At some of its steps; nothing where values at steps are no numbers.
std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info, StepRange steps);

}  // namespace shm::converters::exodus
