// What a .shm file holds, reported without its cells and values: a small part of its bytes is read,
// and memory follows the number of chunks and what extras take, not the mesh.
// spec: "Index and trailer"
#pragma once

#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

struct Summary {
  Schema schema;
  std::vector<double> step_times;  ///< empty where the file has none
  std::vector<Extra> extras;       ///< in the order of the file
  Totals totals;                   ///< as a Reader gives them at the end
};

/// Reads index, schema, extras, step times and the head of each chunk, and of groups and step
/// values no more: these heads must be what the index says, and all that the file has. Bytes behind
/// a torn append are counted in `totals`. `source` is borrowed during the call. Damage of
/// bitstreams is not found, and how many cells each block has stands in the index alone: whoever
/// must know reads with a Reader. Of `limits`, max_active_vertices, max_group_bytes and those of
/// what comes out are not looked at, so a file can be reported that is too large to be read.
/// ErrorCode::truncated where the file has been cut.
SHM_API Result<Summary> read_summary(RandomSource& source, const ReadLimits& limits = {});

}  // namespace shm
