// Helpers to write pieces of a mesh: taking the sets out of the extras, and presenting the piece as
// a mesh of no particular format.
#pragma once

#include <vector>

#include "mesh/forwarding_mesh.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

// Removes the sets from the extras of a mesh and returns them. Extras that follow from blocks are
// removed too.
std::vector<MeshSet> take_sets(MeshInfo& whole);

// A piece without its source format, so that the writer of the same format does not expect the
// extras of a whole file.
class FromElsewhere final : public ForwardingMesh {
 public:
  // `whole` describes the file that the piece came from.
  FromElsewhere(MeshSource& source, const MeshInfo& whole);
};

}  // namespace shm::converters
