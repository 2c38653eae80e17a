// Reports of shm diff, as human-readable text and as JSON.
#pragma once

#include <string>

#include "compare/diff.h"

namespace shm::converters {

struct DiffRun {
  std::string a, b;       // paths of the meshes
  std::string tolerance;  // tolerance as printed in the report: "exact", "abs=1e-6", ...
  bool match = false;
};

std::string diff_text(const DiffRun& run, const MeshDiff& diff);
std::string diff_json(const DiffRun& run, const MeshDiff& diff);

}  // namespace shm::converters
