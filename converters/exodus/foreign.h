// Writes meshes that came from other formats as Exodus files. Uses the Exodus library.
#pragma once

#include <cstddef>
#include <string>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

inline constexpr std::size_t kLongestName = 255;

// Returns the largest block id and the largest set id that write_foreign() keeps. Larger ids are
// replaced with new ids.
Capabilities::MostNumbers most_numbers(const MeshInfo& info);

// Writes a mesh that has no Exodus structure. Called by write_exodus().
void write_foreign(MeshSource& mesh, const std::string& path, Spool& spool);

}  // namespace shm::converters::exodus
