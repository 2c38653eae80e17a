// CellCursor: iterates over the cells of a mesh one by one. It reads the cells from the mesh in
// batches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "mesh/mesh_source.h"

namespace shm::converters {

class CellCursor {
 public:
  explicit CellCursor(MeshSource& mesh) : mesh_(&mesh) { mesh.rewind_cells(); }
  bool next() {
    if (++at_ < batch_.size()) return true;
    at_ = 0;
    return mesh_->next_cells(batch_, kCellsAtOnce) && batch_.size() > 0;
  }
  std::uint32_t block() const { return batch_.blocks[at_]; }
  std::span<const std::uint64_t> corners() const { return batch_.cell(at_); }

 private:
  MeshSource* mesh_;
  CellBatch batch_;
  std::size_t at_ = 0;
};

}  // namespace shm::converters
