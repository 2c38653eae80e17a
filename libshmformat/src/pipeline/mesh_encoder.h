// MeshEncoder: converts vertices and cells to chunk groups. It checks what the caller adds, stores
// the data that the active surface and the delay buffer need, decides where segments begin, and
// writes the groups of the segment encoders in order. mesh_decoder.h is the counterpart.
// spec: "Segments", "Group"
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/number_map.h"
#include "base/ordered_tasks.h"
#include "codecs/surface/cells/number_column.h"
#include "entropy/range_coder.h"
#include "pipeline/choosing_encoder.h"
#include "pipeline/spiral_reorderer.h"
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
  bool is_new() const { return totals_.cells == 0 && entries_.empty(); }

  /// Like add_vertex(), for callers that keep track of entries: the number is neither looked up nor
  /// checked. Returns the entry that identifies the vertex in enter_cell() until its last use.
  /// `xyz` and `data` have the sizes that the schema requires.
  std::uint32_t enter_vertex(std::uint64_t number, const std::byte* xyz, const std::byte* data);
  /// Like add_cell(), with entries that have not ended. The counts of nodes and bytes must be those
  /// of the block.
  Result<void> enter_cell(std::uint32_t block, std::span<const std::uint32_t> entries,
                          std::uint64_t last_use, std::span<const std::byte> data);

  Result<void> end();
  /// Writes all groups that are complete. Only the calls so far determine which groups these are,
  /// not the speed of threads.
  Result<void> catch_up();
  /// Writes all groups of a part after end(), except in Order::keep. `numbers` are the stream
  /// numbers of the imported vertices of the part, in the order of add_imported_vertex().
  Result<void> give_out_part(std::span<const std::uint64_t> numbers);
  std::size_t imported() const { return foreign_tickets_.size(); }

  const container::Index& totals() const { return totals_; }

 private:
  /// A vertex that cells may still refer to.
  struct Entry {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
    std::uint32_t waiting : 30 = 0;  // number of uses by cells in the delay buffer
    bool used : 1 = false;           // true: a cell has used the vertex
    bool ends : 1 = false;           // true: only waiting cells will still use the vertex
    bool named = false;              // true: by_number_ contains the vertex
  };
  struct WaitingCell {
    std::uint64_t number = 0;
    std::uint32_t block = 0;
    std::vector<std::uint32_t> entries;
    std::vector<std::byte> data;
  };
  /// Counts of the current segment, which determine the end of the segment.
  struct Run {
    std::uint64_t cells = 0;  // number of cells added, both coded and waiting
    std::uint64_t introduced =
        0;  // number of vertices that cells of the segment use and no earlier cell has used
  };

  std::uint32_t next_entry() const {
    return static_cast<std::uint32_t>(free_entries_.empty() ? entries_.size()
                                                            : free_entries_.back());
  }
  Result<void> delay(std::uint32_t block, std::span<const std::uint32_t> entries,
                     std::uint64_t number, std::span<const std::byte> data);
  Result<void> code_waiting();
  Result<void> code_all_waiting();
  bool cut_is_due(std::uint32_t block) const;
  CodecTrial trial() const;
  Result<void> cut();
  void let_go();
  /// Codes a cell. `may_give`: the cell may be the first in the segment to use one of its vertices.
  /// `may_end`: bit mask of the nodes at which the cell may use a vertex for the last time.
  Result<void> code(std::uint64_t number, std::uint32_t block,
                    std::span<const std::uint32_t> entries, std::span<const std::byte> data,
                    bool may_give, std::uint64_t may_end);
  std::uint64_t end_vertices(std::span<const std::uint32_t> entries, std::uint64_t may_end);
  Result<void> code_unused(std::uint32_t entry);
  void give_vertex(std::uint32_t entry);
  bool piece_is_full() const;
  Result<void> pass_piece_on();
  Result<void> take_finished(OrderedTasks<SegmentPiece, EncodedGroup>::Wait wait);
  Result<void> end_segment();
  Result<void> give_out(std::vector<EncodedGroup>& groups);
  Result<void> give_out(EncodedGroup& group);
  Result<void> finish_group(EncodedGroup& group);
  std::uint32_t new_ticket();
  void number_vertices(EncodedGroup& group);
  void code_import_numbers(EncodedGroup& group);
  void report_order(const EncodedGroup& group) const;

  const Schema* schema_;
  WriteOptions options_;
  GroupSink sink_;
  std::size_t xyz_bytes_, values_bytes_;
  std::vector<std::size_t> cell_data_bytes_;  // size of the data of a cell in bytes, by block

  // Everything added so far
  std::vector<Entry> entries_;
  /// The last segment to which each entry was passed. A separate list, because each cell reads it.
  std::vector<std::uint32_t> in_segment_;
  std::vector<std::byte> values_;  // coordinates and point data of each entry
  std::vector<std::uint32_t> free_entries_;
  NumberMap by_number_;
  std::uint64_t live_ = 0;  // number of vertices that a cell has used and that are not finalized
  std::vector<std::uint32_t> cell_entries_;
  std::optional<SpiralReorderer> reorderer_;  // set if cells may be delayed
  std::vector<WaitingCell> cells_;
  std::vector<std::uint32_t> free_cells_;

  // The current segment
  SegmentStart start_;
  Run run_;
  std::uint32_t last_block_ = 0;
  std::uint64_t given_vertices_ = 0;  // number of own vertices passed to encoders
  std::uint64_t given_cells_ = 0;
  SegmentPiece piece_;
  bool segment_begun_ = false;
  std::unique_ptr<ChoosingEncoder> encoder_;  // used without threads
  std::vector<EncodedGroup> done_;
  std::unique_ptr<OrderedTasks<SegmentPiece, EncodedGroup>> tasks_;  // used with threads

  // Stream numbers, by ticket, of vertices that a segment may import; not used in Order::keep. A
  // ticket becomes free when the group with the last use of its vertex has been written.
  std::vector<std::uint64_t> tickets_;
  std::vector<std::uint32_t> free_tickets_;
  std::deque<std::pair<std::uint64_t, std::uint32_t>>
      ending_tickets_;  // for each ticket that ends: number of the cell with the last use, and the
                        // ticket
  std::uint32_t segment_given_out_ = 0;
  NumberColumn<RangeEncoder> import_numbers_;
  RangeEncoder import_coder_;

  // Used only for a part
  bool holds_groups_ = false;
  std::vector<EncodedGroup> held_;
  std::vector<std::uint32_t> foreign_tickets_;

  container::Index totals_;
};

/// Returns the schema to store in a file written with these options. Fails with ErrorCode::misuse
/// if the schema or the options are invalid.
Result<Schema> schema_of_file(Schema schema, const WriteOptions& options);

}  // namespace shm
