// GroupDecoder: decodes the groups of one segment to blocks of vertices and cells. It needs no data
// of other segments. This base class contains the interface, and the code that is shared by the
// decoders for cells over an active surface, for shifts and for patterns. Its counterpart is
// segment_encoder.h.
// spec: "Segments", "Decoding a group"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "codecs/shared/neighbourhood.h"
#include "codecs/shared/special_values.h"
#include "format/schema.h"
#include "shm/blocks.h"
#include "shm/result.h"

namespace shm {

/// The result of one decoding step: some vertices and cells of a segment.
struct DecodedBlock {
  MeshBlock mesh;
  SegmentStart segment;      ///< the segment of the block
  std::uint64_t offset = 0;  ///< offset in the file, in bytes, of the chunk that contains the
                             ///< block's group
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  /// `imported`: numbers of the vertices that earlier segments own and whose first use in this
  /// segment is in this block. `finalized_imports`: numbers of the imported vertices whose last use
  /// is in this block.
  std::vector<std::uint64_t> imported, finalized_imports;

  /// Results that are available after the last block of a group; empty in all other blocks.
  struct GroupEnd {
    std::uint64_t imported_vertices = 0, max_active_vertices = 0;
    /// True if the bounding box in the header matches the decoded coordinates. Also true if the
    /// coordinates were not decoded.
    bool has_its_box = true;
    /// Sizes of the streams in bytes. The keys are the stream names in SizeReport
    std::map<std::string, std::uint64_t> stream_bytes;
    std::uint64_t digest = 0;  ///< digest of the group that its header states
  };
  std::optional<GroupEnd> group_end;
};

/// Size in bytes of the static arrays of one cell, for each element block. All decoders share one
/// vector, because a file may have many segments.
using CellBytes = std::shared_ptr<const std::vector<std::size_t>>;

class GroupDecoder {
 public:
  /// `schema` must have passed check_schema() and must outlive the decoder. `cell_bytes`: the
  /// result of cell_data_bytes(schema).
  GroupDecoder(const Schema& schema, const SegmentStart& start, DecodedParts parts,
               CellBytes cell_bytes);
  virtual ~GroupDecoder() = default;
  GroupDecoder(const GroupDecoder&) = delete;
  GroupDecoder& operator=(const GroupDecoder&) = delete;

  const SegmentStart& start() const { return start_; }

  // The errors do not name a place in the file, because the caller knows which group is being
  // decoded.

  /// Begins a group. `header` must stay valid until the next group begins. `known`: the codec of
  /// the group's cells; nothing if the group has no cells or the codec is unknown.
  Result<void> begin_group(const container::GroupHeader& header,
                           std::optional<ConnectivityCodec> known);
  /// Begins a stream. Call it for each stream that the header lists, in the order of the header,
  /// but not for streams that the caller does not want to decode. `bytes` must stay valid until the
  /// group ends.
  Result<void> begin_stream(const container::StreamEntry& entry, std::span<const std::byte> bytes);
  /// Marks the end of the streams. Call it after the last begin_stream().
  virtual Result<void> end_streams() { return {}; }
  /// Sets limits on the memory that columns use for data indexed by slot. `bytes`: maximum number
  /// of bytes. `plenty`: number of bytes above which the columns begin to save memory.
  virtual void allow_memory(std::uint64_t /*bytes*/, std::uint64_t /*plenty*/) {}

  /// Decodes the next block: up to a few thousand cells (a tile), or unused vertices. Precondition:
  /// !is_complete(), or the group is empty.
  Result<void> next_block(DecodedBlock& decoded);
  /// Returns true if all cells and vertices of the group have been decoded.
  bool is_complete() const {
    return done_.cells == header_->cells && done_.own == header_->vertices;
  }
  /// Checks that the contents of the group match its header, and that the streams contain no
  /// further data. Call it after the last block.
  Result<DecodedBlock::GroupEnd> end_group() const;

  /// Returns the numbers of the vertices that the segment owns and that are not finalized yet.
  virtual std::vector<std::uint64_t> alive() const = 0;

  /// Neighbourhoods of the vertices and cells of the most recent block; empty unless DecodedParts
  /// requests them.
  struct Items {
    std::span<const Neighbourhood> vertices, cells;
  };
  virtual Items items() const = 0;
  /// Returns a number that is greater than every slot in the neighbourhoods so far.
  virtual std::uint32_t slots() const = 0;

 protected:
  /// Counts of the elements and bytes of the group that have been decoded so far, and the largest
  /// number of active vertices in the group.
  struct Progress {
    std::uint64_t cells = 0, own = 0, imported = 0, unused = 0, bytes = 0, active = 0;
    std::array<ValueRange, 3> box{};  ///< bounding box of the coordinates, by axis
  };

  // --- functions that each codec implements

  /// Begins the streams of a group. It is called before the first stream. `codec`: the codec of the
  /// group's connectivity, the same in all groups of the segment; nothing if the group has no
  /// connectivity.
  virtual Result<void> begin_streams(std::optional<ConnectivityCodec> codec) = 0;
  /// Begins a stream, see begin_stream(). `codec` and `bytes` do not include the special values of
  /// a column.
  virtual Result<void> begin_plain_stream(const container::StreamEntry& entry, Codec codec,
                                          std::span<const std::byte> bytes) = 0;
  /// Decodes the cells and vertices of the next block, but not their values.
  virtual Result<void> decode_elements(DecodedBlock& decoded) = 0;
  /// Returns true if decode_column() failed because the columns would exceed the memory limit.
  virtual bool is_out_of_memory() const { return false; }
  /// Decodes the values of one column for the elements of this block. Returns false if the data is
  /// damaged.
  virtual bool decode_column(std::size_t column, const MeshBlock& block,
                             std::vector<std::byte>& out) = 0;
  /// Returns true if all data of the streams have been decoded.
  virtual bool is_used_up() const { return true; }

  // --- the functions that all codecs share

  bool may_import() const { return start_.segment > 0; }
  bool numbered_by_order() const { return schema_->order != Order::keep; }
  /// Returns true if the group may contain another vertex of the given kind: an imported vertex if
  /// `imported` is true, otherwise a vertex that the segment owns. The header states the number of
  /// vertices of each kind.
  bool has_room_for_vertex(bool imported) const {
    return imported ? done_.imported < header_->imported_vertices : done_.own < header_->vertices;
  }
  bool has_room_for_bytes(std::uint64_t bytes) const {
    return done_.bytes + bytes <= header_->decoded_bytes;
  }
  /// Adds a vertex to the block. An imported vertex is skipped if the caller did not request
  /// imported vertices. Precondition: has_room_for_vertex().
  void add_vertex(std::uint64_t number, bool imported, DecodedBlock& decoded) {
    if (may_import() || parts_.imported_vertices)
      note_import(number, imported, decoded);
    else
      decoded.mesh.vertex_numbers.push_back(number);
    ++(imported ? done_.imported : done_.own);
    done_.bytes += vertex_bytes_;
  }
  void add_own_vertices(std::span<const std::uint64_t> numbers, DecodedBlock& decoded);
  // Prepares the block for cells that are added one by one. If the block is reused, removes its old
  // cells.
  static void begin_cells(MeshBlock& block);
  /// Resizes the block for cells that will be overwritten. The block has `cells` cells, or all
  /// remaining cells of the group if fewer remain; each cell has at most `nodes` nodes. Returns the
  /// number of cells.
  std::size_t make_room_for_cells(std::uint64_t cells, std::size_t nodes, MeshBlock& block) const;
  /// Removes all cells of the block except the first `cells` cells. Precondition: corner_begin is
  /// set for these cells.
  static void keep_cells(std::size_t cells, MeshBlock& block);

  // Columns of values. Column 0 is geometry; the following columns are the static arrays in schema
  // order.
  std::size_t columns() const { return arrays_.size() + 1; }
  bool is_wanted(std::size_t column) const {
    return column == 0 ? parts_.geometry : parts_.includes_array(arrays_[column - 1]);
  }
  bool of_cells(std::size_t column) const {
    return column > 0 && schema_->arrays[arrays_[column - 1]].location == Location::cell;
  }
  std::uint32_t array_of(std::size_t column) const { return arrays_[column - 1]; }
  /// Returns the index of the column that the stream contains; returns columns() if the stream does
  /// not contain values.
  std::size_t column_of(const container::StreamEntry& entry) const;

  static Error wrong_stream(const container::StreamEntry& entry);
  static Error unknown_codec(const container::StreamEntry& entry);

  const Schema* schema_;
  const SegmentStart start_;
  const DecodedParts parts_;
  const std::size_t vertex_bytes_;
  const CellBytes cell_bytes_;
  std::optional<Codec> codec_;  // codec of the connectivity, once it is known
  ConnectivityCodec codec_name_ = ConnectivityCodec::automatic;

  // Data of the current group
  const container::GroupHeader* header_ = nullptr;
  Progress done_;

 private:
  void note_import(std::uint64_t number, bool imported, DecodedBlock& decoded);
  static void resize_cells(std::size_t cells, MeshBlock& block);
  Result<void> decode_values(MeshBlock& block);
  void widen_box(std::span<const std::byte> xyz);
  bool has_its_box() const;
  std::size_t element_bytes(std::size_t column) const;

  // The special values of the columns in the current group; empty if no column has any.
  std::map<std::size_t, SpecialValuesDecoder> special_;
  std::vector<std::uint32_t> arrays_;   // schema indices of the arrays in columns 1, 2, ...
  std::vector<std::uint8_t> left_out_;  // for each vertex of the block: 1 if it is imported
};

}  // namespace shm
