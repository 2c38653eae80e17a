// Passes a whole mesh to a mesh encoder: its cells, and each vertex immediately before the first
// cell that uses it. The last cell that uses a vertex finalizes it (vertex compaction; Isenburg &
// Lindstrom 2005).
#pragma once

#include "pipeline/mesh_encoder.h"
#include "shm/mesh.h"

namespace shm {

/// Adds `mesh` to `encoder`, which was created for `schema` and must be new. Vertices that no cell
/// uses are added last; the encoder stores them until the end of the mesh. Fails with
/// ErrorCode::misuse, before adding anything, if the sizes of the arrays are inconsistent or a
/// number is out of range.
Result<void> feed_mesh(MeshEncoder& encoder, const Schema& schema, const MeshArrays& mesh);

}  // namespace shm
