// Tests on a sample of the cells whether a delay buffer makes a mesh smaller.
#pragma once

#include <cstdint>
#include <functional>

#include "mesh/mesh_source.h"
#include "shm/writer.h"

namespace shm::converters {

// Encodes a mesh that has the arrays of the source, with a delay buffer of `delay` cells. Returns
// the sizes.
using DelayCoder = std::function<SizeReport(MeshSource& part, std::uint32_t delay)>;

// Fraction of the bytes that a delay buffer must save. Savings of less than a percent would be
// within the error of the sample. For fast codecs, a buffer doubles the time, because cells take as
// long in the buffer as in the codec. Fast levels therefore require larger savings.
inline constexpr double kWorthwhile = .03, kWorthwhileAtBest = .01;

// Returns the size of the delay buffer, in cells, for which the sample is smallest. Returns 0 (no
// buffer) if no buffer saves the fraction `worthwhile` of the bytes, or if the mesh is small.
// Memory is proportional to the sample.
std::uint32_t find_delay(MeshSource& mesh, double worthwhile, const DelayCoder& code);

}  // namespace shm::converters
