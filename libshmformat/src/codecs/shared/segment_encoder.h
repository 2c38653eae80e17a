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
#include "codecs/shared/stencil.h"
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

/// Some cells of a segment in coding order, with the vertices that they introduce. A vertex is
/// introduced by the first cell of the segment that uses it. The arrays are flat because a piece
/// contains thousands of cells and is reused.
struct SegmentPiece {
  static constexpr std::uint32_t kUnused = kNone;
  struct Cell {
    std::uint64_t number = 0;
    std::uint64_t last_use = 0;
    /// Element block of the cell. If the block is kUnused, the entry is not a cell but a vertex
    /// that no cell uses
    std::uint32_t block = 0;
    std::uint32_t nodes = 0;
    std::uint32_t new_vertices = 0;
    std::uint32_t other_last_uses = 0;  ///< number of entries of SegmentPiece::other_last_uses
  };
  struct Vertex {
    std::uint64_t number = 0;  ///< the caller's number for the vertex

    /// Handle of the vertex. `nodes` refers to vertices by their handles. After the vertex is
    /// finalized, the handle may be reused for another vertex
    std::uint32_t handle = 0;
    std::uint32_t ticket = kNone;
    bool imported = false;
  };
  std::vector<Cell> cells;
  std::vector<Vertex> vertices;
  ShortRuns<std::uint32_t> nodes;
  /// Nodes from position kMaxLastUse on whose vertices no later cell uses, of cells whose nodes
  /// form a grid. If a vertex occurs several times in its cell, this is its first node, and
  /// `last_use` does not mark it.
  std::vector<std::uint32_t> other_last_uses;
  ShortRuns<std::byte> vertex_values;  ///< coordinates, then static point data
  ShortRuns<std::byte> cell_data;

  std::span<const std::uint32_t> nodes_of(const Cell& cell, std::size_t begin) const {
    return {nodes.data() + begin, cell.nodes};
  }

  bool empty() const { return cells.empty(); }
  std::size_t bytes() const {
    return cells.size() * sizeof(Cell) + vertices.size() * sizeof(Vertex) + nodes.size() * 4 +
           other_last_uses.size() * 4 + vertex_values.size() + cell_data.size();
  }
  void clear() {
    other_last_uses.clear();
    cells.clear();
    vertices.clear();
    nodes.clear();
    vertex_values.clear();
    cell_data.clear();
  }
};

/// An encoded group. Only the numbers of its imported vertices are missing, since other segments
/// assign these numbers.
struct EncodedGroup {
  std::uint32_t segment = 0;
  container::GroupHeader header;
  std::vector<std::vector<std::byte>> streams;  ///< encoded streams, in the same order as in the
                                                ///< header
  std::uint64_t hexahedra = 0;
  std::vector<std::uint64_t> cell_numbers;  ///< cell numbers in coding order, if with_order is set

  struct Vertex {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
  };
  std::vector<Vertex> own;  ///< vertices that the segment owns, in order of introduction; filled if
                            ///< with_order is set
  struct Import {
    std::uint32_t ticket = kNone, slot = 0;
    Stencil stencil;
  };
  std::vector<Import>
      imports;  ///< imported vertices in the order of introduction; not filled in Order::keep

  std::size_t bytes() const {
    std::size_t sum =
        cell_numbers.size() * 8 + own.size() * sizeof(Vertex) + imports.size() * sizeof(Import);
    for (const auto& stream : streams) sum += stream.size();
    return sum;
  }
};

/// Returns an empty group. Reserves memory for the same counts of cells and owned vertices as in
/// the group `before`.
inline EncodedGroup group_like(const EncodedGroup& before) {
  EncodedGroup group;
  group.cell_numbers.reserve(before.cell_numbers.size());
  group.own.reserve(before.own.size());
  return group;
}

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
};

/// Coordinates and static arrays of a group, stored in the layout in which the caller passes them.
/// This class locates the values of each column and computes the bounding box for the group header.
class GroupValues {
 public:
  /// `schema` must outlive this object.
  explicit GroupValues(const Schema& schema);

  std::size_t vertex_bytes() const { return vertex_bytes_; }
  std::size_t cell_bytes(std::uint32_t block) const { return cell_bytes_[block]; }

  /// Adds the packed values of one vertex: the coordinates, then the point arrays in schema order.
  void add_vertex(const std::byte* values) { vertices_.append(values, vertex_bytes_); }
  /// Adds the packed values of one cell: the cell arrays that cover the cell's block, in schema
  /// order.
  void add_cell(std::uint32_t block, const std::byte* values);

  /// Columns of values. Column 0 is the coordinates; the following columns are the static arrays in
  /// schema order.
  std::size_t columns() const { return columns_.size(); }
  bool of_cells(std::size_t column) const { return columns_[column].of_cells; }
  /// Returns the schema index of the array in a column. `column` is at least 1.
  std::uint32_t array(std::size_t column) const { return columns_[column].array; }
  /// Returns a pointer to the value of the first element; null if the group has no element in this
  /// column.
  const std::byte* values(std::size_t column) const {
    const Column& own = columns_[column];
    if (count(column) == 0) return nullptr;
    return own.of_cells ? own.cells.data() : vertices_.data() + own.offset;
  }
  /// Returns the number of bytes from the value of an element to the value of the next element.
  std::size_t stride(std::size_t column) const {
    return columns_[column].of_cells ? columns_[column].bytes : vertex_bytes_;
  }

  /// Returns the number of elements of the group in this column.
  std::size_t count(std::size_t column) const {
    const Column& own = columns_[column];
    return own.of_cells ? own.cells.size() / own.bytes : vertices_.size() / vertex_bytes_;
  }

  /// Returns the bounding box of all finite coordinates of the group.
  std::array<double, 6> box() const;
  void clear();

 private:
  struct Column {
    std::uint32_t array = 0;
    bool of_cells = false;
    std::size_t bytes = 0, offset = 0;  // byte offset of the column in the data of a vertex
    ShortRuns<std::byte> cells{};
  };
  const Schema* schema_;
  std::vector<Column> columns_;
  std::size_t vertex_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // size in bytes of a cell's data, indexed by block
  ShortRuns<std::byte> vertices_;
};

/// Base class of all segment encoders. It divides the elements into groups, builds the group
/// headers, and collects the vertex and cell numbers that the pipeline needs.
class SegmentEncoder {
 public:
  /// `schema` must have passed check_schema() and must outlive the encoder.
  SegmentEncoder(const Schema& schema, const SegmentOptions& options, const SegmentStart& start);
  virtual ~SegmentEncoder() = default;
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
  // Size in bytes of the largest element that a stepped point array or a stepped cell array has at
  // one step
  std::uint64_t vertex_step_bytes_ = 0, cell_step_bytes_ = 0;
};

}  // namespace shm
