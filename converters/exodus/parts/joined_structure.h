// JoinedStructure: what the parts of a decomposed Exodus mesh hold of the whole one: its structure
// in netCDF, blocks, arrays, time steps, sets and records, as a file of the whole mesh would have
// it.
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

// Collective; the same on all ranks. Numbers must have been found. Members of sets are in the order
// of their numbers in the whole mesh. Sets, records and so on are in the memory of every rank.
// Throws SharedFailure: where parts contradict each other, or have what cannot be joined.
JoinedStructure join_structure(PartFiles& parts);

}  // namespace shm::converters
