// SegmentEncoder: takes the cells of one segment, gives out the bitstreams of its groups. It needs
// nothing from other segments, so several can work at once. The mirror of group_decoder.h.
// spec: "Segments", "Group"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/lists.h"
#include "codecs/shared/group_parts.h"
#include "codecs/shared/stencil.h"
#include "codecs/shared/value_domain.h"
#include "format/format.h"
#include "shm/result.h"
#include "shm/schema.h"

namespace shm {

/// A group ends early when its values, or those of a stepped array in it at one step, reach this
/// many bytes, so that readers can keep memory small.
inline constexpr std::uint64_t kFullGroupBytes = std::uint64_t{1} << 26;
inline constexpr std::uint64_t kFullGroupVertices =
    std::uint64_t{1} << 16;  // for groups that end in unused vertices

/// Some cells of a segment in coding order. Each comes with the vertices that no earlier cell of
/// the segment uses. The arrays are flat, since a piece holds thousands of cells and is reused.
struct SegmentPiece {
  static constexpr std::uint32_t kUnused = kNone;
  struct Cell {
    std::uint64_t number = 0;
    std::uint64_t last_use = 0;
    std::uint32_t block = 0;  ///< kUnused: not a cell, but a vertex that no cell uses
    std::uint32_t nodes = 0;
    std::uint32_t new_vertices = 0;
  };
  struct Vertex {
    std::uint64_t number = 0;  ///< the caller's number of the vertex
    std::uint32_t handle = 0;  ///< its number in `nodes`, reused after it is finalized
    std::uint32_t ticket = kNone;
    bool imported = false;
  };
  std::vector<Cell> cells;
  std::vector<Vertex> vertices;
  ShortRuns<std::uint32_t> nodes;
  ShortRuns<std::byte> vertex_values;  ///< coordinates, then static point data
  ShortRuns<std::byte> cell_data;

  std::span<const std::uint32_t> nodes_of(const Cell& cell, std::size_t begin) const {
    return {nodes.data() + begin, cell.nodes};
  }

  bool empty() const { return cells.empty(); }
  std::size_t bytes() const {
    return cells.size() * sizeof(Cell) + vertices.size() * sizeof(Vertex) + nodes.size() * 4 +
           vertex_values.size() + cell_data.size();
  }
  void clear() {
    cells.clear();
    vertices.clear();
    nodes.clear();
    vertex_values.clear();
    cell_data.clear();
  }
};

/// A group, complete except for the numbers of its imported vertices, which other segments give.
struct EncodedGroup {
  std::uint32_t segment = 0;
  container::GroupHeader header;
  std::vector<std::vector<std::byte>> streams;  ///< the streams listed in the header
  std::uint64_t hexahedra = 0;
  std::vector<std::uint64_t> cell_numbers;  ///< cell numbers in coding order, if with_order is set

  struct Vertex {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
  };
  std::vector<Vertex> own;  ///< own vertices in the order of introduction, if with_order is set
  struct Import {
    std::uint32_t ticket = kNone, slot = 0;
    Stencil stencil;
  };
  std::vector<Import>
      imports;  ///< imported vertices in the order of introduction; unused in Order::keep

  std::size_t bytes() const {
    std::size_t sum =
        cell_numbers.size() * 8 + own.size() * sizeof(Vertex) + imports.size() * sizeof(Import);
    for (const auto& stream : streams) sum += stream.size();
    return sum;
  }
};

/// Returns an empty group with memory for as many numbers as `before` has.
inline EncodedGroup group_like(const EncodedGroup& before) {
  EncodedGroup group;
  group.cell_numbers.reserve(before.cell_numbers.size());
  group.own.reserve(before.own.size());
  return group;
}

/// Approximate bytes of a segment so far.
struct SegmentSize {
  std::uint64_t topology = 0;  ///< bytes of connectivity, corner order and vertex numbers
  std::uint64_t values = 0;    ///< bytes of coordinates and arrays with their stream headers
  std::uint64_t besides = 0;   ///< bytes of imports and of all other stream headers
  std::uint64_t all() const { return topology + values + besides; }

  /// Adds a stream of `bytes` bytes and its header.
  void add(container::StreamKind kind, std::uint64_t bytes);
};
/// For each column, the domains in which its values would be coded.
using ValueChoices = std::vector<std::vector<DomainChoice>>;

/// How a segment is coded.
struct SegmentOptions {
  std::uint32_t group_cells = 65536;
  ConnectivityCodec codec = ConnectivityCodec::rows;
  Codec codec_id{};               ///< id of `codec`; make_segment_encoder() sets it
  Level level = Level::standard;  ///< level of the value coders
  bool values = true;             ///< false: coordinates and arrays are left out, for measuring
  bool with_order = true;         ///< true: groups get `own` and `cell_numbers`
};

/// Coordinates and static arrays of a group, as the caller gave them. It locates the values of each
/// column, and computes the box for the group header.
class GroupValues {
 public:
  /// `schema` must outlive this object.
  explicit GroupValues(const Schema& schema);

  std::size_t vertex_bytes() const { return vertex_bytes_; }
  std::size_t cell_bytes(std::uint32_t block) const { return cell_bytes_[block]; }

  /// Adds the coordinates, then the point arrays in schema order, packed.
  void add_vertex(const std::byte* values) { vertices_.append(values, vertex_bytes_); }
  /// Adds the values of the cell arrays that cover the block, in schema order, packed.
  void add_cell(std::uint32_t block, const std::byte* values);

  /// Column 0 is the coordinates; the static arrays follow in schema order.
  std::size_t columns() const { return columns_.size(); }
  bool of_cells(std::size_t column) const { return columns_[column].of_cells; }
  /// Index in the schema of the array in a column; `column` is at least 1.
  std::uint32_t array(std::size_t column) const { return columns_[column].array; }
  /// Values of the first element; null if there is none.
  const std::byte* values(std::size_t column) const {
    const Column& own = columns_[column];
    if (count(column) == 0) return nullptr;
    return own.of_cells ? own.cells.data() : vertices_.data() + own.offset;
  }
  /// Bytes from one element to the next.
  std::size_t stride(std::size_t column) const {
    return columns_[column].of_cells ? columns_[column].bytes : vertex_bytes_;
  }

  /// Returns the bounding box of the finite coordinates.
  std::array<double, 6> box() const;
  void clear();

 private:
  struct Column {
    std::uint32_t array = 0;
    bool of_cells = false;
    std::size_t bytes = 0, offset = 0;  // offset: in a vertex
    ShortRuns<std::byte> cells{};
  };
  std::size_t count(std::size_t column) const {
    const Column& own = columns_[column];
    return own.of_cells ? own.cells.size() / own.bytes : vertices_.size() / vertex_bytes_;
  }

  const Schema* schema_;
  std::vector<Column> columns_;
  std::size_t vertex_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // by block
  ShortRuns<std::byte> vertices_;
};

/// Base of all segment encoders: decides where groups begin and end, and builds their headers and
/// the numbers that MeshEncoder needs.
class SegmentEncoder {
 public:
  /// `schema` has passed check_schema() and must outlive the encoder.
  SegmentEncoder(const Schema& schema, const SegmentOptions& options, const SegmentStart& start);
  virtual ~SegmentEncoder() = default;
  SegmentEncoder(const SegmentEncoder&) = delete;
  SegmentEncoder& operator=(const SegmentEncoder&) = delete;

  /// Encodes the cells of `piece`, and appends the groups that they complete to `done`.
  Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done);
  /// Ends the segment: appends the last group, if it has any elements.
  void end(std::vector<EncodedGroup>& done);

  /// Returns the approximate size of the segment so far, without the values of the current group.
  SegmentSize size();
  /// Returns the approximate size of the values of the current group. `choices`: by column, as in
  /// ValueColumn::about_bytes().
  std::uint64_t about_values(ValueChoices& choices) {
    choices.resize(values_.columns());
    return has_group() ? values_at_hand(&choices) : 0;
  }
  /// Returns the exact size of these values if the group ended here. This takes as long as coding
  /// them.
  std::uint64_t values_if_coded() { return has_group() ? values_at_hand(nullptr) : 0; }

 protected:
  /// Begin of the data of a cell or unused vertex in its piece.
  struct Place {
    std::size_t node = 0, vertex = 0, data = 0;
  };

  // --- the part that depends on the codec

  /// Encodes a cell and its new vertices, with take_vertex() for each. Returns false if it cannot.
  virtual bool encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                           const Place& place) = 0;
  /// Encodes a vertex that no cell uses, with take_vertex().
  virtual void encode_unused(const SegmentPiece& piece, std::size_t vertex) = 0;
  /// Adds the streams of the group, and clears the data of the group.
  virtual void encode_streams() = 0;
  /// Adds the current size of the group's streams, without values.
  virtual void add_size_at_hand(SegmentSize& size) = 0;
  /// Returns the size of the group's values: an estimate, or without `choices` the size when coded.
  virtual std::uint64_t values_at_hand(ValueChoices* choices) = 0;

  /// Adds vertex `index` of the piece, with its values, to the group.
  void take_vertex(const SegmentPiece& piece, std::size_t index);
  /// Raises the largest number of active vertices in the group's header to `active`, if that is
  /// more.
  void note_active(std::uint64_t active);
  /// Adds a stream; sets the size and checksum in its entry.
  void add_stream(container::StreamEntry entry, std::vector<std::byte> bytes);

  const Schema* schema_;
  const SegmentOptions options_;
  const SegmentStart start_;
  // The current group
  EncodedGroup group_;
  GroupValues values_;
  TileEnds tile_ends_;

 private:
  bool is_full() const;
  bool has_group() const;  // true if it has any elements
  void begin_group();
  void end_group(std::vector<EncodedGroup>& done);

  SegmentSize finished_;  // of the finished groups
  std::uint64_t next_cell_, next_vertex_;
  // Bytes of one element at one step, in the widest stepped array
  std::uint64_t vertex_step_bytes_ = 0, cell_step_bytes_ = 0;
};

}  // namespace shm
