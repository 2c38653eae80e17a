// Damage: everything that is hurt in a .shm file, whatever of it is: found by the marks and the
// checksums of chunks and bitstreams, without decoding values. What is whole in such a file
// MeshExtractor::open_damaged() reads (shm/mesh_extract.h).
// spec: "Container", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

enum class DamageKind : std::uint8_t {
  damaged = 1,   ///< bytes are not what they were
  missing,       ///< there are no bytes of it: cut off, or taken out
  repeated,      ///< whole, and there already
  out_of_order,  ///< whole, but not where it belongs
  stray,         ///< bytes that belong to nothing
};

/// One chunk, or what else a file consists of, that is not what or where it was. A chunk of several
/// step values is one for each of them, at the same place; all but the first have `chunks` 0.
struct Damage {
  DamageKind kind = DamageKind::damaged;
  /// "file start", "schema", "group", "step values", "step times", "extra", "index", "end record";
  /// "chunk" where nobody knows.
  std::string section;
  /// Where it is; of what is missing where it would be, and 0 bytes.
  std::uint64_t offset = 0, bytes = 0;
  std::uint64_t chunks = 1;  ///< how many are lost here, where their headers are lost too
  /// Of a group, and of step values, as far as it is known.
  std::optional<std::uint32_t> segment{};
  /// Cells that are hurt, in coding order, from there on. Where a header is lost and there is no
  /// index, they follow from the groups before and behind.
  std::optional<std::uint64_t> first_cell{};
  std::uint64_t cells = 0;
  /// Arrays (indices into Schema::arrays) that are hurt: of step values the one; of a group those
  /// whose bitstreams are, where all else of it is whole, and none else.
  std::vector<std::uint32_t> arrays{};
  std::optional<std::uint64_t> step{};  ///< of step values
};

struct DamageReport {
  std::vector<Damage> damages;  ///< in the order of the file; empty: every checksum is right
  /// All chunks and the index are whole, wherever they are: write_in_order() gives the file back.
  bool restorable = false;
  /// All that holds values is whole: at most what tells where things are is lost.
  bool complete = false;
  /// The index is lost, and as far as is known no more than what tells where things are:
  /// write_in_order() makes it anew if the values can be decoded. If `complete` is not set, there
  /// may have been other chunks at the end; then it must fit into the bytes behind the last one.
  bool lacks_index = false;
  /// An index made anew may have other ranges of arrays that are kept within a bound: those of
  /// their values as they are restored. In files of before 0.10.
  bool has_other_ranges = false;
  std::optional<Schema> schema;  ///< unless all copies are lost
  std::optional<std::uint64_t> vertices, cells,
      steps;  ///< of the whole file, if the index is there
};

/// Goes through all of `source`, which is borrowed during the call. Fails where it cannot be read,
/// is an archive (ErrorCode::unsupported), or has nothing of a .shm file (ErrorCode::corrupt).
/// What a chunk with right checksums says is not decoded: that is a Reader's. Time: each byte is
/// read a few times at most. Memory: the largest chunk (ReadLimits::max_chunk_bytes) and some
/// hundred bytes for each.
SHM_API Result<DamageReport> find_damage(RandomSource& source, const ReadLimits& limits = {});

/// Writes the very bytes that the file had, from chunks that are all whole, but perhaps not in
/// their places, repeated, or between stray bytes; what stands at the start and at the end is made
/// anew. So is an index that is lost, from all that a Decoder finds; its bytes may be others where
/// DamageReport::has_other_ranges. Fails, and writes nothing, unless
/// DamageReport::restorable, or DamageReport::lacks_index and the index could be made.
SHM_API Result<void> write_in_order(RandomSource& source, ByteSink& sink,
                                    const ReadLimits& limits = {});

}  // namespace shm
