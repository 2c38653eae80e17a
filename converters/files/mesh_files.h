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

// Opens a mesh file of any format. Throws Failure with the code io if the file does not exist, and
// with the code unsupported if its format is unknown.
std::unique_ptr<MeshSource> open_mesh(const std::string& path, Spool& spool,
                                      const Progress& progress = {});

// Writes `mesh` to a temporary file, then renames the file to `path`. If `path` is "-", writes to
// standard output instead. To standard output, a .shm file is written while it is encoded; a file
// of any other format is written only when it is complete. Throws Failure.
void write_mesh(MeshSource& mesh, const std::string& path, const Format& format, Spool& spool);
// Writes `mesh` to `output`. The caller must commit `output`, which renames the file to its final
// name.
void write_mesh(MeshSource& mesh, OutputFile& output, const Format& format, Spool& spool);

}  // namespace shm::converters
