// MergedMesh: the parts of a decomposed Exodus mesh as one mesh, read by one process alone. Memory
// is 40 bytes for each node and element of the mesh, 16 more for each that several parts have, sets
// and records; cells and values are in the spool.
#pragma once

#include <string>
#include <vector>

#include "base/spool.h"
#include "exodus/parts/joined_mesh.h"
#include "exodus/parts/ranks.h"

namespace shm::converters {

struct OneRank {
  Ranks one_rank;
};

class MergedMesh final : OneRank, public JoinedMesh {
 public:
  // `spool` is borrowed. Throws Failure, naming a part: where parts contradict each other, or have
  // what cannot be joined.
  MergedMesh(const std::vector<std::string>& files, Spool& spool)
      : JoinedMesh(one_rank, files, spool) {
    hold_cells({0, info().cells()});
  }
};

}  // namespace shm::converters
