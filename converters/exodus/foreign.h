// Exodus files from meshes of other formats, through the Exodus library.
#pragma once

#include <cstddef>
#include <string>

#include "base/spool.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

inline constexpr std::size_t kLongestName = 255;

// write_exodus for a mesh without an Exodus structure of its own.
void write_foreign(MeshSource& mesh, const std::string& path, Spool& spool);

}  // namespace shm::converters::exodus
