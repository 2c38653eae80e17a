// Tests whether rounding makes the coordinates and each array of a mesh smaller.
#pragma once

#include <functional>

#include "mesh/mesh_source.h"
#include "shm/writer.h"

namespace shm::converters {

// Encodes `part`, a mesh or a sample of it, with the quantizations of `schema`. Returns the sizes
// of the encoded data.
using RoundingCoder = std::function<SizeReport(MeshSource& part, const Schema& schema)>;

// Removes each quantization of `schema` that does not make the coordinates or an array smaller than
// they are without loss. Encodes the whole mesh if it is small, otherwise a sample, with and
// without the quantizations. The memory needed is proportional to the size of the sample.
void remove_useless_rounding(MeshSource& mesh, Schema& schema, const RoundingCoder& code);

}  // namespace shm::converters
