// GroupValues: coordinates and values of the static arrays of a group, as the caller gave them:
// where each column finds its own, and what the group's header says of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bytes/lists.h"
#include "container/format.h"
#include "shm/schema.h"

namespace shm {

class GroupValues {
 public:
  /// `schema` is borrowed.
  explicit GroupValues(const Schema& schema);

  std::size_t vertex_bytes() const { return vertex_bytes_; }
  std::size_t cell_bytes(std::uint32_t block) const { return cell_bytes_[block]; }

  /// Coordinates, then the point arrays in schema order, packed.
  void add_vertex(const std::byte* values) {
    expect_more(vertices_, vertex_bytes_);
    vertices_.insert(vertices_.end(), values, values + vertex_bytes_);
  }
  /// The cell arrays that cover the block, in schema order, packed.
  void add_cell(std::uint32_t block, const std::byte* values);

  /// 0: coordinates; else the static arrays in schema order.
  std::size_t columns() const { return columns_.size(); }
  bool of_cells(std::size_t column) const { return columns_[column].of_cells; }
  /// The schema's index of the array in a column from 1 on.
  std::uint32_t array(std::size_t column) const { return columns_[column].array; }
  /// Of the first element; null when there is none.
  const std::byte* values(std::size_t column) const {
    const Column& it = columns_[column];
    if (count(column) == 0) return nullptr;
    return it.of_cells ? it.cells.data() : vertices_.data() + it.offset;
  }
  /// Bytes from one element to the next.
  std::size_t stride(std::size_t column) const {
    return columns_[column].of_cells ? columns_[column].bytes : vertex_bytes_;
  }

  /// The box of the finite coordinates.
  std::array<double, 6> box() const;
  /// Ranges of the static arrays.
  std::vector<container::ArrayRange> ranges() const;
  void clear();

 private:
  struct Column {
    std::uint32_t array = 0;
    bool of_cells = false;
    std::size_t bytes = 0, offset = 0;  // offset: in a vertex
    std::vector<std::byte> cells{};
  };
  std::size_t count(std::size_t column) const {
    const Column& it = columns_[column];
    return it.of_cells ? it.cells.size() / it.bytes : vertices_.size() / vertex_bytes_;
  }

  const Schema* schema_;
  std::vector<Column> columns_;
  std::size_t vertex_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // by block
  std::vector<std::byte> vertices_;
};

}  // namespace shm
