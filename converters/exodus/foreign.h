// Exodus files from meshes of other formats, through the Exodus library.
#pragma once

#include <string>

#include "base/spool.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// write_exodus for a mesh without an Exodus structure of its own.
void write_foreign(MeshSource& mesh, const std::string& path, Spool& spool);

}  // namespace shm::converters::exodus
