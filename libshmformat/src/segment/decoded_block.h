// What comes out of one step of decoding a segment.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "segment/segment_start.h"
#include "shm/reader.h"

namespace shm {

struct DecodedBlock {
  MeshBlock mesh;
  SegmentStart segment;      ///< that it belongs to
  std::uint64_t offset = 0;  ///< of its group's chunk in the file
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  /// Numbers of vertices of earlier segments: those that cells of this block are the first of their
  /// segment to use, and those that they finalize.
  std::vector<std::uint64_t> imported, finalized_imports;

  /// Comes with the last block of a group.
  struct GroupEnd {
    std::uint64_t imported_vertices = 0, max_active_vertices = 0;
    std::map<std::string, std::uint64_t> stream_bytes;  ///< by the names of SizeReport
  };
  std::optional<GroupEnd> group_end;
};

/// How much of a group has been decoded, and the largest number of active vertices in it.
struct GroupProgress {
  std::uint64_t cells = 0, own = 0, imported = 0, loose = 0, bytes = 0, active = 0;
};

/// Keeps the elements of `stride` bytes that are not marked.
void leave_out(std::vector<std::byte>& values, const std::vector<std::uint8_t>& marked,
               std::size_t stride);

}  // namespace shm
