// Exodus files from meshes of other formats, through the Exodus library.
#pragma once

#include <cstddef>
#include <string>

#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "transfer/format.h"

namespace shm::converters::exodus {

inline constexpr std::size_t kLongestName = 255;

// The largest numbers that blocks and sets of such a mesh keep; there are new ones for others.
Capabilities::MostNumbers most_numbers(const MeshInfo& info);

// write_exodus for a mesh without an Exodus structure of its own.
void write_foreign(MeshSource& mesh, const std::string& path, Spool& spool);

}  // namespace shm::converters::exodus
