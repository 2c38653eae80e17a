// Exodus files from meshes of other formats, through the Exodus library.
#pragma once

#include <string>

#include "mesh_source.h"
#include "spool.h"

namespace shm::converters::exodus {

// write_exodus for a mesh without an Exodus structure of its own.
void write_foreign(MeshSource& mesh, const std::string& path, Spool& spool);

}  // namespace shm::converters::exodus
