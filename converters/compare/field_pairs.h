// Pairs the arrays of two meshes, and reads both arrays of a pair in the same form even if their
// formats store them differently: a vector of one mesh may be v_x, v_y and v_z in the other, or be
// padded with zeros; block numbers may be an array.
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

// The array or arrays of one mesh that hold a field.
struct FieldSide {
  static constexpr std::size_t kZeros = ~std::size_t{0};
  struct Part {
    std::size_t array;  // or kZeros
    std::uint32_t component;
  };
  std::vector<Part> parts;  // one for each component of the field; empty: ids of blocks
  ScalarType type = ScalarType::float64;
  bool per_step = false;
  std::vector<std::uint32_t> blocks;  // as in ArrayInfo
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
  bool is_type = false;  // only the scalar type differs: the numbers can be compared
};

struct FieldPairs {
  std::vector<FieldPair> pairs;
  std::vector<std::string> only_a, only_b;  // paths
  std::vector<FieldDifference> differences;
};

// With `one_format`, arrays with a role are also compared (unless `with_roles` is false), and
// paired arrays must agree in everything. Between formats, only fields are compared (strings too
// between the two VTK formats), and properties that one of the formats cannot represent are
// ignored.
FieldPairs pair_fields(const MeshInfo& a, const MeshInfo& b, bool one_format, bool with_roles);

// Reads the values of one side of a field, and finds the vertices or cells to which they belong.
class FieldReader {
 public:
  // Borrows `mesh` and `spool`. Reads all cells if it needs to know their blocks.
  FieldReader(MeshSource& mesh, const FieldPair& field, const FieldSide& side, Spool& spool);

  std::uint64_t elements() const { return elements_; }
  std::size_t stride() const { return stride_; }
  ScalarType type() const { return side_->type; }
  // Returns true if the elements are all vertices or all cells, in their order.
  bool covers_all() const { return covers_all_; }
  void read(std::uint64_t step, std::uint64_t first, std::uint64_t count, std::byte* out);
  // The values are indices into a list of strings. From now on, converts those of A or B to indices
  // into the common list, which is borrowed.
  void translate_by(const CommonStrings& strings, bool is_a) {
    strings_ = &strings;
    is_a_ = is_a;
  }
  // Returns the cell (or vertex) of each of `count` elements.
  void entities(std::uint64_t first, std::uint64_t count, std::vector<std::uint64_t>& out);
  // Returns the element of a cell; nothing if the field does not cover this cell.
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
  // Used if the field covers only some cells; needs 16 bytes per cell in the spool.
  std::optional<NumberList> covered_;
  std::optional<NumberTable> rank_;     // by cell, from 1; 0: not covered
  std::optional<PagedArray> block_id_;  // int64, by cell
};

}  // namespace shm::converters
