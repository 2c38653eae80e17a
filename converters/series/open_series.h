// Opens meshes by the names that commands accept: a file, the name of a series ("out_%04d.vtu"), or
// a collection (.pvd).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "series/series_mesh.h"

namespace shm::converters {

// Returns the files of the series that `path` names. Returns nothing if it is the name of a single
// mesh, or if there is no file of this name. Throws Failure if a series has no files.
std::optional<std::vector<SeriesFile>> series_of(const std::string& path);

// Returns all files that are read to open `path`: the files of a series and its collection, or the
// file itself.
std::vector<std::string> files_of(const std::string& path);

// Opens a series, or a single mesh as open_mesh() does.
std::unique_ptr<MeshSource> open_any(const std::string& path, Spool& spool,
                                     const Progress& progress, const Remark& remark);

}  // namespace shm::converters
