// SurfaceBuilder: collects the boundary surface. The caller adds vertices and faces with their
// values, in any order. At the end, the builder sorts them into coding order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/lists.h"
#include "shm/schema.h"
#include "shm/surface.h"

namespace shm {

/// Layout of a record. A record contains the values of one vertex or one cell.
struct RecordLayout {
  struct Column {
    std::size_t request = 0;  ///< index among the requested arrays
    std::uint32_t array = 0;
    /// Position of the array's value in the record, and size of the value, in bytes.
    std::size_t offset = 0, bytes = 0;

    /// True for a stepped cell array. Its values are read later. Until then the record contains a
    /// mark of the cell (64 bits, see mark_of()) instead of a value.
    bool is_mark = false;
  };
  std::vector<Column> columns;
  std::size_t bytes = 0;
};

/// Returns the bytes that represent a missing value: NaN for floating-point types, 0 for integers.
std::vector<std::byte> no_value(const ArrayInfo& info);

class SurfaceBuilder {
 public:
  /// Returns a 64-bit mark that states where the values of a stepped array contain the value of a
  /// cell. The mark contains an index into the values, and a flag that is set if the array covers
  /// the cell. If the array does not cover the cell, the index is that of the next cell, in coding
  /// order, that the array covers. In coding order, marks ascend.
  static constexpr std::uint64_t mark_of(std::uint64_t element, bool is_covered) {
    return element * 2 + (is_covered ? 1 : 0);
  }

  /// Creates a builder. `schema` is borrowed. Precondition: the schema has all requested arrays.
  SurfaceBuilder(const Schema& schema, std::vector<BoundaryArray> arrays);

  /// Returns the layout of vertex records: coordinates, then static point arrays.
  const RecordLayout& vertex_layout() const { return vertex_layout_; }
  /// Returns the layout of cell records, which contain the cell arrays.
  const RecordLayout& cell_layout() const { return cell_layout_; }

  /// Adds a vertex and returns its index. `record` has the layout vertex_layout(). Precondition:
  /// fewer than 2^32 - 1 vertices have been added.
  std::uint32_t add_vertex(std::uint64_t number, std::uint64_t ordinal, const std::byte* record);
  struct Cell {
    std::uint64_t position = 0;  ///< position of the cell in coding order
    std::uint64_t number = 0;
    std::uint32_t block = 0;
    const std::byte* record = nullptr;  ///< record of the cell, with the layout cell_layout()
  };
  /// Adds a corner of the next face. `place` is the index of the corner's vertex.
  void add_corner(std::uint32_t place) { push_tightly(surface_.corners, place); }
  /// Adds a face. Its corners are those that have been added since the previous face. `side` is the
  /// number of the side, or 0 if the cell itself is the face.
  void add_face(const Cell& cell, std::uint32_t side);

  std::size_t vertices() const { return surface_.vertex_numbers.size(); }
  std::size_t faces() const { return surface_.cell_numbers.size(); }
  /// Returns the memory in use, in bytes.
  std::uint64_t memory() const;
  /// Returns the maximum memory in bytes that sort() and later calls need.
  std::uint64_t memory_of_sort() const;

  /// Sorts vertices into coding order, and faces by cell and side. Then fills each stepped array
  /// with one missing value (NaN, or 0 for integers) per vertex or face.
  void sort();

  // The functions below must be called after sort().

  /// Stores values of a stepped array at one step. The values belong to consecutive elements in
  /// coding order, starting at element `first`.
  void fill(std::uint32_t array, std::uint64_t step, std::uint64_t first,
            std::span<const std::byte> values);
  /// Stores values of a stepped array at one step. The values belong to the vertices or cells
  /// `numbers`.
  void fill(std::uint32_t array, std::uint64_t step, std::span<const std::uint64_t> numbers,
            std::span<const std::byte> values);
  /// Returns the index in arrays() of a stepped array that has elements but no values yet. Returns
  /// arrays().size() if no such array exists.
  std::size_t unfilled() const;
  const std::vector<BoundaryArray>& arrays() const { return arrays_; }
  BoundarySurface& surface() { return surface_; }

 private:
  const ArrayInfo& info(std::size_t request) const {
    return schema_->arrays[arrays_[request].array];
  }
  bool of_points(std::size_t request) const { return info(request).location == Location::point; }
  std::size_t stride(std::size_t request) const {
    return scalar_bytes(info(request).type) * info(request).components;
  }
  void sort_vertices();
  void sort_faces();
  bool wants(std::size_t request, std::uint32_t array, std::uint64_t step) const {
    return info(request).per_step && arrays_[request].array == array &&
           arrays_[request].step == step;
  }
  /// Returns the indices of vertices or faces, sorted by number. The first call creates the list.
  const std::vector<std::uint32_t>& by_number(bool of_points);

  const Schema* schema_;
  std::vector<BoundaryArray> arrays_;
  RecordLayout vertex_layout_, cell_layout_;
  std::size_t xyz_bytes_;

  // Boundary surface. The initial 0 of face_begin is added by sort().
  BoundarySurface surface_;
  std::vector<std::uint64_t> ordinals_;   // ordinal of each vertex
  std::vector<std::uint64_t> positions_;  // for each face, the position of its cell in coding order
  // For each requested stepped cell array: one mark per face (see mark_of()), which states the
  // element of the face's cell.
  std::vector<std::vector<std::uint64_t>> marks_;
  std::vector<bool> filled_;  // true for each request whose values have been stored
  std::vector<std::uint32_t> vertices_by_number_, faces_by_number_;
};

}  // namespace shm
