// ReorderedMesh: a mesh with its cells in another order. Vertices keep their numbers. Cell data,
// and extras that refer to cells, are reordered with the cells. Without a spool, ReorderedMesh
// keeps in memory each static cell array that has been read, and the most recently read step of one
// stepped array.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "mesh/cells.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"

namespace shm::converters {

class ReorderedMesh final : public MeshSource {
 public:
  // Borrows all arguments. `cells` must contain the cells of `mesh`, and `order` must contain each
  // cell exactly once. If `spool` is not null, no values are kept in memory; each value is read
  // from `mesh` when it is needed.
  ReorderedMesh(MeshSource& mesh, const Cells& cells, const CellList& order,
                Spool* spool = nullptr);

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    mesh_->read_points(first, count, out);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  struct Values {
    std::size_t array = ~std::size_t{0};
    std::uint64_t step = 0;
    std::vector<std::byte> bytes;  // values in file order
  };
  const Values& values(std::size_t array, std::uint64_t step);
  // Returns, for an array that covers only some blocks, the indices of its elements in `mesh`. They
  // are listed in the new order of the cells.
  const CellList& elements(std::size_t array);

  MeshSource* mesh_;
  const Cells* cells_;
  const CellList* order_;
  Spool* spool_;
  MeshInfo info_;
  std::uint64_t next_cell_ = 0;
  std::map<std::size_t, Values> static_values_;
  Values step_values_;  // the most recently read step of one stepped array
  std::map<std::vector<std::uint32_t>, CellList> elements_;  // elements by covered blocks
};

}  // namespace shm::converters
