// MergedMesh: reads the parts of a decomposed Exodus mesh as one mesh, in a single process. Needs
// 40 bytes of memory per node and element of the mesh, 16 more bytes for each node or element that
// occurs in several parts, and memory for sets and records. Cells and values are in the spool.
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
  // Opens the parts. Borrows `spool`. Throws Failure if parts contradict each other or contain data
  // that cannot be joined. The error names a part.
  MergedMesh(const std::vector<std::string>& files, Spool& spool)
      : JoinedMesh(one_rank, files, spool) {
    hold_cells({0, info().cells()});
  }
};

}  // namespace shm::converters
