// A series of files with one time step each as one mesh with time steps: vertices, cells and all
// that is no field are those of the first file, and the same in all. Fields change with time, but
// for integers that are the same in all files: numbers of blocks, members of sets.
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
  std::optional<double> time;  // where a collection has it
};

// Told what of a file is not that of the first one, which stands for all: each once.
using Remark = std::function<void(const std::string& sentence)>;

// Times are those of `files`; else those in the field data of each; else 0, 1, 2, ... The first
// file stays open, of the others one at a time is, once: their values go to `spool`, which must
// outlive the mesh. Throws Failure, naming the file that is none of a series with the first one,
// and why.
std::unique_ptr<MeshSource> open_series(std::span<const SeriesFile> files, Spool& spool,
                                        const Progress& progress, const Remark& remark);

// The same of a single one that is open, which must have a time.
std::unique_ptr<MeshSource> series_of_one(std::unique_ptr<MeshSource> mesh, const SeriesFile& file,
                                          Spool& spool);

// A mesh with time steps whose arrays change with them where those of `like` do.
std::unique_ptr<MeshSource> stepped_like(std::unique_ptr<MeshSource> mesh, const MeshInfo& like);

}  // namespace shm::converters
