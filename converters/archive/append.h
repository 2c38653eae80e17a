// Appending: adds time steps of a mesh, read from any file, to those of a .shm file with the same
// mesh. The new file goes to a sink; the old file is only read.
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
  // Append all steps of the source; false: only those later than the last step of the file.
  bool all = false;
  std::vector<std::uint64_t> steps;  // if not empty: append these steps, from 0, in this order
  std::optional<double> time;        // time of a source that has neither steps nor a time
  bool strict = false;               // write nothing if something would be left out
  AppendOptions options;
  unsigned threads = 1;                      // threads that decode the mesh; 0: one per core
  const CellSequence* cell_order = nullptr;  // as in compare_meshes
  Progress progress;
};

struct AppendOutcome {
  std::vector<std::string> differences;  // some of the reasons why the meshes differ
  LossList losses;                       // data of the source that the new file does not contain
  std::vector<std::uint64_t> steps;      // steps of the source that were appended
  std::vector<double> times;             // times of all steps of the new file
  std::optional<SizeReport> sizes;       // empty if nothing was written
};

// `path` is the old file. Throws Failure if the old file or the source is damaged, or if they do
// not match for a reason other than differing values.
AppendOutcome append_steps(const std::string& path, MeshSource& source, ByteSink& sink,
                           const AppendHow& how, Spool& spool);

}  // namespace shm::converters
