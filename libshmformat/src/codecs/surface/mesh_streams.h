// MeshStreams: the bitstreams of one segment, and the coders that write or read them. The class
// synchronizes the streams of connectivity, corner order, vertex and cell numbers, geometry and
// static arrays. The same code runs in both directions: `Coder` is RangeEncoder or RangeDecoder.
// mesh_streams.cpp instantiates the templates with ColumnPlanner or ColumnDecoder as `Column`.
// spec: "Segments", "Group", "Tiles", "Value columns", "Decoding a group"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/lists.h"
#include "codecs/surface/cells/connectivity.h"
#include "codecs/surface/cells/imports.h"
#include "codecs/surface/cells/number_column.h"
#include "codecs/surface/cells/vertex_numbers.h"
#include "codecs/surface/values/column_coder.h"
#include "format/format.h"
#include "format/schema.h"
#include "shm/schema.h"

namespace shm {

/// Calls visit(info, blocks, traits) for each column of static values: first for geometry, then for
/// the static arrays in schema order. `info`, `blocks` and `traits` are the arguments of the
/// constructor of a column.
template <class Visit>
void for_each_static_column(const Schema& schema, Visit&& visit) {
  ColumnTraits traits{.repeats = false, .earlier_values = schema.earlier_values, .copies = true};
  visit(coordinates_info(schema), std::vector<std::uint32_t>(), traits);
  traits.repeats = true;
  // Number of components that the remaining columns with tables may have (see
  // kMostTableComponentsInAll)
  std::uint32_t room = kMostTableComponentsInAll - 3;
  for (const ArrayInfo& info : schema.arrays) {
    if (info.per_step) continue;
    traits.tables = info.components <= std::min(kMostTableComponents, room);
    if (traits.tables) room -= info.components;
    visit(info, info.blocks, traits);
  }
}

/// Coordinates and static arrays of one segment, each in its own bitstream. The caller visits the
/// mesh cell by cell, and this class collects the neighbourhoods of new vertices and cells. The
/// caller then codes the values: a decoder does so after each tile, an encoder after each group.
/// `Column`: ColumnPlanner or ColumnDecoder.
template <class Column>
class ValueStreams {
 public:
  /// `schema` must outlive this object. If `parts` states that an array is not decoded, its column
  /// must not be used.
  ValueStreams(const Schema& schema, const DecodedParts& parts);

  // For each cell in coding order, call begin_cell(), then add_vertex() for each new vertex in
  // order, then end_cell().
  void begin_cell(const CellTopology& cell, std::uint64_t live);
  void add_vertex(const CellTopology& cell, std::uint32_t position) {
    if (!finds()) return;
    const Neighbourhood item = finder_.vertex(cell, position, vertex_reach_);
    if (of_vertices_) push_tightly(vertices_.items, item);
  }
  void end_cell(const CellTopology& cell);
  void add_unused_vertex(std::uint32_t slot) {
    if (of_vertices_) push_tightly(vertices_.items, finder_.unused_vertex(slot));
  }

  /// Decoding: begins a group. The reach (how far neighbourhoods extend) is at first the smallest
  /// reach that the caller needs.
  void begin_group() {
    vertex_reach_ = least_vertex_reach_;
    cell_reach_ = least_cell_reach_;
  }
  /// Decoding: increases the reach (how far neighbourhoods extend) in this group, if a column needs
  /// a larger reach.
  void need_reach(std::size_t column, Reach reach) {
    Reach& own = is_of_cells_[column] ? cell_reach_ : vertex_reach_;
    own = std::max(own, reach);
  }
  /// Encoding: sets the reach (how far neighbourhoods extend). Call this function before the first
  /// cell of the segment.
  void set_reach(Reach reach) { vertex_reach_ = cell_reach_ = reach; }
  /// Encoding: begins a tile of a group. Call it before the first element of the tile.
  void begin_tile() {
    vertices_.tile_begin.push_back(vertices_.items.size());
    cells_.tile_begin.push_back(cells_.items.size());
  }

  // Columns of values. Column 0 is geometry; the following columns are the static arrays in schema
  // order.
  std::size_t columns() const { return columns_.size(); }
  bool has_column(std::size_t column) const { return columns_[column].has_value(); }
  Column& column(std::size_t column) { return *columns_[column]; }
  /// Returns the elements that have been added to a column since the previous call to clear().
  /// These are the elements of a tile when decoding, and of a group when encoding.
  const TiledItems& elements_of(std::size_t column) const {
    return is_of_cells_[column] ? cells_ : vertices_;
  }
  /// Return the neighbourhoods of the vertices and cells that have been added.
  std::span<const Neighbourhood> vertices() const { return vertices_.items; }
  std::span<const Neighbourhood> cells() const { return cells_.items; }
  /// Removes all elements. Call it after the last column of a group (encoding) or of a tile
  /// (decoding).
  void clear() {
    vertices_.clear();
    cells_.clear();
  }

 private:
  bool finds() const { return of_vertices_ || of_cells_; }

  const Schema* schema_;
  bool of_vertices_, of_cells_;  // of_vertices_: true if neighbourhoods of vertices are needed;
                                 // of_cells_: the same for cells
  NeighbourFinder finder_;
  Reach least_vertex_reach_ = Reach::lattice, least_cell_reach_ = Reach::lattice;
  Reach vertex_reach_ = Reach::farther, cell_reach_ = Reach::farther;
  TiledItems vertices_, cells_;
  std::vector<std::optional<Column>> columns_;
  std::vector<bool> is_of_cells_;  // whether each column has cell values
};

/// Order::keep: codes the numbers of the vertices that a cell introduces. If the coder of hexahedra
/// codes vertex numbers, `stream` contains only the numbers of vertices that are not corners of
/// hexahedra. number(position) returns a reference; the encoder reads the number from it, and the
/// decoder writes the number to it.
template <class Coder, class Number>
void code_vertex_numbers(Connectivity<Coder>& connectivity, VertexNumbers<Coder>& numbers,
                         Coder& stream, const CellTopology& cell, Number&& number) {
  const bool with_cells = connectivity.codes_numbers();
  const std::uint32_t corners = with_cells && cell.hexahedral ? 8 : 0;
  bool more = false;
  for (std::uint32_t position : cell.new_positions) {
    more |= position >= corners;
    if (position >= corners) continue;
    number(position) = cell.original[position];
    numbers.add(cell.slots[position], cell.original[position]);
  }
  if (!more) return;
  numbers.code_cell(stream, cell, number, corners);
  if (!with_cells) return;
  for (std::uint32_t position : cell.new_positions)
    if (position >= corners) connectivity.set_number(cell.slots[position], number(position));
}

/// Codes the numbers of the cells of a segment. If the file stores the source's cell numbers, these
/// are coded. Otherwise the number of a cell is its position in coding order.
template <class Coder>
class CellNumbers {
 public:
  /// `first`: position in coding order of the first cell of the segment.
  CellNumbers(const Schema& schema, std::uint64_t first)
      : stored_(schema.order == Order::keep && schema.delay > 0), next_(first) {}

  std::uint64_t code(Coder& coder, std::uint64_t number) {
    if (stored_)
      number = next_ + static_cast<std::uint64_t>(
                           code_signed(coder, step_, static_cast<std::int64_t>(number - next_)));
    else
      number = next_;
    next_ = number + 1;
    return number;
  }

 private:
  bool stored_;
  std::uint64_t next_;
  SignedModel<NumberModel> step_;
};

/// `Coder` and `Column` are RangeEncoder and ColumnPlanner, or RangeDecoder and ColumnDecoder.
template <class Coder, class Column>
class MeshStreams {
 public:
  /// `schema` must have passed check_schema(). It must outlive this object, and must not be moved.
  MeshStreams(const Schema& schema, const SegmentStart& start, const DecodedParts& parts = {});

  /// Order::keep: codes the numbers of the vertices that a cell introduces. For an unused vertex,
  /// codes its number.
  template <class Number>
  void code_vertex_numbers(const CellTopology& cell, Number&& number) {
    if (schema_->order == Order::keep)
      shm::code_vertex_numbers(connectivity_, vertex_numbers_, streams_[kVertexNumbers], cell,
                               number);
  }
  void code_unused_number(std::uint32_t slot, std::uint64_t& number) {
    if (schema_->order == Order::keep)
      number = vertex_numbers_.code_unused(streams_[kVertexNumbers], slot, number);
  }

  // The next functions code, for each new vertex of a cell, a flag that is set if an earlier
  // segment owns the vertex. If vertices are numbered in coding order, these functions also code
  // the vertex's stream number. The flag and the number precede the values of the vertex. The first
  // segment contains neither.
  void begin_new_vertices(const CellTopology& cell) { imports_.begin_cell(cell); }
  bool code_import(const CellTopology& cell, std::uint32_t position, bool imported) {
    return imports_.code(streams_[imports_stream_], cell, position, imported);
  }
  Stencil import_stencil(const CellTopology& cell, std::uint32_t position) const {
    return imports_.stencil(cell, position);
  }
  void code_import_number(const Stencil& stencil, std::uint32_t slot, std::uint64_t& number) {
    number = import_numbers_.code(streams_[kVertexNumbers], stencil, slot, number);
  }

  /// Codes the topology of one cell. Returns false if the decoded data is damaged.
  bool encode_cell(const StoredCell& stored, CellTopology& cell) {
    return connectivity_.code_cell(streams_[kConnectivity], streams_[kCornerOrder], stored, cell);
  }
  bool decode_cell(CellTopology& cell) {
    return connectivity_.decode_cell(streams_[kConnectivity], streams_[kCornerOrder], cell);
  }
  std::uint64_t code_cell_number(std::uint64_t number) {
    return cell_numbers_.code(streams_[kCellNumbers], number);
  }
  void finish_cell(const CellTopology& cell) { connectivity_.finish_cell(cell); }

  Connectivity<Coder>& connectivity() { return connectivity_; }
  /// The streams of coordinates and static arrays. The caller must pass each cell both to
  /// MeshStreams and to ValueStreams.
  using Values = ValueStreams<Column>;
  Values& values() { return values_; }
  const Values& values() const { return values_; }

  /// List of all bitstreams in the order in which a group contains them: first the fixed streams
  /// (the last of these is geometry), then one stream for each static array in schema order, then
  /// imports.
  struct Stream {
    container::StreamKind kind;
    std::uint32_t array = 0;
  };
  static std::vector<Stream> list(const Schema& schema);
  /// Returns true if stream `s` of the list contains values. Then column_of(s) is the index of its
  /// column in values().
  bool holds_values(std::size_t s) const { return s >= kGeometry && s < imports_stream_; }
  std::size_t column_of(std::size_t s) const { return s - kGeometry; }
  /// Returns the range coder of each stream. The range coders of streams with values are unused.
  std::vector<Coder>& coders() { return streams_; }

 private:
  static constexpr std::size_t kConnectivity = 0, kCornerOrder = 1, kCellNumbers = 2,
                               kVertexNumbers = 3, kGeometry = 4;

  const Schema* schema_;
  Connectivity<Coder> connectivity_;
  std::vector<Coder> streams_;
  VertexNumbers<Coder> vertex_numbers_;
  NumberColumn<Coder> import_numbers_;
  Values values_;
  std::size_t imports_stream_ = 0;
  ImportFlags<Coder> imports_;
  CellNumbers<Coder> cell_numbers_;
};

}  // namespace shm
