// Reader and Decoder: decode a .shm file piece by piece. Memory follows the active surface and one
// chunk. For a file with stepped arrays they also hold the compressed connectivity, up to 64 MiB of
// neighbourhoods (ReadOptions::kept_topology_bytes), and one step of all stepped arrays if that is
// 128 MiB or less.
//   Decoder   push: takes bytes and yields items; no I/O, no threads, no global state
//   Reader    pull: reads from a ByteSource and yields items; with threads if requested
// spec: "Decoding a file"
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "shm/io.h"
#include "shm/schema.h"

namespace shm {
namespace container {
struct Index;
}

/// Limits on the demands of a file. Exceeding one is ErrorCode::over_limit.
struct ReadLimits {
  std::uint64_t max_active_vertices = std::uint64_t{1} << 27;
  std::uint64_t max_chunk_bytes = std::uint64_t{1} << 30;  ///< payload of one chunk
  /// One chunk group, unpacked. For step values it also limits the neighbourhoods of a group.
  std::uint64_t max_group_bytes = std::uint64_t{1} << 30;
  std::uint64_t max_extra_bytes = std::uint64_t{1} << 30;  ///< one extra, unpacked
  /// Memory limit for the active vertices of a segment: this value plus `kActiveBytesEach` per byte
  /// of the file read so far. For a file opened by its index, or by a tool that knows its size, all
  /// bytes of the file count from the beginning. An active vertex counts as 288 bytes; with codec
  /// patterns as 72, with codec shifts as 16.
  std::uint64_t max_active_bytes = std::uint64_t{1} << 26;
  static constexpr std::uint64_t kActiveBytesEach = 256;
  /// Memory limit for the values kept for active vertices and cells of a segment: this value plus
  /// 512 bytes per byte of the segment read so far. Arrays in which almost all values are equal
  /// need nothing. Time steps have a separate limit: this value plus 256 bytes per byte of the file
  /// read so far.
  std::uint64_t max_column_bytes = std::uint64_t{1} << 25;
  /// Memory limit for schema, step times and extras together, unpacked: this value plus 256 bytes
  /// per byte of the file. Files of a Writer need less.
  std::uint64_t max_unpacked_bytes = std::uint64_t{1} << 26;
  std::uint32_t max_arrays = 65536;
  std::uint32_t max_static_components = 4096;  ///< of all static arrays together
  std::uint32_t max_blocks = 1 << 20;
  std::uint64_t max_steps = 1 << 20;
  std::uint32_t max_segments = 1 << 20;
  // Size of the result: unlimited by default, since a small file can legitimately hold many cells.
  // For a file opened by its index, the counts of the whole file are checked at once.
  std::uint64_t max_vertices = ~std::uint64_t{0};
  std::uint64_t max_cells = ~std::uint64_t{0};
  /// For a Decoder or Reader: bytes of coordinates and of all values, steps included, plus eight
  /// bytes per corner of a cell.
  std::uint64_t max_decoded_bytes = ~std::uint64_t{0};
};

/// Options of a Reader. They do not affect its results.
struct ReadOptions {
  /// Number of threads that decode segments ahead of the caller's thread. 1: none, 0: one per core.
  unsigned threads = 1;
  /// With threads: limit for the groups that wait for a thread and the blocks that wait for the
  /// caller, together. Each thread may hold one more group.
  std::uint64_t max_ahead_bytes = std::uint64_t{256} << 20;
  /// As in WriteOptions.
  std::uint64_t kept_topology_bytes = std::uint64_t{64} << 20;
};

/// A run of vertices and cells in coding order. Cell i may use the vertices below
/// `vertices_before_cell[i]` of this block and any earlier vertex that is not finalized.
struct MeshBlock {
  std::uint64_t first_vertex = 0;             ///< stream number of the first vertex
  std::vector<std::uint64_t> vertex_numbers;  ///< original numbers (Order::keep) or stream numbers
  std::vector<std::byte> xyz;                 ///< 3 coordinates each
  std::uint64_t first_cell = 0;               ///< position in coding order of the first cell
  std::vector<std::uint64_t>
      cell_numbers;  ///< original numbers (Order::keep) or positions in coding order
  std::vector<std::uint32_t> cell_blocks;
  std::vector<std::uint64_t> corner_begin;  ///< cells + 1 offsets into corners
  std::vector<std::uint64_t> corners;       ///< vertex numbers
  std::vector<std::uint64_t> last_use;      ///< bit i: corner i is finalized by this cell
  std::vector<std::uint64_t> vertices_before_cell;
  /// Empty if each vertex occurs once, in the segment that owns it. If a segment is read on its
  /// own: 1 for each vertex that an earlier segment owns, otherwise 0.
  std::vector<std::uint8_t> imported;
  /// Values of static arrays by array index: point arrays for each vertex, cell arrays for each
  /// cell whose block they cover. Empty for stepped arrays.
  std::vector<std::vector<std::byte>> arrays;

  std::size_t vertex_count() const { return vertex_numbers.size(); }
  std::size_t cell_count() const { return cell_blocks.size(); }
};

/// The values of a stepped array in one chunk group, in coding order of its elements.
struct StepPiece {
  std::uint32_t array = 0;
  std::uint64_t step = 0;
  std::uint64_t first = 0;  ///< position of the first element in the array's coding order
  std::vector<std::byte> values;
};
struct StepTimes {
  std::vector<double> times;
};
/// Totals of a whole file; the last item.
struct Totals {
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0;
  std::uint64_t max_active_vertices = 0;
  std::vector<std::uint64_t> segment_starts;  ///< position in coding order of their first cells
  /// Connectivity codec of each segment; automatic for a segment without cells.
  std::vector<ConnectivityCodec> segment_connectivity;
  std::uint64_t imported_vertices = 0;  ///< vertices coded again by segments that do not own them
  std::uint64_t total_bytes = 0;
  std::map<std::string, std::uint64_t> streams;  ///< as in SizeReport
  std::uint64_t steps = 0;
  std::vector<std::uint64_t> block_cells;
  std::uint64_t trailing_bytes = 0;  ///< ignored bytes after the end record: a torn append
};

/// One item of a file. A Decoder yields MeshBlocks, then StepPieces; Extras and StepTimes at any
/// place; Totals last.
using Item = std::variant<MeshBlock, StepPiece, StepTimes, Extra, Totals>;

/// Decodes bytes that the caller reads. Accepts pieces of any size, even single bytes. After the
/// first error every call returns that error. Not thread safe; distinct Decoders are independent.
class SHM_API Decoder {
 public:
  explicit Decoder(const ReadLimits& limits = {});
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  ~Decoder();

  enum class Progress : std::uint8_t {
    need_input,  ///< no item; feed more
    item_ready,  ///< take() returns an item
    finished,    ///< all items up to end_of_input() have been taken
  };
  /// Copies `bytes` into the decoder's buffer, which keeps at most one chunk in addition to them.
  Result<void> feed(std::span<const std::byte> bytes);
  /// Declares the end of the input: from now on a missing end record is ErrorCode::truncated.
  void end_of_input();
  /// Decodes until an item is ready or input is missing.
  Result<Progress> advance();
  /// Must hold: advance() returned item_ready. Moves the item out.
  Item take();
  /// Returns a block that the caller no longer needs, so that its memory is used for a later block.
  /// Calling it is optional and only saves time.
  void reuse(MeshBlock&& block);
  /// Null until the schema has been decoded; then valid for the decoder's life.
  const Schema* schema() const;

 private:
  friend class Reader;
  friend class IndexBuilder;
  Decoder(const ReadLimits& limits, const ReadOptions& options);
  /// Returns the index that belongs to everything decoded so far, without entries and ranges.
  /// ErrorCode::corrupt if step values are incomplete.
  Result<container::Index> held() const;

  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Pulls a whole file through a Decoder.
class SHM_API Reader {
 public:
  /// Reads up to and including the schema. `source` is borrowed and must outlive the Reader.
  static Result<Reader> open(ByteSource& source, const ReadLimits& limits = {},
                             const ReadOptions& options = {});
  Reader(Reader&&) noexcept;
  Reader& operator=(Reader&&) noexcept;
  ~Reader();

  const Schema& schema() const;
  /// Returns the next item; null at the end, also on further calls. Valid until the next call.
  Result<Item*> next();

 private:
  class Impl;
  explicit Reader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Single events of MeshBlocks, for callers that keep only a small part of the mesh.

struct VertexEvent {
  std::uint64_t number;
  std::span<const std::byte> xyz;  ///< 3 coordinates
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

/// Calls `handler(event)` for each event of `block` in stream order: the vertices that a cell
/// introduces, the cell, the vertices that it finalizes. Spans are valid during the call.
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
