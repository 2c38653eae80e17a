// Whether a delay buffer makes a mesh smaller, tried on some runs of its cells.
#pragma once

#include <cstdint>
#include <functional>

#include "mesh_source.h"
#include "shm/writer.h"

namespace shm::converters {

// Codes a mesh that has the arrays of the source with a delay buffer, and says how large it is.
using DelayCoder = std::function<SizeReport(MeshSource& part, std::uint32_t delay)>;

// Cells of the delay buffer with which the sample is smallest; 0, none, unless a buffer saves
// enough to be worth its time, and where the mesh is small. Memory follows the sample.
std::uint32_t find_delay(MeshSource& mesh, const DelayCoder& code);

}  // namespace shm::converters
