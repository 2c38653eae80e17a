// The extras of a mesh that gets more time steps from another file.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/appended_extras.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// `old`: the mesh as it was; `more`: the other file, of the same format; `extras`: its extras, in
// the numbers of `old`. `steps`: those of the other file that come behind.
// A file that has the old steps too, one that was written on, has everything anew. Where a format
// has extras with a value for each step, those of files that go on from where others ended go
// behind. Throws Failure (unsupported) where that cannot be.
AppendedExtras appended_extras(const MeshInfo& old, const MeshInfo& more,
                               const std::vector<Extra>& extras,
                               std::span<const std::uint64_t> steps);

// The same where the other file is of another format and has nothing of them: `steps` more.
AppendedExtras appended_extras_without_values(const MeshInfo& old, std::uint64_t steps);

}  // namespace shm::converters
