// Treats the input of a target as a sequence of choices, which are taken byte by byte.
#pragma once

#include <cstdint>
#include <span>

#include "codecs/registry.h"

/// Takes bytes from the input; returns zeros after its end.
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

/// Returns automatic, or any codec of cells.
inline shm::ConnectivityCodec any_codec(Choices& in) {
  const std::uint32_t n = in.below(1 + static_cast<std::uint32_t>(shm::cell_codecs().size()));
  return n == 0 ? shm::ConnectivityCodec::automatic : shm::cell_codecs()[n - 1].name;
}
