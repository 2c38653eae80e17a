// JoinedStructure: a description of the whole mesh, derived from the parts of a decomposed Exodus
// mesh. It consists of the netCDF structure, blocks, arrays, time steps, sets and records that a
// file with the whole mesh would have.
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "exodus/layout.h"
#include "exodus/parts/part_files.h"
#include "exodus/skeleton.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct JoinedStructure {
  exodus::Skeleton skeleton;
  exodus::Layout layout;
  MeshInfo info;
  // Values at all steps of the variables of arrays that are neither on points nor on cells. The key
  // is the index of the variable.
  std::map<int, std::vector<std::byte>> beside_mesh;
};

// Collective. Returns the structure of the whole mesh, which is the same on all ranks.
// Precondition: parts.find_numbers() has been called. Members of sets are sorted by their numbers
// in the whole mesh. Each rank needs memory for the sets, records and similar data of the whole
// mesh. Throws SharedFailure if parts contradict each other, or contain data that cannot be joined.
JoinedStructure join_structure(PartFiles& parts);

}  // namespace shm::converters
