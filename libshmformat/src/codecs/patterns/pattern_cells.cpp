#include "codecs/patterns/pattern_cells.h"

#include <algorithm>

namespace shm {
namespace {

constexpr std::size_t kRows = 256;  // number of rows added in one step

}  // namespace

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
  // Rotate rows_ so that the oldest row comes first and new rows can follow the latest row.
  if (!rows_.empty() && remembered_ > at_) {
    std::rotate(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(at_ + 1) * stride_,
                rows_.end());
    at_ = remembered_;
  }
  bits_ = bits;
  ring_ = (std::uint32_t{1} << bits) + 1;
}

void PatternHistory::expect(std::uint64_t cells) {
  const std::uint64_t rows = std::min<std::uint64_t>(ring_, remembered_ + 1 + cells + kRows);
  // Without reserve(), resize() would double the capacity of the vector
  rows_.reserve(static_cast<std::size_t>(rows * stride_));
}

std::uint32_t PatternHistory::add_slot() {
  expect_more_soon(vertices_, 1);
  vertices_.emplace_back();
  states_.emplace_back();
  return static_cast<std::uint32_t>(vertices_.size() - 1);
}

/// Adds more rows to rows_ than are needed now, so that this function is rarely called.
void PatternHistory::add_rows() {
  const std::size_t rows = std::min<std::size_t>(ring_, std::size_t{at_} + kRows);
  if (rows * stride_ > rows_.capacity()) expect(remembered_ / 2);
  rows_.resize(rows * stride_, kNone);
}

}  // namespace shm
