// ShiftGroupDecoder: decodes the groups of a segment that is coded as shifts. It is the counterpart
// of shift_segment_encoder.h.
// spec: "Shifts", "Values as differences"
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "codecs/shared/group_decoder.h"
#include "codecs/shifts/difference_column.h"
#include "codecs/shifts/imported_numbers.h"
#include "codecs/shifts/live_numbers.h"
#include "codecs/shifts/shift_neighbours.h"
#include "codecs/shifts/shifts.h"
#include "codecs/surface/cells/number_column.h"
#include "codecs/surface/values/column_coder.h"
#include "entropy/range_coder.h"

namespace shm {

class ShiftGroupDecoder final : public GroupDecoder {
 public:
  /// Precondition: takes_shifts(schema).
  ShiftGroupDecoder(const Schema& schema, const SegmentStart& start, const DecodedParts& parts,
                    CellBytes cell_bytes);

  Result<void> begin_plain_stream(const container::StreamEntry& entry, Codec codec,
                                  std::span<const std::byte> bytes) override;
  std::vector<std::uint64_t> alive() const override { return live_.own(); }
  Items items() const override { return {vertex_items_, cell_items_}; }
  std::uint32_t slots() const override { return neighbours_.slots(); }

 private:
  Result<void> begin_streams(std::optional<ConnectivityCodec> codec) override;
  Result<void> begin_connectivity(std::span<const std::byte> bytes, std::uint64_t decoded_bytes);
  Result<void> begin_column(const container::StreamEntry& entry, Codec codec,
                            std::span<const std::byte> bytes, std::uint64_t decoded_bytes);
  Result<void> decode_elements(DecodedBlock& decoded) override;
  bool decode_column(std::size_t column, const MeshBlock& block,
                     std::vector<std::byte>& out) override;
  bool is_used_up() const override;

  Result<void> decode_cells(DecodedBlock& decoded);
  std::size_t decode_alike(DecodedBlock& decoded, std::size_t cell, std::size_t most);
  bool count_run(const CellMarks& marks, std::span<const std::uint64_t> numbers, std::size_t count,
                 std::uint64_t& introduced, std::uint64_t& finalized);
  bool take_run(const CellMarks& marks, std::span<const std::uint64_t> numbers, std::size_t count,
                DecodedBlock& decoded);
  bool introduce_and_finalize(const CellMarks& marks, std::span<const std::uint64_t> numbers,
                              DecodedBlock& decoded);
  bool introduce(std::uint64_t number, bool imported, DecodedBlock& decoded);
  void name_imports(std::vector<std::uint64_t>& corners);

  bool names_imports_;  // true: imported vertices receive their stream numbers
  ShiftDecoder shifts_;
  std::vector<DifferenceColumn> columns_;
  std::vector<std::unique_ptr<ColumnDecoder>>
      predicted_;  // columns that predict from neighbourhoods; empty until a group has
                   // neighbourhoods

  // For each column: 1 if its values in the current group are predicted from neighbourhoods
  std::vector<std::uint8_t> is_predicted_;
  ShiftNeighbours neighbours_;
  bool has_neighbours_ = false;  // true: the current group has neighbourhoods
  DifferenceScratch scratch_;
  ZstdDecompressor zstd_;
  std::size_t next_column_ = 0;
  std::size_t most_cell_bytes_ = 0;
  LiveNumbers live_;
  std::array<std::size_t, kMostShiftNodes>
      hints_{};  // for each node of a cell: hint for the next lookup in live_, the table index
                 // found by the previous lookup for this node

  // The following members are used only if vertices are numbered in coding order.
  std::uint64_t next_own_, next_import_ = kFirstImport;
  ImportedNumbers imports_;
  // Import numbers of finalized vertices. They stay in imports_ until the end of the block, because
  // cells of the block may still contain them
  std::vector<std::uint64_t> finalized_;
  NumberColumn<RangeDecoder> import_numbers_;
  RangeDecoder import_coder_{std::span<const std::byte>()};

  // Data of the current block
  std::vector<std::uint64_t> new_numbers_;  // numbers of the vertices that the block adds,
                                            // including imported and unused vertices
  std::vector<std::uint64_t> cells_;  // numbers of the cells that have a value in the current array
  std::vector<Neighbourhood> vertex_items_, cell_items_;
};

}  // namespace shm
