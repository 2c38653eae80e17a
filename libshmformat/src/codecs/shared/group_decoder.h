// GroupDecoder: decodes the groups of one segment to blocks of vertices and cells. It needs no data
// of other segments. This base class has the interface and the shared code for cells over an active
// surface, shifts and patterns. It is the counterpart of segment_encoder.h.
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
#include "format/schema.h"
#include "shm/blocks.h"
#include "shm/result.h"

namespace shm {

/// The result of one decoding step: a block of vertices and cells of a segment.
struct DecodedBlock {
  MeshBlock mesh;
  SegmentStart segment;      ///< the segment of the block
  std::uint64_t offset = 0;  ///< offset in bytes, in the file, of the chunk with the block's group
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  /// `imported`: numbers of vertices that earlier segments own and that this segment uses for the
  /// first time in cells of this block. `finalized_imports`: numbers of such vertices that cells of
  /// this block finalize.
  std::vector<std::uint64_t> imported, finalized_imports;

  /// Set in the last block of a group.
  struct GroupEnd {
    std::uint64_t imported_vertices = 0, max_active_vertices = 0;
    /// True if the bounding box in the header matches the decoded coordinates, or if the
    /// coordinates were not decoded.
    bool has_its_box = true;
    /// Sizes in bytes of the streams, by their names in SizeReport
    std::map<std::string, std::uint64_t> stream_bytes;
  };
  std::optional<GroupEnd> group_end;
};

/// Size in bytes of the static arrays in one cell, by block. The decoders of all segments share the
/// vector because a file may have many segments.
using CellBytes = std::shared_ptr<const std::vector<std::size_t>>;

class GroupDecoder {
 public:
  /// `schema` has passed check_schema() and must outlive the decoder. `cell_bytes`: the result of
  /// cell_data_bytes(schema).
  GroupDecoder(const Schema& schema, const SegmentStart& start, DecodedParts parts,
               CellBytes cell_bytes);
  virtual ~GroupDecoder() = default;
  GroupDecoder(const GroupDecoder&) = delete;
  GroupDecoder& operator=(const GroupDecoder&) = delete;

  const SegmentStart& start() const { return start_; }

  // Errors do not name a place in the file: the caller knows which group is decoded.

  /// Begins a group. `header` must stay valid until the next group begins. `known`: the codec of
  /// the group's cells; nothing if the group has no cells or the codec is unknown.
  Result<void> begin_group(const container::GroupHeader& header,
                           std::optional<ConnectivityCodec> known);
  /// Begins a stream. Call it in order for each stream that the header lists, except streams of
  /// parts that are not decoded. `bytes` must stay valid until the group ends.
  virtual Result<void> begin_stream(const container::StreamEntry& entry,
                                    std::span<const std::byte> bytes) = 0;
  /// Ends the input of streams. Call it after the last stream.
  virtual Result<void> end_streams() { return {}; }
  /// Sets the memory limit, in bytes, for data that columns store by slot. Once `plenty` bytes are
  /// in use, the columns save memory.
  virtual void allow_memory(std::uint64_t /*bytes*/, std::uint64_t /*plenty*/) {}

  /// Decodes the next block: a tile of some thousand cells, or of unused vertices. Must hold:
  /// !is_complete(), or the group is empty.
  Result<void> next_block(DecodedBlock& decoded);
  /// Returns true if all cells and vertices of the group have been decoded.
  bool is_complete() const {
    return done_.cells == header_->cells && done_.own == header_->vertices;
  }
  /// Checks that the contents of the group match its header, and that the streams contain no
  /// further data. Call it after the last block.
  Result<DecodedBlock::GroupEnd> end_group() const;

  /// Returns the numbers of the segment's own vertices that are not finalized yet.
  virtual std::vector<std::uint64_t> alive() const = 0;

  /// Neighbourhoods of the vertices and cells of the last block, if DecodedParts requests them.
  struct Items {
    std::span<const Neighbourhood> vertices, cells;
  };
  virtual Items items() const = 0;
  /// Returns an upper bound (exclusive) of all slots that occur in the neighbourhoods so far.
  virtual std::uint32_t slots() const = 0;

 protected:
  /// Number of elements and bytes of the group decoded so far, and the largest number of active
  /// vertices in the group.
  struct Progress {
    std::uint64_t cells = 0, own = 0, imported = 0, unused = 0, bytes = 0, active = 0;
    std::array<ValueRange, 3> box{};  ///< bounding box of the coordinates, by axis
  };

  // --- the functions that depend on the codec

  /// Begins the streams of a group; called before the first stream. `codec`: the codec of the
  /// group's connectivity, which is known and the same in all groups of the segment; nothing if the
  /// group has no connectivity.
  virtual Result<void> begin_streams(std::optional<ConnectivityCodec> codec) = 0;
  /// Decodes the cells and vertices of the next block, without their values.
  virtual Result<void> decode_elements(DecodedBlock& decoded) = 0;
  /// Returns true if decode_column() failed because columns would need more memory than allowed.
  virtual bool is_out_of_memory() const { return false; }
  /// Decodes the values of one column in this block. Returns false for damaged data.
  virtual bool decode_column(std::size_t column, const MeshBlock& block,
                             std::vector<std::byte>& out) = 0;
  /// Returns true if all data of the streams have been decoded.
  virtual bool is_used_up() const { return true; }

  // --- the functions that all codecs share

  bool may_import() const { return start_.segment > 0; }
  bool numbered_by_order() const { return schema_->order != Order::keep; }
  /// Returns true if the header permits another imported vertex (if `imported` is true) or own
  /// vertex.
  bool has_room_for_vertex(bool imported) const {
    return imported ? done_.imported < header_->imported_vertices : done_.own < header_->vertices;
  }
  bool has_room_for_bytes(std::uint64_t bytes) const {
    return done_.bytes + bytes <= header_->decoded_bytes;
  }
  /// Adds a vertex to the block. Leaves out an imported vertex if the caller did not request
  /// imported vertices. Must hold: has_room_for_vertex().
  void add_vertex(std::uint64_t number, bool imported, DecodedBlock& decoded) {
    if (may_import() || parts_.imported_vertices)
      note_import(number, imported, decoded);
    else
      decoded.mesh.vertex_numbers.push_back(number);
    ++(imported ? done_.imported : done_.own);
    done_.bytes += vertex_bytes_;
  }
  void add_own_vertices(std::span<const std::uint64_t> numbers, DecodedBlock& decoded);
  // Prepares a block whose cells are added one by one. Removes the cells that a reused block still
  // contains.
  static void begin_cells(MeshBlock& block);
  /// Prepares a block whose cells are overwritten: resizes the block to `cells` cells of at most
  /// `nodes` nodes each, or to the remaining cells of the group if there are fewer. Returns the
  /// number of cells.
  std::size_t make_room_for_cells(std::uint64_t cells, std::size_t nodes, MeshBlock& block) const;
  /// Removes all but the first `cells` cells of the block. Must hold: corner_begin of these cells
  /// is set.
  static void keep_cells(std::size_t cells, MeshBlock& block);

  // Columns of values: column 0 is geometry; the static arrays follow in schema order.
  std::size_t columns() const { return arrays_.size() + 1; }
  bool is_wanted(std::size_t column) const {
    return column == 0 ? parts_.geometry : parts_.includes_array(arrays_[column - 1]);
  }
  bool of_cells(std::size_t column) const {
    return column > 0 && schema_->arrays[arrays_[column - 1]].location == Location::cell;
  }
  std::uint32_t array_of(std::size_t column) const { return arrays_[column - 1]; }
  /// Returns the column of a stream; columns() if the stream does not contain values.
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

  std::vector<std::uint32_t> arrays_;   // schema indices of the arrays in columns 1, 2, ...
  std::vector<std::uint8_t> left_out_;  // for each vertex of the block: 1 if it is imported
};

}  // namespace shm
