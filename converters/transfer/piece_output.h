// Helpers for writing pieces of a mesh (some of its cells). take_sets() moves the sets out of the
// extras; FromElsewhere presents the piece as a mesh without a source format.
#pragma once

#include <vector>

#include "mesh/forwarding_mesh.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

// Removes the sets from the extras of a mesh and returns the sets. Also removes the extras that can
// be derived from blocks.
std::vector<MeshSet> take_sets(MeshInfo& whole);

// A piece of a mesh, without the name of its source format. If a writer of that format saw the
// name, it would expect the extras of a whole file.
class FromElsewhere final : public ForwardingMesh {
 public:
  // `whole` describes the mesh of which `source` is a piece.
  FromElsewhere(MeshSource& source, const MeshInfo& whole);
};

}  // namespace shm::converters
