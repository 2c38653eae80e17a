// ShiftSegmentDecoder: the groups of a segment whose cells are shifts. The mirror of
// shift_segment_encoder.h; what all segments share is in segment_decoder.h.
// spec: "Shifts", "Values as differences"
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "connectivity/number_column.h"
#include "container/format.h"
#include "entropy/range_coder.h"
#include "segment/decoded_block.h"
#include "segment/segment_start.h"
#include "segment/wanted_values.h"
#include "shifts/difference_column.h"
#include "shifts/shift_neighbours.h"
#include "shifts/shifts.h"
#include "surface/imported_numbers.h"
#include "surface/live_numbers.h"
#include "values/value_column.h"

namespace shm {

class ShiftSegmentDecoder {
 public:
  /// What is wrong with the data; empty: nothing.
  using Complaint = std::string;

  /// `schema` is checked, borrowed, and takes shifts. Values that are not wanted stay undecoded.
  ShiftSegmentDecoder(const Schema& schema, const SegmentStart& start, const WantedValues& wanted);

  /// A group begins: its header (borrowed for the group), then each of its streams in order.
  void begin_group(const container::GroupHeader& header);
  /// Whether the group may have this stream here.
  bool expects(const container::StreamEntry& entry) const;
  /// Whether it may be in this codec. Must hold: expects().
  bool takes(const container::StreamEntry& entry) const;
  Complaint take(const container::StreamEntry& entry, std::span<const std::byte> bytes);

  /// Some thousand cells, or loose vertices, added to `decoded`.
  Complaint next_block(DecodedBlock& decoded, GroupProgress& done, bool yields_imports);
  /// Whether the streams had no more than the group.
  bool at_end() const;

  std::vector<std::uint64_t> alive() const { return live_.own(); }

 private:
  Complaint next_cells(DecodedBlock& decoded, GroupProgress& done);
  bool bear_and_finalize(const CellMarks& marks, std::span<const std::uint64_t> numbers,
                         DecodedBlock& decoded, GroupProgress& done);
  bool run_at_once(const CellMarks& marks, std::span<const std::uint64_t> numbers,
                   std::size_t count, DecodedBlock& decoded, GroupProgress& done);
  bool bear(std::uint64_t number, bool imported, DecodedBlock& decoded, GroupProgress& done);
  void name_imports(std::vector<std::uint64_t>& corners);
  Complaint next_values(MeshBlock& block);
  std::size_t column_of(const container::StreamEntry& entry) const;
  bool of_cells(std::size_t column) const {
    return column > 0 && schema_->arrays[arrays_[column - 1]].location == Location::cell;
  }
  Complaint take_connectivity(std::span<const std::byte> bytes, std::uint64_t decoded_bytes);
  bool decode_predicted(std::size_t column, const MeshBlock& block, std::vector<std::byte>& out);
  bool decode_bulk(std::size_t column, const MeshBlock& block, std::vector<std::byte>& out);

  const Schema* schema_;
  const WantedValues wanted_;
  bool may_import_, numbered_by_birth_, yields_imports_ = false;
  const container::GroupHeader* header_ = nullptr;
  ShiftDecoder shifts_;
  std::vector<DifferenceColumn> columns_;
  std::vector<std::unique_ptr<ValueColumn<SplitDecoder>>> predicted_;  // once there are some
  std::vector<std::uint8_t> is_predicted_;  // in the group at hand, by column
  ShiftNeighbours neighbours_;
  bool has_neighbours_ = false;  // the group at hand
  DifferenceScratch scratch_;
  std::vector<std::uint32_t> arrays_;  // of the columns, from 1 on
  std::size_t next_column_ = 0;
  std::size_t vertex_bytes_ = 0, most_cell_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // by block
  LiveNumbers live_;
  std::array<std::size_t, kMostShiftNodes>
      hints_{};  // by node: where its number stood the last time

  // where vertices are numbered by birth
  std::uint64_t first_own_, next_own_, next_import_ = kFirstImport;
  ImportedNumbers imports_;
  std::vector<std::uint64_t> dead_imports_;  // that cells of the block at hand may have used
  NumberColumn<RangeDecoder> import_numbers_;
  RangeDecoder import_coder_{std::span<const std::byte>()};

  // of the block at hand
  std::vector<std::uint64_t> born_;     // imported and loose ones too
  std::vector<std::uint8_t> left_out_;  // of these: whether imported, where these are not yielded
  std::vector<std::uint64_t> cells_;    // that an array covers
  std::vector<Neighbourhood> vertex_items_, cell_items_;
};

}  // namespace shm
