// FoundChunks: what a damaged file holds: each chunk that is left, once, by its number, and what is
// hurt. Where the index is whole it lists what there was; else that follows from the numbers of
// chunks and the headers of groups.
// in:  a RandomSource of which nothing need be whole
// out: chunks, groups, step values; damages
// spec: "Container", "Index and trailer", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "container/chunk_scan.h"
#include "container/format.h"
#include "shm/damage.h"

namespace shm {

/// A group whose chunk header is whole.
struct FoundGroup {
  std::uint32_t sequence = 0;
  container::IndexEntry
      entry;  ///< by its own header, where that can be read; else place and segment
  bool readable = false;
  bool has_mesh = false;  ///< all but arrays is whole
  std::vector<std::uint32_t> lost_arrays;

  std::uint64_t end_cell() const { return entry.first_cell + entry.cells; }
};

/// A part of a whole chunk of step values.
struct FoundPart {
  std::uint32_t sequence = 0;
  std::uint64_t offset = 0, bytes = 0;  ///< of the chunk
  container::StepEntry values;
  std::uint64_t reference_step = 0;
};

class FoundChunks {
 public:
  /// `source` is borrowed during the call.
  static Result<FoundChunks> of(RandomSource& source, const ReadLimits& limits);

  const std::vector<Damage>& damages() const { return damages_; }
  /// Each once, by ascending number, those that are hurt too. Where there is an index, only those
  /// that it lists.
  const std::vector<container::FoundChunk>& chunks() const { return chunks_; }
  const std::vector<FoundGroup>& groups() const { return groups_; }
  const std::vector<FoundPart>& parts() const { return parts_; }
  const std::optional<container::Index>& index() const { return index_; }
  /// Where the index really is, and how long. Must hold: there is one.
  std::uint64_t index_offset() const { return index_offset_; }
  std::uint64_t index_bytes() const { return scan_.chunks.back().bytes(); }
  /// Whether the last chunk of chunks() is known to be the last one before the index.
  bool ends_at_index() const;
  /// Where all that is behind the last chunk that is no index begins.
  std::uint64_t end_of_chunks() const;
  /// Payload of a whole schema chunk, the one that stands first; empty where there is none.
  const std::vector<std::byte>& schema_payload() const { return schema_payload_; }
  /// File start and schema chunk as they stand in a file that is whole. Must hold: there is a
  /// schema.
  std::vector<std::byte> beginning() const;
  const std::optional<Schema>& schema() const { return schema_; }

 private:
  FoundChunks(RandomSource& source, const ReadLimits& limits) : source_(&source), limits_(limits) {}

  Result<void> read();
  Result<std::vector<std::byte>> payload_of(const container::FoundChunk& chunk, std::uint64_t most);
  Result<void> find_schema();
  Result<void> find_index();
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
  void add_gap(const container::FoundChunk* before, const container::FoundChunk& behind);
  void guess_cells(const FoundGroup& behind);

  RandomSource* source_;
  ReadLimits limits_;
  container::ChunkScan scan_;
  std::vector<container::FoundChunk> chunks_;
  std::vector<FoundGroup> groups_;
  std::vector<FoundPart> parts_;
  std::optional<container::Index> index_;
  std::uint64_t index_offset_ = 0;
  std::vector<std::byte> schema_payload_;
  bool has_long_headers_ = false;  // the schema, where a short one would do
  std::optional<Schema> schema_;
  std::vector<Damage> damages_;
  // without an index
  std::vector<std::size_t> unplaced_;       // damages whose cells are not known yet
  std::optional<FoundGroup> group_before_;  // the last readable one
};

}  // namespace shm
