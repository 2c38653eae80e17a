// Data of a segment that is encoded: the cells and vertices that an encoder receives, the groups
// that it returns, and the values of the current group. spec: "Segments", "Group"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/lists.h"
#include "codecs/shared/stencil.h"
#include "format/format.h"
#include "shm/schema.h"

namespace shm {

/// Some cells of a segment in coding order, with the vertices that they introduce. A vertex is
/// introduced by the first cell of the segment that uses it. The arrays are flat because a piece
/// contains thousands of cells and is reused.
struct SegmentPiece {
  static constexpr std::uint32_t kUnused = kNone;
  struct Cell {
    std::uint64_t number = 0;
    std::uint64_t last_use = 0;
    /// Element block of the cell. If the block is kUnused, the entry is not a cell but a vertex
    /// that no cell uses
    std::uint32_t block = 0;
    std::uint32_t nodes = 0;
    std::uint32_t new_vertices = 0;
    std::uint32_t other_last_uses = 0;  ///< number of entries of SegmentPiece::other_last_uses
  };
  struct Vertex {
    std::uint64_t number = 0;  ///< the caller's number for the vertex

    /// Handle of the vertex. `nodes` refers to vertices by their handles. After the vertex is
    /// finalized, the handle may be reused for another vertex
    std::uint32_t handle = 0;
    std::uint32_t ticket = kNone;
    bool imported = false;
  };
  std::vector<Cell> cells;
  std::vector<Vertex> vertices;
  ShortRuns<std::uint32_t> nodes;
  /// Nodes from position kMaxLastUse on whose vertices no later cell uses, of cells whose nodes
  /// form a grid. If a vertex occurs several times in its cell, this is its first node, and
  /// `last_use` does not mark it.
  std::vector<std::uint32_t> other_last_uses;
  ShortRuns<std::byte> vertex_values;  ///< coordinates, then static point data
  ShortRuns<std::byte> cell_data;

  std::span<const std::uint32_t> nodes_of(const Cell& cell, std::size_t begin) const {
    return {nodes.data() + begin, cell.nodes};
  }

  bool empty() const { return cells.empty(); }
  std::size_t bytes() const {
    return cells.size() * sizeof(Cell) + vertices.size() * sizeof(Vertex) + nodes.size() * 4 +
           other_last_uses.size() * 4 + vertex_values.size() + cell_data.size();
  }
  void clear() {
    other_last_uses.clear();
    cells.clear();
    vertices.clear();
    nodes.clear();
    vertex_values.clear();
    cell_data.clear();
  }
};

/// An encoded group. Only the numbers of its imported vertices are missing, since other segments
/// assign these numbers.
struct EncodedGroup {
  std::uint32_t segment = 0;
  container::GroupHeader header;
  std::vector<std::vector<std::byte>> streams;  ///< encoded streams, in the same order as in the
                                                ///< header
  std::uint64_t hexahedra = 0;
  std::vector<std::uint64_t> cell_numbers;  ///< cell numbers in coding order, if with_order is set

  struct Vertex {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
  };
  std::vector<Vertex> own;  ///< vertices that the segment owns, in order of introduction; filled if
                            ///< with_order is set
  struct Import {
    std::uint32_t ticket = kNone, slot = 0;
    Stencil stencil;
  };
  std::vector<Import>
      imports;  ///< imported vertices in the order of introduction; not filled in Order::keep

  /// A node whose word is missing in the digest of the group: its vertex is imported, so its number
  /// is not known yet.
  struct LateNode {
    std::uint64_t key = 0;
    std::uint32_t ticket = kNone;
  };
  std::vector<LateNode> late_nodes;

  std::size_t bytes() const {
    std::size_t sum = cell_numbers.size() * 8 + own.size() * sizeof(Vertex) +
                      imports.size() * sizeof(Import) + late_nodes.size() * sizeof(LateNode);
    for (const auto& stream : streams) sum += stream.size();
    return sum;
  }
};

/// Returns an empty group. Reserves memory for the same counts of cells and owned vertices as in
/// the group `before`.
inline EncodedGroup group_like(const EncodedGroup& before) {
  EncodedGroup group;
  group.cell_numbers.reserve(before.cell_numbers.size());
  group.own.reserve(before.own.size());
  return group;
}

/// Coordinates and static arrays of a group, stored in the layout in which the caller passes them.
/// This class locates the values of each column and computes the bounding box for the group header.
class GroupValues {
 public:
  /// `schema` must outlive this object.
  explicit GroupValues(const Schema& schema);

  std::size_t vertex_bytes() const { return vertex_bytes_; }
  std::size_t cell_bytes(std::uint32_t block) const { return cell_bytes_[block]; }

  /// Adds the packed values of one vertex: the coordinates, then the point arrays in schema order.
  void add_vertex(const std::byte* values) { vertices_.append(values, vertex_bytes_); }
  /// Adds the packed values of one cell: the cell arrays that cover the cell's block, in schema
  /// order.
  void add_cell(std::uint32_t block, const std::byte* values);

  /// Columns of values. Column 0 is the coordinates; the following columns are the static arrays in
  /// schema order.
  std::size_t columns() const { return columns_.size(); }
  bool of_cells(std::size_t column) const { return columns_[column].of_cells; }
  /// Returns the schema index of the array in a column. `column` is at least 1.
  std::uint32_t array(std::size_t column) const { return columns_[column].array; }
  /// Returns a pointer to the value of the first element; null if the group has no element in this
  /// column.
  const std::byte* values(std::size_t column) const {
    const Column& own = columns_[column];
    if (count(column) == 0) return nullptr;
    return own.of_cells ? own.cells.data() : vertices_.data() + own.offset;
  }
  /// Returns the number of bytes from the value of an element to the value of the next element.
  std::size_t stride(std::size_t column) const {
    return columns_[column].of_cells ? columns_[column].bytes : vertex_bytes_;
  }

  /// Returns the number of elements of the group in this column.
  std::size_t count(std::size_t column) const {
    const Column& own = columns_[column];
    return own.of_cells ? own.cells.size() / own.bytes : vertices_.size() / vertex_bytes_;
  }

  /// Returns the bounding box of all finite coordinates of the group.
  std::array<double, 6> box() const;
  void clear();

 private:
  struct Column {
    std::uint32_t array = 0;
    bool of_cells = false;
    std::size_t bytes = 0, offset = 0;  // byte offset of the column in the data of a vertex
    ShortRuns<std::byte> cells{};
  };
  const Schema* schema_;
  std::vector<Column> columns_;
  std::size_t vertex_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // size in bytes of a cell's data, indexed by block
  ShortRuns<std::byte> vertices_;
};

}  // namespace shm
