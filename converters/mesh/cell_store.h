// CellStore: cells of any size in the spool, appended in one order and read in any.
// Corners take 4 bytes each while their numbers do, and cells that are alike nothing more: a run of
// cells of one block and size is described once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/spool.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

class CellStore {
 public:
  // `spool` is borrowed.
  explicit CellStore(Spool& spool);
  std::uint64_t size() const { return size_; }
  void append(std::uint32_t block, std::span<const std::uint64_t> corners);
  // Adds cell `position` to the end of `out`.
  void read(std::uint64_t position, CellBatch& out) { read_run(position, 1, out); }
  // Adds `count` cells from `first` on. Must hold: they have been appended.
  void read_run(std::uint64_t first, std::uint64_t count, CellBatch& out);

 private:
  // Cells of one block and one number of corners.
  struct Run {
    std::uint64_t first_cell = 0, first_corner = 0;
    std::uint32_t block = 0, corners = 0;
    std::uint64_t wide = 0;  // 1: their corners take 8 bytes, in wide_
  };
  static constexpr std::size_t kTail = 16384;

  std::uint64_t run_of(std::uint64_t cell);
  void flush();

  PagedArray runs_, narrow_, wide_;
  std::uint64_t size_ = 0;
  Run last_;
  std::vector<std::uint32_t> tail_;  // the last narrow corners
  std::vector<std::uint32_t> piece_;
  std::uint64_t found_ = 0;  // the run that was asked for last
};

}  // namespace shm::converters
