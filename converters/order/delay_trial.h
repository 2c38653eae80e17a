// Tests on some runs of cells if a delay buffer makes a mesh smaller.
#pragma once

#include <cstdint>
#include <functional>

#include "mesh/mesh_source.h"
#include "shm/writer.h"

namespace shm::converters {

// Encodes a mesh that has the arrays of the source, with a delay buffer. Returns the sizes.
using DelayCoder = std::function<SizeReport(MeshSource& part, std::uint32_t delay)>;

// Fraction of the bytes without a delay buffer that a buffer must save. Less than a percent would
// be within the error of the sample. For meshes that are coded fast, a buffer doubles the time,
// because waiting in it takes cells as long as their coding. So the fast levels require more.
inline constexpr double kWorthwhile = .03, kWorthwhileAtBest = .01;

// Returns the size of the delay buffer, in cells, with which the sample is smallest. Returns 0 (no
// buffer) if none saves the fraction `worthwhile` of the bytes, or if the mesh is small. Memory is
// proportional to the sample.
std::uint32_t find_delay(MeshSource& mesh, double worthwhile, const DelayCoder& code);

}  // namespace shm::converters
