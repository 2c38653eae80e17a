#include "choosing_encoder.h"

#include <optional>

namespace shm {

ChoosingEncoder::ChoosingEncoder(const Schema& schema, std::uint32_t group_cells,
                                 const CodecTrial& trial, const SegmentStart& start)
    : schema_(&schema), group_cells_(group_cells), trial_(trial), start_(start) {
  if (trial.codecs.size() == 1)
    encoder_ = std::make_unique<SegmentEncoder>(
        schema, SegmentOptions{group_cells, trial.codecs[0], trial.level}, start);
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
  ConnectivityCodec best = trial_.codecs[0];
  std::optional<Size> size;
  for (ConnectivityCodec codec : trial_.codecs) {
    const auto its = size_with(codec);
    if (!its) return its.error();
    if (size && !is_worth_it(*its, *size)) continue;
    size = *its;
    best = codec;
  }
  encoder_ = std::make_unique<SegmentEncoder>(
      *schema_, SegmentOptions{group_cells_, best, trial_.level}, start_);
  for (const SegmentPiece& piece : sample_)
    if (auto good = encoder_->take(piece, done); !good) return good;
  sample_ = {};
  return {};
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

auto ChoosingEncoder::size_with(ConnectivityCodec codec) const -> Result<Size> {
  using container::StreamKind;
  SegmentEncoder encoder(*schema_, SegmentOptions{group_cells_, codec, Level::fast, false}, start_);
  std::vector<EncodedGroup> groups;
  for (const SegmentPiece& piece : sample_)
    if (auto good = encoder.take(piece, groups); !good) return good.error();
  encoder.end(groups);
  Size size;
  for (const EncodedGroup& group : groups)
    for (const container::StreamEntry& stream : group.header.streams) {
      size.all += stream.bytes;
      if (stream.kind == StreamKind::connectivity || stream.kind == StreamKind::corner_order ||
          stream.kind == StreamKind::vertex_numbers)
        size.topology += stream.bytes;
    }
  return size;
}

}  // namespace shm
