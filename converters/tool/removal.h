// Implements --rm: removes the input of a command after the output has been read back and found to
// contain the same mesh.
#pragma once

#include <string>

#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "tool/support.h"

namespace shm::converters {

// Throws Failure (output) if `path` is a link, a device, a pipe or a series of files, which --rm
// does not remove.
void check_removable(const std::string& path);

// Reads both files from the disk and compares them as shm verify --against does, or as shm diff
// does if `written` is not a .shm file. If the meshes are equal, removes `source`. Otherwise keeps
// `source` and throws Failure (output). `cell_order` is passed to compare_meshes() and may be null.
void remove_source(const std::string& source, const std::string& written, CommonOptions& options,
                   const Progress& progress, const CellSequence* cell_order = nullptr);

}  // namespace shm::converters
