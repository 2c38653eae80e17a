// Summary: describes the contents of a .shm file without its cells and values. Only a small part of
// the file is read. The memory needed depends on the number of chunks and the size of the extras,
// not on the size of the mesh.
// spec: "Index and trailer"
#pragma once

#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

struct Summary {
  Schema schema;
  std::vector<double> step_times;  ///< times of the steps; empty if the file has no step times
  std::vector<Extra> extras;       ///< extras of the file, in file order
  Totals totals;                   ///< totals of the whole file, as a Reader yields them at the end
};

/// Reads the index, schema, extras and step times completely. Reads only the headers of all other
/// chunks, including groups and parts of step values. These headers must match the index, and the
/// file must not have chunks that the index does not list. An interrupted append leaves bytes after
/// the end record; Totals::trailing_bytes counts them. `source` is borrowed during the call.
///
/// Damage to bitstreams is not detected, and the number of cells of each block is taken from the
/// index without a check; use a Reader to verify them. The members max_active_vertices and
/// max_group_bytes of `limits`, and the limits on the size of the result, are ignored, so that a
/// file that is too large to be read can still be summarized. Fails with ErrorCode::truncated if
/// the end of the file is missing.
SHM_API Result<Summary> read_summary(RandomSource& source, const ReadLimits& limits = {});

/// Returns how many bytes of `source` belong to the .shm file: the bytes up to the end of its last
/// index. If the source does not end with an index, reads the headers of all chunks to find it.
/// More bytes follow if the file has parity, or if the program that writes a live file has not
/// committed them. Fails with ErrorCode::truncated if the file has no index. Thread safe if
/// `source` is.
SHM_API Result<std::uint64_t> bytes_of_file(RandomSource& source);

}  // namespace shm
