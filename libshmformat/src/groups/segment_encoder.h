// SegmentEncoder: the cells of one segment in, bitstreams of groups out. It needs nothing of other
// segments, so several can work at once. The mirror of group_decoder.h.
// spec: "Segments", "Group"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bytes/lists.h"
#include "container/format.h"
#include "groups/mesh_streams.h"
#include "shm/result.h"
#include "shm/schema.h"

namespace shm {

/// A group is closed early when it, or a stepped array in it at one step, holds this much, so that
/// readers can promise small memory.
inline constexpr std::uint64_t kFullGroupBytes = std::uint64_t{1} << 26;
inline constexpr std::uint64_t kFullGroupVertices = std::uint64_t{1}
                                                    << 16;  // unused vertices alone

/// Some cells of a segment in coding order, each with the vertices that it is the first of its
/// segment to use. Flat arrays: a piece holds thousands of cells and is used again.
struct SegmentPiece {
  static constexpr std::uint32_t kUnused = kNone;
  struct Cell {
    std::uint64_t number = 0;
    std::uint64_t last_use = 0;
    std::uint32_t block = 0;  ///< kUnused: no cell, but a vertex that none uses
    std::uint32_t nodes = 0;
    std::uint32_t new_vertices = 0;
  };
  struct Vertex {
    std::uint64_t number = 0;  ///< the caller's
    std::uint32_t handle = 0;  ///< its name in `nodes`; free again when the vertex is finalized
    std::uint32_t ticket = kNone;
    bool imported = false;
  };
  std::vector<Cell> cells;
  std::vector<Vertex> vertices;
  ShortRuns<std::uint32_t> nodes;
  ShortRuns<std::byte> vertex_values;  ///< coordinates, then static point data
  ShortRuns<std::byte> cell_data;

  std::span<const std::uint32_t> nodes_of(const Cell& cell, std::size_t at) const {
    return {nodes.data() + at, cell.nodes};
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

/// A group but for the numbers of its imported vertices, which another segment gives.
struct EncodedGroup {
  std::uint32_t segment = 0;
  container::GroupHeader header;
  std::vector<std::vector<std::byte>> streams;  ///< those that the header lists
  std::uint64_t hexahedra = 0;
  std::vector<std::uint64_t> cell_numbers;  ///< in coding order, if wanted

  struct Vertex {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
  };
  std::vector<Vertex> own;  ///< own vertices in the order of their introduction, if wanted
  struct Import {
    std::uint32_t ticket = kNone, slot = 0;
    Stencil stencil;
  };
  std::vector<Import> imports;  ///< in the order of their introduction; not in Order::keep

  std::size_t bytes() const {
    std::size_t sum =
        cell_numbers.size() * 8 + own.size() * sizeof(Vertex) + imports.size() * sizeof(Import);
    for (const auto& stream : streams) sum += stream.size();
    return sum;
  }
};

/// An empty group with room for as many numbers as another one has.
inline EncodedGroup group_like(const EncodedGroup& before) {
  EncodedGroup group;
  group.cell_numbers.reserve(before.cell_numbers.size());
  group.own.reserve(before.own.size());
  return group;
}

/// About the bytes of a segment so far.
struct SegmentSize {
  std::uint64_t topology = 0;  ///< connectivity, corner order, vertex numbers
  std::uint64_t values = 0;    ///< coordinates and arrays, with the heads of their streams
  std::uint64_t besides = 0;   ///< imports, and other heads
  std::uint64_t all() const { return topology + values + besides; }

  /// Of a stream of so many bytes, with its head.
  void add(container::StreamKind kind, std::uint64_t bytes);
};
/// By column: in which domains its values would be coded.
using ValueChoices = std::vector<std::vector<DomainChoice>>;

/// How a segment is coded.
struct SegmentOptions {
  std::uint32_t group_cells = 65536;
  ConnectivityCodec codec = ConnectivityCodec::rows;
  Level level = Level::standard;  ///< of values
  bool values = true;             ///< false, to measure: coordinates and arrays are left out
  bool with_order = true;         ///< whether groups have `own` and `cell_numbers`
};

/// Coordinates and values of the static arrays of a group, as the caller gave them: where each
/// column finds its own, and what the group's header states of them.
class GroupValues {
 public:
  /// `schema` is borrowed.
  explicit GroupValues(const Schema& schema);

  std::size_t vertex_bytes() const { return vertex_bytes_; }
  std::size_t cell_bytes(std::uint32_t block) const { return cell_bytes_[block]; }

  /// Coordinates, then the point arrays in schema order, packed.
  void add_vertex(const std::byte* values) { vertices_.append(values, vertex_bytes_); }
  /// The cell arrays that cover the block, in schema order, packed.
  void add_cell(std::uint32_t block, const std::byte* values);

  /// 0: coordinates; else the static arrays in schema order.
  std::size_t columns() const { return columns_.size(); }
  bool of_cells(std::size_t column) const { return columns_[column].of_cells; }
  /// The schema's index of the array in a column from 1 on.
  std::uint32_t array(std::size_t column) const { return columns_[column].array; }
  /// Of the first element; null when there is none.
  const std::byte* values(std::size_t column) const {
    const Column& it = columns_[column];
    if (count(column) == 0) return nullptr;
    return it.of_cells ? it.cells.data() : vertices_.data() + it.offset;
  }
  /// Bytes from one element to the next.
  std::size_t stride(std::size_t column) const {
    return columns_[column].of_cells ? columns_[column].bytes : vertex_bytes_;
  }

  /// The box of the finite coordinates.
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
    const Column& it = columns_[column];
    return it.of_cells ? it.cells.size() / it.bytes : vertices_.size() / vertex_bytes_;
  }

  const Schema* schema_;
  std::vector<Column> columns_;
  std::size_t vertex_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // by block
  ShortRuns<std::byte> vertices_;
};

/// What all encoders of segments do alike: where groups begin and end, their header and the numbers
/// that others ask for.
class SegmentEncoder {
 public:
  /// `schema` is checked and borrowed.
  SegmentEncoder(const Schema& schema, const SegmentOptions& options, const SegmentStart& start);
  virtual ~SegmentEncoder() = default;
  SegmentEncoder(const SegmentEncoder&) = delete;
  SegmentEncoder& operator=(const SegmentEncoder&) = delete;

  /// Encodes the cells of `piece`, and adds the groups that they complete to `done`.
  Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done);
  /// Adds the last group, if anything is left for it.
  void end(std::vector<EncodedGroup>& done);

  /// About what the segment takes so far, without the values of the group at hand.
  SegmentSize size();
  /// About what these take. `choices`: as ValueColumn::about_bytes() has them, by column.
  std::uint64_t about_values(ValueChoices& choices) {
    choices.resize(values_.columns());
    return has_group() ? values_at_hand(&choices) : 0;
  }
  /// Just what they would take if the group ended here. It costs as much as to code them.
  std::uint64_t values_if_coded() { return has_group() ? values_at_hand(nullptr) : 0; }

 protected:
  /// Where the parts of a cell or unused vertex begin in the piece.
  struct Place {
    std::size_t node = 0, vertex = 0, data = 0;
  };

  // --- what depends on the codec

  /// Encodes a cell and its new vertices, with take_vertex() for each of these. False: it cannot.
  virtual bool encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                           const Place& at) = 0;
  /// Encodes a vertex that no cell uses, with take_vertex().
  virtual void encode_unused(const SegmentPiece& piece, std::size_t vertex) = 0;
  /// Adds the streams of the group, and forgets what belongs to it.
  virtual void encode_streams() = 0;
  /// Adds what the streams of the group take so far but for values.
  virtual void add_size_at_hand(SegmentSize& size) = 0;
  /// What its values would take: estimated, or, without `choices`, by coding them.
  virtual std::uint64_t values_at_hand(ValueChoices* choices) = 0;

  /// Counts vertex `index` of the piece, which the group gets, and its values.
  void take_vertex(const SegmentPiece& piece, std::size_t index);
  /// Raises the group's largest number of active vertices.
  void note_active(std::uint64_t active);
  /// The sizes and checksum of the entry come from the bytes.
  void add_stream(container::StreamEntry entry, std::vector<std::byte> bytes);

  const Schema* schema_;
  const SegmentOptions options_;
  const SegmentStart start_;
  // the group at hand
  EncodedGroup group_;
  GroupValues values_;
  TileEnds tile_ends_;

 private:
  bool is_full() const;
  bool has_group() const;  // whether anything is in the one at hand
  void begin_group();
  void end_group(std::vector<EncodedGroup>& done);

  SegmentSize finished_;  // of groups that are
  std::uint64_t next_cell_, next_vertex_;
  // of the widest stepped array: what an element has at one step
  std::uint64_t vertex_step_bytes_ = 0, cell_step_bytes_ = 0;
};

}  // namespace shm
