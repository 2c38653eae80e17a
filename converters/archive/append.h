// Appending: time steps of a mesh, in whatever file, behind those of a .shm file that holds the
// same mesh. The new file goes to a sink; the old one is only read.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "shm/appender.h"
#include "transfer/losses.h"

namespace shm::converters {

struct AppendHow {
  bool all = false;                  // all steps of the source; else those later than the last one
  std::vector<std::uint64_t> steps;  // not empty: these, from 0, in this order
  std::optional<double> time;        // of a source without steps and without a time of its own
  bool strict = false;               // nothing is written where something would be left out
  AppendOptions options;
  unsigned threads = 1;                      // that decode the mesh; 0: one for each core
  const CellSequence* cell_order = nullptr;  // as in compare_meshes
  Progress progress;
};

struct AppendOutcome {
  std::vector<std::string> differences;  // what keeps them from being the same mesh, some of it
  LossList losses;                       // what the new file does not hold of the source
  std::vector<std::uint64_t> steps;      // of the source, that are new
  std::vector<double> times;             // of all steps
  std::optional<SizeReport> sizes;       // nothing: nothing was written
};

// `path`: the old file. Throws Failure where it or the source is bad, or does not fit in a way that
// no difference of values is.
AppendOutcome append_steps(const std::string& path, MeshSource& source, ByteSink& sink,
                           const AppendHow& how, Spool& spool);

}  // namespace shm::converters
