#include "segment/choosing_encoder.h"

#include <bit>
#include <optional>

#include "groups/pattern_segment_encoder.h"
#include "groups/shift_segment_encoder.h"
#include "groups/surface_segment_encoder.h"
#include "patterns/pattern_cells.h"
#include "shifts/shifts.h"

namespace shm {
namespace {

/// Shifts do where a cell takes no more bits; where size matters, a part of one: then numbers run
/// on undisturbed.
constexpr std::uint64_t kShiftBits = 1, kShiftPart = 2;
/// Where size matters, values over their numbers may take one part in so many more. Of a sample
/// that lies within a first layer, the second one: what is behind the cells of the next ones is not
/// there yet, and shifts, which know nothing else, look worse than they are.
constexpr std::uint64_t kShiftShare = 25, kShiftShareOfLayer = 12;
/// Mixing saves at most so many tenths of connectivity and numbers.
constexpr std::uint64_t kMixedSavesTenths = 4;
/// What a bitstream takes in the header of its group, about.
constexpr std::uint64_t kStreamHeadBytes = 8;

std::unique_ptr<SegmentEncoder> make_segment_encoder(const Schema& schema,
                                                     const SegmentOptions& options,
                                                     const SegmentStart& start) {
  if (options.codec == ConnectivityCodec::shifts)
    return std::make_unique<ShiftSegmentEncoder>(schema, options, start);
  if (options.codec == ConnectivityCodec::patterns)
    return std::make_unique<PatternSegmentEncoder>(schema, options, start);
  return std::make_unique<SurfaceSegmentEncoder>(schema, options, start);
}

}  // namespace

CodecTrial trial_for(const Schema& schema, ConnectivityCodec codec, Level level) {
  using enum ConnectivityCodec;
  if (codec != automatic) return {.level = level, .codecs = {codec}};
  switch (level) {
    case Level::fast:
      return {.level = level,
              .codecs = {takes_patterns(schema) ? patterns : rows},
              .shifts = CodecTrial::Shifts::for_speed};
    case Level::standard: break;
    case Level::best:
      return {.level = level,
              .codecs = {replay, rows, mixed},
              .shifts = CodecTrial::Shifts::for_size,
              .sample_cells = 65536,
              .spare_share = 1 << 16,
              .spare_bits = 1 << 16};
  }
  return {.level = level,
          .codecs = {replay, rows, mixed},
          .shifts = CodecTrial::Shifts::for_size,
          .sample_cells = 32768};
}

std::unique_ptr<SegmentEncoder> ChoosingEncoder::encoder_with(ConnectivityCodec codec) const {
  return make_segment_encoder(*schema_,
                              {group_cells_, codec, trial_.level, true, trial_.with_order}, start_);
}

ChoosingEncoder::ChoosingEncoder(const Schema& schema, std::uint32_t group_cells,
                                 const CodecTrial& trial, const SegmentStart& start)
    : schema_(&schema), group_cells_(group_cells), trial_(trial), start_(start) {
  if (trial.codecs.size() == 1 && trial.shifts == CodecTrial::Shifts::no)
    encoder_ = encoder_with(trial.codecs[0]);
}

Result<void> ChoosingEncoder::take(const SegmentPiece& piece, std::vector<EncodedGroup>& done) {
  if (encoder_) return encoder_->take(piece, done);
  sample_.push_back(piece);
  sample_cells_ += piece.cells.size();
  return sample_cells_ >= trial_.sample_cells ? choose(done) : Result<void>();
}

Result<void> ChoosingEncoder::end(std::vector<EncodedGroup>& done) {
  if (!encoder_)
    if (auto good = choose(done); !good) return good;
  encoder_->end(done);
  return {};
}

Result<void> ChoosingEncoder::choose(std::vector<EncodedGroup>& done) {
  const Result<bool> shifts = shifts_do();
  if (!shifts) return shifts.error();
  using enum CodecTrial::Shifts;
  auto best = *shifts && trial_.shifts == for_speed
                  ? Result<ConnectivityCodec>(ConnectivityCodec::shifts)
                  : smallest();
  if (!best) return best.error();
  if (*shifts && trial_.shifts == for_size) {
    const Result<bool> take_them = shifts_are_as_small(*best);
    if (!take_them) return take_them.error();
    if (*take_them) best = ConnectivityCodec::shifts;
  }
  encoder_ = encoder_with(*best);
  for (const SegmentPiece& piece : sample_)
    if (auto good = encoder_->take(piece, done); !good) return good;
  sample_ = {};
  return {};
}

/// Whether shifts come into question: they take no room, and the segment is one on which time is
/// felt.
Result<bool> ChoosingEncoder::shifts_do() const {
  if (trial_.shifts == CodecTrial::Shifts::no || sample_cells_ < trial_.sample_cells ||
      !takes_shifts(*schema_))
    return false;
  const auto its = size_with(ConnectivityCodec::shifts, false);
  if (!its) return its.error();
  const std::uint64_t parts = trial_.shifts == CodecTrial::Shifts::for_size ? kShiftPart : 1;
  return 8 * its->all * parts <= kShiftBits * sample_cells_;
}

/// The fastest first. Where size matters, shifts are one like the others.
std::vector<ConnectivityCodec> ChoosingEncoder::candidates() const {
  std::vector<ConnectivityCodec> codecs = trial_.codecs;
  if (trial_.shifts == CodecTrial::Shifts::for_size && takes_shifts(*schema_))
    codecs.insert(codecs.begin(), ConnectivityCodec::shifts);
  return codecs;
}

Result<ConnectivityCodec> ChoosingEncoder::smallest() const {
  const std::vector<ConnectivityCodec> codecs = candidates();
  ConnectivityCodec best = codecs[0];
  if (codecs.size() == 1) return best;
  std::optional<Size> size;
  for (ConnectivityCodec codec : codecs) {
    if (codec == ConnectivityCodec::mixed && size && trial_.level != Level::best &&
        size->topology * kMixedSavesTenths * trial_.spare_share < size->all * 10)
      continue;
    const auto its = size_with(codec);
    if (!its) return its.error();
    if (size && !is_worth_it(*its, *size)) continue;
    // Decoding mixed bits takes several times as long, of small meshes too.
    if (size && codec == ConnectivityCodec::mixed && trial_.level != Level::best &&
        (size->all - its->all) * trial_.spare_share <= size->all)
      continue;
    size = *its;
    best = codec;
  }
  return best;
}

bool ChoosingEncoder::is_worth_it(const Size& smaller, const Size& faster) const {
  if (smaller.all >= faster.all) return false;
  if (sample_cells_ < trial_.sample_cells) return true;  // time is no matter
  const auto is_felt = [&](std::uint64_t bytes) {
    return 8 * bytes * trial_.spare_bits > sample_cells_;
  };
  const std::uint64_t saved = faster.all - smaller.all;
  if (!is_felt(saved)) return false;
  return saved * trial_.spare_share > faster.all ||
         (smaller.topology < faster.topology && is_felt(faster.topology - smaller.topology));
}

Result<bool> ChoosingEncoder::shifts_are_as_small(ConnectivityCodec other) const {
  const auto its = size_with(ConnectivityCodec::shifts), others = size_with(other);
  if (!its) return its.error();
  if (!others) return others.error();
  // What shifts themselves take they take at the beginning.
  const std::uint64_t share = lies_in_a_layer() ? kShiftShareOfLayer : kShiftShare;
  return its->all - its->topology <= others->all + others->all / share;
}

/// Nearly each cell of the sample has left a vertex that later ones use.
bool ChoosingEncoder::lies_in_a_layer() const {
  std::int64_t alive = 0;
  for (const SegmentPiece& piece : sample_)
    for (const SegmentPiece::Cell& cell : piece.cells)
      alive += std::int64_t{cell.new_vertices} - std::popcount(cell.last_use);
  return alive * 8 >= static_cast<std::int64_t>(sample_cells_) * 7;
}

auto ChoosingEncoder::size_with(ConnectivityCodec codec, bool values) const -> Result<Size> {
  using container::StreamKind;
  const auto encoder = make_segment_encoder(
      *schema_, SegmentOptions{group_cells_, codec, trial_.level, values, false}, start_);
  std::vector<EncodedGroup> groups;
  for (const SegmentPiece& piece : sample_)
    if (auto good = encoder->take(piece, groups); !good) return good.error();
  encoder->end(groups);
  Size size;
  for (const EncodedGroup& group : groups)
    for (const container::StreamEntry& stream : group.header.streams) {
      size.all += stream.bytes + kStreamHeadBytes;
      if (stream.kind == StreamKind::connectivity || stream.kind == StreamKind::corner_order ||
          stream.kind == StreamKind::vertex_numbers)
        size.topology += stream.bytes;
    }
  return size;
}

}  // namespace shm
