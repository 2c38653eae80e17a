// Opens a series of files, each with one time step, as one mesh with time steps. Vertices, cells
// and all other data except fields come from the first file, and must be the same in all files.
// Fields become stepped arrays, except integer arrays that are the same in all files, such as block
// numbers and set membership.
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
  std::optional<double> time;  // time of the step, if a collection states it
};

// Receives a sentence about a difference between a file and the first file of a series, such as a
// different title. The mesh has the title (or other property) of the first file. Remark is called
// at most once for each property that differs.
using Remark = std::function<void(const std::string& sentence)>;

// Opens a series. The time of each step comes from `files`, or from the field data of each file. If
// neither contains times, the times are 0, 1, 2, ... The first file stays open. Each other file is
// opened once, one at a time, and its values are written to `spool`, which must outlive the mesh.
// Throws Failure if a file does not belong to the same series as the first file; the error states
// the file and the reason.
std::unique_ptr<MeshSource> open_series(std::span<const SeriesFile> files, Spool& spool,
                                        const Progress& progress, const Remark& remark);

// Converts `mesh`, which has no time steps, to a mesh with one time step. The time of the step must
// be in `file` or in the field data of the mesh.
std::unique_ptr<MeshSource> series_of_one(std::unique_ptr<MeshSource> mesh, const SeriesFile& file,
                                          Spool& spool);

// Converts `mesh` so that an array is stepped (has values for each time step) if and only if it is
// stepped in `like`.
std::unique_ptr<MeshSource> stepped_like(std::unique_ptr<MeshSource> mesh, const MeshInfo& like);

}  // namespace shm::converters
