// Helpers for writing a piece of a mesh, i.e. some of its cells.
#pragma once

#include <vector>

#include "mesh/forwarding_mesh.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

// Removes the extras that store sets from `whole`, and returns these sets. Also removes extras
// whose contents follow from the blocks of the mesh.
std::vector<MeshSet> take_sets(MeshInfo& whole);

// A piece of a mesh from which the name of the source format is removed. If the name were present,
// the writer of the source format would expect the extras of a whole file.
class FromElsewhere final : public ForwardingMesh {
 public:
  // `source` is a piece of a mesh, and `whole` describes the whole mesh.
  FromElsewhere(MeshSource& source, const MeshInfo& whole);
};

}  // namespace shm::converters
