// What pieces of a mesh have in common on their way out, whatever they are: their sets, and a mesh
// that its own format's writer takes for one from elsewhere.
#pragma once

#include <vector>

#include "mesh/forwarding_mesh.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"
#include "transfer/losses.h"

namespace shm::converters {

// What a .shm file holds of a mesh from elsewhere: all but faces of polyhedra.
extern const Holds kShmHolds;

// The sets of a mesh. What they tell leaves its extras, and so does what blocks tell.
std::vector<TransferSet> take_sets(MeshInfo& whole);

// A mesh that its own format's writer takes for one from elsewhere, which lacks that format's
// words.
class FromElsewhere final : public ForwardingMesh {
 public:
  // `whole`: the file that it came from.
  FromElsewhere(MeshSource& source, const MeshInfo& whole);
};

}  // namespace shm::converters
