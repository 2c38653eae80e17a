// Compression by several ranks: each rank codes some segments of one mesh, and all ranks write one
// file. The file is byte for byte the same as the file that compress_mesh() writes with the same
// options. Memory per rank: 64 bytes for each vertex of its part, 24 bytes for each vertex number
// that it owns (see NumberOwners), the compressed data of its part, and the memory that
// compress_mesh() needs in addition to the mesh.
#pragma once

#include "base/spool.h"
#include "compression/compress.h"
#include "exodus/parts/joined_mesh.h"
#include "exodus/parts/ranks.h"
#include "mesh/mesh_source.h"
#include "mpi/output.h"
#include "shm/writer.h"

namespace shm::converters {

// Collective. Each rank must have opened the same file as `mesh`. options.segment_cells must be
// set, and options.order must be keep or stream. Does not commit `output`. Returns the sizes of the
// whole file on rank 0, and an empty report on the other ranks. Throws SharedFailure.
SizeReport compress_with_ranks(Ranks& ranks, MeshSource& mesh, SharedOutput& output,
                               const CompressOptions& options, Spool& spool);
// Compresses a mesh that is read from parts. The output is byte for byte the same as if a file with
// the whole mesh were compressed.
SizeReport compress_with_ranks(Ranks& ranks, JoinedMesh& mesh, SharedOutput& output,
                               const CompressOptions& options, Spool& spool);

}  // namespace shm::converters
