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
/// Below this nothing is tried: what is left to gain are bytes.
inline constexpr std::size_t kFewestTrialCells = 1024;

class ChoosingEncoder {
 public:
  /// `schema` is checked and borrowed. `codecs`: not empty, static; the first one wins a tie, and
  /// where there is only one nothing is tried.
  ChoosingEncoder(const Schema& schema, std::uint32_t group_cells,
                  std::span<const HexahedronCodec> codecs, const SegmentStart& start);

  /// Codes the cells of `piece`, and adds the groups that they complete to `done`.
  Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done);
  /// Adds what is left.
  Result<void> end(std::vector<EncodedGroup>& done);

 private:
  Result<void> choose(std::vector<EncodedGroup>& done);
  Result<std::uint64_t> bytes_with(HexahedronCodec codec) const;

  const Schema* schema_;
  std::uint32_t group_cells_;
  std::span<const HexahedronCodec> codecs_;
  SegmentStart start_;
  std::vector<SegmentPiece> sample_;
  std::size_t sample_cells_ = 0;
  std::unique_ptr<SegmentEncoder> encoder_;  // once chosen
};

}  // namespace shm
