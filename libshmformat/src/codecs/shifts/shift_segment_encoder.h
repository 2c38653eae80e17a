// ShiftSegmentEncoder: encodes the cells of a segment as shifts, and values as differences along
// element numbers. The encoder uses no active surface and finds neighbours by their numbers, so it
// is fast. It suits meshes whose vertices are numbered in rows and layers.
// spec: "Shifts", "Values as differences"
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "codecs/shared/segment_encoder.h"
#include "codecs/shifts/difference_column.h"
#include "codecs/shifts/shift_neighbours.h"
#include "codecs/shifts/shifts.h"
#include "codecs/surface/plan/column_planner.h"
#include "entropy/range_coder.h"

namespace shm {

class ShiftSegmentEncoder final : public SegmentEncoder {
 public:
  /// `schema` must have passed check_schema() and must outlive the encoder. Precondition:
  /// takes_shifts(schema).
  ShiftSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                      const SegmentStart& start);

 private:
  bool encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                   const Place& place) override;
  void encode_unused(const SegmentPiece& piece, std::size_t vertex) override;
  void encode_streams() override;
  void add_size_at_hand(SegmentSize& size) override;
  std::uint64_t values_at_hand(RatedDomains* rated) override;
  std::uint64_t number_of(const SegmentPiece::Vertex& vertex) const;
  void take_numbered(const SegmentPiece& piece, std::size_t index, std::uint64_t number);
  void note_lags();
  std::vector<std::uint32_t> cell_lags() const;
  bool predicts() const { return !predicted_.empty(); }
  void begin_element(bool is_cell);
  std::uint32_t ring_bits() const;
  void find_neighbours(std::span<const std::byte> shifts);
  void add_columns();
  void choose_lags();
  std::vector<std::uint64_t> numbers_of_cells(std::size_t column) const;
  void add_column(std::size_t column, std::span<const std::uint64_t> numbers);

  bool numbered_by_order_;
  ShiftEncoder shifts_;
  std::vector<DifferenceColumn> columns_;
  std::vector<std::unique_ptr<ColumnPlanner>> predicted_;  // predicted columns; empty at level fast

  // Decoder for the bitstreams of the encoded groups. Decoding the cells again when they are needed
  // takes less memory and time than storing them.
  ShiftDecoder decoder_;
  ShiftNeighbours neighbours_;
  // True if the encoder must find neighbourhoods, either to predict the static values of the groups
  // or because the file has stepped arrays
  bool has_rings_ = false;
  DifferenceScratch scratch_;
  ZstdCompressor packing_;
  ZstdDecompressor unpacking_;

  std::vector<std::uint64_t> number_of_;  // vertex numbers by handle
  std::vector<std::uint64_t> corners_;    // vertex numbers of the current cell, by corner
  std::uint64_t active_ = 0;

  // Data of the current group
  std::vector<std::uint64_t>
      introduced_;  // numbers of the introduced vertices, including imported and unused vertices
  std::vector<std::uint32_t> cell_blocks_;
  TiledItems vertices_, cells_;
  std::vector<std::uint32_t> by_vertex_, by_cell_;  // lags for vertices and for cells, ascending
  struct Lag {
    std::uint64_t lag = 0, weight = 0;
  };
  std::vector<Lag> lags_;                    // differences between the vertex numbers within a cell
  std::array<std::uint32_t, 65> spreads_{};  // for each bit length: number of cells whose range of
                                             // vertex numbers has this bit length

  std::uint64_t next_own_, next_import_ = kFirstImport;
};

}  // namespace shm
