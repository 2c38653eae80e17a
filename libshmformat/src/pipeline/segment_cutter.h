// SegmentCutter: decides where segments end. The decision depends only on counts of added vertices
// and cells, so that the same calls produce the same bytes. Groups end within the segment encoder
// (codecs/shared/segment_encoder.h).
// spec: "Segments"
#pragma once

#include <cstdint>

#include "shm/options.h"

namespace shm {

class SegmentCutter {
 public:
  /// `options` must outlive the cutter.
  explicit SegmentCutter(const WriteOptions& options) : options_(&options) {}

  /// Returns true if a segment begins before the next cell, which belongs to `block` and has number
  /// `cell`.
  bool is_due(std::uint32_t block, std::uint64_t cell) const;
  void begin_segment() { cells_ = introduced_ = 0; }

  /// Counts a cell that introduces `introduced` vertices and ends `ended` vertices.
  void add_cell(std::uint32_t block, std::uint64_t introduced, std::uint64_t ended) {
    block_ = block;
    ++cells_;
    introduced_ += introduced;
    live_ += introduced;
    live_ -= ended;
  }
  /// Counts a vertex that an earlier part has introduced.
  void add_import() { ++live_; }

 private:
  const WriteOptions* options_;
  std::uint64_t live_ = 0;   // number of vertices that a cell has used and that are not finalized
  std::uint32_t block_ = 0;  // block of the last cell
  // Counts of the current segment
  std::uint64_t cells_ = 0;  // number of cells added, both coded and waiting
  std::uint64_t introduced_ =
      0;  // number of vertices that cells of the segment use and no earlier cell has used
};

}  // namespace shm
