// Appending: adds time steps to a .shm file. The steps are read from any file with the same mesh.
// The new file is written to a sink; the old file is only read.
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
  // True: append all steps of the source; false: only steps later than the last step of the file.
  bool all = false;
  // Numbers of the steps to append, counted from 0, in the order of appending. Empty if the user
  // chose no step.
  std::vector<std::uint64_t> steps;
  // Time of the only step of a source that has neither steps nor a time.
  std::optional<double> time;
  bool strict = false;  // true: write nothing if data of the source would be left out
  AppendOptions options;
  unsigned threads = 1;  // number of threads that decode the mesh; 0: one per core
  const CellSequence* cell_order = nullptr;  // order of cells for compare_meshes(); may be null
  Progress progress;
};

struct AppendOutcome {
  std::vector<std::string> differences;  // some of the reasons why the meshes differ
  LossList losses;                       // data of the source that the new file does not contain
  std::vector<std::uint64_t> steps;      // steps of the source that were appended
  std::vector<double> times;             // times of all steps of the new file
  std::optional<SizeReport> sizes;       // sizes of the new file; nothing if no file was written
};

// Appends steps to the file at `path` and writes the new file to `sink`. Throws Failure if the old
// file or the source is damaged, or if they do not match for a reason other than differing values.
AppendOutcome append_steps(const std::string& path, MeshSource& source, ByteSink& sink,
                           const AppendHow& how, Spool& spool);

}  // namespace shm::converters
