// CellStore: cells with any number of corners, stored in the spool (temporary storage, on disk if
// large). Cells are appended one after the other and can be read in any order. A corner uses 4
// bytes if the vertex numbers of its cell fit into 4 bytes, otherwise 8. Consecutive cells of the
// same block and size form a run, which is described only once, so a regular mesh needs little
// memory in addition to its corners.
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
  // Appends `count` cells to `out`, starting with cell `first`. All these cells must have been
  // appended to the store before.
  void read_run(std::uint64_t first, std::uint64_t count, CellBatch& out);

 private:
  // Consecutive cells of one block with the same number of corners.
  struct Run {
    std::uint64_t first_cell = 0, first_corner = 0;
    std::uint32_t block = 0, corners = 0;
    // 1 if the corners are in wide_ (8 bytes each), 0 if they are in narrow_ (4 bytes each).
    std::uint64_t wide = 0;
  };
  static constexpr std::size_t kTail = 16384;

  std::uint64_t run_of(std::uint64_t cell);
  void flush();

  PagedArray runs_, narrow_, wide_;
  std::uint64_t size_ = 0;
  Run last_;
  // Buffer for 4-byte corners before they are appended to narrow_.
  std::vector<std::uint32_t> tail_;
  std::vector<std::uint32_t> piece_;
  std::uint64_t found_ = 0;  // index of the most recently found run
};

}  // namespace shm::converters
