// ChoosingEncoder: a SegmentEncoder that tries the codecs of hexahedra on the first cells of its
// segment, with their coordinates and values, whose order a codec decides, and goes on with the
// one that makes these smallest. It decides by these alone: the same for any number of threads.
//
// The codecs race. In the first round all of them code the connectivity of a few cells, and one of
// them the values; in the next ones those that were not clearly larger code more cells, with values
// where these differ; in the last one those that are still close code the connectivity of the whole
// sample, and at level best its values. Values that are not coded are taken to grow as they did.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "groups/segment_encoder.h"

namespace shm {

/// Codecs to choose from.
struct CodecTrial {
  Level level = Level::standard;          ///< of values
  bool with_order = true;                 ///< as in SegmentOptions
  std::vector<ConnectivityCodec> codecs;  ///< not empty, the fastest first
  /// Shifts are tried besides, where cells of them are hardly felt.
  enum class Shifts : std::uint8_t {
    no,
    for_speed,  ///< and taken
    for_size,   ///< and taken where the values over them are about as small: they are quicker
  };
  Shifts shifts = Shifts::no;
  /// Cells of a segment on which they are tried; the whole segment if it is shorter.
  std::size_t sample_cells = 16384;
  // Where there are more cells than that, a faster codec is preferred to one that saves at most
  // this much:
  std::uint64_t spare_share = 128;  ///< one part of all bytes in so many, and
  std::uint64_t spare_bits = 32;    ///< one bit of connectivity and numbers in so many cells;
                                    ///< or no more than such a bit of everything
};

/// What to try at a level, the fastest first; a codec that is not automatic alone.
CodecTrial trial_for(const Schema& schema, ConnectivityCodec codec, Level level);

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
  std::unique_ptr<SegmentEncoder> encoder_with(ConnectivityCodec codec) const;
  Result<ConnectivityCodec> smallest() const;
  Result<bool> shifts_do() const;
  Result<bool> shifts_are_as_small(ConnectivityCodec other) const;
  bool lies_in_a_layer() const;
  /// Bytes of pieces of the sample.
  struct Size {
    std::uint64_t topology = 0;     ///< connectivity, corner order, vertex numbers
    std::uint64_t values = 0;       ///< coordinates and arrays, with the heads of their streams
    std::uint64_t besides = 0;      ///< imports, and other heads
    std::uint64_t value_bytes = 0;  ///< before they are coded; not always stated
    std::uint64_t all() const { return topology + values + besides; }
  };
  /// With values at the level of the trial or without.
  Result<Size> size_with(ConnectivityCodec codec, std::size_t pieces, bool values) const;
  std::uint64_t value_bytes(std::size_t pieces) const;
  std::vector<ConnectivityCodec> candidates() const;
  /// A codec in the race, and what it made in the last round.
  struct Runner {
    ConnectivityCodec codec = ConnectivityCodec::rows;
    Size size;
  };
  static std::size_t have_values_of_their_own(std::span<const Runner> runners);
  Result<void> run(std::vector<Runner>& runners, std::size_t pieces, bool values, bool mixes) const;
  void settle_mixing(std::vector<Runner>& runners) const;
  bool mixing_can_pay(const Size& other) const;
  ConnectivityCodec best_of(std::span<const Runner> runners) const;
  bool is_worth_it(const Size& smaller, const Size& faster) const;

  const Schema* schema_;
  std::uint32_t group_cells_;
  CodecTrial trial_;
  SegmentStart start_;
  std::vector<SegmentPiece> sample_;
  std::size_t sample_cells_ = 0;
  std::unique_ptr<SegmentEncoder> encoder_;  // once chosen
};

}  // namespace shm
