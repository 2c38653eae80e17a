// Appending: adds time steps to a .shm file. The steps are read from another file with the same
// mesh, in any format. The new file is written to a sink; the old file is only read.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "shm/appender.h"

namespace shm::converters {

struct AppendHow {
  // Used only if `steps` is empty. If true, all steps of the source are appended. If false, only
  // steps whose time is later than the time of the file's final step are appended.
  bool all = false;
  // Indices (from 0) of the source's steps to append, in the order in which they are appended.
  // Empty if the user did not choose steps.
  std::vector<std::uint64_t> steps;
  // Time of the appended step. Needed only if the source has no time steps and states no time.
  std::optional<double> time;
  // If true, nothing is written unless the new file would contain all data of the source.
  bool strict = false;
  AppendOptions options;
  unsigned threads = 1;  // number of threads that decode the mesh; 0: one per core
  const CellSequence* cell_order = nullptr;  // coding order of the source's cells, which is passed
                                             // to compare_meshes(); may be null
  Progress progress;
};

struct AppendOutcome {
  std::vector<std::string> differences;  // the first differences that were found between the meshes
  LossList losses;                       // data of the source that the new file does not contain
  std::vector<std::uint64_t> steps;      // steps of the source that were appended
  std::vector<double> times;             // times of all steps of the new file
  std::optional<SizeReport> sizes;       // sizes of the new file; not set if no file was written
};

// Appends steps to the file at `path` and writes the new file to `sink`. Throws Failure if the old
// file or the source is damaged, or if their meshes cannot be combined. If the meshes of the old
// file and the source differ, writes nothing and returns the differences.
AppendOutcome append_steps(const std::string& path, MeshSource& source, ByteSink& sink,
                           const AppendHow& how, Spool& spool);

}  // namespace shm::converters
