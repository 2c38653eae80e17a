// RecordedOrder: records the order in which a Writer codes vertices and cells, and derives from it
// the order in which the Writer expects step values and the numbers that a Reader will see.
//   shm::RecordedOrder order;
//   options.coding_order = &order;
//   ... Writer::create, vertices and cells, end_mesh ...
//   const auto from = order.elements(schema, array, cell_blocks);
//   ... pass the value of element from[0] to add_step_values() first, then of from[1], ...
// spec: "Order", "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shm/result.h"
#include "shm/schema.h"
#include "shm/writer.h"

namespace shm {

/// Needs 8 bytes for each vertex and cell. A plain value; several threads may call const members at
/// once.
struct SHM_API RecordedOrder final : public CodingOrder {
  std::vector<std::uint64_t> vertices, cells;  ///< their numbers, in coding order

  void vertex(std::uint64_t number) override { vertices.push_back(number); }
  void cell(std::uint64_t number) override { cells.push_back(number); }

  /// Returns the elements of an array in the order in which the Writer expects their values. An
  /// element is a vertex number, or the index of a cell, counted in input order among the cells
  /// that have values. `cell_blocks`: the block of each cell, in input order; may be empty if the
  /// array covers all blocks. ErrorCode::misuse if the vertices were not numbered 0 to n - 1, each
  /// once, or if `cell_blocks` does not have one entry per cell.
  Result<std::vector<std::uint64_t>> elements(const Schema& schema, std::size_t array,
                                              std::span<const std::uint32_t> cell_blocks) const;

  /// Converts the references of an extra from the numbers that the Writer received to the numbers
  /// that a Reader will see; needed unless the order is Order::keep. Numbers that refer to nothing
  /// are kept. Needs 8 bytes per vertex or cell during the call. ErrorCode::misuse as in
  /// elements(), or if the references are neither int32 nor int64.
  Result<void> renumber(Extra& extra) const;
};

}  // namespace shm
