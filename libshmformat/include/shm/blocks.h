// Items that a Reader returns: vertices and cells block by block, values of time steps, and totals.
// All types are plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "shm/schema.h"

namespace shm {

/// Converts each number in `from` to T, as static_cast does. The numbers have type `type` and host
/// byte order.
template <class T>
std::vector<T> numbers_as(ScalarType type, std::span<const std::byte> from) {
  std::vector<T> to;
  const auto convert = [&]<class From>(From) {
    to.resize(from.size() / sizeof(From));
    for (std::size_t i = 0; i < to.size(); ++i) {
      From value;
      std::memcpy(&value, from.data() + i * sizeof value, sizeof value);
      to[i] = static_cast<T>(value);
    }
  };
  switch (type) {
    case ScalarType::int8: convert(std::int8_t{}); break;
    case ScalarType::uint8: convert(std::uint8_t{}); break;
    case ScalarType::int16: convert(std::int16_t{}); break;
    case ScalarType::uint16: convert(std::uint16_t{}); break;
    case ScalarType::int32: convert(std::int32_t{}); break;
    case ScalarType::uint32: convert(std::uint32_t{}); break;
    case ScalarType::int64: convert(std::int64_t{}); break;
    case ScalarType::uint64: convert(std::uint64_t{}); break;
    case ScalarType::float32: convert(float{}); break;
    case ScalarType::float64: convert(double{}); break;
  }
  return to;
}

/// A vertex that a cell finalizes, and that the cell has only at corners from 64 on.
struct OtherLastUse {
  std::uint64_t cell = 0;    ///< index of the cell in its MeshBlock
  std::uint64_t vertex = 0;  ///< number of the vertex
  bool operator==(const OtherLastUse&) const = default;
};

/// A run of vertices and cells in coding order. Cell i uses only the first vertices_before_cell[i]
/// vertices of this block, and vertices of earlier blocks that have not been finalized.
struct MeshBlock {
  std::uint64_t first_vertex = 0;             ///< stream number of the first vertex
  std::vector<std::uint64_t> vertex_numbers;  ///< original numbers (Order::keep) or stream numbers
  std::vector<std::byte> xyz;                 ///< 3 coordinates of each vertex
  std::uint64_t first_cell = 0;               ///< position of the first cell in coding order
  /// Number of each cell: its original number if the order is Order::keep, otherwise its position
  /// in coding order.
  std::vector<std::uint64_t> cell_numbers;
  std::vector<std::uint32_t> cell_blocks;
  /// The corners of cell i are corners[corner_begin[i]] to corners[corner_begin[i + 1] - 1]. The
  /// vector has one entry more than there are cells.
  std::vector<std::uint64_t> corner_begin;
  std::vector<std::uint64_t> corners;   ///< vertex numbers of the corners
  std::vector<std::uint64_t> last_use;  ///< one bit mask per cell: bit i is set if the cell
                                        ///< finalizes its corner i (no later cell uses that vertex)
  /// Vertices that cells finalize and that `last_use` cannot mark, in ascending order of cells.
  /// Only cells of orders 3 to 10 have such vertices.
  std::vector<OtherLastUse> other_last_uses;
  std::vector<std::uint64_t> vertices_before_cell;
  /// If a single segment is read: for each vertex, 1 if the vertex is imported (an earlier segment
  /// owns it), otherwise 0. Empty if a whole file or a piece of a mesh is read, because each vertex
  /// then occurs only once.
  std::vector<std::uint8_t> imported;
  /// Values of static arrays, indexed by array. A point array has one value for each vertex of this
  /// MeshBlock. A cell array has one value for each cell of this MeshBlock whose element block the
  /// array covers. The entries of stepped arrays are empty.
  std::vector<std::vector<std::byte>> arrays;

  std::size_t vertex_count() const { return vertex_numbers.size(); }
  std::size_t cell_count() const { return cell_blocks.size(); }
};

/// Description of a segment in the index of a file. Reading a segment fails if its contents do not
/// match this description.
struct SegmentInfo {
  std::uint64_t first_cell = 0, cells = 0;  ///< range of cells in coding order
  /// Range of the vertices that the segment owns, as stream numbers (positions in coding order).
  std::uint64_t first_vertex = 0, vertices = 0;
  std::uint64_t bytes = 0;  ///< size in bytes of the segment's groups in the file
  /// Smallest x y z and largest x y z of the segment's vertices, imported vertices included; +inf
  /// and -inf if the segment has no vertices.
  std::array<double, 6> box{};
};

/// Values of a stepped array at one time step, for the elements of one group. The values are in
/// coding order. Values that are neither on points nor on cells are in one piece, in the order of
/// the caller of the Writer.
struct StepPiece {
  std::uint32_t array = 0;
  std::uint64_t step = 0;
  std::uint64_t first = 0;  ///< index of the first element, counted in the array's coding order
  std::vector<std::byte> values;
};
struct StepTimes {
  std::uint64_t first = 0;  ///< step of the first of `times`; the number of times in earlier items
  std::vector<double> times;
};
/// Totals of a whole file. They are the final item that a Reader returns.
struct Totals {
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0;
  std::uint64_t max_active_vertices = 0;
  /// Position of each segment's first cell in coding order.
  std::vector<std::uint64_t> segment_starts;
  /// Connectivity codec of each segment; `automatic` if the segment has no cells.
  std::vector<ConnectivityCodec> segment_connectivity;
  std::uint64_t imported_vertices = 0;  ///< number of imports in all segments; a vertex counts
                                        ///< once for each segment that imports it
  std::uint64_t total_bytes = 0;
  /// Size in bytes of each kind of stream, as in SizeReport.
  std::map<std::string, std::uint64_t> streams;
  std::uint64_t steps = 0;
  std::vector<std::uint64_t> block_cells;
  /// Digest of the mesh with its values and step times: the same for all files with the same
  /// vertices, cells, numbers, values and times, however they are coded (spec "Digests"). Empty if
  /// the file has no digests.
  std::optional<std::uint64_t> digest;
  /// Number of bytes after the end record. An interrupted append leaves such bytes; readers ignore
  /// them.
  std::uint64_t trailing_bytes = 0;
};

// Events: the contents of a MeshBlock as single vertices and cells, for callers that do not keep
// the whole mesh in memory.

struct VertexEvent {
  std::uint64_t number;
  std::span<const std::byte> xyz;  ///< 3 coordinates of the vertex
};
struct CellEvent {
  std::uint64_t number;
  std::uint32_t block;
  std::span<const std::uint64_t> corners;
  std::uint64_t last_use;
};
struct FinalizeEvent {
  std::uint64_t vertex;  ///< number of a vertex that no later cell uses
};
using Event = std::variant<VertexEvent, CellEvent, FinalizeEvent>;

/// Calls `handler(event)` for each event of `block` in stream order. The events of a cell are the
/// vertices that it introduces, the cell itself, and the vertices that it finalizes. Spans are
/// valid during the call.
template <class Handler>
void for_each_event(const MeshBlock& block, ScalarType coordinate_type, Handler&& handler) {
  const std::size_t xyz_bytes = 3 * scalar_bytes(coordinate_type);
  std::size_t vertex = 0, other = 0;
  const auto emit_vertices_below = [&](std::size_t end) {
    for (; vertex < end; ++vertex)
      handler(Event{VertexEvent{block.vertex_numbers[vertex],
                                std::span(block.xyz).subspan(vertex * xyz_bytes, xyz_bytes)}});
  };
  for (std::size_t cell = 0; cell < block.cell_count(); ++cell) {
    emit_vertices_below(static_cast<std::size_t>(block.vertices_before_cell[cell]));
    const auto begin = static_cast<std::size_t>(block.corner_begin[cell]);
    const auto end = static_cast<std::size_t>(block.corner_begin[cell + 1]);
    const auto corners = std::span(block.corners).subspan(begin, end - begin);
    handler(Event{CellEvent{block.cell_numbers[cell], block.cell_blocks[cell], corners,
                            block.last_use[cell]}});
    for (std::size_t i = 0; i < corners.size() && i < 64; ++i)
      if (block.last_use[cell] >> i & 1) handler(Event{FinalizeEvent{corners[i]}});
    const auto& others = block.other_last_uses;
    for (; other < others.size() && others[other].cell == cell; ++other)
      handler(Event{FinalizeEvent{others[other].vertex}});
  }
  emit_vertices_below(block.vertex_count());
}

}  // namespace shm
