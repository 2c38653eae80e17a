// Opens meshes by the names that commands accept: a file, the name of a series ("out_%04d.vtu"), or
// a collection (.pvd).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "series/series_mesh.h"

namespace shm::converters {

// If `path` is the name of a series or a collection, returns its files. Returns nothing for any
// other path, whether or not a file exists at this path. Throws Failure if a series has no files.
std::optional<std::vector<SeriesFile>> series_of(const std::string& path);

// Returns the paths of all files that are read when `path` is opened: the files of a series and the
// .pvd file that lists them, or the single file `path`.
std::vector<std::string> files_of(const std::string& path);

// Opens a series, or a single mesh as open_mesh() does.
std::unique_ptr<MeshSource> open_any(const std::string& path, Spool& spool,
                                     const Progress& progress, const Remark& remark);

}  // namespace shm::converters
