// ChoosingEncoder: codes one segment. It tries several codecs of hexahedra on the first cells of
// the segment and continues with the codec that needs the fewest bytes. The bytes of coordinates
// and values count too, because the codec determines the order in which they are coded. The choice
// depends only on these sizes, so it is the same for any number of threads.
//
// The codecs compete in a race of several rounds. In the first round, all codecs code the
// connectivity of a few cells. After each round, a codec whose result is clearly larger than the
// smallest result drops out. The remaining codecs code more cells in the next round, up to the end
// of the sample. The winner continues after the sample, so its cells are not coded twice.
//
// The size of the values is estimated: for one codec in the first round, then for each codec whose
// values differ. In later rounds the size is assumed to grow in proportion to the uncompressed
// size. Values are coded to measure their size only in two cases. One case is that shifts compete,
// which estimates do not distinguish well from other codecs. The other case is level best, if the
// sample is the whole segment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "codecs/shared/segment_encoder.h"

namespace shm {

/// Codecs to try, and the rules of choice.
struct CodecTrial {
  Level level = Level::standard;  ///< level of the value coders
  bool with_order = true;         ///< true: groups report the coding order of their elements
  std::vector<ConnectivityCodec> codecs;  ///< codecs to try, the fastest first; not empty

  /// Way in which the shifts codec is tried. It qualifies if its cells need almost no bytes.
  enum class Shifts : std::uint8_t {
    no,
    for_speed,  ///< shifts are chosen whenever they qualify
    for_size,   ///< shifts, which are faster, are chosen if they qualify and their values are about
                ///< as small as with other codecs
  };
  Shifts shifts = Shifts::no;
  /// Number of cells at the beginning of a segment on which codecs are tried. If a segment has
  /// fewer cells, the sample is the whole segment.
  std::size_t sample_cells = 16384;
  // Savings that a slower codec needs in a segment longer than the sample. It must save more than
  // one bit per `spare_bits` cells. It must also save more than one part in `spare_share` of all
  // bytes, or more than one bit of connectivity and vertex numbers per `spare_bits` cells.
  std::uint64_t spare_share = 128;
  std::uint64_t spare_bits = 32;
};

/// Returns the codecs to try at `level`, the fastest first. If `codec` is not automatic, it is the
/// only codec to try.
CodecTrial trial_for(const Schema& schema, ConnectivityCodec codec, Level level);

class ChoosingEncoder {
 public:
  /// Creates an encoder of one segment. `schema` has passed check_schema() and must outlive the
  /// encoder. If `trial` has a single codec, the encoder uses that codec from the first cell on.
  ChoosingEncoder(const Schema& schema, std::uint32_t group_cells, const CodecTrial& trial,
                  const SegmentStart& start);

  /// Codes the cells of `piece`, and appends the groups that they complete to `done`.
  Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done);
  /// Ends the segment and appends its remaining groups to `done`.
  Result<void> end(std::vector<EncodedGroup>& done);

 private:
  /// Codec in the race. Its groups are stored here, since the groups of the winner are written to
  /// the file.
  struct Runner {
    ConnectivityCodec codec = ConnectivityCodec::rows;
    std::unique_ptr<SegmentEncoder> encoder{};
    std::size_t taken = 0;  ///< number of pieces of the sample that this codec has coded so far
    std::vector<EncodedGroup> done{};
    SegmentSize size{};  ///< approximate size after the last round of this codec
    /// Uncompressed size in bytes of the values in the pieces coded so far.
    std::uint64_t value_bytes = 0;
  };

  /// Way in which a round determines the size of the runners' values.
  enum class Values : std::uint8_t {
    grown,  ///< the size is assumed to grow in proportion to the uncompressed size since the last
            ///< round
    estimated,
    estimated_last,  ///< the size is estimated for the last time: later rounds do not estimate
  };

  /// Runs the race and sets the encoder of the winner. `is_over` is true if the sample is the whole
  /// segment.
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
  bool is_better(const Runner& smaller, const Runner& faster) const;
  bool is_worth_it(const SegmentSize& smaller, const SegmentSize& faster) const;

  const Schema* schema_;
  std::uint32_t group_cells_;
  CodecTrial trial_;
  SegmentStart start_;
  std::vector<SegmentPiece> sample_;
  std::size_t sample_cells_ = 0;
  Runner shifts_{ConnectivityCodec::shifts};  // shifts runner after it has left the race
  std::unique_ptr<SegmentEncoder> encoder_;   // encoder of the chosen codec
};

}  // namespace shm
