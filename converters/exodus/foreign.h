// Writes meshes of other formats as Exodus files, by means of the Exodus library.
#pragma once

#include <cstddef>
#include <string>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

inline constexpr std::size_t kLongestName = 255;

// Returns the largest numbers that blocks and sets of a mesh of another format can keep in an
// Exodus file. Larger numbers are replaced by new numbers.
Capabilities::MostNumbers most_numbers(const MeshInfo& info);

// Writes a mesh that has no Exodus structure. Called by write_exodus().
void write_foreign(MeshSource& mesh, const std::string& path, Spool& spool);

}  // namespace shm::converters::exodus
