// Pairs the arrays of two meshes, and reads both arrays of a pair in the same form even if their
// formats store them differently. A vector of one mesh may be v_x, v_y and v_z in the other mesh,
// or may be padded with zeros. Block ids of one mesh may be an array of the other mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/spool.h"
#include "compare/strings.h"
#include "mesh/coding_order.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// The array or arrays in which one mesh stores a field.
struct FieldSide {
  static constexpr std::size_t kZeros = ~std::size_t{0};
  struct Part {
    std::size_t array;  // index of the array, or kZeros
    std::uint32_t component;
  };
  std::vector<Part> parts;  // part for each component of the field; empty: the field consists of
                            // the ids of blocks
  ScalarType type = ScalarType::float64;
  bool per_step = false;
  std::vector<std::uint32_t> blocks;  // blocks that the field covers, as in ArrayInfo
};

struct FieldPair {
  std::string path;  // "point/T" or "cell/T", with "#2", ... if the name occurs again
  Location location = Location::point;
  std::uint32_t components = 1;
  FieldSide a, b;
};

// A property in which two arrays of the same name differ.
struct FieldDifference {
  std::string path, a, b;
  bool is_type = false;  // true: only the scalar type differs, so the values can be compared
};

struct FieldPairs {
  std::vector<FieldPair> pairs;
  std::vector<std::string> only_a, only_b;  // paths of the fields that only one mesh has
  std::vector<FieldDifference> differences;
};

// Pairs the fields of two meshes. With `one_format`, arrays with a role are also compared (unless
// `with_roles` is false), and paired arrays must agree in all properties. If the formats differ,
// only fields are compared (also strings if both are VTK formats), and properties that one of the
// formats cannot represent are ignored.
FieldPairs pair_fields(const MeshInfo& a, const MeshInfo& b, bool one_format, bool with_roles);

// Reads the values of one side of a field, and finds the vertices or cells to which they belong.
class FieldReader {
 public:
  // Borrows `mesh` and `spool`. Reads all cells if the blocks of cells are needed.
  FieldReader(MeshSource& mesh, const FieldPair& field, const FieldSide& side, Spool& spool);

  std::uint64_t elements() const { return elements_; }
  std::size_t stride() const { return stride_; }
  ScalarType type() const { return side_->type; }
  // Returns true if the elements are all vertices or all cells, in the mesh's order.
  bool covers_all() const { return covers_all_; }
  void read(std::uint64_t step, std::uint64_t first, std::uint64_t count, std::byte* out);
  // Declares that the values are indices into a list of strings. From now on, converts indices of A
  // or B to indices into the common list, which is borrowed.
  void translate_by(const CommonStrings& strings, bool is_a) {
    strings_ = &strings;
    is_a_ = is_a;
  }
  // Stores the number of the cell (or vertex) of each of `count` elements in `out`.
  void entities(std::uint64_t first, std::uint64_t count, std::vector<std::uint64_t>& out);
  // Returns the element of a cell, or nothing if the field does not cover this cell.
  std::optional<std::uint64_t> element_of(std::uint64_t entity);

 private:
  void index_covered(Spool& spool);

  MeshSource* mesh_;
  const FieldSide* side_;
  std::uint64_t elements_ = 0;
  std::size_t stride_ = 0;
  bool covers_all_ = true, whole_array_ = false;
  const CommonStrings* strings_ = nullptr;
  bool is_a_ = true;
  std::vector<std::byte> piece_;
  // Numbers of the covered cells if the field covers only some cells. Needs 16 bytes per cell in
  // the spool.
  std::optional<NumberList> covered_;
  std::optional<NumberTable> rank_;     // element of each cell, from 1; 0: cell is not covered
  std::optional<PagedArray> block_id_;  // block id of each cell, int64
};

}  // namespace shm::converters
