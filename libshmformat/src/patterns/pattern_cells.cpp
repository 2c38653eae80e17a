#include "patterns/pattern_cells.h"

#include <algorithm>
#include <utility>

namespace shm {

bool takes_patterns(const Schema& schema) {
  return schema.delay == 0 &&
         std::all_of(schema.blocks.begin(), schema.blocks.end(), [](const BlockInfo& block) {
           return block.nodes_per_cell > 0 && block.nodes_per_cell <= kMostPatternNodes;
         });
}

std::uint32_t most_nodes(const Schema& schema) {
  std::uint32_t most = 1;
  for (const BlockInfo& block : schema.blocks) most = std::max(most, block.nodes_per_cell);
  return most;
}

void PatternHistory::reach(std::uint32_t bits) {
  if (bits <= bits_) return;
  // The oldest row comes first, so that the ring is no longer than what has come.
  if (!rows_.empty()) {
    std::vector<std::uint32_t> rows;
    rows.reserve(std::size_t{remembered_} * stride_);
    for (std::uint32_t back = remembered_; back > 0; --back) {
      const std::uint32_t* const row = rows_.data() + place(next_ - back);
      rows.insert(rows.end(), row, row + stride_);
    }
    rows_ = std::move(rows);
  }
  first_ = next_ - remembered_;
  bits_ = bits;
  mask_ = static_cast<std::uint32_t>((std::uint64_t{1} << bits) - 1);
}

void PatternHistory::expect(std::uint64_t cells) {
  const std::uint64_t room = std::min<std::uint64_t>(std::uint64_t{mask_} + 1, remembered_ + cells);
  const auto size = static_cast<std::size_t>(room * stride_);
  if (size <= rows_.size()) return;
  rows_.reserve(size);  // or it would double
  rows_.resize(size, kNone);
}

}  // namespace shm
