// SegmentEncoder: encodes the cells of one segment to the bitstreams of its groups. It needs no
// data of other segments, so several segments can be encoded in parallel. Its counterpart is
// group_decoder.h.
// spec: "Segments", "Group"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/lists.h"
#include "codecs/shared/group_data.h"
#include "codecs/shared/value_domain.h"
#include "format/format.h"
#include "format/schema.h"
#include "shm/result.h"
#include "shm/schema.h"

namespace shm {

/// Size in bytes at which a group ends early. The limit applies to the static values of the group,
/// and to the values of each stepped array at one step. It limits the memory that readers need.
inline constexpr std::uint64_t kFullGroupBytes = std::uint64_t{1} << 26;
/// Number of vertices at which a group ends. This limit matters for cells that introduce more than
/// four vertices each. It keeps the memory for their values and neighbourhoods small.
inline constexpr std::uint64_t kManyGroupVertices = std::uint64_t{1} << 18;
/// Largest number of vertices in a group that has unused vertices. This limit matters for groups
/// that consist of unused vertices.
inline constexpr std::uint64_t kFullGroupVertices = std::uint64_t{1} << 16;

/// Approximate size, in bytes, of the part of a segment that has been encoded so far.
struct SegmentSize {
  std::uint64_t topology = 0;  ///< size of connectivity, corner order and vertex numbers
  std::uint64_t values = 0;    ///< size of coordinates and arrays, including the headers of their
                               ///< streams
  std::uint64_t besides = 0;   ///< size of the import streams, and of the headers of all streams
                               ///< that do not contain values
  std::uint64_t all() const { return topology + values + besides; }

  /// Adds the size of a stream: `bytes` bytes and the stream's header.
  void add(container::StreamKind kind, std::uint64_t bytes);
};
/// For each column and each component, the domain in which the component will probably be coded.
using RatedDomains = std::vector<std::vector<RatedDomain>>;

/// Options for coding a segment.
struct SegmentOptions {
  std::uint32_t group_cells = 65536;
  ConnectivityCodec codec = ConnectivityCodec::rows;
  Codec codec_id{};               ///< id of `codec`; set by make_segment_encoder()
  Level level = Level::standard;  ///< level of the value coders

  /// False if coordinates and arrays are not encoded, because only the size of the connectivity is
  /// of interest
  bool values = true;
  bool with_order = true;  ///< true: groups contain `own` and `cell_numbers`
  bool with_digest = false;
};

class GroupDigest;

/// Base class of all segment encoders. It divides the elements into groups, builds the group
/// headers, and collects the vertex and cell numbers that the pipeline needs.
class SegmentEncoder {
 public:
  /// `schema` must have passed check_schema() and must outlive the encoder.
  SegmentEncoder(const Schema& schema, const SegmentOptions& options, const SegmentStart& start);
  virtual ~SegmentEncoder();
  SegmentEncoder(const SegmentEncoder&) = delete;
  SegmentEncoder& operator=(const SegmentEncoder&) = delete;

  /// Encodes the cells of `piece`. Appends all groups that end in this piece to `done`.
  Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done);
  /// Ends the segment. Appends the current group to `done` unless it is empty.
  void end(std::vector<EncodedGroup>& done);

  /// Returns the approximate size in bytes of the segment so far. The values of the current group
  /// are not included.
  SegmentSize size();
  /// Returns the approximate size in bytes of the values of the current group. `rated` contains,
  /// for each column, the domains that earlier calls have chosen. This call uses them, and adds the
  /// domains of columns that have none yet.
  std::uint64_t about_values(RatedDomains& rated) {
    rated.resize(values_.columns());
    return has_group() ? values_at_hand(&rated) : 0;
  }
  /// Returns the exact size in bytes that the values of the current group would have if the group
  /// ended now. The call is slow: it codes all these values.
  std::uint64_t values_if_coded() { return has_group() ? values_at_hand(nullptr) : 0; }

 protected:
  /// Start of the data of one cell or unused vertex, as positions in the arrays of a piece.
  struct Place {
    std::size_t node = 0, vertex = 0, data = 0, other_last_use = 0;
  };

  // --- functions that each codec implements

  /// Encodes a cell and the vertices that it introduces. Calls take_vertex() for each of these
  /// vertices. Returns false if the cell cannot be encoded.
  virtual bool encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                           const Place& place) = 0;
  /// Encodes a vertex that no cell uses. Calls take_vertex() for this vertex.
  virtual void encode_unused(const SegmentPiece& piece, std::size_t vertex) = 0;
  /// Adds the streams of the current group to the result. Then clears the data of the group.
  virtual void encode_streams() = 0;
  /// Adds the sizes of the current group's streams, except the streams of values, to `size`.
  virtual void add_size_at_hand(SegmentSize& size) = 0;
  /// Returns the size in bytes of the group's values. If `rated` is null, codes the values and
  /// returns the exact size; otherwise returns an estimate.
  virtual std::uint64_t values_at_hand(RatedDomains* rated) = 0;

  /// Adds vertex `index` of the piece, with its values, to the group.
  void take_vertex(const SegmentPiece& piece, std::size_t index);
  /// Records the current number of active vertices. The header of the group contains the maximum of
  /// all recorded numbers.
  void note_active(std::uint64_t active);
  /// Adds a stream with the contents `bytes`. Sets the size and checksum in `entry`.
  void add_stream(container::StreamEntry entry, std::vector<std::byte> bytes);

  /// The values of a column, as a value coder encodes them.
  struct ColumnValues {
    const std::byte* values = nullptr;
    std::size_t stride = 0;
    std::vector<std::byte> copy{};     ///< if the column has special values: the other values
    std::vector<std::byte> special{};  ///< the coded special values
  };
  /// Returns the values of a column of the current group, without special values.
  ColumnValues values_of(std::size_t column) const;
  /// Adds the stream of a column, whose values were coded as `bytes` by `codec`.
  void add_values(std::size_t column, const ColumnValues& values, Codec codec,
                  std::vector<std::byte> bytes);

  const Schema* schema_;
  const SegmentOptions options_;
  const SegmentStart start_;
  // Data of the current group
  EncodedGroup group_;
  GroupValues values_;
  TileEnds tile_ends_;

 private:
  bool is_full() const;
  bool has_group() const;  // true if the current group contains at least one element
  void begin_group();
  void end_group(std::vector<EncodedGroup>& done);

  SegmentSize finished_;  // total size of the finished groups
  std::uint64_t next_cell_, next_vertex_;
  std::unique_ptr<GroupDigest> digest_;  // set if options_.with_digest is
  // Size in bytes of the largest element that a stepped point array or a stepped cell array has at
  // one step
  std::uint64_t vertex_step_bytes_ = 0, cell_step_bytes_ = 0;
};

}  // namespace shm
