// MeshEncoder: vertices and cells in, chunk groups out. Checks what the caller gives, holds what
// the active surface and the delay buffer need, decides where segments begin, and gives the groups
// of their encoders out in order. The mirror of mesh_decoder.h.
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

#include "bytes/ordered_tasks.h"
#include "connectivity/spiral_reorderer.h"
#include "segment/choosing_encoder.h"
#include "shm/writer.h"
#include "surface/number_map.h"

namespace shm {

class MeshEncoder {
 public:
  /// Receives a finished group of a segment: header, and the bitstreams that it lists, in order.
  using GroupSink = std::function<Result<void>(std::uint32_t, const container::GroupHeader&,
                                               const std::vector<std::vector<std::byte>>&)>;

  /// `schema` is checked and borrowed.
  MeshEncoder(const Schema& schema, const WriteOptions& options, GroupSink sink);

  /// Before anything is added: the mesh is some segments of a larger one, from `start` on. Groups
  /// are then held until give_out_part(), but for Order::keep.
  void begin_part(const SegmentStart& start);

  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data);
  /// Of a part that does not begin with segment 0: a segment before it owns the vertex.
  Result<void> add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                   std::span<const std::byte> data);
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data);
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use, std::span<const std::byte> data);
  /// Nothing has been added.
  bool is_new() const { return totals_.cells == 0 && entries_.empty(); }

  // The same for who knows vertices by place: no numbers are looked up, nor checked.
  /// Returns the entry by which cells use the vertex until they end it; values have their sizes.
  std::uint32_t enter_vertex(std::uint64_t number, const std::byte* xyz, const std::byte* data);
  /// add_cell() of entered vertices that have not ended, and sizes that fit.
  Result<void> enter_cell(std::uint32_t block, std::span<const std::uint32_t> entries,
                          std::uint64_t last_use, std::span<const std::byte> data);

  Result<void> end();
  /// Gives out all groups that are complete by now: which these are depends on calls alone.
  Result<void> catch_up();
  /// After end(), of a part, not in Order::keep: the stream numbers of its imported vertices, in
  /// order of add_imported_vertex(). Gives out all groups.
  Result<void> give_out_part(std::span<const std::uint64_t> numbers);
  std::size_t imported() const { return foreign_tickets_.size(); }

  const container::Index& totals() const { return totals_; }

 private:
  /// A vertex that the caller may still name.
  struct Entry {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
    std::uint32_t waiting : 30 = 0;  // uses by cells in the delay buffer
    bool used : 1 = false;           // by a cell
    bool ends : 1 = false;           // no cell will use it but those waiting
    bool named = false;              // by_number_ has it
  };
  struct WaitingCell {
    std::uint64_t number = 0;
    std::uint32_t block = 0;
    std::vector<std::uint32_t> entries;
    std::vector<std::byte> data;
  };
  /// What the cut rule counts, of the segment at hand.
  struct Run {
    std::uint64_t cells = 0;       // added, coded or waiting
    std::uint64_t introduced = 0;  // vertices that no cell used before
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
  /// Whether it may be the first cell of one of its vertices in the segment; nodes whose last it
  /// is.
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

  // what has been added
  std::vector<Entry> entries_;
  /// Of each entry: the last segment that it was given to. Apart, since each cell asks for it.
  std::vector<std::uint32_t> in_segment_;
  std::vector<std::byte> values_;  // xyz and point data of each entry
  std::vector<std::uint32_t> free_entries_;
  NumberMap by_number_;
  std::uint64_t live_ = 0;  // vertices used by a cell and not finalized
  std::vector<std::uint32_t> cell_entries_;
  std::optional<SpiralReorderer> reorderer_;  // where cells may be delayed
  std::vector<WaitingCell> cells_;
  std::vector<std::uint32_t> free_cells_;

  // the segment at hand
  SegmentStart start_;
  Run run_;
  std::uint32_t last_block_ = 0;
  std::uint64_t given_vertices_ = 0;  // to encoders, own ones
  std::uint64_t given_cells_ = 0;
  SegmentPiece piece_;
  bool segment_begun_ = false;
  std::unique_ptr<ChoosingEncoder> encoder_;  // without threads
  std::vector<EncodedGroup> done_;
  std::unique_ptr<OrderedTasks<SegmentPiece, EncodedGroup>> tasks_;  // with threads

  // Stream numbers of vertices that a segment may import, by ticket; not in Order::keep. A ticket
  // is free again when the group with the vertex's last use has been given out.
  std::vector<std::uint64_t> tickets_;
  std::vector<std::uint32_t> free_tickets_;
  std::deque<std::pair<std::uint64_t, std::uint32_t>> ending_tickets_;  // with their last cell
  std::uint32_t segment_given_out_ = 0;
  NumberColumn<RangeEncoder> import_numbers_;
  RangeEncoder import_coder_;

  // of a part
  bool holds_groups_ = false;
  std::vector<EncodedGroup> held_;
  std::vector<std::uint32_t> foreign_tickets_;

  container::Index totals_;
};

/// The schema that stands in a file written with these options; misuse where either is wrong.
Result<Schema> schema_of_file(Schema schema, const WriteOptions& options);

}  // namespace shm
