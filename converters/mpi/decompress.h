// Decompression by several ranks: each rank decodes a share of the cells and writes it as its part
// of a decomposed Exodus mesh, e.g. out.e.4.0 to out.e.4.3. Memory per rank: the memory of a
// PieceMesh with the rank's cells, 16 to 24 bytes for each of its vertices, and one bit for each
// vertex number that the rank owns (see NumberOwners).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "exodus/parts/ranks.h"
#include "interface/losses.h"
#include "mpi/uses.h"
#include "shm/segment_reader.h"
#include "tool/commands/convert.h"

namespace shm::converters {

// Divides the cells into `parts` ranges of about equal size and returns range number `part`. The
// end of a range is moved to the beginning of a segment if one is nearby, so that fewer segments
// are decoded twice.
CellRange part_range(const std::vector<SegmentInfo>& segments, std::uint64_t cells,
                     std::size_t parts, std::size_t part);

// Collective. Writes one part per rank, named after command.output. Writes either all parts or
// none. Throws SharedFailure.
ExitCode decompress_with_ranks(Ranks& ranks, const DecompressCommand& command);

}  // namespace shm::converters
