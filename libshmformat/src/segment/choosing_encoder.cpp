#include "segment/choosing_encoder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <span>

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
constexpr std::size_t kFirstPieces = 3;
/// Where size matters, values over their numbers may take one part in so many more. Of a sample
/// that lies within a first layer, the second one: what is behind the cells of the next ones is not
/// there yet, and shifts, which know nothing else, look worse than they are.
constexpr std::uint64_t kShiftShare = 25, kShiftShareOfLayer = 12;
/// Mixing saves at most so many tenths of connectivity and numbers.
constexpr std::uint64_t kMixedSavesTenths = 4;
/// A round before the last one, which is on all of the sample.
struct Round {
  std::size_t pieces;   ///< of the sample, of 1024 cells each, as a rule
  std::uint64_t share;  ///< who is larger than the smallest by one part in so many drops out,
  std::uint64_t bytes;  ///< and by so many bytes: what codecs learn first they learn at any length
  bool values;          ///< whether codecs code their own
  bool mixes;           ///< not on few cells: mixing has not learnt what it will save
};
constexpr std::array<Round, 3> kRounds = {
    {{1, 10, 256, false, false}, {3, 20, 256, true, true}, {10, 50, 128, true, true}}};
/// Shifts may be larger by so many times as much: what they save comes with the next rows.
constexpr std::uint64_t kShiftPatience = 2;
/// Mixing that saves so many times what is asked for, or one part in so many, is decided.
constexpr std::uint64_t kClearly = 2;
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
  const std::uint64_t parts = trial_.shifts == CodecTrial::Shifts::for_size ? kShiftPart : 1;
  // Where the first cells alone take more than all may, the others need not be seen.
  for (const std::size_t pieces : {std::min(kFirstPieces, sample_.size()), sample_.size()}) {
    const auto its = size_with(ConnectivityCodec::shifts, pieces, false);
    if (!its) return its.error();
    if (8 * its->all() * parts > kShiftBits * sample_cells_) return false;
  }
  return true;
}

/// The fastest first. Where size matters, shifts are one like the others.
std::vector<ConnectivityCodec> ChoosingEncoder::candidates() const {
  std::vector<ConnectivityCodec> codecs = trial_.codecs;
  if (trial_.shifts == CodecTrial::Shifts::for_size && takes_shifts(*schema_))
    codecs.insert(codecs.begin(), ConnectivityCodec::shifts);
  return codecs;
}

Result<ConnectivityCodec> ChoosingEncoder::smallest() const {
  std::vector<Runner> runners;
  for (ConnectivityCodec codec : candidates()) runners.push_back({codec, {}});
  for (const Round& round : kRounds) {
    if (runners.size() == 1 || sample_.size() < 2 * round.pieces) break;
    const bool values = round.values && have_values_of_their_own(runners) > 1;
    if (auto good = run(runners, round.pieces, values, round.mixes); !good) return good.error();
    std::uint64_t least = runners[0].size.all();
    for (const Runner& it : runners) least = std::min(least, it.size.all());
    std::erase_if(runners, [&](const Runner& it) {
      const std::uint64_t times = it.codec == ConnectivityCodec::shifts ? kShiftPatience : 1;
      return it.size.all() > least + least * times / round.share + round.bytes;
    });
    if (round.mixes) settle_mixing(runners);
  }
  if (runners.size() == 1) return runners[0].codec;
  const bool values = trial_.level == Level::best || runners[0].size.values == 0;
  if (auto good = run(runners, sample_.size(), values, true); !good) return good.error();
  return best_of(runners);
}

/// How many of them: values of mixed rows are those of rows.
std::size_t ChoosingEncoder::have_values_of_their_own(std::span<const Runner> runners) {
  return static_cast<std::size_t>(std::count_if(runners.begin(), runners.end(), [](auto& it) {
    return it.codec != ConnectivityCodec::mixed;
  }));
}

/// Each on so many pieces, with its own values or without; mixed rows, unless they cannot pay or
/// are not asked for. What is not coded is estimated.
Result<void> ChoosingEncoder::run(std::vector<Runner>& runners, std::size_t pieces, bool values,
                                  bool mixes) const {
  using enum ConnectivityCodec;
  const std::uint64_t bytes = value_bytes(pieces);
  const Runner* rows_or_first = &runners[0];
  for (const Runner& it : runners)
    if (it.codec == rows) rows_or_first = &it;
  for (Runner& it : runners) {
    const bool is_mixed_rows = it.codec == mixed && rows_or_first->codec == rows;
    if (is_mixed_rows && !(mixes && mixing_can_pay(rows_or_first->size))) {
      it.size = rows_or_first->size;
      continue;
    }
    const Size before = it.size;
    const bool codes_values =
        !is_mixed_rows && (values || (before.values == 0 && &it == rows_or_first));
    const auto its = size_with(it.codec, pieces, codes_values);
    if (!its) return its.error();
    it.size = *its;
    it.size.value_bytes = bytes;
    if (!codes_values && before.value_bytes > 0)
      it.size.values = before.values * bytes / before.value_bytes;
    if (is_mixed_rows) it.size.values = rows_or_first->size.values;
  }
  // In the first round the neighbours of a vertex are about the same for all of them.
  for (Runner& it : runners)
    if (it.size.values == 0) it.size.values = rows_or_first->size.values;
  return {};
}

/// Of two that differ by what mixing saves alone, one drops out where that is clear.
void ChoosingEncoder::settle_mixing(std::vector<Runner>& runners) const {
  const auto find = [&](ConnectivityCodec codec) {
    return std::find_if(runners.begin(), runners.end(),
                        [&](const Runner& it) { return it.codec == codec; });
  };
  const auto rows = find(ConnectivityCodec::rows), mixed = find(ConnectivityCodec::mixed);
  if (rows == runners.end() || mixed == runners.end()) return;
  const std::uint64_t all = rows->size.all(), its = mixed->size.all();
  const std::uint64_t saved = (all - std::min(all, its)) * trial_.spare_share;
  if (!mixing_can_pay(rows->size) || saved * kClearly < all)
    runners.erase(mixed);
  else if (saved > all * kClearly)
    runners.erase(rows);
}

/// Whether mixing may save what is felt: it takes several times as long to decode.
bool ChoosingEncoder::mixing_can_pay(const Size& other) const {
  return trial_.level == Level::best ||
         other.topology * kMixedSavesTenths * trial_.spare_share >= other.all() * 10;
}

/// Must hold: there are some, the fastest first.
ConnectivityCodec ChoosingEncoder::best_of(std::span<const Runner> runners) const {
  const Runner* best = &runners[0];
  for (const Runner& it : runners.subspan(1)) {
    if (!is_worth_it(it.size, best->size)) continue;
    // Decoding mixed bits takes several times as long, of small meshes too.
    if (it.codec == ConnectivityCodec::mixed && trial_.level != Level::best &&
        (best->size.all() - it.size.all()) * trial_.spare_share <= best->size.all())
      continue;
    best = &it;
  }
  return best->codec;
}

bool ChoosingEncoder::is_worth_it(const Size& smaller, const Size& faster) const {
  if (smaller.all() >= faster.all()) return false;
  if (sample_cells_ < trial_.sample_cells) return true;  // time is no matter
  const auto is_felt = [&](std::uint64_t bytes) {
    return 8 * bytes * trial_.spare_bits > sample_cells_;
  };
  const std::uint64_t saved = faster.all() - smaller.all();
  if (!is_felt(saved)) return false;
  return saved * trial_.spare_share > faster.all() ||
         (smaller.topology < faster.topology && is_felt(faster.topology - smaller.topology));
}

Result<bool> ChoosingEncoder::shifts_are_as_small(ConnectivityCodec other) const {
  const auto its = size_with(ConnectivityCodec::shifts, sample_.size(), true);
  const auto others = size_with(other, sample_.size(), true);
  if (!its) return its.error();
  if (!others) return others.error();
  // What shifts themselves take they take at the beginning.
  const std::uint64_t share = lies_in_a_layer() ? kShiftShareOfLayer : kShiftShare;
  return its->all() - its->topology <= others->all() + others->all() / share;
}

/// Nearly each cell of the sample has left a vertex that later ones use.
bool ChoosingEncoder::lies_in_a_layer() const {
  std::int64_t alive = 0;
  for (const SegmentPiece& piece : sample_)
    for (const SegmentPiece::Cell& cell : piece.cells)
      alive += std::int64_t{cell.new_vertices} - std::popcount(cell.last_use);
  return alive * 8 >= static_cast<std::int64_t>(sample_cells_) * 7;
}

auto ChoosingEncoder::size_with(ConnectivityCodec codec, std::size_t pieces, bool values) const
    -> Result<Size> {
  using container::StreamKind;
  const auto encoder = make_segment_encoder(
      *schema_, SegmentOptions{group_cells_, codec, trial_.level, values, false}, start_);
  std::vector<EncodedGroup> groups;
  for (const SegmentPiece& piece : std::span(sample_).first(pieces))
    if (auto good = encoder->take(piece, groups); !good) return good.error();
  encoder->end(groups);
  Size size;
  for (const EncodedGroup& group : groups)
    for (const container::StreamEntry& stream : group.header.streams) {
      const bool of_values =
          stream.kind == StreamKind::geometry || stream.kind == StreamKind::array;
      const bool of_topology = stream.kind == StreamKind::connectivity ||
                               stream.kind == StreamKind::corner_order ||
                               stream.kind == StreamKind::vertex_numbers;
      (of_values ? size.values : of_topology ? size.topology : size.besides) += stream.bytes;
      (of_values ? size.values : size.besides) += kStreamHeadBytes;
    }
  return size;
}

/// What the values of so many pieces take before they are coded.
std::uint64_t ChoosingEncoder::value_bytes(std::size_t pieces) const {
  std::uint64_t bytes = 0;
  for (const SegmentPiece& piece : std::span(sample_).first(pieces))
    bytes += piece.vertex_values.size() + piece.cell_data.size();
  return bytes;
}

}  // namespace shm
