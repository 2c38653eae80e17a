// Opens and writes mesh files of any format.
#pragma once

#include <memory>
#include <string>

#include "base/output_file.h"
#include "base/progress.h"
#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Opens a mesh of any format. Throws Failure: io if the file does not exist, unsupported if its
// format is unknown.
std::unique_ptr<MeshSource> open_mesh(const std::string& path, Spool& spool,
                                      const Progress& progress = {});

// Writes `mesh` to a temporary file, which then gets its name. "-" is standard output; it receives
// a .shm file as it is encoded, and files of other formats at the end. Throws Failure.
void write_mesh(MeshSource& mesh, const std::string& path, const Format& format, Spool& spool);
// The same, but the caller commits the output.
void write_mesh(MeshSource& mesh, OutputFile& output, const Format& format, Spool& spool);

}  // namespace shm::converters
