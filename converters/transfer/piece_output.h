// What pieces of a mesh have in common on their way out, whatever they are: their sets, and a mesh
// that its own format's writer takes for one from elsewhere.
#pragma once

#include <vector>

#include "mesh/forwarding_mesh.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

// The sets of a mesh. The extras that hold them leave it, and so do those that follow from blocks.
std::vector<MeshSet> take_sets(MeshInfo& whole);

// A mesh that its own format's writer takes for one from elsewhere, which lacks that format's
// extras.
class FromElsewhere final : public ForwardingMesh {
 public:
  // `whole`: the file that it came from.
  FromElsewhere(MeshSource& source, const MeshInfo& whole);
};

}  // namespace shm::converters
