// GroupDecoder: the groups of one segment in, blocks of vertices and cells out. One interface for
// cells over an active surface and for cells that are shifts; what both do alike stands here. It
// needs nothing of other segments. The mirror of segment_encoder.h.
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

#include "groups/mesh_streams.h"
#include "model/schema.h"
#include "shm/reader.h"
#include "shm/result.h"

namespace shm {

/// One step of decoding a segment.
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
    /// Whether the box in the header is that of the coordinates, as far as these were decoded.
    bool has_its_box = true;
    std::map<std::string, std::uint64_t> stream_bytes;  ///< by the names of SizeReport
  };
  std::optional<GroupEnd> group_end;
};

/// Bytes of the static arrays in a cell, by block; shared where there are many segments.
using CellBytes = std::shared_ptr<const std::vector<std::size_t>>;

/// Whether as many vertices may be active as a group with this header has; `file`: bytes up to its
/// end. The error names no place.
Result<void> check_active(const container::GroupHeader& header, const ReadLimits& limits,
                          std::uint64_t file);

class GroupDecoder {
 public:
  /// `schema` is checked and borrowed. `cell_bytes`: of cell_data_bytes(schema).
  GroupDecoder(const Schema& schema, const SegmentStart& start, DecodedParts parts,
               CellBytes cell_bytes);
  virtual ~GroupDecoder() = default;
  GroupDecoder(const GroupDecoder&) = delete;
  GroupDecoder& operator=(const GroupDecoder&) = delete;

  const SegmentStart& start() const { return start_; }

  // Errors name no place: a caller knows which group this is.

  /// `header` is borrowed until the next group begins.
  Result<void> begin_group(const container::GroupHeader& header);
  /// Each stream that the header lists, in order, but for those of parts that are left out. `bytes`
  /// are borrowed for the group.
  virtual Result<void> begin_stream(const container::StreamEntry& entry,
                                    std::span<const std::byte> bytes) = 0;
  /// Behind the last stream.
  virtual Result<void> end_streams() { return {}; }
  /// What columns may keep by slot from here on, in bytes; beyond `plenty` they are sparing.
  virtual void allow_memory(std::uint64_t /*bytes*/, std::uint64_t /*plenty*/) {}

  /// The next block, some thousand cells or vertices that no cell uses: a tile. Must hold:
  /// !is_complete(), or the group is empty.
  Result<void> next_block(DecodedBlock& decoded);
  /// Whether all cells and vertices of the group have come.
  bool is_complete() const {
    return done_.cells == header_->cells && done_.own == header_->vertices;
  }
  /// Behind the last block: whether the group holds what its header states, and nothing else.
  Result<DecodedBlock::GroupEnd> end_group() const;

  /// Numbers of own vertices that are not finalized by now.
  virtual std::vector<std::uint64_t> alive() const = 0;

  /// Neighbourhoods of the vertices and cells of the last block, of those that DecodedParts names.
  struct Items {
    std::span<const Neighbourhood> vertices, cells;
  };
  virtual Items items() const = 0;
  /// Above every slot that an item named so far.
  virtual std::uint32_t slots() const = 0;

 protected:
  /// How much of a group has been decoded, and the largest number of active vertices in it.
  struct Progress {
    std::uint64_t cells = 0, own = 0, imported = 0, unused = 0, bytes = 0, active = 0;
    std::array<ValueRange, 3> box{};  ///< of the coordinates, by axis
  };

  // --- what depends on the codec

  /// Before the streams of a group. `codec`: of its connectivity, if it has that; known, and the
  /// same as before in the segment.
  virtual Result<void> begin_streams(std::optional<ConnectivityCodec> codec) = 0;
  /// Cells and vertices of the next block, but for their values.
  virtual Result<void> decode_elements(DecodedBlock& decoded) = 0;
  /// Whether a decode_column() failed since columns would keep more than was allowed.
  virtual bool is_out_of_memory() const { return false; }
  /// The values of these. False for damaged data.
  virtual bool decode_column(std::size_t column, const MeshBlock& block,
                             std::vector<std::byte>& out) = 0;
  /// Whether the streams hold no more than the group.
  virtual bool is_used_up() const { return true; }

  // --- what is alike

  bool may_import() const { return start_.segment > 0; }
  bool numbered_by_order() const { return schema_->order != Order::keep; }
  /// Whether the group may have one more.
  bool has_room_for_vertex(bool imported) const {
    return imported ? done_.imported < header_->imported_vertices : done_.own < header_->vertices;
  }
  bool has_room_for_bytes(std::uint64_t bytes) const {
    return done_.bytes + bytes <= header_->decoded_bytes;
  }
  /// Adds a vertex to the block, unless it is imported and left out. Must hold:
  /// has_room_for_vertex().
  void add_vertex(std::uint64_t number, bool imported, DecodedBlock& decoded) {
    if (may_import() || parts_.imported_vertices)
      note_import(number, imported, decoded);
    else
      decoded.mesh.vertex_numbers.push_back(number);
    ++(imported ? done_.imported : done_.own);
    done_.bytes += vertex_bytes_;
  }
  void add_own_vertices(std::span<const std::uint64_t> numbers, DecodedBlock& decoded);
  // A block may have the cells of one before. Either they go, and its own are added one by one:
  static void begin_cells(MeshBlock& block);
  /// Or it gets room for `cells`, or those that are left, of so many nodes at most, and what is in
  /// it is written over; how many these are.
  std::size_t make_room_for_cells(std::uint64_t cells, std::size_t nodes, MeshBlock& block) const;
  /// So many it has; their corners must be told.
  static void keep_cells(std::size_t cells, MeshBlock& block);

  // Columns of values: 0 is geometry, the others are the static arrays in schema order.
  std::size_t columns() const { return arrays_.size() + 1; }
  bool is_wanted(std::size_t column) const {
    return column == 0 ? parts_.geometry : parts_.includes_array(arrays_[column - 1]);
  }
  bool of_cells(std::size_t column) const {
    return column > 0 && schema_->arrays[arrays_[column - 1]].location == Location::cell;
  }
  std::uint32_t array_of(std::size_t column) const { return arrays_[column - 1]; }
  /// Of a stream of values; columns() where there is none.
  std::size_t column_of(const container::StreamEntry& entry) const;

  static Error corrupt(std::string detail) {
    return Error{ErrorCode::corrupt, std::move(detail), {}, kNoOffset, {}};
  }
  static Error unsupported(std::string detail) {
    return Error{ErrorCode::unsupported, std::move(detail), {}, kNoOffset, {}};
  }
  static Error wrong_stream(const container::StreamEntry& entry);
  static Error unknown_codec(const container::StreamEntry& entry);

  const Schema* schema_;
  const SegmentStart start_;
  const DecodedParts parts_;
  const std::size_t vertex_bytes_;
  const CellBytes cell_bytes_;
  std::optional<container::Codec> codec_;  // of the connectivity, once it is known

  // the group at hand
  const container::GroupHeader* header_ = nullptr;
  Progress done_;

 private:
  void note_import(std::uint64_t number, bool imported, DecodedBlock& decoded);
  static void resize_cells(std::size_t cells, MeshBlock& block);
  Result<void> decode_values(MeshBlock& block);
  void widen_box(std::span<const std::byte> xyz);
  bool has_its_box() const;
  std::size_t element_bytes(std::size_t column) const;

  std::vector<std::uint32_t> arrays_;   // of the columns, from 1 on
  std::vector<std::uint8_t> left_out_;  // of the vertices of the block: whether imported
};

}  // namespace shm
