// MeshStreams: the bitstreams of one segment and the coders that write or read them. This class
// keeps connectivity, corner order, vertex and cell numbers, geometry and static arrays
// synchronized. The same code runs in both directions: Coder is a RangeEncoder or a RangeDecoder.
// spec: "Segments", "Group", "Tiles", "Value columns", "Decoding a group"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "base/lists.h"
#include "codecs/surface/cells/connectivity.h"
#include "codecs/surface/cells/imports.h"
#include "codecs/surface/cells/number_column.h"
#include "codecs/surface/cells/vertex_numbers.h"
#include "codecs/surface/values/value_column.h"
#include "format/format.h"
#include "format/schema.h"
#include "shm/schema.h"

namespace shm {

/// Calls visit(info, blocks, traits) with the constructor arguments of each ValueColumn of static
/// values: first geometry, then the static arrays in schema order.
template <class Visit>
void for_each_static_column(const Schema& schema, Visit&& visit) {
  ColumnTraits traits{.repeats = false, .earlier_values = schema.earlier_values, .copies = true};
  visit(coordinates_info(schema), std::vector<std::uint32_t>(), traits);
  traits.repeats = true;
  // Number of components that may still have tables
  std::uint32_t room = kMostTableComponentsInAll - 3;
  for (const ArrayInfo& info : schema.arrays) {
    if (info.per_step) continue;
    traits.tables = info.components <= std::min(kMostTableComponents, room);
    if (traits.tables) room -= info.components;
    visit(info, info.blocks, traits);
  }
}

/// Coordinates and static arrays of one segment, each in its own bitstream. The caller visits the
/// mesh cell by cell, and this class collects the neighbourhoods of new vertices and cells. One
/// call then codes the values of a tile (decoding) or of a whole group (encoding).
template <class Coder>
class ValueStreams {
 public:
  /// `schema` must outlive this object. Columns that `parts` leaves out must not be used.
  ValueStreams(const Schema& schema, const DecodedParts& parts);

  // Call these functions for each cell in coding order: begin_cell(), add_vertex() for each new
  // vertex in order, end_cell().
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

  /// Encoding: sets the level at which values will be encoded. Call it before the first cell.
  void expect_level(Level level) { vertex_reach_ = cell_reach_ = farthest_reach(level); }

  // Encoding: call begin_tile() for the tiles of a group, then encode() for each column, then
  // continue with the next group.
  void begin_tile();
  EncodedColumn encode(std::size_t column, const std::byte* values, std::size_t stride,
                       Level level);
  /// Encoding: does the same as in ValueColumn, for the elements of the group so far.
  std::uint64_t about_bytes(std::size_t column, const std::byte* values, std::size_t stride,
                            std::vector<DomainChoice>& choices) {
    return columns_[column]->about_bytes(elements_of(column), values, stride, choices);
  }
  std::uint64_t bytes_if_coded(std::size_t column, const std::byte* values, std::size_t stride,
                               Level level) {
    return columns_[column]->bytes_if_coded(elements_of(column), values, stride, level);
  }

  // Column 0 is geometry; the static arrays follow in schema order.

  // Decoding: begin the group, then begin each of its columns, then decode tile by tile. `bytes`
  // must stay valid until the group ends, and may unpack to at most `limit` bytes. Returns false if
  // the data is damaged.
  void begin_group() {
    vertex_reach_ = least_vertex_reach_;
    cell_reach_ = least_cell_reach_;
  }
  bool takes(std::size_t column, Codec codec) const { return columns_[column]->takes(codec); }
  bool begin_column(std::size_t column, Codec codec, std::span<const std::byte> bytes,
                    std::uint64_t limit);
  /// Appends the values of the elements since the last tile to `out`. Returns false if the data is
  /// damaged.
  bool decode_tile(std::size_t column, std::vector<std::byte>& out);
  /// Returns the memory budget for the data that columns store by slot.
  ColumnMemory& memory() { return *memory_; }
  const ColumnMemory& memory() const { return *memory_; }
  /// Return the neighbourhoods of the elements since the last tile.
  std::span<const Neighbourhood> vertices() const { return vertices_.items; }
  std::span<const Neighbourhood> cells() const { return cells_.items; }
  /// Clears these neighbourhoods. Call it after the last column of a group (encoding) or tile
  /// (decoding).
  void clear();

 private:
  bool finds() const { return of_vertices_ || of_cells_; }
  const TiledItems& elements_of(std::size_t column) const {
    return is_of_cells_[column] ? cells_ : vertices_;
  }

  const Schema* schema_;
  bool of_vertices_, of_cells_;  // whether neighbourhoods of vertices or cells are needed
  NeighbourFinder finder_;
  Reach least_vertex_reach_ = Reach::lattice, least_cell_reach_ = Reach::lattice;
  Reach vertex_reach_ = Reach::farther, cell_reach_ = Reach::farther;
  TiledItems vertices_, cells_;
  std::unique_ptr<ColumnMemory> memory_;  // memory budget of the columns; null when encoding
  std::vector<std::optional<ValueColumn<Coder>>> columns_;
  std::vector<bool> is_of_cells_;  // whether each column has cell values
};

/// Order::keep: codes the numbers of the vertices that a cell introduces. If the coder of hexahedra
/// codes vertex numbers, `stream` contains only the numbers of vertices that are not corners of
/// hexahedra. number(position) returns a reference, which is read when encoding and set when
/// decoding.
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

/// Codes the numbers of the cells of a segment. These are positions in coding order, or the
/// source's cell numbers if the file stores them.
template <class Coder>
class CellNumbers {
 public:
  /// `first`: position of the segment's first cell in coding order.
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

template <class Coder>
class MeshStreams {
 public:
  /// `schema` has passed check_schema(). It must outlive this object and must not move.
  MeshStreams(const Schema& schema, const SegmentStart& start, const DecodedParts& parts = {});

  /// Order::keep: codes the numbers of the vertices that a cell introduces, or the number of an
  /// unused vertex.
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

  // In all segments except the first, these functions code data that precede the values of each new
  // vertex of a cell: a flag that an earlier segment owns the vertex and, if vertices are numbered
  // in coding order, its stream number.
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

  /// Codes the topology of one cell. Returns false if decoded data are damaged.
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
  /// Coordinates and static arrays. The caller visits the same cells in both objects.
  using Values = ValueStreams<std::conditional_t<Coder::kDecodes, SplitDecoder, SplitEncoder>>;
  Values& values() { return values_; }
  const Values& values() const { return values_; }

  /// All bitstreams in the order of a group: first the fixed streams, of which geometry is the
  /// last; then one stream for each static array in schema order; then imports.
  struct Stream {
    container::StreamKind kind;
    std::uint32_t array = 0;
  };
  static std::vector<Stream> list(const Schema& schema);
  /// Returns true if stream `s` of the list contains values. In this case column_of() returns its
  /// column in values().
  bool holds_values(std::size_t s) const { return s >= kGeometry && s < imports_stream_; }
  std::size_t column_of(std::size_t s) const { return s - kGeometry; }
  /// Range coders by stream; those of value streams are unused.
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

extern template class ValueStreams<SplitEncoder>;
extern template class ValueStreams<SplitDecoder>;
extern template class MeshStreams<RangeEncoder>;
extern template class MeshStreams<RangeDecoder>;

}  // namespace shm
