// CellStore: cells of any size in the spool, appended in one order and read in any order. A corner
// uses 4 bytes if the vertex numbers of its cell fit into 4 bytes, otherwise 8. Consecutive cells
// of the same block and size form a run, which is described only once, so regular meshes need no
// other memory.
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
  // Appends cell `position` to `out`.
  void read(std::uint64_t position, CellBatch& out) { read_run(position, 1, out); }
  // Appends `count` cells to `out`, starting with cell `first`. All of them must have been added
  // before.
  void read_run(std::uint64_t first, std::uint64_t count, CellBatch& out);

 private:
  // Consecutive cells of one block with the same number of corners.
  struct Run {
    std::uint64_t first_cell = 0, first_corner = 0;
    std::uint32_t block = 0, corners = 0;
    std::uint64_t wide = 0;  // 1: the corners are in wide_ and use 8 bytes each
  };
  static constexpr std::size_t kTail = 16384;

  std::uint64_t run_of(std::uint64_t cell);
  void flush();

  PagedArray runs_, narrow_, wide_;
  std::uint64_t size_ = 0;
  Run last_;
  std::vector<std::uint32_t> tail_;  // last corners of 4 bytes that are not yet in narrow_
  std::vector<std::uint32_t> piece_;
  std::uint64_t found_ = 0;  // index of the run that was read last
};

}  // namespace shm::converters
