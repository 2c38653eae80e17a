// RecordedOrder: records the order in which a Writer codes vertices and cells. From this order it
// derives the order in which the Writer expects step values, and the numbers that a Reader will
// see.
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

/// Recorded coding order of a mesh. Needs 8 bytes for each vertex and cell. Several threads may
/// call const members at the same time.
struct SHM_API RecordedOrder final : public CodingOrder {
  std::vector<std::uint64_t> vertices,
      cells;  ///< numbers of the vertices and of the cells, in coding order

  void vertex(std::uint64_t number) override { vertices.push_back(number); }
  void cell(std::uint64_t number) override { cells.push_back(number); }

  /// Returns the elements of an array in the order in which the Writer expects their values. An
  /// element of a point array is a vertex number. An element of a cell array is the index of a
  /// cell, counted in input order among the cells that have values. `cell_blocks` contains the
  /// block of each cell, in input order; it may be empty if the array covers all blocks.
  /// Fails with ErrorCode::misuse if the vertices were not numbered 0 to n - 1, each number once,
  /// or if `cell_blocks` does not have one entry per cell.
  Result<std::vector<std::uint64_t>> elements(const Schema& schema, std::size_t array,
                                              std::span<const std::uint32_t> cell_blocks) const;

  /// Replaces the vertex or cell numbers in an extra: the numbers that the Writer received become
  /// the numbers that a Reader will return. This is necessary unless the order is Order::keep.
  /// Numbers that do not refer to an existing vertex or cell are not changed. Needs 8 bytes per
  /// vertex or cell during the call. Fails with ErrorCode::misuse if the references are neither
  /// int32 nor int64, or under the same conditions as elements().
  Result<void> renumber(Extra& extra) const;
};

}  // namespace shm
