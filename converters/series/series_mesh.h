// Opens a series of files with one time step each as one mesh with time steps. Vertices, cells and
// all other data except fields come from the first file and must be the same in all files.
// Fields change with time, except integer arrays that are the same in all files, such as block
// numbers and members of sets.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct SeriesFile {
  std::string path;
  std::optional<double> time;  // time from the collection, if there is one
};

// Called once for each item that differs between a file and the first file. The item of the first
// file is used for all files.
using Remark = std::function<void(const std::string& sentence)>;

// Opens a series. Step times come from `files`, or from the field data of each file, or are 0, 1,
// 2, ... The first file stays open. Each other file is opened once, one at a time, and its values
// are written to `spool`, which must outlive the mesh. Throws Failure if a file does not belong to
// the same series as the first file; the error states the file and the reason.
std::unique_ptr<MeshSource> open_series(std::span<const SeriesFile> files, Spool& spool,
                                        const Progress& progress, const Remark& remark);

// Returns a single open mesh as a mesh with one step. The mesh must have a time.
std::unique_ptr<MeshSource> series_of_one(std::unique_ptr<MeshSource> mesh, const SeriesFile& file,
                                          Spool& spool);

// Returns `mesh` as a mesh in which the same arrays are stepped as in `like`.
std::unique_ptr<MeshSource> stepped_like(std::unique_ptr<MeshSource> mesh, const MeshInfo& like);

}  // namespace shm::converters
