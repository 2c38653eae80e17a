// --rm: a file goes once what was made of it has been read back and is the same mesh.
#pragma once

#include <string>

#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "tool/support.h"

namespace shm::converters {

// Throws Failure (output) where `path` is no file that may be removed: a link, a device, a pipe.
void check_removable(const std::string& path);

// Reads both files from the disk, compares them as shm verify --against does, or as shm diff where
// `written` is no .shm file, and removes `source`. `cell_order`: as compare_meshes has it; may be
// null. Throws Failure (output), and `source` stays, where they differ.
void remove_source(const std::string& source, const std::string& written, CommonOptions& options,
                   const Progress& progress, const CellSequence* cell_order = nullptr);

}  // namespace shm::converters
