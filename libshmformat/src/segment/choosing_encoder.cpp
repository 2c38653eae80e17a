#include "segment/choosing_encoder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>
#include <span>
#include <utility>

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

/// Components of static arrays, more of which are in no race: each that takes part keeps what it
/// has of all of them, and what cells take is little beside it.
constexpr std::uint64_t kMostRacing = 512;

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
  return sample_cells_ >= trial_.sample_cells ? choose(false, done) : Result<void>();
}

Result<void> ChoosingEncoder::end(std::vector<EncodedGroup>& done) {
  if (!encoder_)
    if (auto good = choose(true, done); !good) return good;
  encoder_->end(done);
  return {};
}

Result<void> ChoosingEncoder::choose(bool is_over, std::vector<EncodedGroup>& done) {
  using enum CodecTrial::Shifts;
  if (trial_.shifts == for_speed) {
    const Result<bool> take_them = shifts_do(shifts_);
    if (!take_them) return take_them.error();
    if (*take_them) return go_on_with(shifts_, done);
  }
  Result<Runner> best = smallest(is_over);
  if (!best) return best.error();
  if (trial_.shifts == for_size && best->codec != ConnectivityCodec::shifts) {
    const Result<bool> may = shifts_do(shifts_);
    const Result<bool> take_them = may && *may ? shifts_are_as_small(shifts_, *best) : may;
    if (!take_them) return take_them.error();
    if (*take_them) return go_on_with(shifts_, done);
  }
  return go_on_with(*best, done);
}

/// Codes as many pieces of the sample as it has not.
Result<void> ChoosingEncoder::advance(Runner& runner, std::size_t pieces) const {
  if (!runner.encoder) runner.encoder = encoder_with(runner.codec);
  for (; runner.taken < pieces; ++runner.taken)
    if (auto good = runner.encoder->take(sample_[runner.taken], runner.done); !good) return good;
  return {};
}

Result<void> ChoosingEncoder::go_on_with(Runner& runner, std::vector<EncodedGroup>& done) {
  if (auto good = advance(runner, sample_.size()); !good) return good;
  std::move(runner.done.begin(), runner.done.end(), std::back_inserter(done));
  encoder_ = std::move(runner.encoder);
  shifts_ = {};
  sample_ = {};
  return {};
}

/// Whether shifts come into question: they take no room, and the segment is one on which time is
/// felt.
Result<bool> ChoosingEncoder::shifts_do(Runner& shifts) const {
  if (trial_.shifts == CodecTrial::Shifts::no || sample_cells_ < trial_.sample_cells ||
      !takes_shifts(*schema_))
    return false;
  const std::uint64_t parts = trial_.shifts == CodecTrial::Shifts::for_size ? kShiftPart : 1;
  // Where the first cells alone take more than all may, the others need not be seen.
  for (const std::size_t pieces : {std::min(kFirstPieces, sample_.size()), sample_.size()}) {
    if (auto good = advance(shifts, pieces); !good) return good.error();
    const SegmentSize its = shifts.encoder->size();
    if (8 * (its.topology + its.besides) * parts > kShiftBits * sample_cells_) return false;
  }
  return true;
}

/// The fastest first. Where size matters, shifts are one like the others.
std::vector<ConnectivityCodec> ChoosingEncoder::candidates() const {
  std::vector<ConnectivityCodec> codecs = trial_.codecs;
  std::uint64_t components = 0;
  for (const ArrayInfo& array : schema_->arrays)
    components += array.per_step ? 0 : array.components;
  if (components > kMostRacing && std::count(codecs.begin(), codecs.end(), ConnectivityCodec::rows))
    return {ConnectivityCodec::rows};
  if (trial_.shifts == CodecTrial::Shifts::for_size && takes_shifts(*schema_))
    codecs.insert(codecs.begin(), ConnectivityCodec::shifts);
  return codecs;
}

auto ChoosingEncoder::smallest(bool is_over) -> Result<Runner> {
  std::vector<Runner> runners;
  for (ConnectivityCodec codec : candidates()) runners.push_back({codec});
  for (std::size_t r = 0; r < kRounds.size(); ++r) {
    const Round& round = kRounds[r];
    if (runners.size() == 1 || sample_.size() < 2 * round.pieces) break;
    const bool is_last = r + 1 == kRounds.size() || sample_.size() < 2 * kRounds[r + 1].pieces;
    const Values values = !round.values || have_values_of_their_own(runners) == 1 ? Values::grown
                          : is_last ? Values::estimated_last
                                    : Values::estimated;
    if (auto good = run(runners, round.pieces, values, round.mixes); !good) return good.error();
    std::uint64_t least = runners[0].size.all();
    for (const Runner& it : runners) least = std::min(least, it.size.all());
    for (ConnectivityCodec codec : candidates()) {
      const Runner* it = find(runners, codec);
      const std::uint64_t times = codec == ConnectivityCodec::shifts ? kShiftPatience : 1;
      if (it && it->size.all() > least + least * times / round.share + round.bytes)
        drop(runners, codec);
    }
    // What mixing saves of many cells it saves of the others.
    if (round.mixes) settle_mixing(runners, r + 1 == kRounds.size() && trial_.level != Level::best);
  }
  if (runners.size() == 1) return std::move(runners[0]);
  return finish_race(runners, is_over);
}

/// On all of the sample.
auto ChoosingEncoder::finish_race(std::vector<Runner>& runners, bool is_over) -> Result<Runner> {
  const bool ends = is_over && trial_.level == Level::best;
  const bool is_first = runners[0].size.values == 0;
  if (is_first || ends) {
    const Values values = ends ? Values::grown : Values::estimated;
    if (auto good = run(runners, sample_.size(), values, true); !good) return good.error();
    if (ends) settle_mixing(runners, true);
    for (Runner& it : runners) {
      if (!ends || runners.size() == 1) break;
      it.encoder->end(it.done);
      it.size = it.encoder->size();
    }
    return std::move(best_of(runners));
  }
  if (lies_in_a_layer()) {
    // More of its first layer tells nothing of the next ones, and takes most of the memory.
    const std::uint64_t bytes = value_bytes(sample_.size());
    for (Runner& it : runners)
      for (std::uint64_t* part : {&it.size.topology, &it.size.besides, &it.size.values})
        *part = *part * bytes / std::max<std::uint64_t>(it.value_bytes, 1);
    Runner best = std::move(best_of(runners));
    if (Runner* its = find(runners, ConnectivityCodec::shifts); its && its->encoder)
      shifts_ = std::move(*its);
    return best;
  }
  // Two at a time: there is no room for what all of them have coded.
  while (runners.size() > 1) {
    std::vector<Runner> two;
    for (Runner& it : std::span(runners).first(2)) two.push_back(std::move(it));
    if (auto good = run(two, sample_.size(), Values::grown, true); !good) return good.error();
    runners.erase(runners.begin());
    runners[0] = std::move(best_of(two));
    if (Runner* its_shifts = find(two, ConnectivityCodec::shifts);
        its_shifts && its_shifts->encoder)
      shifts_ = std::move(*its_shifts);
  }
  return std::move(runners[0]);
}

/// How many of them: values of mixed rows are those of rows.
std::size_t ChoosingEncoder::have_values_of_their_own(std::span<const Runner> runners) {
  return static_cast<std::size_t>(std::count_if(runners.begin(), runners.end(), [](auto& it) {
    return it.codec != ConnectivityCodec::mixed;
  }));
}

/// Null: it has left.
auto ChoosingEncoder::find(std::span<Runner> runners, ConnectivityCodec codec) -> Runner* {
  const auto at = std::find_if(runners.begin(), runners.end(),
                               [&](const Runner& it) { return it.codec == codec; });
  return at == runners.end() ? nullptr : &*at;
}

void ChoosingEncoder::drop(std::vector<Runner>& runners, ConnectivityCodec codec) {
  Runner* its = find(runners, codec);
  if (codec == ConnectivityCodec::shifts) shifts_ = std::move(*its);
  runners.erase(runners.begin() + (its - runners.data()));
}

/// Just what its values take so far.
std::uint64_t ChoosingEncoder::coded_values(Runner& runner) {
  return runner.encoder->size().values + runner.encoder->values_if_coded();
}

/// Each goes on to so many pieces, and its values are estimated or not; mixed rows only if they can
/// pay and are asked for. Values that are not estimated have grown as those of all.
Result<void> ChoosingEncoder::run(std::vector<Runner>& runners, std::size_t pieces, Values values,
                                  bool mixes) const {
  using enum ConnectivityCodec;
  const std::uint64_t bytes = value_bytes(pieces);
  Runner* first = find(runners, rows);  // whose values are always known; never shifts
  if (!first) first = &runners.back();
  ValueChoices choices;
  const auto size_of = [&](Runner& it, bool estimates) -> Result<void> {
    if (auto good = advance(it, pieces); !good) return good;
    const SegmentSize before = std::exchange(it.size, it.encoder->size());
    if (estimates)
      it.size.values += it.encoder->about_values(choices);
    else if (it.value_bytes > 0)
      it.size.values = before.values * bytes / it.value_bytes;
    it.value_bytes = bytes;
    return {};
  };
  // Estimates do not tell values over numbers well enough from those over a surface.
  const bool codes =
      find(runners, shifts) &&
      (trial_.level == Level::best ? values != Values::grown : values == Values::estimated_last);
  const bool estimates = values != Values::grown && !codes;
  if (auto good = size_of(*first, estimates || first->size.values == 0); !good) return good;
  if (codes) first->size.values = coded_values(*first);
  for (Runner& it : runners) {
    if (&it == first) continue;
    const bool is_mixed_rows = it.codec == mixed && first->codec == rows;
    if (is_mixed_rows && !(mixes && mixing_can_pay(first->size))) {
      it.size = first->size;
      it.value_bytes = first->value_bytes;
      continue;
    }
    if (auto good = size_of(it, estimates && !is_mixed_rows); !good) return good;
    if (codes && !is_mixed_rows) it.size.values = coded_values(it);
    // In the first round the neighbours of a vertex are about the same for all of them.
    if (is_mixed_rows || it.size.values == 0) it.size.values = first->size.values;
  }
  return {};
}

/// Of two that differ by what mixing saves alone, one drops out where that is clear, or finally.
void ChoosingEncoder::settle_mixing(std::vector<Runner>& runners, bool finally) {
  using enum ConnectivityCodec;
  Runner *its_rows = find(runners, rows), *its_mixed = find(runners, mixed);
  if (!its_rows || !its_mixed) return;
  if (finally) return drop(runners, is_better(*its_mixed, *its_rows) ? rows : mixed);
  const std::uint64_t all = its_rows->size.all(), its = its_mixed->size.all();
  const std::uint64_t saved = (all - std::min(all, its)) * trial_.spare_share;
  if (!mixing_can_pay(its_rows->size) || saved * kClearly < all)
    drop(runners, mixed);
  else if (saved > all * kClearly)
    drop(runners, rows);
}

/// Whether mixing may save what is felt: it takes several times as long to decode.
bool ChoosingEncoder::mixing_can_pay(const SegmentSize& other) const {
  return trial_.level == Level::best ||
         other.topology * kMixedSavesTenths * trial_.spare_share >= other.all() * 10;
}

/// Must hold: there are some, the fastest first.
auto ChoosingEncoder::best_of(std::span<Runner> runners) const -> Runner& {
  Runner* best = &runners[0];
  for (Runner& it : runners.subspan(1))
    if (is_better(it, *best)) best = &it;
  return *best;
}

/// `faster`: another one, which is.
bool ChoosingEncoder::is_better(const Runner& it, const Runner& faster) const {
  if (!is_worth_it(it.size, faster.size)) return false;
  // Decoding mixed bits takes several times as long, of small meshes too.
  return it.codec != ConnectivityCodec::mixed || trial_.level == Level::best ||
         (faster.size.all() - it.size.all()) * trial_.spare_share > faster.size.all();
}

bool ChoosingEncoder::is_worth_it(const SegmentSize& smaller, const SegmentSize& faster) const {
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

Result<bool> ChoosingEncoder::shifts_are_as_small(Runner& shifts, Runner& other) const {
  ValueChoices choices;
  for (Runner* it : {&other, &shifts}) {
    if (auto good = advance(*it, sample_.size()); !good) return good.error();
    it->size = it->encoder->size();
    it->size.values += it->encoder->about_values(choices);
  }
  // What shifts themselves take they take at the beginning.
  const std::uint64_t share = lies_in_a_layer() ? kShiftShareOfLayer : kShiftShare;
  const auto are_as_small = [&] {
    return shifts.size.all() - shifts.size.topology <= other.size.all() + other.size.all() / share;
  };
  if (!are_as_small()) return false;
  for (Runner* it : {&other, &shifts}) {
    it->size = it->encoder->size();
    it->size.values += it->encoder->values_if_coded();
  }
  return are_as_small();
}

/// Nearly each cell of the sample has left a vertex that later ones use.
bool ChoosingEncoder::lies_in_a_layer() const {
  std::int64_t alive = 0;
  for (const SegmentPiece& piece : sample_)
    for (const SegmentPiece::Cell& cell : piece.cells)
      alive += std::int64_t{cell.new_vertices} - std::popcount(cell.last_use);
  return alive * 8 >= static_cast<std::int64_t>(sample_cells_) * 7;
}

/// What the values of so many pieces take before they are coded.
std::uint64_t ChoosingEncoder::value_bytes(std::size_t pieces) const {
  std::uint64_t bytes = 0;
  for (const SegmentPiece& piece : std::span(sample_).first(pieces))
    bytes += piece.vertex_values.size() + piece.cell_data.size();
  return bytes;
}

}  // namespace shm
