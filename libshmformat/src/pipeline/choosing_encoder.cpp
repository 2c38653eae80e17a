#include "pipeline/choosing_encoder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>
#include <span>
#include <utility>

#include "base/workers.h"
#include "codecs/registry.h"

namespace shm {
namespace {

/// Limits for choosing the shifts codec. The codec qualifies if its cells need at most kShiftBits
/// bits each on average, or at most kShiftBits / kShiftPart bits if size matters more than speed.
/// Cells need so few bits only if most vertex numbers continue regularly from cell to cell.
constexpr std::uint64_t kShiftBits = 1, kShiftPart = 2;
constexpr std::size_t kFirstPieces = 3;
/// Limit on the excess size of the shifts codec, used if size matters more than speed. With shifts,
/// the sample may be larger than with another codec by 1/kShiftShare of the other codec's size.
constexpr std::uint64_t kShiftShare = 25;
/// A slower codec must save 1/kSlowerSaves of the bytes, except at level best. It need not save
/// this share of the bytes of the shifts codec, because the size of the values differs more between
/// shifts and other codecs, and may only have been estimated.
constexpr std::uint64_t kSlowerSaves = 64;
/// A round of the race between codecs. The final round, which codes the whole sample, is not in
/// kRounds.
struct Round {
  std::size_t pieces;   ///< number of pieces of the sample that are coded; a piece usually has 1024
                        ///< cells
  std::uint64_t share;  ///< allowed excess: a codec drops out if its size exceeds the smallest size
                        ///< by more than 1/share of it plus `bytes`
  /// Further allowed excess in bytes, because adaptive models need some bytes to learn.
  std::uint64_t bytes;
  bool values;  ///< true if the size of values is estimated for each codec
};
constexpr std::array<Round, 3> kRounds = {
    {{1, 10, 256, false}, {3, 20, 256, true}, {10, 50, 128, true}}};
/// Factor that increases the allowed excess size of all codecs but the slowest. These codecs stay
/// in the race longer, because they need fewer bytes in later rows.
constexpr std::uint64_t kFasterPatience = 2;
/// At level fast, segments with at most kFewCells cells use the codec `rows`. Their files are then
/// up to half as large, and coding so few cells takes about a millisecond with any codec. At level
/// best, they may use `rows`, because the models of `mixed` need more cells to adapt.
constexpr std::size_t kFewCells = 128;
/// The sample also ends after this number of vertices, so that it stays small if each cell
/// introduces many of them.
constexpr std::size_t kSampleVertices = std::size_t{1} << 17;

/// A sample with fewer cells is coded by one thread. Starting threads takes about as long as coding
/// a few hundred cells.
constexpr std::size_t kAloneCells = 4096;
/// Largest total number of components of static arrays for which several codecs are tried. Each
/// codec in the race stores a copy of all values. With more components, the cells are only a small
/// part of the file.
constexpr std::uint64_t kMostRacing = 512;

bool takes(ConnectivityCodec codec, const Schema& schema) {
  return find_codec(codec)->takes(schema);
}

}  // namespace

CodecTrial trial_for(const Schema& schema, ConnectivityCodec codec, Level level) {
  using enum ConnectivityCodec;
  if (codec != automatic) return {.level = level, .codecs = {codec}};
  switch (level) {
    case Level::fast:
      return {.level = level,
              .codecs = {takes(patterns, schema) ? patterns : rows},
              .shifts = CodecTrial::Shifts::for_speed};
    case Level::standard: break;
    case Level::best:
      return {.level = level,
              .codecs = {replay, mixed},
              .shifts = CodecTrial::Shifts::for_size,
              .sample_cells = 65536};
  }
  return {.level = level,
          .codecs = {replay, rows},
          .shifts = CodecTrial::Shifts::for_size,
          .sample_cells = 32768};
}

std::unique_ptr<SegmentEncoder> ChoosingEncoder::encoder_with(ConnectivityCodec codec) const {
  return make_segment_encoder(*schema_,
                              {.group_cells = group_cells_,
                               .codec = codec,
                               .level = trial_.level,
                               .with_order = trial_.with_order,
                               .with_digest = trial_.with_digest},
                              start_);
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
  sample_vertices_ += piece.vertices.size();
  return sample_cells_ >= trial_.sample_cells || sample_vertices_ >= kSampleVertices
             ? choose(false, done)
             : Result<void>();
}

Result<void> ChoosingEncoder::end(std::vector<EncodedGroup>& done) {
  if (!encoder_)
    if (auto status = choose(true, done); !status) return status;
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

/// Codes the pieces of the sample up to index `pieces` (exclusive). Skips pieces that `runner` has
/// coded before.
Result<void> ChoosingEncoder::advance(Runner& runner, std::size_t pieces) const {
  if (!runner.encoder) runner.encoder = encoder_with(runner.codec);
  for (; runner.taken < pieces; ++runner.taken)
    if (auto status = runner.encoder->take(sample_[runner.taken], runner.done); !status)
      return status;
  return {};
}

/// Calls work(runner) for each runner, in several threads if the trial allows it.
template <class Work>
Result<void> ChoosingEncoder::for_each(std::span<Runner> runners, const Work& work) const {
  std::vector<Result<void>> results(runners.size());
  in_threads(sample_cells_ < kAloneCells ? 1 : trial_.threads, runners.size(),
             [&](std::size_t r) { results[r] = work(runners[r]); });
  const auto failed = std::find_if_not(results.begin(), results.end(),
                                       [](const Result<void>& result) { return bool(result); });
  return failed == results.end() ? Result<void>() : *failed;
}

Result<void> ChoosingEncoder::go_on_with(Runner& runner, std::vector<EncodedGroup>& done) {
  if (auto status = advance(runner, sample_.size()); !status) return status;
  std::move(runner.done.begin(), runner.done.end(), std::back_inserter(done));
  encoder_ = std::move(runner.encoder);
  shifts_ = {};
  sample_ = {};
  return {};
}

/// Returns true if the shifts codec qualifies: its cells need almost no bytes, and the segment is
/// at least as long as the sample. Shorter segments are coded quickly by any codec.
Result<bool> ChoosingEncoder::shifts_do(Runner& shifts) const {
  if (trial_.shifts == CodecTrial::Shifts::no || sample_cells_ < trial_.sample_cells ||
      !takes(ConnectivityCodec::shifts, *schema_))
    return false;
  const std::uint64_t parts = trial_.shifts == CodecTrial::Shifts::for_size ? kShiftPart : 1;
  // Code a few pieces first. If they already exceed the bound for the whole sample, do not code the
  // remaining pieces.
  for (const std::size_t pieces : {std::min(kFirstPieces, sample_.size()), sample_.size()}) {
    if (auto status = advance(shifts, pieces); !status) return status.error();
    const SegmentSize size = shifts.encoder->size();
    if (8 * (size.topology + size.besides) * parts > kShiftBits * sample_cells_) return false;
  }
  return true;
}

/// Returns the codecs that take part in the race, the fastest first. If size matters more than
/// speed, the shifts codec is one of them.
std::vector<ConnectivityCodec> ChoosingEncoder::candidates(bool is_over) const {
  const bool are_few = is_over && sample_cells_ <= kFewCells;
  if (are_few && trial_.level == Level::fast) return {ConnectivityCodec::rows};
  std::vector<ConnectivityCodec> codecs = trial_.codecs;
  if (are_few && trial_.level == Level::best)
    codecs.insert(codecs.end() - 1, ConnectivityCodec::rows);
  std::uint64_t components = 0;
  for (const ArrayInfo& array : schema_->arrays)
    components += array.per_step ? 0 : array.components;
  if (components > kMostRacing) return {codecs.back()};
  if (trial_.shifts == CodecTrial::Shifts::for_size && takes(ConnectivityCodec::shifts, *schema_))
    codecs.insert(codecs.begin(), ConnectivityCodec::shifts);
  return codecs;
}

auto ChoosingEncoder::smallest(bool is_over) -> Result<Runner> {
  std::vector<Runner> runners;
  for (ConnectivityCodec codec : candidates(is_over)) runners.push_back({codec});
  for (std::size_t r = 0; r < kRounds.size(); ++r) {
    const Round& round = kRounds[r];
    if (runners.size() == 1 || sample_.size() < 2 * round.pieces) break;
    const bool is_last = r + 1 == kRounds.size() || sample_.size() < 2 * kRounds[r + 1].pieces;
    const Values values = !round.values ? Values::grown
                          : is_last     ? Values::estimated_last
                                        : Values::estimated;
    if (auto status = run(runners, round.pieces, values); !status) return status.error();
    std::uint64_t least = runners[0].size.all();
    for (const Runner& runner : runners) least = std::min(least, runner.size.all());
    for (ConnectivityCodec codec : candidates(is_over)) {
      const Runner* runner = find(runners, codec);
      const std::uint64_t times = codec != trial_.codecs.back() ? kFasterPatience : 1;
      if (runner && runner->size.all() > least + least * times / round.share + round.bytes)
        drop(runners, codec);
    }
  }
  if (runners.size() == 1) return std::move(runners[0]);
  return finish_race(runners, is_over);
}

/// Runs the final round of the race, in which the whole sample is coded. Returns the winner.
auto ChoosingEncoder::finish_race(std::vector<Runner>& runners, bool is_over) -> Result<Runner> {
  const bool ends = is_over && trial_.level == Level::best;
  const bool is_first = runners[0].size.values == 0;
  if (is_first || ends) {
    const Values values = ends ? Values::grown : Values::estimated;
    if (auto status = run(runners, sample_.size(), values); !status) return status.error();
    if (ends) {
      const auto end = [](Runner& runner) -> Result<void> {
        runner.encoder->end(runner.done);
        runner.size = runner.encoder->size();
        return {};
      };
      if (auto status = for_each(runners, end); !status) return status.error();
    }
    return std::move(best_of(runners));
  }
  if (lies_in_a_layer()) {
    // All cells of the sample are in the first layer. Coding more of these cells would not show how
    // well the codecs code later layers, and would need much memory (9 MB for a cube of five
    // million hexahedra). So extrapolate the sizes instead of coding the rest of the sample.
    const std::uint64_t bytes = value_bytes(sample_.size());
    for (Runner& runner : runners)
      for (std::uint64_t* part : {&runner.size.topology, &runner.size.besides, &runner.size.values})
        *part = *part * bytes / std::max<std::uint64_t>(runner.value_bytes, 1);
    Runner best = std::move(best_of(runners));
    if (Runner* shifts = find(runners, ConnectivityCodec::shifts); shifts && shifts->encoder)
      shifts_ = std::move(*shifts);
    return best;
  }
  // Only two codecs run at a time, because the output of all codecs together would need too much
  // memory.
  while (runners.size() > 1) {
    std::vector<Runner> two;
    for (Runner& runner : std::span(runners).first(2)) two.push_back(std::move(runner));
    const Values values = is_over ? Values::estimated : Values::grown;
    if (auto status = run(two, sample_.size(), values); !status) return status.error();
    runners.erase(runners.begin());
    runners[0] = std::move(best_of(two));
    if (Runner* shifts = find(two, ConnectivityCodec::shifts); shifts && shifts->encoder)
      shifts_ = std::move(*shifts);
  }
  return std::move(runners[0]);
}

/// Returns the runner of `codec`, or null if the codec is no longer in the race.
auto ChoosingEncoder::find(std::span<Runner> runners, ConnectivityCodec codec) -> Runner* {
  const auto found = std::find_if(runners.begin(), runners.end(),
                                  [&](const Runner& runner) { return runner.codec == codec; });
  return found == runners.end() ? nullptr : &*found;
}

void ChoosingEncoder::drop(std::vector<Runner>& runners, ConnectivityCodec codec) {
  Runner* runner = find(runners, codec);
  if (codec == ConnectivityCodec::shifts) shifts_ = std::move(*runner);
  runners.erase(runners.begin() + (runner - runners.data()));
}

/// Returns the exact size in bytes of the values of all cells that have been passed to the runner.
/// Values of the current group are coded to measure their size.
std::uint64_t ChoosingEncoder::coded_values(Runner& runner) {
  return runner.encoder->size().values + runner.encoder->values_if_coded();
}

/// Codes the first `pieces` pieces of the sample with each runner, and determines the size of each
/// runner's values. `values`: whether that size is estimated, or assumed to grow in proportion to
/// the uncompressed size.
Result<void> ChoosingEncoder::run(std::vector<Runner>& runners, std::size_t pieces,
                                  Values values) const {
  const std::uint64_t bytes = value_bytes(pieces);
  const auto go_on = [&](Runner& runner) { return advance(runner, pieces); };
  if (auto status = for_each(runners, go_on); !status) return status;
  RatedDomains rated;
  const auto take_size = [&](Runner& runner, bool estimates) {
    const SegmentSize before = std::exchange(runner.size, runner.encoder->size());
    if (estimates)
      runner.size.values += runner.encoder->about_values(rated);
    else if (runner.value_bytes > 0)
      runner.size.values = before.values * bytes / runner.value_bytes;
    runner.value_bytes = bytes;
  };
  // If the shifts codec competes, code the values to measure their size. Estimates do not show
  // reliably whether predicting values by vertex numbers or from neighbours on the surface needs
  // fewer bytes.
  const bool codes =
      find(runners, ConnectivityCodec::shifts) &&
      (trial_.level == Level::best ? values != Values::grown : values == Values::estimated_last);
  const bool estimates = values != Values::grown && !codes;
  // The values of the slowest codec are measured first. The result may be used for other runners,
  // too.
  Runner& first = runners.back();
  take_size(first, estimates || first.size.values == 0);
  for (Runner& runner : std::span(runners).first(runners.size() - 1)) take_size(runner, estimates);
  if (codes) {
    const auto code = [](Runner& runner) -> Result<void> {
      runner.size.values = coded_values(runner);
      return {};
    };
    if (auto status = for_each(runners, code); !status) return status;
  }
  // In the first round, the neighbours of a vertex are about the same for all codecs. Therefore one
  // estimate of the size of the values is used for all codecs.
  for (Runner& runner : runners)
    if (runner.size.values == 0) runner.size.values = first.size.values;
  return {};
}

/// Returns the best runner. Precondition: `runners` is not empty, and is sorted from the fastest to
/// the slowest codec.
auto ChoosingEncoder::best_of(std::span<Runner> runners) const -> Runner& {
  Runner* best = &runners[0];
  for (Runner& runner : runners.subspan(1)) {
    const std::uint64_t least = best->size.all();
    const bool saves = trial_.level != Level::best && best->codec != ConnectivityCodec::shifts;
    const std::uint64_t saved = saves ? least / kSlowerSaves : 0;
    if (runner.size.all() + saved < least) best = &runner;
  }
  return *best;
}

Result<bool> ChoosingEncoder::shifts_are_as_small(Runner& shifts, Runner& other) const {
  RatedDomains rated;
  for (Runner* runner : {&other, &shifts}) {
    if (auto status = advance(*runner, sample_.size()); !status) return status.error();
    runner->size = runner->encoder->size();
    runner->size.values += runner->encoder->about_values(rated);
  }
  // The size of the cells coded with shifts is not counted, because almost all of their bytes are
  // needed at the beginning of a segment.
  const auto are_as_small = [&] {
    return shifts.size.all() - shifts.size.topology <=
           other.size.all() + other.size.all() / kShiftShare;
  };
  if (!are_as_small()) return false;
  for (Runner* runner : {&other, &shifts}) {
    runner->size = runner->encoder->size();
    runner->size.values += runner->encoder->values_if_coded();
  }
  return are_as_small();
}

/// Returns true if all cells of the sample are probably in the first layer. This is assumed if
/// nearly every cell introduces a vertex that later cells can use.
bool ChoosingEncoder::lies_in_a_layer() const {
  std::int64_t alive = 0;
  for (const SegmentPiece& piece : sample_)
    for (const SegmentPiece::Cell& cell : piece.cells)
      alive += std::int64_t{cell.new_vertices} - std::popcount(cell.last_use) -
               std::int64_t{cell.other_last_uses};
  return alive * 8 >= static_cast<std::int64_t>(sample_cells_) * 7;
}

/// Returns the uncompressed size in bytes of the values in the first `pieces` pieces of the sample.
std::uint64_t ChoosingEncoder::value_bytes(std::size_t pieces) const {
  std::uint64_t bytes = 0;
  for (const SegmentPiece& piece : std::span(sample_).first(pieces))
    bytes += piece.vertex_values.size() + piece.cell_data.size();
  return bytes;
}

}  // namespace shm
