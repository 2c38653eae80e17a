// A whole mesh into a mesh encoder: its cells, and each vertex before the first cell that uses it.
// Vertices end with the last cell that uses them (vertex compaction; Isenburg & Lindstrom 2005).
#pragma once

#include "segment/mesh_encoder.h"
#include "shm/mesh.h"

namespace shm {

/// `encoder`, of `schema`, is new. Vertices that no cell uses wait in it for the end. Misuse where
/// sizes contradict each other, or numbers name what there is not; before anything is added.
Result<void> feed_mesh(MeshEncoder& encoder, const Schema& schema, const MeshArrays& mesh);

}  // namespace shm
