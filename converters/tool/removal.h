// Implements --rm: removes a source after its output has been read back and found to be the same
// mesh.
#pragma once

#include <string>

#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "tool/support.h"

namespace shm::converters {

// Throws Failure (output) if --rm may not remove `path`, because it is a link, a device, a pipe or
// a series.
void check_removable(const std::string& path);

// Reads both files from the disk and compares them as shm verify --against does, or as shm diff
// does if `written` is not a .shm file. Removes `source` if they are equal; otherwise keeps it and
// throws Failure (output). `cell_order`: as for compare_meshes; may be null.
void remove_source(const std::string& source, const std::string& written, CommonOptions& options,
                   const Progress& progress, const CellSequence* cell_order = nullptr);

}  // namespace shm::converters
