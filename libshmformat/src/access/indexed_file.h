// IndexedFile: a .shm file that is read by its index: finds chunks and the bitstreams of groups,
// and reads these alone. The index is believed where to look, and never what is there.
// spec: "Index and trailer", "Group"
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bytes/binary.h"
#include "bytes/packing.h"
#include "container/format.h"
#include "groups/mesh_streams.h"
#include "recovery/decodable_parts.h"
#include "shm/reader.h"
#include "shm/segment_reader.h"

namespace shm {

class IndexedFile {
 public:
  /// `source` is borrowed.
  IndexedFile(RandomSource& source, const ReadLimits& limits)
      : source_(&source), limits_(within_sizes(limits)) {
    limits_.max_active_bytes =
        limit_with(limits_.max_active_bytes, ReadLimits::kActiveBytesEach, source.size());
  }

  /// Reads trailer, index and schema, and nothing else.
  Result<void> open();
  /// A damaged file: goes through all of it, and has what can be decoded of it. Segments and groups
  /// are counted among those that are left.
  Result<void> open_damaged();
  /// Null unless the file is damaged.
  const DecodableParts* decodable() const { return decodable_.get(); }
  const Schema& schema() const { return *decoder_.schema(); }
  const ReadLimits& limits() const { return limits_; }
  /// Its totals of the whole file, and its entries.
  const container::Index& index() const { return index_; }
  std::uint64_t index_offset() const { return index_offset_; }
  /// Those of step values, when they are held elsewhere.
  void drop_step_entries();
  RandomSource& source() { return *source_; }

  const std::vector<SegmentInfo>& segments() const { return segments_; }
  const std::vector<container::IndexEntry>& groups() const { return groups_; }
  /// Of `segment`; that of the segment behind the last one is the number of groups.
  std::size_t first_group(std::size_t segment) const { return first_group_[segment]; }
  /// Which of segments() has the group; of a damaged file not the number in the header of the
  /// group.
  std::size_t segment_of(std::size_t group) const {
    return static_cast<std::size_t>(
               std::upper_bound(first_group_.begin(), first_group_.end(), group) -
               first_group_.begin()) -
           1;
  }
  /// What a segment and a group of groups() are called in the file.
  std::uint32_t segment_number(std::size_t segment) const {
    return groups_[first_group_[segment]].segment;
  }
  std::uint64_t group_number(std::size_t group) const {
    return decodable_ ? decodable_->group_numbers[group] : group;
  }
  /// Static arrays that are lost in a segment, ascending.
  std::span<const std::uint32_t> lost_arrays(std::size_t segment) const {
    return decodable_ ? std::span<const std::uint32_t>(decodable_->lost_arrays[segment])
                      : std::span<const std::uint32_t>();
  }

  /// The payload of a whole chunk; `version`, where it is asked for, is that of the chunk.
  Result<std::vector<std::byte>> read_chunk(const container::IndexEntry& entry,
                                            std::uint8_t* version = nullptr);
  /// The same of a chunk with several parts, which is read for each of them: a small one is kept
  /// for the next call. The payload lives until then.
  struct Payload {
    std::span<const std::byte> bytes;
    std::uint8_t version = 0;
  };
  Result<Payload> read_chunk_of_parts(const container::IndexEntry& entry);
  /// All of them, in the order of the file.
  Result<std::vector<Extra>> read_extras();
  /// Empty where the file has none.
  Result<std::vector<double>> read_step_times();
  /// Fails unless the groups follow each other, and add up to the totals of the index.
  Result<void> expect_totals() const;
  /// Fails unless the header of a group agrees with its line in the index, its box included.
  Result<void> expect_group(std::size_t group, const container::GroupHeader& header) const;
  /// A group without its bitstreams.
  struct GroupHead {
    std::vector<std::byte> bytes;  ///< as they stand in the payload
    container::GroupHeader header;
    std::uint64_t payload_offset = 0;          ///< in the file
    std::vector<std::uint64_t> stream_offset;  ///< in the file, of each stream of the header
  };
  Result<GroupHead> read_group_head(std::size_t group);
  /// Tells the source that these groups will be read, whole.
  void prefetch_groups(std::span<const std::size_t> groups);
  /// Tells it which bitstreams of these groups will be. For that their heads are read, and kept for
  /// read_group_head(), which also complains of them. Of very many groups nothing is told.
  using WantsStream =
      std::function<bool(const container::GroupHeader&, const container::StreamEntry&)>;
  void prefetch_streams(std::span<const std::size_t> groups, const WantsStream& wants);
  /// The bytes of one of its bitstreams.
  Result<std::vector<std::byte>> read_stream(std::size_t group, const GroupHead& head,
                                             std::size_t stream);
  /// A group, in whose payload zeros stand for streams that are not wanted.
  Result<container::GroupChunk> read_group(std::size_t group, const DecodedParts& parts);

  /// A complaint about the bytes at `offset`.
  static Error wrong(std::string detail, std::string section, std::uint64_t offset,
                     ErrorCode code = ErrorCode::corrupt) {
    return Error{code, std::move(detail), std::move(section), offset, {}};
  }
  Error wrong_index(std::string detail) const {
    return wrong(std::move(detail), "index", index_offset_);
  }

 private:
  std::uint64_t head_bytes(const container::IndexEntry& group) const;
  void look_at_beginning(std::span<const std::byte> bytes);
  Result<void> read_index();
  Result<void> expect_limits() const;
  Result<void> read_schema();
  Result<void> list_groups();
  void add_to_segment(const container::IndexEntry& entry);
  Result<std::vector<std::byte>> read_packed(const container::IndexEntry& entry);
  /// Without what the schema takes. Who reads again gets what was there.
  UnpackBudget budget() const;
  /// Files that have earlier values have bounded blobs (container::has_bounded_blobs()).
  bool has_bounded_blobs() const { return schema().earlier_values; }

  RandomSource* source_;
  ReadLimits limits_;
  Decoder decoder_;  // of the schema
  std::uint64_t index_offset_ = 0;
  container::Index index_;
  bool has_long_headers_ = false;  // of chunks, where short ones would do
  std::vector<SegmentInfo> segments_;
  std::vector<container::IndexEntry> groups_;
  std::vector<std::size_t> first_group_;  // of each segment, and behind them
  std::unique_ptr<const DecodableParts> decodable_;
  std::unordered_map<std::size_t, GroupHead> heads_;  // read ahead, by group
  std::vector<std::byte> kept_;                       // of read_chunk_of_parts()
  std::uint64_t kept_offset_ = kNoOffset;  // of its chunk; kNoOffset: not to be used again
  std::uint64_t kept_bytes_ = 0;           // of its chunk
  std::uint8_t kept_version_ = 0;
};

}  // namespace shm
