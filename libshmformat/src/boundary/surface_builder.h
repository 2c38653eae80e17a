// SurfaceBuilder: what is known of the boundary, as it is found: vertices and faces in any order,
// their values, and in the end all of it in coding order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bytes/lists.h"
#include "shm/boundary_surface.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

/// The values that are carried along with each vertex, or with each cell, packed into one record.
struct RecordLayout {
  struct Column {
    std::size_t request = 0;  ///< which of the arrays that are asked for
    std::uint32_t array = 0;
    std::size_t offset = 0, bytes = 0;  ///< in the record
    /// A stepped array of cells: in the record stands mark_of() what the cell is in it, 64 bits.
    bool is_mark = false;
  };
  std::vector<Column> columns;
  std::size_t bytes = 0;
};

/// An element of values that are not there: NaN, and 0 of integers.
std::vector<std::byte> no_value(const ArrayInfo& info);

class SurfaceBuilder {
 public:
  /// Which element of a stepped array a cell is; or, where the array does not cover it, before
  /// which one it stands. Marks of cells ascend in coding order.
  static constexpr std::uint64_t mark_of(std::uint64_t element, bool is_covered) {
    return element * 2 + (is_covered ? 1 : 0);
  }

  /// `schema` is borrowed. Must hold: it has all arrays that are asked for.
  SurfaceBuilder(const Schema& schema, std::vector<BoundaryArray> arrays);

  /// Coordinates, then static arrays of points.
  const RecordLayout& vertex_layout() const { return vertex_layout_; }
  /// Arrays of cells.
  const RecordLayout& cell_layout() const { return cell_layout_; }

  /// Its place. `record`: as vertex_layout() says. Must hold: there are fewer than 2^32 - 1.
  std::uint32_t add_vertex(std::uint64_t number, std::uint64_t ordinal, const std::byte* record);
  struct Cell {
    std::uint64_t position = 0;  ///< in coding order
    std::uint64_t number = 0;
    std::uint32_t block = 0;
    const std::byte* record = nullptr;  ///< as cell_layout() says
  };
  /// The corners of the next face, places of vertices.
  void add_corner(std::uint32_t place) { push_tightly(surface_.corners, place); }
  /// Behind its corners. `side`: 0 where the cell itself is the face.
  void add_face(const Cell& cell, std::uint32_t side);

  std::size_t vertices() const { return surface_.vertex_numbers.size(); }
  std::size_t faces() const { return surface_.cell_numbers.size(); }
  /// Bytes that it takes.
  std::uint64_t memory() const;
  /// The most that it will take from sort() on.
  std::uint64_t memory_of_sort() const;

  /// Puts all of it in coding order: vertices, faces by their cells and by the sides of these.
  /// Makes room for values of stepped arrays, where nothing stands yet.
  void sort();

  // After sort().
  /// Values of a stepped array at a step: of its elements from `first` on in coding order.
  void fill(std::uint32_t array, std::uint64_t step, std::uint64_t first,
            std::span<const std::byte> values);
  /// Of the vertices or cells of these numbers.
  void fill(std::uint32_t array, std::uint64_t step, std::span<const std::uint64_t> numbers,
            std::span<const std::byte> values);
  /// An array of arrays() for which no values came, though there are elements; arrays().size():
  /// none.
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
  /// Places of vertices, or of faces, by number; made by the first call.
  const std::vector<std::uint32_t>& by_number(bool of_points);

  const Schema* schema_;
  std::vector<BoundaryArray> arrays_;
  RecordLayout vertex_layout_, cell_layout_;
  std::size_t xyz_bytes_;

  BoundarySurface surface_;                        // face_begin from 1 on
  std::vector<std::uint64_t> ordinals_;            // of vertices
  std::vector<std::uint64_t> positions_;           // of the cells of faces
  std::vector<std::vector<std::uint64_t>> marks_;  // by request: stepped arrays of cells
  std::vector<bool> filled_;                       // by request
  std::vector<std::uint32_t> vertices_by_number_, faces_by_number_;
};

}  // namespace shm
