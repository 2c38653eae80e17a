#include "pipeline/segment_cutter.h"

#include <algorithm>

namespace shm {
namespace {

// Smallest number of cells in a segment that is cut because the restart budget allows it. A segment
// that ends at the beginning of an element block, which is a better place for a cut, needs only
// half of that number.
constexpr std::uint64_t kLeastSegmentCells = 131072;

}  // namespace

bool SegmentCutter::is_due(std::uint32_t block, std::uint64_t cell) const {
  if (cells_ == 0) return false;
  const std::vector<std::uint64_t>& starts = options_->segment_starts;
  if (!starts.empty()) return std::binary_search(starts.begin(), starts.end(), cell);
  if (options_->segment_cells > 0) return cells_ >= options_->segment_cells;
  if (!(options_->restart_budget > 0)) return false;
  const std::uint64_t least = block != block_ ? kLeastSegmentCells / 2 : kLeastSegmentCells;
  return cells_ >= least &&
         static_cast<double>(live_) <= options_->restart_budget * static_cast<double>(introduced_);
}

}  // namespace shm
