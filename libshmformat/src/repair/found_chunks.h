// FoundChunks: the contents of a file that may be damaged anywhere. It lists the damaged and
// undamaged chunks found; if several chunks have the same number, it lists only one of them. It
// also lists groups, step values, and all damage. An undamaged index shows which chunks the
// original file had. Without it, the original chunks are derived from the sequence numbers of
// chunks and the headers of groups.
// spec: "Container", "Index and trailer", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "format/chunk_scan.h"
#include "format/format.h"
#include "shm/damage_report.h"
#include "shm/limits.h"

namespace shm {

/// Group whose chunk header is undamaged.
struct FoundGroup {
  std::uint32_t sequence = 0;
  /// Index entry of the group, made from the group header. If the header is not readable, only
  /// position and segment are set.
  container::IndexEntry entry;
  bool readable = false;
  bool has_mesh = false;  ///< true if all bitstreams except those of arrays are undamaged
  std::vector<std::uint32_t> lost_arrays;

  std::uint64_t end_cell() const { return entry.first_cell + entry.cells; }
};

/// Part of an undamaged chunk of step values.
struct FoundPart {
  std::uint32_t sequence = 0;
  std::uint64_t offset = 0, bytes = 0;  ///< position and size in bytes of the chunk
  container::StepEntry values;
  std::uint64_t reference_step = 0;
};

class FoundChunks {
 public:
  /// Finds the chunks of `source`, which is borrowed during the call.
  static Result<FoundChunks> of(RandomSource& source, const ReadLimits& limits);

  const std::vector<Damage>& damages() const { return damages_; }
  /// Returns all chunks found, including damaged chunks, in ascending order of their numbers. Each
  /// number occurs once. If there is an index, only chunks that the index lists are returned.
  const std::vector<container::FoundChunk>& chunks() const { return chunks_; }
  const std::vector<FoundGroup>& groups() const { return groups_; }
  const std::vector<FoundPart>& parts() const { return parts_; }
  const std::optional<container::Index>& index() const { return index_; }
  /// Return the offset and the length of the index in `source`. Precondition: an index was found.
  std::uint64_t index_offset() const { return index_offset_; }
  std::uint64_t index_bytes() const { return scan_.chunks.back().bytes(); }
  /// Returns true if no chunk is lost between the last chunk in chunks() and the index.
  bool ends_at_index() const;
  /// Returns the end offset of the last chunk before the last index.
  std::uint64_t end_of_chunks() const;
  /// Returns the payload of the first undamaged schema chunk, or an empty list if no schema is
  /// undamaged.
  const std::vector<std::byte>& schema_payload() const { return schema_payload_; }
  /// Returns the file start and the schema chunk with the bytes that they have in an undamaged
  /// file. Precondition: a schema was found.
  std::vector<std::byte> beginning() const;
  const std::optional<Schema>& schema() const { return schema_; }

 private:
  FoundChunks(RandomSource& source, const ReadLimits& limits) : source_(&source), limits_(limits) {}

  Result<void> read();
  void drop_uncommitted();
  Result<std::vector<std::byte>> payload_of(const container::FoundChunk& chunk, std::uint64_t most);
  Result<void> find_schema();
  Result<void> find_index();
  Result<std::optional<container::Index>> index_written_at(std::uint64_t offset);
  std::uint64_t written_at(const container::FoundChunk& index);
  Result<bool> is_contradicted(const container::Index& index);
  Result<void> judge_by_index();
  Result<void> judge_by_numbers();
  void judge_start();
  void judge_end();
  Result<void> take(const container::FoundChunk& chunk, const container::IndexEntry* listed);
  Result<FoundGroup> look_at_group(const container::FoundChunk& chunk);
  Result<void> take_parts(const container::FoundChunk& chunk);
  void add_damage(Damage damage, const std::vector<container::StepEntry>& parts);
  void add_lost(const container::IndexEntry& listed);
  void add_gap(const container::FoundChunk* before, const container::FoundChunk& after);
  void guess_cells(const FoundGroup& after);

  RandomSource* source_;
  ReadLimits limits_;
  container::ChunkScan scan_;
  std::vector<container::FoundChunk> chunks_;
  std::vector<FoundGroup> groups_;
  std::vector<FoundPart> parts_;
  std::uint64_t bundle_pairs_ = 0;  // number of pairs of an array and a step in the bundles found
  std::optional<container::Index> index_;
  std::uint64_t index_offset_ = 0;
  std::vector<std::byte> schema_payload_;
  // True if the file stores the header of the schema chunk in its long form, although the short
  // form would suffice.
  bool has_long_headers_ = false;
  std::optional<Schema> schema_;
  std::vector<Damage> damages_;
  // State that is used only for files without an index.

  // Indices in damages_ of the entries whose lost cells are not known yet.
  std::vector<std::size_t> unplaced_;
  std::optional<FoundGroup> group_before_;  // last readable group
};

}  // namespace shm
