// Compression by several ranks: each codes some segments of one mesh, and all write one file. It
// has the bytes that compress_mesh writes with the same options. Memory of a rank: 64 bytes for
// each vertex of its part, 24 for each that it owns (NumberOwners), its compressed part, and what
// compress_mesh takes beside the mesh.
#pragma once

#include "base/spool.h"
#include "compression/compress.h"
#include "exodus/parts/joined_mesh.h"
#include "exodus/parts/ranks.h"
#include "mesh/mesh_source.h"
#include "mpi/output.h"
#include "shm/writer.h"

namespace shm::converters {

// Collective: each rank has opened the same file as `mesh`. options.segment_cells must be given;
// options.order is keep or stream. `output` is not committed. Sizes are those of the whole file, on
// rank 0 alone. Throws SharedFailure.
SizeReport compress_with_ranks(Ranks& ranks, MeshSource& mesh, SharedOutput& output,
                               const CompressOptions& options, Spool& spool);
// The same of a mesh that is read in parts: the bytes that a file of the whole mesh would become.
SizeReport compress_with_ranks(Ranks& ranks, JoinedMesh& mesh, SharedOutput& output,
                               const CompressOptions& options, Spool& spool);

}  // namespace shm::converters
