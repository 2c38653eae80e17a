// Reader and Decoder: a .shm file out again, in pieces, with memory that follows the active
// surface and one chunk. Where a file has stepped arrays it also holds the compressed connectivity,
// up to 64 MiB of neighbourhoods (or what ReadOptions say), and one step of all stepped arrays
// where that is 128 MiB or less.
//   Decoder   push bytes in, take items out; no I/O, no threads, nothing global
//   Reader    pulls from a ByteSource and offers blocks or single events; with threads if asked
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

/// What a file may ask of its reader. Asking for more is ErrorCode::over_limit.
struct ReadLimits {
  std::uint64_t max_active_vertices = std::uint64_t{1} << 27;
  std::uint64_t max_chunk_bytes = std::uint64_t{1} << 30;  ///< payload of one chunk
  /// One chunk group, unpacked; of step values also its neighbourhoods.
  std::uint64_t max_group_bytes = std::uint64_t{1} << 30;
  std::uint64_t max_extra_bytes = std::uint64_t{1} << 30;  ///< one extra, unpacked
  /// What active vertices may take in a segment, beside `kActiveBytesEach` for each byte of
  /// the file so far. A file that is opened by its index, or by a tool that knows how large it is,
  /// has as much for all of its bytes from the beginning. They count as 288 bytes each, by codec
  /// patterns as 72, by shifts as 16.
  std::uint64_t max_active_bytes = std::uint64_t{1} << 26;
  static constexpr std::uint64_t kActiveBytesEach = 256;
  /// What values of active vertices and cells take in a segment, beside 512 bytes for each byte of
  /// it so far; where all but few are alike they take nothing. Of time steps the same apart, beside
  /// 256 bytes for each byte of the file so far.
  std::uint64_t max_column_bytes = std::uint64_t{1} << 25;
  /// Budget of all that a file holds beside its mesh and values, as it is in memory: schema, step
  /// times and extras together. To it come 256 bytes for each byte of the file, which is more than
  /// a Writer's files take.
  std::uint64_t max_unpacked_bytes = std::uint64_t{1} << 26;
  std::uint32_t max_arrays = 65536;
  std::uint32_t max_static_components = 4096;  ///< of all arrays without time steps together
  std::uint32_t max_blocks = 1 << 20;
  std::uint64_t max_steps = 1 << 20;
  std::uint32_t max_segments = 1 << 20;
  // What comes out: without limit, since few bytes may truly be many cells. Of a file that is
  // opened by its index the counts are those of all of it, and refused at once.
  std::uint64_t max_vertices = ~std::uint64_t{0};
  std::uint64_t max_cells = ~std::uint64_t{0};
  /// A Decoder or Reader: coordinates, values, those of steps too, and eight bytes for each corner
  /// of a cell.
  std::uint64_t max_decoded_bytes = ~std::uint64_t{0};
};

/// How a Reader works. What it yields is the same in every case.
struct ReadOptions {
  /// Threads that decode segments ahead, beside the caller's; 1: none, 0: one for each core.
  unsigned threads = 1;
  /// With threads: groups that wait for them and blocks that wait for the caller, together; each
  /// thread may hold one group more.
  std::uint64_t max_ahead_bytes = std::uint64_t{256} << 20;
  /// As in WriteOptions.
  std::uint64_t kept_topology_bytes = std::uint64_t{64} << 20;
};

/// A run of vertices and cells in coding order. Cell i may use the vertices below
/// `vertices_before_cell[i]` of this block and any earlier vertex that is not finalized.
struct MeshBlock {
  std::uint64_t first_vertex = 0;  ///< stream number of the first vertex
  std::vector<std::uint64_t>
      vertex_numbers;            ///< keep: the original number; stream: the stream number
  std::vector<std::byte> xyz;    ///< 3 coordinates each
  std::uint64_t first_cell = 0;  ///< position in coding order of the first cell
  std::vector<std::uint64_t> cell_numbers;  ///< keep: the original number; stream: the position
  std::vector<std::uint32_t> cell_blocks;
  std::vector<std::uint64_t> corner_begin;  ///< cells + 1 offsets into corners
  std::vector<std::uint64_t> corners;       ///< vertex numbers
  std::vector<std::uint64_t> last_use;      ///< bit i: corner i is finalized by this cell
  std::vector<std::uint64_t> vertices_before_cell;
  /// Empty where each vertex comes once, from the segment that owns it. Where a segment is read
  /// alone: 1 for each vertex that an earlier segment owns, 0 for the others.
  std::vector<std::uint8_t> imported;
  /// Values of static arrays by array index; point arrays for each vertex, cell arrays for
  /// each cell whose block they cover. Stepped arrays: empty.
  std::vector<std::vector<std::byte>> arrays;

  std::size_t vertex_count() const { return vertex_numbers.size(); }
  std::size_t cell_count() const { return cell_blocks.size(); }
};

/// The values of a stepped array in one chunk group, in coding order of its elements.
struct StepPiece {
  std::uint32_t array = 0;
  std::uint64_t step = 0;
  std::uint64_t first = 0;  ///< first element in the array's coding order
  std::vector<std::byte> values;
};
struct StepTimes {
  std::vector<double> times;
};
/// Totals of a whole file, the last item.
struct Totals {
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0;
  std::uint64_t max_active_vertices = 0;
  std::vector<std::uint64_t> segment_starts;  ///< position in coding order of their first cells
  /// How the hexahedra of each segment are encoded; automatic where it has no cells.
  std::vector<ConnectivityCodec> segment_connectivity;
  std::uint64_t imported_vertices = 0;  ///< coded again by segments that do not own them
  std::uint64_t total_bytes = 0;
  std::map<std::string, std::uint64_t> streams;  ///< as in SizeReport
  std::uint64_t steps = 0;
  std::vector<std::uint64_t> block_cells;
  std::uint64_t trailing_bytes = 0;  ///< ignored bytes behind the end record: a torn append
};

/// One thing read from a file. A Decoder yields MeshBlocks, then StepPieces; Extras and StepTimes
/// anywhere; Totals last.
using Item = std::variant<MeshBlock, StepPiece, StepTimes, Extra, Totals>;

/// Decodes bytes that somebody else reads. Feed pieces of any size, even one byte.
/// The first error sticks. Not thread safe; distinct Decoders are independent.
class SHM_API Decoder {
 public:
  explicit Decoder(const ReadLimits& limits = {});
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  ~Decoder();

  enum class Progress : std::uint8_t {
    need_input,  ///< nothing to take; feed more
    item_ready,  ///< take() has something
    finished,    ///< everything up to end_of_input() has been taken
  };
  /// Copies `bytes` into the decoder's chunk buffer (at most one chunk is kept beyond them).
  Result<void> feed(std::span<const std::byte> bytes);
  /// No more bytes will come: from now on a missing end record is ErrorCode::truncated.
  void end_of_input();
  /// Works until something can be taken or input is missing.
  Result<Progress> advance();
  /// Must hold: advance() returned item_ready. Moves the item out.
  Item take();
  /// Gives back a block that nobody needs any more: its room is taken for a block to come. Who
  /// does without it loses time alone.
  void reuse(MeshBlock&& block);
  /// Null until the file header has been decoded; then valid for the decoder's life.
  const Schema* schema() const;

 private:
  friend class Reader;
  friend class IndexBuilder;
  Decoder(const ReadLimits& limits, const ReadOptions& options);
  /// What an index would tell of all that was decoded, but for entries and ranges. Corrupt where
  /// step values are not complete.
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
  /// The next item; null at the end, again and again. Valid until the next call.
  Result<Item*> next();

 private:
  class Impl;
  explicit Reader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Single events over MeshBlocks, for callers that hold a sliver of the mesh.

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
  std::uint64_t vertex;  ///< no later cell uses it
};
using Event = std::variant<VertexEvent, CellEvent, FinalizeEvent>;

/// Calls `handler(event)` for each event of `block` in stream order: the vertices a cell
/// introduces, the cell, the vertices it finalizes. Spans live during the call.
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
