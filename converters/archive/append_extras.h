// The extras of a mesh that gets more time steps from another file of the same format.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/mesh_source.h"
#include "transfer/losses.h"

namespace shm::converters {

struct AppendedExtras {
  bool changed = false;       // they are not those of the mesh as it was
  std::vector<Extra> extras;  // all of them
  LossList losses;            // what the other file says otherwise: the mesh keeps its own
};

// `old`: the mesh as it was; `more`: the other file; `extras`: its extras, in the numbers of `old`.
// `steps`: those of the other file that come behind.
// A file that has the old steps too, one that was written on, says everything anew. Of Exodus files
// that go on from where others ended, what has a value for each step goes behind, and the number of
// steps grows. Throws Failure (unsupported) where that cannot be.
AppendedExtras appended_extras(const MeshInfo& old, const MeshInfo& more,
                               const std::vector<Extra>& extras,
                               std::span<const std::uint64_t> steps);

// The same where the other file is of another format and says nothing of them: `steps` more.
AppendedExtras appended_extras_without_values(const MeshInfo& old, std::uint64_t steps);

}  // namespace shm::converters
