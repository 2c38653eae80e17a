// Determines the error bounds of blocks (block_bounds.h) that options request.
#pragma once

#include "accuracy/block_bounds.h"
#include "accuracy/lossy.h"
#include "base/progress.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Determines the bounds that `lossy` requests. A relative bound of a block refers to the range of
// the array in this block; one of the whole array refers to the range in all blocks. Reads these
// arrays once. Throws Failure (misuse), see accuracies_of_blocks().
BlockBounds block_bounds_of(MeshSource& mesh, const Lossy& lossy, const Progress& progress);

}  // namespace shm::converters
