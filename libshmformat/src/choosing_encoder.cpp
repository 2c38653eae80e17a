#include "choosing_encoder.h"

namespace shm {

ChoosingEncoder::ChoosingEncoder(const Schema& schema, std::uint32_t group_cells,
                                 const CodecTrial& trial, const SegmentStart& start)
    : schema_(&schema), group_cells_(group_cells), trial_(trial), start_(start) {
  if (trial.codecs.size() == 1)
    encoder_ = std::make_unique<SegmentEncoder>(
        schema, SegmentOptions{group_cells, trial.codecs[0]}, start);
}

Result<void> ChoosingEncoder::take(const SegmentPiece& piece, std::vector<EncodedGroup>& done) {
  if (encoder_) return encoder_->take(piece, done);
  sample_.push_back(piece);
  sample_cells_ += piece.cells.size();
  return sample_cells_ >= kTrialCells ? choose(done) : Result<void>();
}

Result<void> ChoosingEncoder::end(std::vector<EncodedGroup>& done) {
  if (!encoder_)
    if (auto good = choose(done); !good) return good;
  encoder_->end(done);
  return {};
}

Result<void> ChoosingEncoder::choose(std::vector<EncodedGroup>& done) {
  HexahedronCodec best = trial_.codecs[0];
  std::uint64_t fewest = ~std::uint64_t{0};
  for (HexahedronCodec codec : trial_.codecs) {
    const auto bytes = bytes_with(codec);
    if (!bytes) return bytes.error();
    const std::uint64_t gain = sample_cells_ >= kTrialCells ? fewest / trial_.gain : 0;
    if (*bytes >= fewest - gain) continue;
    fewest = *bytes;
    best = codec;
  }
  encoder_ = std::make_unique<SegmentEncoder>(*schema_, SegmentOptions{group_cells_, best}, start_);
  for (const SegmentPiece& piece : sample_)
    if (auto good = encoder_->take(piece, done); !good) return good;
  sample_ = {};
  return {};
}

Result<std::uint64_t> ChoosingEncoder::bytes_with(HexahedronCodec codec) const {
  SegmentEncoder encoder(*schema_, SegmentOptions{group_cells_, codec}, start_);
  std::vector<EncodedGroup> groups;
  for (const SegmentPiece& piece : sample_)
    if (auto good = encoder.take(piece, groups); !good) return good.error();
  encoder.end(groups);
  std::uint64_t bytes = 0;
  for (const EncodedGroup& group : groups)
    for (const auto& stream : group.streams) bytes += stream.size();
  return bytes;
}

}  // namespace shm
