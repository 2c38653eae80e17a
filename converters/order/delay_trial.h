// Whether a delay buffer makes a mesh smaller, tried on some runs of its cells.
#pragma once

#include <cstdint>
#include <functional>

#include "mesh/mesh_source.h"
#include "shm/writer.h"

namespace shm::converters {

// Encodes a mesh that has the arrays of the source with a delay buffer; how large it is.
using DelayCoder = std::function<SizeReport(MeshSource& part, std::uint32_t delay)>;

// Of the bytes without a buffer, what one must save at least. Less than a percent would be within
// the error of the sample. A buffer doubles the time of meshes that are coded fast, since cells
// wait in it as long as they take to be coded, so that who is in a hurry asks for more.
inline constexpr double kWorthwhile = .03, kWorthwhileAtBest = .01;

// Cells of the delay buffer with which the sample is smallest; 0, none, unless a buffer saves
// `worthwhile` of the bytes, and where the mesh is small. Memory follows the sample.
std::uint32_t find_delay(MeshSource& mesh, double worthwhile, const DelayCoder& code);

}  // namespace shm::converters
