// Decompression by several ranks: each decodes a share of the cells and writes it as its part of a
// decomposed Exodus mesh, out.e.4.0 to out.e.4.3. Memory of a rank: what a piece takes
// (PieceMesh), 16 to 24 bytes for each of its vertices, and a bit for each that it owns.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "exodus/parts/ranks.h"
#include "mpi/uses.h"
#include "shm/segment_reader.h"
#include "tool/commands/convert.h"
#include "transfer/losses.h"

namespace shm::converters {

// The cells of part `part` of `parts`: equal shares, but for ends that move to the beginning of a
// segment where one is near, so that fewer segments are decoded twice.
CellRange part_range(const std::vector<SegmentInfo>& segments, std::uint64_t cells,
                     std::size_t parts, std::size_t part);

// Collective. Writes command.output as one part for each rank, all or none. Throws SharedFailure.
ExitCode decompress_with_ranks(Ranks& ranks, const DecompressCommand& command);

}  // namespace shm::converters
