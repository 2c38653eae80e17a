#include "codecs/weighted/length_coder.h"

#include <algorithm>

namespace shm {

bool LengthDecoder::begin(ByteReader& in) {
  const std::uint64_t count = in.get_varint();
  if (!in.ok() || count > kLengthContexts) return false;
  tables_.clear();
  std::uint32_t begin = 0;
  for (std::uint64_t t = 0; t < count; ++t) {
    const std::uint32_t end = t + 1 < count ? begin + in.get_u8() : kLengthContexts;
    if (end <= begin || end > kLengthContexts) return false;
    std::fill(map_.begin() + begin, map_.begin() + end, static_cast<std::uint8_t>(t));
    begin = end;
    const std::uint32_t low = in.get_u8(), high = in.get_u8();
    if (!in.ok() || low > high || high >= kLengths) return false;
    Table& table = tables_.emplace_back();
    std::uint32_t first = 0;
    for (std::uint32_t i = low; i <= high; ++i) {
      const std::uint64_t frequency = i < high ? in.get_varint() : kScale - first;
      if (!in.ok() || frequency > kScale - first) return false;
      if (i == high && frequency == 0) return false;
      table.ranges[i] = {static_cast<std::uint16_t>(frequency), static_cast<std::uint16_t>(first)};
      std::fill_n(table.length_at.begin() + first, frequency, static_cast<std::uint8_t>(i));
      first += static_cast<std::uint32_t>(frequency);
    }
  }
  const std::uint64_t words = in.get_varint();
  state_ = in.get_u64();
  if (!in.ok() || words > in.left() / 4 || tables_.empty()) return false;
  words_ = in.get_bytes(words * 4);
  next_ = 0;
  is_short_ = false;
  return state_ >= kLow && state_ >> 63 == 0;
}

void LengthDecoder::refill() {
  if (words_.size() - next_ < 4) {
    is_short_ = true;
    state_ = kLow;
    return;
  }
  std::uint32_t word = 0;
  for (std::size_t b = 0; b < 4; ++b)
    word |= std::to_integer<std::uint32_t>(words_[next_ + b]) << 8 * b;
  next_ += 4;
  state_ = state_ << 32 | word;
}

}  // namespace shm
