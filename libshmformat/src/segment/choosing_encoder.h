// ChoosingEncoder: a SegmentEncoder that tries the codecs of hexahedra on the first cells of its
// segment, with their coordinates and values, whose order a codec decides, and goes on with the
// one that makes these smallest. It decides by these alone: the same for any number of threads.
//
// The codecs race. In the first round all of them code the connectivity of a few cells; in the next
// ones those that were not clearly larger go on to more cells, and those that are still close to
// the end of the sample. The winner goes on from there: its cells are not coded twice. What values
// take is estimated, for one codec in the first round, then for each where they differ, and then
// taken to grow as they did. They are coded to see what they take only beside shifts, which
// estimates do not tell from others well, and at level best where the sample is all of the segment.
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
  /// A codec in the race. What it has coded is kept: that of the winner is what is written.
  struct Runner {
    ConnectivityCodec codec = ConnectivityCodec::rows;
    std::unique_ptr<SegmentEncoder> encoder{};
    std::size_t taken = 0;  ///< pieces of the sample
    std::vector<EncodedGroup> done{};
    SegmentSize size{};             ///< about, in the last round
    std::uint64_t value_bytes = 0;  ///< of its values, before they are coded
  };

  /// What values of the runners take in a round.
  enum class Values : std::uint8_t {
    grown,  ///< as those of all have since the round before
    estimated,
    estimated_last,  ///< for the last time
  };

  /// `is_over`: the sample is all of the segment.
  Result<void> choose(bool is_over, std::vector<EncodedGroup>& done);
  std::unique_ptr<SegmentEncoder> encoder_with(ConnectivityCodec codec) const;
  Result<void> advance(Runner& runner, std::size_t pieces) const;
  Result<void> go_on_with(Runner& runner, std::vector<EncodedGroup>& done);
  Result<Runner> smallest(bool is_over);
  Result<Runner> finish_race(std::vector<Runner>& runners, bool is_over);
  Result<bool> shifts_do(Runner& shifts) const;
  Result<bool> shifts_are_as_small(Runner& shifts, Runner& other) const;
  bool lies_in_a_layer() const;
  std::uint64_t value_bytes(std::size_t pieces) const;
  std::vector<ConnectivityCodec> candidates() const;
  static std::size_t have_values_of_their_own(std::span<const Runner> runners);
  static Runner* find(std::span<Runner> runners, ConnectivityCodec codec);
  static std::uint64_t coded_values(Runner& runner);
  Result<void> run(std::vector<Runner>& runners, std::size_t pieces, Values values,
                   bool mixes) const;
  void drop(std::vector<Runner>& runners, ConnectivityCodec codec);
  void settle_mixing(std::vector<Runner>& runners, bool finally);
  bool mixing_can_pay(const SegmentSize& other) const;
  Runner& best_of(std::span<Runner> runners) const;
  bool is_better(const Runner& it, const Runner& faster) const;
  bool is_worth_it(const SegmentSize& smaller, const SegmentSize& faster) const;

  const Schema* schema_;
  std::uint32_t group_cells_;
  CodecTrial trial_;
  SegmentStart start_;
  std::vector<SegmentPiece> sample_;
  std::size_t sample_cells_ = 0;
  Runner shifts_{ConnectivityCodec::shifts};  // where they have left the race
  std::unique_ptr<SegmentEncoder> encoder_;   // once chosen
};

}  // namespace shm
