// ChoosingEncoder: a SegmentEncoder that tries the codecs of hexahedra on the first cells of its
// segment and goes on with the one that makes them smallest, values and all.
// It decides by coded cells alone: the same for any number of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "segment_encoder.h"

namespace shm {

/// Cells of a segment on which codecs are tried; the whole segment if it is shorter.
inline constexpr std::size_t kTrialCells = 16384;

/// Codecs to choose from.
struct CodecTrial {
  std::span<const HexahedronCodec> codecs;  ///< not empty, static, the fastest first
  /// Where there are more than kTrialCells, a codec must be smaller than a faster one by one part
  /// in so many of the bytes.
  std::uint64_t gain = 128;
};

class ChoosingEncoder {
 public:
  /// `schema` is checked and borrowed. Of one codec nothing is tried.
  ChoosingEncoder(const Schema& schema, std::uint32_t group_cells, const CodecTrial& trial,
                  const SegmentStart& start);

  /// Codes the cells of `piece`, and adds the groups that they complete to `done`.
  Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done);
  /// Adds what is left.
  Result<void> end(std::vector<EncodedGroup>& done);

 private:
  Result<void> choose(std::vector<EncodedGroup>& done);
  Result<std::uint64_t> bytes_with(HexahedronCodec codec) const;

  const Schema* schema_;
  std::uint32_t group_cells_;
  CodecTrial trial_;
  SegmentStart start_;
  std::vector<SegmentPiece> sample_;
  std::size_t sample_cells_ = 0;
  std::unique_ptr<SegmentEncoder> encoder_;  // once chosen
};

}  // namespace shm
