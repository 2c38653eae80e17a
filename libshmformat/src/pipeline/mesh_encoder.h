// MeshEncoder: takes vertices and cells, gives out chunk groups. It checks what the caller adds,
// holds what the active surface and the delay buffer need, decides where segments begin, and gives
// out the groups of the segment encoders in order. The mirror of mesh_decoder.h.
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
  /// before anything is added. Groups are then held until give_out_part(), except in Order::keep.
  void begin_part(const SegmentStart& start);

  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data);
  /// Adds a vertex that a segment before this part owns. Only for a part that does not begin with
  /// segment 0.
  Result<void> add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                   std::span<const std::byte> data);
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data);
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use, std::span<const std::byte> data);
  /// Returns true if nothing has been added.
  bool is_new() const { return totals_.cells == 0 && entries_.empty(); }

  // The same for callers that keep track of entries: numbers are neither looked up nor checked.
  /// Returns the entry that cells use for the vertex until its last use. `xyz` and `data` have the
  /// sizes of the schema.
  std::uint32_t enter_vertex(std::uint64_t number, const std::byte* xyz, const std::byte* data);
  /// add_cell() with entries that have not ended. The numbers of nodes and bytes fit the block.
  Result<void> enter_cell(std::uint32_t block, std::span<const std::uint32_t> entries,
                          std::uint64_t last_use, std::span<const std::byte> data);

  Result<void> end();
  /// Gives out all groups that are complete. Which groups these are depends on the calls alone.
  Result<void> catch_up();
  /// Gives out all groups of a part after end(), except in Order::keep. `numbers` are the stream
  /// numbers of its imported vertices, in the order of add_imported_vertex().
  Result<void> give_out_part(std::span<const std::uint64_t> numbers);
  std::size_t imported() const { return foreign_tickets_.size(); }

  const container::Index& totals() const { return totals_; }

 private:
  /// A vertex that the caller may still name.
  struct Entry {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
    std::uint32_t waiting : 30 = 0;  // number of uses by cells in the delay buffer
    bool used : 1 = false;           // true: some cell has used it
    bool ends : 1 = false;           // true: only waiting cells will still use it
    bool named = false;              // true: by_number_ contains it
  };
  struct WaitingCell {
    std::uint64_t number = 0;
    std::uint32_t block = 0;
    std::vector<std::uint32_t> entries;
    std::vector<std::byte> data;
  };
  /// Counts of the current segment, for the cut rule.
  struct Run {
    std::uint64_t cells = 0;       // cells added, whether coded or waiting
    std::uint64_t introduced = 0;  // vertices that no cell had used before
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
  /// `may_end`: the nodes, as bits, whose last use it may be.
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
  std::vector<std::size_t> cell_data_bytes_;  // by block

  // Everything added so far
  std::vector<Entry> entries_;
  /// The last segment that each entry was given to. It is kept apart because each cell reads it.
  std::vector<std::uint32_t> in_segment_;
  std::vector<std::byte> values_;  // coordinates and point data of each entry
  std::vector<std::uint32_t> free_entries_;
  NumberMap by_number_;
  std::uint64_t live_ = 0;  // vertices used by a cell and not finalized
  std::vector<std::uint32_t> cell_entries_;
  std::optional<SpiralReorderer> reorderer_;  // set if cells may be delayed
  std::vector<WaitingCell> cells_;
  std::vector<std::uint32_t> free_cells_;

  // The current segment
  SegmentStart start_;
  Run run_;
  std::uint32_t last_block_ = 0;
  std::uint64_t given_vertices_ = 0;  // own vertices passed to encoders
  std::uint64_t given_cells_ = 0;
  SegmentPiece piece_;
  bool segment_begun_ = false;
  std::unique_ptr<ChoosingEncoder> encoder_;  // without threads
  std::vector<EncodedGroup> done_;
  std::unique_ptr<OrderedTasks<SegmentPiece, EncodedGroup>> tasks_;  // with threads

  // Stream numbers, by ticket, of vertices that a segment may import; unused in Order::keep. A
  // ticket is free again when the group with the vertex's last use has been given out.
  std::vector<std::uint64_t> tickets_;
  std::vector<std::uint32_t> free_tickets_;
  std::deque<std::pair<std::uint64_t, std::uint32_t>>
      ending_tickets_;  // the cell of its last use, and the ticket
  std::uint32_t segment_given_out_ = 0;
  NumberColumn<RangeEncoder> import_numbers_;
  RangeEncoder import_coder_;

  // For a part
  bool holds_groups_ = false;
  std::vector<EncodedGroup> held_;
  std::vector<std::uint32_t> foreign_tickets_;

  container::Index totals_;
};

/// Returns the schema to store in a file written with these options, or misuse if either is
/// invalid.
Result<Schema> schema_of_file(Schema schema, const WriteOptions& options);

}  // namespace shm
