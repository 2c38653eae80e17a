// Choices: turns the bytes of a fuzz target's input into choices (numbers, flags).
#pragma once

#include <cstdint>
#include <span>

#include "codecs/registry.h"

/// Reads choices from the input. After the end of the input, all bytes are 0.
class Choices {
 public:
  explicit Choices(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::uint32_t below(std::uint32_t limit) {
    std::uint32_t value = byte();
    if (limit > 256) value = value << 8 | byte();
    return value % limit;
  }
  bool flag() { return below(2) == 1; }
  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t value = bytes_[0];
    bytes_ = bytes_.subspan(1);
    return value;
  }
  bool empty() const { return bytes_.empty(); }

 private:
  std::span<const std::uint8_t> bytes_;
};

/// Returns ConnectivityCodec::automatic or one of the cell codecs.
inline shm::ConnectivityCodec any_codec(Choices& in) {
  const std::uint32_t n = in.below(1 + static_cast<std::uint32_t>(shm::cell_codecs().size()));
  return n == 0 ? shm::ConnectivityCodec::automatic : shm::cell_codecs()[n - 1].name;
}
