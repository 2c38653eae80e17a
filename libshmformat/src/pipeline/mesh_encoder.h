// MeshEncoder: converts vertices and cells to chunk groups. It checks what the caller adds and
// connects the units that do the work: the vertex table, the delay buffer, the segment cutter, and
// the segment queue, whose groups it completes and writes. mesh_decoder.h is the counterpart.
// spec: "Segments", "Group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/delay_buffer.h"
#include "pipeline/segments.h"
#include "pipeline/stream_numbers.h"
#include "pipeline/vertex_table.h"
#include "shm/options.h"

namespace shm {

class MeshEncoder {
 public:
  /// Receives a finished group: its segment, its header, and the bitstreams that the header lists,
  /// in order.
  using GroupSink = std::function<Result<void>(std::uint32_t, const container::GroupHeader&,
                                               const std::vector<std::vector<std::byte>>&)>;

  /// `schema` has passed check_schema() and must outlive the encoder.
  MeshEncoder(const Schema& schema, const WriteOptions& options, GroupSink sink);
  MeshEncoder(const MeshEncoder&) = delete;
  MeshEncoder& operator=(const MeshEncoder&) = delete;

  /// Declares that the mesh consists of some segments of a larger mesh, from `start` on. Call it
  /// before adding anything. Groups are then held until give_out_part(), except in Order::keep.
  void begin_part(const SegmentStart& start);

  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data);
  /// Adds a vertex that is owned by a segment before this part. Allowed only if the part does not
  /// begin with segment 0.
  Result<void> add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                   std::span<const std::byte> data);
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data);
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use, std::span<const std::byte> data);
  /// Returns true if nothing has been added.
  bool is_new() const { return totals_.cells == 0 && vertices_.empty(); }

  /// Like add_vertex(), for callers that keep track of entries: the number is neither looked up nor
  /// checked. Returns the entry that identifies the vertex in enter_cell() until its last use.
  /// `xyz` and `data` have the sizes that the schema requires.
  std::uint32_t enter_vertex(std::uint64_t number, const std::byte* xyz, const std::byte* data) {
    return vertices_.add(number, xyz, data);
  }
  /// Like add_cell(), with entries that have not ended. The counts of nodes and bytes must be those
  /// of the block.
  Result<void> enter_cell(std::uint32_t block, std::span<const std::uint32_t> entries,
                          std::uint64_t last_use, std::span<const std::byte> data);

  Result<void> end();
  /// Writes all groups that are complete. Only the calls so far determine which groups these are,
  /// not the speed of threads.
  Result<void> catch_up() { return queue_.catch_up(); }
  /// Writes all groups of a part after end(), except in Order::keep. `numbers` are the stream
  /// numbers of the imported vertices of the part, in the order of add_imported_vertex().
  Result<void> give_out_part(std::span<const std::uint64_t> numbers);
  std::size_t imported() const { return stream_numbers_.imported(); }

  const container::Index& totals() const { return totals_; }

 private:
  /// Returns true if groups list stream numbers for their imported vertices, not the caller's
  /// numbers.
  bool has_stream_numbers() const { return schema_->order != Order::keep; }
  Result<void> delay(std::uint64_t number, std::uint32_t block,
                     std::span<const std::uint32_t> entries, std::span<const std::byte> data);
  Result<void> code_waiting();
  Result<void> code_all_waiting();
  Result<void> cut();
  /// Codes a cell. `may_give`: the cell may be the first in the segment to use one of its vertices.
  /// `may_end`: bit mask of the nodes at which the cell may use a vertex for the last time.
  Result<void> code(std::uint64_t number, std::uint32_t block,
                    std::span<const std::uint32_t> entries, std::span<const std::byte> data,
                    bool may_give, std::uint64_t may_end);
  void give_vertex(SegmentPiece& piece, std::uint32_t entry);
  Result<void> code_unused(std::uint32_t entry);
  Result<void> give_out(EncodedGroup& group);
  Result<void> finish_group(EncodedGroup& group);
  void report_order(const EncodedGroup& group) const;

  const Schema* schema_;
  const WriteOptions options_;
  GroupSink sink_;
  std::vector<std::size_t> cell_data_bytes_;  // size of the data of a cell in bytes, by block
  std::vector<std::uint32_t> cell_entries_;

  VertexTable vertices_;
  std::optional<DelayBuffer> delayed_;  // set if cells may be delayed
  SegmentCutter cutter_;
  SegmentQueue queue_;
  StreamNumbers stream_numbers_;  // used if has_stream_numbers()

  SegmentStart start_;              // the current segment
  std::uint64_t coded_cells_ = 0;   // number of cells added to the queue
  std::uint64_t own_vertices_ = 0;  // number of vertices added to the queue, without imports

  std::uint32_t last_segment_ = 0;  // segment of the last group written
  bool holds_groups_ = false;       // true: a part whose imported vertices have no numbers yet
  std::vector<EncodedGroup> held_;

  container::Index totals_;
};

/// Returns the schema to store in a file written with these options. Fails with ErrorCode::misuse
/// if the schema or the options are invalid.
Result<Schema> schema_of_file(Schema schema, const WriteOptions& options);

}  // namespace shm
