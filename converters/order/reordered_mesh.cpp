#include "order/reordered_mesh.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "mesh/coding_order.h"

namespace shm::converters {
namespace {

constexpr std::uint64_t kPieceElements = 65536;

}  // namespace

ReorderedMesh::ReorderedMesh(MeshSource& mesh, const Cells& cells, const CellList& order,
                             Spool* spool)
    : mesh_(&mesh), cells_(&cells), order_(&order), spool_(spool), info_(mesh.info()) {
  const auto refers = [](const Extra& extra) { return extra.refers == Reference::cell; };
  if (std::none_of(info_.extras.begin(), info_.extras.end(), refers)) return;
  CellList position(spool, order.size());
  for (std::uint32_t index = 0; index < order.size(); ++index) position.set(order[index], index);
  Renumbering to;
  to.cells = order.size();
  to.cell = [&](std::uint64_t cell) { return position[cell]; };
  for (Extra& extra : info_.extras)
    if (refers(extra)) extra = renumbered(std::move(extra), to);
}

bool ReorderedMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  const std::uint64_t end = std::min<std::uint64_t>(order_->size(), next_cell_ + max_cells);
  for (; next_cell_ < end; ++next_cell_) {
    const std::uint32_t cell = (*order_)[next_cell_];
    const auto corners = cells_->cell(cell);
    out.blocks.push_back(cells_->block(cell));
    out.corners.insert(out.corners.end(), corners.begin(), corners.end());
    out.corner_begin.push_back(out.corners.size());
  }
  return out.size() > 0;
}

const ReorderedMesh::Values& ReorderedMesh::values(std::size_t array, std::uint64_t step) {
  Values& held = info_.schema.arrays[array].per_step ? step_values_ : static_values_[array];
  if (held.array == array && held.step == step) return held;
  held.array = array;
  held.step = step;
  const std::uint64_t elements = info_.array_elements(array);
  const std::size_t stride = info_.array_stride(array);
  held.bytes.resize(elements * stride);
  for (std::uint64_t first = 0; first < elements; first += kPieceElements)
    mesh_->read_array(array, step, first, std::min(kPieceElements, elements - first),
                      held.bytes.data() + first * stride);
  return held;
}

const CellList& ReorderedMesh::elements(std::size_t array) {
  const auto& blocks = info_.schema.arrays[array].blocks;
  if (blocks.empty()) return *order_;
  const auto [place, fresh] = elements_.try_emplace(blocks, spool_);
  CellList& list = place->second;
  if (!fresh) return list;
  CellList rank(spool_, cells_->size());
  std::uint32_t ranks = 0;
  for (std::uint32_t cell = 0; cell < cells_->size(); ++cell)
    if (info_.schema.array_covers(array, cells_->block(cell))) rank.set(cell, ranks++);
  for (std::uint64_t index = 0; index < order_->size(); ++index) {
    const std::uint32_t cell = (*order_)[index];
    if (info_.schema.array_covers(array, cells_->block(cell))) list.push_back(rank[cell]);
  }
  return list;
}

void ReorderedMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                               std::uint64_t count, std::byte* out) {
  if (info_.schema.arrays[array].location != Location::cell)
    return mesh_->read_array(array, step, first, count, out);
  const std::size_t stride = info_.array_stride(array);
  const CellList& list = elements(array);
  if (spool_ != nullptr) {
    for (std::uint64_t i = 0; i < count; ++i)
      mesh_->read_array(array, step, list[first + i], 1, out + i * stride);
    return;
  }
  const std::byte* from = values(array, step).bytes.data();
  for (std::uint64_t i = 0; i < count; ++i)
    std::memcpy(out + i * stride, from + list[first + i] * stride, stride);
}

}  // namespace shm::converters
