// JoinedStructure: the structure of a whole mesh, derived from the parts of a decomposed Exodus
// mesh. It contains the same information as a file of the whole mesh: netCDF structure, blocks,
// arrays, time steps, sets and records.
#pragma once

#include "exodus/layout.h"
#include "exodus/parts/part_files.h"
#include "exodus/skeleton.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct JoinedStructure {
  exodus::Skeleton skeleton;
  exodus::Layout layout;
  MeshInfo info;
};

// Collective. Returns the structure, which is the same on all ranks. Requires parts.find_numbers().
// Members of sets are sorted by their numbers in the whole mesh. Each rank keeps sets, records and
// similar data in memory. Throws SharedFailure if parts contradict each other, or contain data that
// cannot be joined.
JoinedStructure join_structure(PartFiles& parts);

}  // namespace shm::converters
