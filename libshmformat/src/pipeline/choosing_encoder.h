// ChoosingEncoder: codes one segment. It tries several cell codecs on the first cells of the
// segment, and continues with the codec that needs the fewest bytes. The bytes of coordinates and
// arrays are counted, too, since the codec determines the order in which they are coded. The choice
// depends only on these sizes, so it is the same for any number of threads.
//
// The codecs compete in a race of several rounds. In the first round, each codec codes the
// connectivity of a few cells. After each round, codecs drop out if their size is clearly larger
// than the smallest size. The remaining codecs code more cells in the next round, up to the end of
// the sample. The winner continues after the sample, and does not code the sample again.
//
// The size of the values (coordinates and arrays) is estimated: in the first round for one codec
// only, in later rounds for each codec whose values differ. After these rounds, the size is assumed
// to grow in proportion to the uncompressed size. The values are coded to measure their size only
// in two cases: if the shifts codec competes, because estimates cannot reliably compare it with
// other codecs; and at level best, if the sample is the whole segment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "codecs/shared/segment_encoder.h"

namespace shm {

/// The codecs to try, and the rules by which a codec is chosen.
struct CodecTrial {
  Level level = Level::standard;  ///< level of the value coders
  bool with_order = true;         ///< true if groups also store the coding order of their elements
  bool with_digest = false;       ///< true if groups have digests
  std::vector<ConnectivityCodec> codecs;  ///< codecs to try, from the fastest to the slowest; not
                                          ///< empty

  /// Rule for the choice of the shifts codec. The codec qualifies if its cells need almost no
  /// bytes.
  enum class Shifts : std::uint8_t {
    no,
    for_speed,  ///< the shifts codec is chosen whenever it qualifies
    for_size,   ///< the shifts codec is chosen if it qualifies and its values need about as few
                ///< bytes as those of other codecs
  };
  Shifts shifts = Shifts::no;
  /// Number of cells in the sample. The sample is the beginning of a segment, and codecs are tried
  /// on it. If a segment is shorter, the sample is the whole segment.
  std::size_t sample_cells = 16384;
  /// Number of threads that may code the sample. Each codec is coded by one thread.
  unsigned threads = 1;
};

/// Returns the codecs to try at `level`, from the fastest to the slowest. If `codec` is not
/// `automatic`, the list contains only `codec`.
CodecTrial trial_for(const Schema& schema, ConnectivityCodec codec, Level level);

class ChoosingEncoder {
 public:
  /// Creates an encoder of one segment. `schema` must have passed check_schema() and must outlive
  /// the encoder. If `trial` has only one codec, that codec is used from the first cell on.
  ChoosingEncoder(const Schema& schema, std::uint32_t group_cells, const CodecTrial& trial,
                  const SegmentStart& start);

  /// Codes the cells of `piece`. Appends the groups that become complete to `done`.
  Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done);
  /// Ends the segment. Appends its remaining groups to `done`.
  Result<void> end(std::vector<EncodedGroup>& done);

 private:
  /// A codec that takes part in the race, with its encoder. The encoded groups are stored, because
  /// the groups of the winner are written to the file.
  struct Runner {
    ConnectivityCodec codec = ConnectivityCodec::rows;
    std::unique_ptr<SegmentEncoder> encoder{};
    std::size_t taken = 0;  ///< number of pieces of the sample that this runner has coded
    std::vector<EncodedGroup> done{};
    SegmentSize size{};  ///< approximate size of the coded pieces, as measured most recently
    /// Uncompressed size in bytes of the values in the coded pieces.
    std::uint64_t value_bytes = 0;
  };

  /// How a round determines the size of the values.
  enum class Values : std::uint8_t {
    grown,  ///< no estimate: the size grows in proportion to the uncompressed size
    estimated,
    estimated_last,  ///< like `estimated`, but this is the final estimate: later rounds use `grown`
  };

  /// Runs the race, and sets encoder_ to the encoder of the winner. `is_over`: true if the sample
  /// is the whole segment.
  Result<void> choose(bool is_over, std::vector<EncodedGroup>& done);
  std::unique_ptr<SegmentEncoder> encoder_with(ConnectivityCodec codec) const;
  Result<void> advance(Runner& runner, std::size_t pieces) const;
  template <class Work>
  Result<void> for_each(std::span<Runner> runners, const Work& work) const;
  Result<void> go_on_with(Runner& runner, std::vector<EncodedGroup>& done);
  Result<Runner> smallest(bool is_over);
  Result<Runner> finish_race(std::vector<Runner>& runners, bool is_over);
  Result<bool> shifts_do(Runner& shifts) const;
  Result<bool> shifts_are_as_small(Runner& shifts, Runner& other) const;
  bool lies_in_a_layer() const;
  std::uint64_t value_bytes(std::size_t pieces) const;
  std::vector<ConnectivityCodec> candidates(bool is_over) const;
  static Runner* find(std::span<Runner> runners, ConnectivityCodec codec);
  static std::uint64_t coded_values(Runner& runner);
  Result<void> run(std::vector<Runner>& runners, std::size_t pieces, Values values) const;
  void drop(std::vector<Runner>& runners, ConnectivityCodec codec);
  Runner& best_of(std::span<Runner> runners) const;

  const Schema* schema_;
  std::uint32_t group_cells_;
  CodecTrial trial_;
  SegmentStart start_;
  std::vector<SegmentPiece> sample_;
  std::size_t sample_cells_ = 0, sample_vertices_ = 0;
  Runner shifts_{ConnectivityCodec::shifts};  // runner of the shifts codec, once it has dropped out
  std::unique_ptr<SegmentEncoder> encoder_;   // encoder of the chosen codec
};

}  // namespace shm
