// IndexedFile: reads a .shm file through its index. It finds chunks and the bitstreams of groups,
// and reads only the requested data. It relies on the offsets in the index, and checks all other
// contents of the index against the file.
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

#include "base/binary.h"
#include "base/errors.h"
#include "base/packing.h"
#include "format/format.h"
#include "format/schema.h"
#include "repair/decodable_parts.h"

namespace shm {

class IndexedFile {
 public:
  /// Creates an object for `source`, which is borrowed. Must be followed by open() or
  /// open_damaged().
  IndexedFile(RandomSource& source, const ReadLimits& limits)
      : source_(&source), limits_(within_sizes(limits)) {
    limits_.max_active_bytes =
        limit_with(limits_.max_active_bytes, ReadLimits::kActiveBytesEach, source.size());
  }

  /// Opens an undamaged file. Reads only the trailer, the index and the schema.
  Result<void> open();
  /// Opens a damaged file: scans all of it and stores the list of decodable parts. segments() and
  /// groups() then contain only the decodable segments and groups.
  Result<void> open_damaged();
  /// Returns the decodable parts, or null if the file was not opened by open_damaged().
  const DecodableParts* decodable() const { return decodable_.get(); }
  const Schema& schema() const { return *schema_; }
  const ReadLimits& limits() const { return limits_; }
  /// Returns the index: the totals of the whole file, and all entries.
  const container::Index& index() const { return index_; }
  std::uint64_t index_offset() const { return index_offset_; }
  /// Returns the size in bytes of the index chunk.
  std::uint64_t index_bytes() const { return index_bytes_; }
  /// Returns the number of entries of each index that was read: of the first one in the file, and
  /// of each index that refers to it, up to the last.
  const std::vector<std::size_t>& index_sizes() const { return index_sizes_; }
  /// Removes the entries of step values from the index. Call it when these entries have been stored
  /// elsewhere.
  void drop_step_entries();
  RandomSource& source() { return *source_; }

  const std::vector<SegmentInfo>& segments() const { return segments_; }
  const std::vector<container::IndexEntry>& groups() const { return groups_; }
  /// Returns the index in groups() of the first group of `segment`. Returns the number of groups if
  /// `segment` is segments().size().
  std::size_t first_group(std::size_t segment) const { return first_group_[segment]; }
  /// Returns the index in segments() of the segment that contains the group. In a damaged file this
  /// index can differ from the segment number in the header of the group.
  std::size_t segment_of(std::size_t group) const {
    return static_cast<std::size_t>(
               std::upper_bound(first_group_.begin(), first_group_.end(), group) -
               first_group_.begin()) -
           1;
  }
  /// Return the number that segments()[segment] or groups()[group] has in the file. In a damaged
  /// file, the number can differ from the index.
  std::uint32_t segment_number(std::size_t segment) const {
    return groups_[first_group_[segment]].segment;
  }
  std::uint64_t group_number(std::size_t group) const {
    return decodable_ ? decodable_->group_numbers[group] : group;
  }
  /// Returns the static arrays that are lost in a segment, in ascending order.
  std::span<const std::uint32_t> lost_arrays(std::size_t segment) const {
    return decodable_ ? std::span<const std::uint32_t>(decodable_->lost_arrays[segment])
                      : std::span<const std::uint32_t>();
  }

  /// Returns the payload of a whole chunk. If `version` is not null, stores the version of the
  /// chunk there.
  Result<std::vector<std::byte>> read_chunk(const container::IndexEntry& entry,
                                            std::uint8_t* version = nullptr);
  /// Result of read_chunk_of_parts(). That function is a variant of read_chunk() for chunks that
  /// contain several parts of step values. Such a chunk is requested once for each part, so a small
  /// payload is cached. The payload is valid until the next call to read_chunk_of_parts().
  struct Payload {
    std::span<const std::byte> bytes;
    std::uint8_t version = 0;
  };
  Result<Payload> read_chunk_of_parts(const container::IndexEntry& entry);
  /// Returns all extras in file order.
  Result<std::vector<Extra>> read_extras();
  /// Returns the step times. Returns an empty list if the file has no step times.
  Result<std::vector<double>> read_step_times();
  /// Fails unless the groups are contiguous and add up to the totals of the index.
  Result<void> expect_totals() const;
  /// Fails unless the header of a group agrees with the group's entry in the index, including the
  /// box.
  Result<void> expect_group(std::size_t group, const container::GroupHeader& header) const;
  /// Header of a group, without the bitstreams.
  struct GroupHead {
    std::vector<std::byte> bytes;  ///< group header as stored in the payload
    container::GroupHeader header;
    std::uint64_t payload_offset = 0;  ///< offset of the payload in the file
    /// Offset in the file of each stream that the group header lists.
    std::vector<std::uint64_t> stream_offset;
  };
  Result<GroupHead> read_group_head(std::size_t group);
  /// Announces to the source that these groups will be read as a whole.
  void prefetch_groups(std::span<const std::size_t> groups);
  /// Announces to the source which bitstreams of these groups will be read. To determine these
  /// bitstreams, reads the group headers and stores them for read_group_head(). Ignores errors in
  /// the headers, because read_group_head() reports them later. If there are too many groups, does
  /// nothing.
  using WantsStream =
      std::function<bool(const container::GroupHeader&, const container::StreamEntry&)>;
  void prefetch_streams(std::span<const std::size_t> groups, const WantsStream& wants);
  /// Returns the bytes of one bitstream of a group.
  Result<std::vector<std::byte>> read_stream(std::size_t group, const GroupHead& head,
                                             std::size_t stream);
  /// Reads a group. In the payload returned, streams that are not wanted are replaced with zeros.
  Result<container::GroupChunk> read_group(std::size_t group, const DecodedParts& parts);

  Error wrong_index(std::string detail) const {
    return corrupt(std::move(detail), "index", index_offset_);
  }

 private:
  std::uint64_t head_bytes(const container::IndexEntry& group) const;
  void look_at_beginning(std::span<const std::byte> bytes);
  Result<void> read_index();
  Result<void> expect_limits() const;
  Result<void> read_schema();
  Result<void> list_groups();
  void add_to_segment(const container::IndexEntry& entry);
  Result<void> read_step_times(const container::IndexEntry& entry, std::vector<double>& times);
  /// Returns the memory budget for unpacked blobs that remains after the schema has been unpacked.
  /// Each call returns the full remaining budget, so that reading the same parts a second time does
  /// not fail.
  UnpackBudget budget() const;
  /// Returns true if the unpacked size of blobs in this file is bounded
  /// (container::has_bounded_blobs()). This is the case if and only if values may be coded by
  /// reference to earlier values.
  bool has_bounded_blobs() const { return schema().earlier_values; }

  RandomSource* source_;
  ReadLimits limits_;
  // Schema of the file; on the heap, since other objects keep a pointer to it.
  std::unique_ptr<const Schema> schema_;
  std::uint64_t index_offset_ = 0, index_bytes_ = 0;
  std::vector<std::size_t> index_sizes_;
  container::Index index_;
  // True if the file stores all chunk headers in their long form, even if short headers would
  // suffice.
  bool has_long_headers_ = false;
  std::vector<SegmentInfo> segments_;
  std::vector<container::IndexEntry> groups_;
  std::vector<std::size_t> first_group_;  // index in groups_ of the first group of each segment;
                                          // the last entry is the number of groups
  std::unique_ptr<const DecodableParts> decodable_;
  // Group headers that prefetch_streams() has read, by group.
  std::unordered_map<std::size_t, GroupHead> heads_;
  std::vector<std::byte> kept_;  // payload stored by read_chunk_of_parts()
  // Offset of the chunk whose payload is in kept_; kNoOffset if kept_ is not valid.
  std::uint64_t kept_offset_ = kNoOffset;
  std::uint64_t kept_bytes_ = 0;  // length in bytes of the chunk whose payload is in kept_
  std::uint8_t kept_version_ = 0;
};

}  // namespace shm
