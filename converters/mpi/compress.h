// Compression by several ranks: each codes some segments of one mesh, and all write one file, with
// the same bytes that compress_mesh() writes with the same options. Memory per rank: 64 bytes for
// each vertex of its part, 24 for each vertex that it owns (NumberOwners), its compressed part, and
// the memory of compress_mesh() in addition to the mesh.
#pragma once

#include "base/spool.h"
#include "compression/compress.h"
#include "exodus/parts/joined_mesh.h"
#include "exodus/parts/ranks.h"
#include "mesh/mesh_source.h"
#include "mpi/output.h"
#include "shm/writer.h"

namespace shm::converters {

// Collective: each rank has opened the same file as `mesh`. Requires options.segment_cells, and
// options.order keep or stream. Does not commit `output`. Returns the sizes of the whole file, only
// on rank 0. Throws SharedFailure.
SizeReport compress_with_ranks(Ranks& ranks, MeshSource& mesh, SharedOutput& output,
                               const CompressOptions& options, Spool& spool);
// The same for a mesh that is read in parts. Writes the bytes that a file of the whole mesh would
// give.
SizeReport compress_with_ranks(Ranks& ranks, JoinedMesh& mesh, SharedOutput& output,
                               const CompressOptions& options, Spool& spool);

}  // namespace shm::converters
