// Meshes by the names that commands are given: a file, a name of many ("out_%04d.vtu"), or a
// collection (.pvd).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "series/series_mesh.h"

namespace shm::converters {

// The files that a name stands for; nothing where it is one mesh, or nothing is known of it. Throws
// Failure where there are none.
std::optional<std::vector<SeriesFile>> series_of(const std::string& path);

// All files that are read where `path` is: the series with its collection, or the file itself.
std::vector<std::string> files_of(const std::string& path);

// Opens a series, or a single mesh as open_mesh() does.
std::unique_ptr<MeshSource> open_any(const std::string& path, Spool& spool,
                                     const Progress& progress, const Remark& remark);

}  // namespace shm::converters
