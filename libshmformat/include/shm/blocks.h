// Items that a Reader yields: vertices and cells block by block, values of time steps, and totals.
// All types are plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "shm/schema.h"

namespace shm {

/// Converts the numbers in `from`, stored as `type` in host byte order, to T, as static_cast does.
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

/// A run of vertices and cells in coding order. Cell i may use two kinds of vertices: those of this
/// block with an index below `vertices_before_cell[i]`, and all vertices of earlier blocks that are
/// not finalized.
struct MeshBlock {
  std::uint64_t first_vertex = 0;             ///< stream number of the first vertex
  std::vector<std::uint64_t> vertex_numbers;  ///< original numbers (Order::keep) or stream numbers
  std::vector<std::byte> xyz;                 ///< 3 coordinates of each vertex
  std::uint64_t first_cell = 0;               ///< position of the first cell in coding order
  /// Original cell numbers (Order::keep) or positions of the cells in coding order.
  std::vector<std::uint64_t> cell_numbers;
  std::vector<std::uint32_t> cell_blocks;
  /// Offsets of the cells in `corners`; cells + 1 entries.
  std::vector<std::uint64_t> corner_begin;
  std::vector<std::uint64_t> corners;   ///< vertex numbers of the corners
  std::vector<std::uint64_t> last_use;  ///< one bit mask per cell: bit i is set if the cell
                                        ///< finalizes its corner i (no later cell uses that vertex)
  std::vector<std::uint64_t> vertices_before_cell;
  /// Import flag of each vertex, set if a single segment is read: 1 if an earlier segment owns the
  /// vertex, otherwise 0. If a whole file or a piece of a mesh is read, each vertex occurs only
  /// once, and this vector is empty.
  std::vector<std::uint8_t> imported;
  /// Values of static arrays, by array index. Point arrays have a value for each vertex; cell
  /// arrays have a value for each cell in a block that they cover. Empty for stepped arrays.
  std::vector<std::vector<std::byte>> arrays;

  std::size_t vertex_count() const { return vertex_numbers.size(); }
  std::size_t cell_count() const { return cell_blocks.size(); }
};

/// Index entry that describes a segment. Reading the segment fails if its contents differ from this
/// description.
struct SegmentInfo {
  std::uint64_t first_cell = 0, cells = 0;  ///< range of cells in coding order
  /// Range of stream numbers of the vertices that the segment owns.
  std::uint64_t first_vertex = 0, vertices = 0;
  std::uint64_t bytes = 0;  ///< size in bytes of the segment's groups in the file
  /// Smallest x y z and largest x y z of the segment's vertices, imported vertices included; +inf
  /// and -inf if the segment has no vertices.
  std::array<double, 6> box{};
};

/// Values of a stepped array in one chunk group, in coding order of the elements.
struct StepPiece {
  std::uint32_t array = 0;
  std::uint64_t step = 0;
  std::uint64_t first = 0;  ///< position of the first element in the array's coding order
  std::vector<std::byte> values;
};
struct StepTimes {
  std::vector<double> times;
};
/// Totals of a whole file: the last item that a Reader yields.
struct Totals {
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0;
  std::uint64_t max_active_vertices = 0;
  /// Position of each segment's first cell in coding order.
  std::vector<std::uint64_t> segment_starts;
  /// Connectivity codec of each segment; `automatic` if the segment has no cells.
  std::vector<ConnectivityCodec> segment_connectivity;
  std::uint64_t imported_vertices = 0;  ///< number of vertices coded again by a segment that does
                                        ///< not own them, summed over all segments
  std::uint64_t total_bytes = 0;
  /// Size in bytes of each kind of stream, as in SizeReport.
  std::map<std::string, std::uint64_t> streams;
  std::uint64_t steps = 0;
  std::vector<std::uint64_t> block_cells;
  /// Number of bytes after the end record. An interrupted append leaves such bytes; readers ignore
  /// them.
  std::uint64_t trailing_bytes = 0;
};

// Events: the contents of a MeshBlock as single vertices and cells, for callers that store only a
// small part of the mesh.

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
  std::size_t vertex = 0;
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
  }
  emit_vertices_below(block.vertex_count());
}

}  // namespace shm
