// MeshStreams: the bitstreams of one segment and the coders that fill or read them, in step.
// The one place where connectivity, corner order, numbers, geometry and static arrays meet; the
// same code runs in both directions (Coder is a RangeEncoder or a RangeDecoder).
// spec: "Segments", "Group", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "connectivity/connectivity.h"
#include "connectivity/imports.h"
#include "connectivity/number_column.h"
#include "connectivity/vertex_numbers.h"
#include "container/format.h"
#include "segment/segment_start.h"
#include "segment/value_streams.h"
#include "shm/schema.h"

namespace shm {

/// Order::keep: the numbers of the vertices that a cell introduces. Corners of hexahedra whose
/// coder codes numbers are taken from there, all others from `stream`; number(position) refers to
/// one: read when encoding, filled when decoding.
template <class Coder, class Number>
void code_vertex_numbers(Connectivity<Coder>& connectivity, VertexNumbers<Coder>& numbers,
                         Coder& stream, const CellTopology& cell, Number&& number) {
  const bool told = connectivity.codes_numbers();
  const std::uint32_t corners = told && cell.hexahedral ? 8 : 0;
  bool more = false;
  for (std::uint32_t position : cell.new_positions) {
    more |= position >= corners;
    if (position >= corners) continue;
    number(position) = cell.original[position];
    numbers.add(cell.slots[position], cell.original[position]);
  }
  if (!more) return;
  numbers.code_cell(stream, cell, number, corners);
  if (!told) return;
  for (std::uint32_t position : cell.new_positions)
    if (position >= corners) connectivity.set_number(cell.slots[position], number(position));
}

/// Numbers of the cells of a segment: positions in coding order, unless the source's own are said.
template <class Coder>
class CellNumbers {
 public:
  /// `schema` is borrowed. `first`: of the segment's first cell, in coding order.
  CellNumbers(const Schema& schema, std::uint64_t first)
      : said_(schema.order == Order::keep && schema.delay > 0), next_(first) {}

  std::uint64_t code(Coder& coder, std::uint64_t number) {
    if (said_)
      number = next_ + static_cast<std::uint64_t>(
                           code_signed(coder, step_, static_cast<std::int64_t>(number - next_)));
    else
      number = next_;
    next_ = number + 1;
    return number;
  }

 private:
  bool said_;
  std::uint64_t next_;
  SignedModel<NumberModel> step_;
};

template <class Coder>
class MeshStreams {
 public:
  /// `schema` is checked, borrowed, and stays where it is.
  MeshStreams(const Schema& schema, const SegmentStart& start);

  /// Order::keep: the numbers of the vertices that a cell introduces, or of one that no cell uses.
  template <class Number>
  void code_vertex_numbers(const CellTopology& cell, Number&& number) {
    if (schema_->order == Order::keep)
      shm::code_vertex_numbers(connectivity_, vertex_numbers_, streams_[kVertexNumbers], cell,
                               number);
  }
  void code_loose_number(std::uint32_t slot, std::uint64_t& number) {
    if (schema_->order == Order::keep)
      number = vertex_numbers_.code_loose(streams_[kVertexNumbers], slot, number);
  }

  // In segments but the first, before the values of each new vertex of a cell: whether an earlier
  // segment owns it; and, where vertices are numbered by birth, the number that it has there.
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

  /// Topology of one cell; false when decoding damaged data.
  bool code_cell(CellTopology& cell) {
    return connectivity_.code_cell(streams_[0], streams_[1], cell);
  }
  std::uint64_t code_cell_number(std::uint64_t number) {
    return cell_numbers_.code(streams_[kCellNumbers], number);
  }
  void finish_cell(const CellTopology& cell) { connectivity_.finish_cell(cell); }

  Connectivity<Coder>& connectivity() { return connectivity_; }
  /// Coordinates and static arrays; follows the cells on its own.
  using Values = ValueStreams<std::conditional_t<Coder::kDecodes, SplitDecoder, SplitEncoder>>;
  Values& values() { return values_; }

  /// All bitstreams in the order of a group: fixed ones first, geometry the last of these, then one
  /// for each static array in schema order, then imports.
  struct Stream {
    container::StreamKind kind;
    std::uint32_t array = 0;
  };
  static std::vector<Stream> list(const Schema& schema);
  /// Whether stream number s of the list holds values, and of which column of values().
  bool holds_values(std::size_t s) const { return s >= kGeometry && s < imports_stream_; }
  std::size_t column_of(std::size_t s) const { return s - kGeometry; }
  /// By stream; those that hold values are left alone.
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

/// The codec of connectivity streams that says hexahedra so. Must hold: not automatic.
container::Codec stream_codec(ConnectivityCodec codec);
/// The reverse; nothing for a codec of other streams, or an unknown one.
std::optional<ConnectivityCodec> connectivity_codec(container::Codec codec);

/// The codec of a stream of values, and the reverse.
container::Codec stream_codec(ColumnCodec codec);
std::optional<ColumnCodec> column_codec(container::Codec codec);

/// Bytes of the static point arrays in one vertex.
std::size_t point_data_bytes(const Schema& schema);
/// Bytes of the static arrays in one cell, by block.
std::vector<std::size_t> cell_data_bytes(const Schema& schema);

extern template class MeshStreams<RangeEncoder>;
extern template class MeshStreams<RangeDecoder>;

}  // namespace shm
