#include "mesh/cell_store.h"

#include <algorithm>
#include <limits>

namespace shm::converters {

CellStore::CellStore(Spool& spool)
    : runs_(spool, sizeof(Run)),
      narrow_(spool, sizeof(std::uint32_t)),
      wide_(spool, sizeof(std::uint64_t)) {}

void CellStore::append(std::uint32_t block, std::span<const std::uint64_t> corners) {
  std::uint64_t all = 0;
  for (const std::uint64_t corner : corners) all |= corner;
  const bool wide = all > std::numeric_limits<std::uint32_t>::max();
  if (size_ == 0 || block != last_.block || corners.size() != last_.corners ||
      wide != (last_.wide != 0)) {
    last_ = {size_, wide ? wide_.size() : narrow_.size() + tail_.size(), block,
             static_cast<std::uint32_t>(corners.size()), wide ? 1u : 0u};
    runs_.set(runs_.size(), last_);
  }
  ++size_;
  if (wide) {
    wide_.append(corners.size(), reinterpret_cast<const std::byte*>(corners.data()));
    return;
  }
  for (const std::uint64_t corner : corners) tail_.push_back(static_cast<std::uint32_t>(corner));
  if (tail_.size() >= kTail) flush();
}

void CellStore::flush() {
  narrow_.append(tail_.size(), reinterpret_cast<const std::byte*>(tail_.data()));
  tail_.clear();
}

std::uint64_t CellStore::run_of(std::uint64_t cell) {
  const auto begin = [&](std::uint64_t run) {
    return run < runs_.size() ? runs_.get<Run>(run).first_cell : size_;
  };
  if (begin(found_) <= cell && cell < begin(found_ + 1)) return found_;
  std::uint64_t low = 0, high = runs_.size();
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    (begin(middle) <= cell ? low : high) = middle;
  }
  return found_ = low;
}

void CellStore::read_run(std::uint64_t first, std::uint64_t count, CellBatch& out) {
  if (count == 0) return;
  flush();
  for (std::uint64_t r = run_of(first); count > 0; found_ = r++) {
    const Run run = runs_.get<Run>(r);
    const std::uint64_t end = r + 1 < runs_.size() ? runs_.get<Run>(r + 1).first_cell : size_;
    const std::uint64_t cells = std::min(count, end - first);
    const std::uint64_t from = run.first_corner + (first - run.first_cell) * run.corners;
    const std::uint64_t corners = cells * run.corners;
    const std::size_t old = out.corners.size();
    out.corners.resize(old + corners);
    if (run.wide != 0) {
      wide_.read(from, corners, reinterpret_cast<std::byte*>(out.corners.data() + old));
    } else {
      piece_.resize(corners);
      narrow_.read(from, corners, reinterpret_cast<std::byte*>(piece_.data()));
      std::copy(piece_.begin(), piece_.end(),
                out.corners.begin() + static_cast<std::ptrdiff_t>(old));
    }
    out.blocks.insert(out.blocks.end(), cells, run.block);
    for (std::uint64_t i = 0; i < cells; ++i)
      out.corner_begin.push_back(out.corner_begin.back() + run.corners);
    first += cells;
    count -= cells;
  }
}

}  // namespace shm::converters
