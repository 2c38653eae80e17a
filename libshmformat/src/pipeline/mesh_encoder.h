// MeshEncoder: converts vertices and cells to encoded groups. It checks the data that the caller
// adds. It connects the parts that do the work: the vertex table, the delay buffer, the segment
// cutter and the segment queue. It completes the groups of the segment queue and writes them. Its
// counterpart is mesh_decoder.h.
// spec: "Segments", "Group"
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/delay_buffer.h"
#include "pipeline/segments.h"
#include "pipeline/stream_numbers.h"
#include "pipeline/vertex_table.h"
#include "shm/options.h"

namespace shm {

/// A vertex of a whole mesh, see MeshEncoder::feed_cell().
struct FedVertex {
  /// Largest value of `uses`. A vertex with at least this number of uses is never finalized.
  static constexpr std::uint32_t kEndless = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t uses = 0;         ///< number of uses by cells that have not been added yet
  std::uint32_t segment = kNone;  ///< most recent segment that uses the vertex; kNone if none does
  std::uint32_t handle = 0, ticket = kNone;  ///< used by the encoder
};

class MeshEncoder {
 public:
  /// Receives a finished group.
  using GroupSink = std::function<Result<void>(const EncodedGroup&)>;

  /// `schema` must have passed check_schema() and must outlive the encoder.
  MeshEncoder(const Schema& schema, const WriteOptions& options, GroupSink sink);
  MeshEncoder(const MeshEncoder&) = delete;
  MeshEncoder& operator=(const MeshEncoder&) = delete;

  /// Declares that the encoder codes only a part of a larger mesh: consecutive segments, beginning
  /// with segment `start`. Must be called before anything is added. Except in Order::keep, groups
  /// are then stored in memory until give_out_part() is called.
  void begin_part(const SegmentStart& start);

  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data);
  /// Adds a vertex that is owned by a segment before the encoded part of the mesh. Precondition:
  /// the part does not begin with segment 0.
  Result<void> add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                   std::span<const std::byte> data);
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data);
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use, std::span<const std::byte> data,
                        std::span<const std::uint64_t> other_last_uses);
  /// Returns true if nothing has been added.
  bool is_new() const { return totals_.cells == 0 && vertices_.empty(); }

  /// Returns true if feed_cell() may be called: the mesh has no delay buffer.
  bool takes_fed_cells() const { return !delayed_; }
  /// Adds a cell of a mesh of which all cells are added by this function. This is faster than
  /// add_vertex() and add_cell(), because vertices need not be looked up or stored. `vertices`: all
  /// vertices of the mesh, by number; FedVertex::uses must count the uses by this cell and all
  /// later cells. `corners` and `data` must have the sizes that the block requires.
  /// put_values(runs, vertex) appends the coordinates and static point data of a vertex to `runs`.
  template <class PutValues>
  Result<void> feed_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                         std::span<FedVertex> vertices, std::span<const std::byte> data,
                         PutValues&& put_values);

  Result<void> end();
  /// Writes all groups that are complete. Which groups these are depends only on the calls made so
  /// far, not on the speed of the threads.
  Result<void> catch_up() { return queue_.catch_up(); }
  /// Writes all groups of a part. With Order::keep, the groups have already been written. Call it
  /// after end(). `numbers`: the stream numbers of the vertices that the part imports, in the order
  /// of the calls to add_imported_vertex().
  Result<void> give_out_part(std::span<const std::uint64_t> numbers);
  std::size_t imported() const { return stream_numbers_.imported(); }

  const container::Index& totals() const { return totals_; }

 private:
  /// Returns true if groups list imported vertices by their stream numbers instead of the caller's
  /// numbers.
  bool has_stream_numbers() const { return schema_->order != Order::keep; }
  Result<void> enter_cell(std::uint32_t block, std::span<const std::uint32_t> entries,
                          std::uint64_t last_use, std::span<const std::byte> data);
  Result<void> delay(std::uint64_t number, std::uint32_t block,
                     std::span<const std::uint32_t> entries, std::span<const std::byte> data);
  Result<void> code_waiting();
  Result<void> code_all_waiting();
  Result<void> cut();
  /// Codes a cell. `may_give`: true if the cell may be the first cell in the segment that uses one
  /// of its vertices. `may_end`: bit mask of the nodes whose vertices may have their last use in
  /// this cell.
  Result<void> code(std::uint64_t number, std::uint32_t block,
                    std::span<const std::uint32_t> entries, std::span<const std::byte> data,
                    bool may_give, std::uint64_t may_end);
  void give_vertex(SegmentPiece& piece, std::uint32_t entry);
  SegmentPiece::Vertex feed_vertex(std::uint64_t number, FedVertex& vertex);
  Result<void> code_unused(std::uint32_t entry);
  Result<void> give_out(EncodedGroup& group);
  Result<void> finish_group(EncodedGroup& group);
  void report_order(const EncodedGroup& group) const;

  const Schema* schema_;
  const WriteOptions options_;
  GroupSink sink_;
  std::vector<std::size_t> cell_data_bytes_;  // for each block: size in bytes of the data of a cell
  std::vector<std::uint32_t> cell_entries_;
  std::vector<std::uint32_t> other_entries_;  // vertices that end and that last_use does not mark

  // Handles of fed vertices: the number of handles so far, those that are free again, and those of
  // the vertices that the current cell ends. The latter become free after the cell, since its later
  // vertices need other handles.
  std::uint32_t handles_ = 0;
  std::vector<std::uint32_t> free_handles_, ended_handles_;

  VertexTable vertices_;
  std::optional<DelayBuffer> delayed_;  // set if cells may be delayed
  SegmentCutter cutter_;
  SegmentQueue queue_;
  StreamNumbers stream_numbers_;  // used if has_stream_numbers()

  SegmentStart start_;              // the current segment
  std::uint64_t coded_cells_ = 0;   // number of cells added to the queue
  std::uint64_t own_vertices_ = 0;  // number of vertices added to the queue; imported vertices are
                                    // not counted

  std::uint32_t last_segment_ = 0;  // segment of the most recently written group
  // For each block: true if the last uses of all nodes of its cells can be marked, because the
  // nodes form a grid
  std::vector<bool> ends_others_;
  bool holds_groups_ = false;  // true if groups are stored until give_out_part() provides the
                               // numbers of the imported vertices
  std::vector<EncodedGroup> held_;

  container::Index totals_;
};

template <class PutValues>
Result<void> MeshEncoder::feed_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                                    std::span<FedVertex> vertices, std::span<const std::byte> data,
                                    PutValues&& put_values) {
  if (cutter_.is_due(block, totals_.cells))
    if (auto status = cut(); !status) return status;
  SegmentPiece& piece = queue_.piece();
  SegmentPiece::Cell cell;
  cell.number = totals_.cells;
  cell.block = block;
  cell.nodes = static_cast<std::uint32_t>(corners.size());
  std::uint32_t* const handles = piece.nodes.append(corners.size());
  std::uint64_t introduced = 0;
  ended_handles_.clear();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    FedVertex& vertex = vertices[static_cast<std::size_t>(corners[i])];
    if (vertex.segment != start_.segment) {
      introduced += vertex.segment == kNone ? 1 : 0;
      ++cell.new_vertices;
      piece.vertices.push_back(feed_vertex(corners[i], vertex));
      put_values(piece.vertex_values, static_cast<std::size_t>(corners[i]));
    }
    handles[i] = vertex.handle;
    if (vertex.uses == FedVertex::kEndless || --vertex.uses > 0) continue;
    std::uint64_t nodes = 0;
    for (std::size_t j = 0; j < std::min<std::size_t>(i + 1, kMaxLastUse); ++j)
      nodes |= std::uint64_t{handles[j] == vertex.handle} << j;
    if (nodes == 0) {
      if (!ends_others_[block]) continue;  // only nodes that cannot be marked have the vertex
      const std::uint32_t* const first =
          std::find(handles + kMaxLastUse, handles + i, vertex.handle);
      piece.other_last_uses.push_back(static_cast<std::uint32_t>(first - handles));
      ++cell.other_last_uses;
    }
    cell.last_use |= nodes;
    ended_handles_.push_back(vertex.handle);
    if (vertex.ticket != kNone) stream_numbers_.end_ticket(vertex.ticket, coded_cells_);
  }
  for (const std::uint32_t handle : ended_handles_) free_handles_.push_back(handle);
  cutter_.add_cell(block, introduced, ended_handles_.size());
  ++totals_.block_cells[block];
  ++totals_.cells;
  piece.cells.push_back(cell);
  piece.cell_data.append(data.data(), data.size());
  ++coded_cells_;
  return queue_.added();
}

/// Returns the schema that is stored in a file written with these options. Fails with
/// ErrorCode::misuse if the schema or the options are invalid.
Result<Schema> schema_of_file(Schema schema, const WriteOptions& options);

}  // namespace shm
