// Tests on a sample of the cells whether a delay buffer makes the compressed mesh smaller. The
// delay buffer holds back cells, so that adjacent cells are coded one after another.
#pragma once

#include <cstdint>
#include <functional>

#include "mesh/mesh_source.h"
#include "shm/writer.h"

namespace shm::converters {

// Encodes `part`, a sample of a mesh with all arrays of the mesh, with a delay buffer of `delay`
// cells. Returns the sizes of the encoded data.
using DelayCoder = std::function<SizeReport(MeshSource& part, std::uint32_t delay)>;

// Fraction of the encoded size that a delay buffer must save: kWorthwhileAtBest at level `best`,
// kWorthwhile at all other levels. A saving below 1% could be a sampling error. Levels other than
// `best` require a larger saving, because the buffer needs about as much time per cell as a fast
// codec, i.e. it doubles the compression time.
inline constexpr double kWorthwhile = .03, kWorthwhileAtBest = .01;

// Returns the size of the delay buffer, in cells, for which the sample is smallest. Returns 0 (no
// buffer) if no buffer saves at least the fraction `worthwhile` of the encoded size, or if the mesh
// is small. The memory needed is proportional to the size of the sample.
std::uint32_t find_delay(MeshSource& mesh, double worthwhile, const DelayCoder& code);

}  // namespace shm::converters
