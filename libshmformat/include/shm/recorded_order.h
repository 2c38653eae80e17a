// RecordedOrder: the order in which a Writer codes, kept, and what follows from it: in which order
// it wants step values, and which numbers a Reader will see.
//   shm::RecordedOrder order;
//   options.coding_order = &order;
//   ... Writer::create, vertices and cells, end_mesh ...
//   const auto from = order.elements(schema, array, cell_blocks);
//   ... add_step_values() takes element from[0] first, then from[1], ...
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

/// Takes 8 bytes for each vertex and cell. A plain value; calls that change nothing may be made in
/// several threads.
struct SHM_API RecordedOrder final : public CodingOrder {
  std::vector<std::uint64_t> vertices, cells;  ///< their numbers, in coding order

  void vertex(std::uint64_t number) override { vertices.push_back(number); }
  void cell(std::uint64_t number) override { cells.push_back(number); }

  /// Which elements of an array the Writer wants the values of, one after the other: vertices by
  /// number; cells counted from 0 among those that have values, as they were added. `cell_blocks`:
  /// the block of each cell, as added; may be empty where the array covers all blocks.
  /// ErrorCode::misuse where vertices were not numbered from 0 on, each once, or `cell_blocks` are
  /// not those of all cells.
  Result<std::vector<std::uint64_t>> elements(const Schema& schema, std::size_t array,
                                              std::span<const std::uint32_t> cell_blocks) const;

  /// Brings the references of an extra from the numbers that the Writer was given to those that a
  /// Reader will see: where the order is not Order::keep. Numbers of nothing stay. Takes 8 bytes
  /// for each vertex or cell for a while. ErrorCode::misuse as above, or where references are
  /// neither int32 nor int64.
  Result<void> renumber(Extra& extra) const;
};

}  // namespace shm
