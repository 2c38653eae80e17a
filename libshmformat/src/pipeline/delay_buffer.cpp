#include "pipeline/delay_buffer.h"

namespace shm {

void DelayBuffer::push(std::uint64_t number, std::uint32_t block,
                       std::span<const std::uint32_t> entries, std::span<const std::byte> data,
                       const std::optional<Corners>& corners) {
  auto handle = static_cast<std::uint32_t>(cells_.size());
  if (free_.empty()) {
    cells_.emplace_back();
  } else {
    handle = free_.back();
    free_.pop_back();
  }
  Cell& cell = cells_[handle];
  cell.number = number;
  cell.block = block;
  cell.entries.assign(entries.begin(), entries.end());
  cell.data.assign(data.begin(), data.end());
  if (corners)
    order_.push_hexahedron(handle, *corners);
  else
    order_.push_other(handle);
}

const DelayBuffer::Cell& DelayBuffer::pop() {
  const std::uint32_t handle = order_.pop();
  free_.push_back(handle);
  return cells_[handle];
}

}  // namespace shm
