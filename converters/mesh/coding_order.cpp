#include "mesh/coding_order.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "base/failure.h"

namespace shm::converters {
namespace {

template <class Integer>
void renumber_values(Extra& extra, const std::function<std::uint64_t(std::uint64_t)>& to,
                     std::uint64_t limit) {
  // Number of references (vertex or cell numbers in the extra) that are sorted and then looked up
  // together. Lookups in ascending order are faster, because the table of new numbers may be on
  // disk.
  constexpr std::size_t kTogether = std::size_t{1} << 20;
  const std::size_t count = extra.data.size() / sizeof(Integer);
  // For each reference, the vertex or cell number and its index in the extra.
  std::vector<std::pair<std::uint64_t, std::size_t>> references;
  for (std::size_t first = 0; first < count; first += kTogether) {
    references.clear();
    for (std::size_t i = first; i < std::min(first + kTogether, count); ++i) {
      Integer value;
      std::memcpy(&value, extra.data.data() + i * sizeof value, sizeof value);
      if (value >= 0 && static_cast<std::uint64_t>(value) < limit)
        references.emplace_back(static_cast<std::uint64_t>(value), i);
    }
    std::sort(references.begin(), references.end());
    for (const auto& [number, i] : references) {
      const std::uint64_t fresh = to(number);
      if (fresh > static_cast<std::uint64_t>(std::numeric_limits<Integer>::max()))
        throw Failure(
            Error{.code = ErrorCode::unsupported,
                  .detail = "a renumbered vertex or cell number does not fit into 32 bits",
                  .section = extra.key});
      const auto value = static_cast<Integer>(fresh);
      std::memcpy(extra.data.data() + i * sizeof value, &value, sizeof value);
    }
  }
}

}  // namespace

NumberList& CoveredOrder::elements(std::size_t array) {
  const Schema& schema = mesh_->info().schema;
  const auto& blocks = schema.arrays[array].blocks;
  if (blocks.empty()) return *cell_order_;
  auto& list = lists_[blocks];
  if (list) return *list;

  std::vector<bool> covered(schema.blocks.size());
  for (std::uint32_t b : blocks) covered[b] = true;
  // For each cell that the array covers, 1 + the rank of the cell among these cells. For all other
  // cells, 0.
  NumberTable rank_of_cell(*spool_, mesh_->info().cells(), mesh_->info().cells());
  std::uint64_t cell = 0, ranks = 0;
  CellBatch batch;
  for (mesh_->rewind_cells(); mesh_->next_cells(batch, kCellsAtOnce);)
    for (std::uint32_t block : batch.blocks) {
      if (covered[block]) rank_of_cell.set(cell, ++ranks);
      ++cell;
    }
  list = std::make_unique<NumberList>(*spool_);
  cell_order_->for_each([&](std::uint64_t, std::uint64_t number) {
    const std::uint64_t rank = rank_of_cell.get(number);
    if (rank != 0) list->push_back(rank - 1);
  });
  return *list;
}

Extra renumbered(Extra extra, const Renumbering& to) {
  const auto& map = extra.refers == Reference::vertex ? to.vertex : to.cell;
  const std::uint64_t limit = extra.refers == Reference::vertex ? to.vertices : to.cells;
  if (extra.refers == Reference::nothing || !map) return extra;
  if (extra.type == ScalarType::int32) renumber_values<std::int32_t>(extra, map, limit);
  if (extra.type == ScalarType::int64) renumber_values<std::int64_t>(extra, map, limit);
  return extra;
}

}  // namespace shm::converters
