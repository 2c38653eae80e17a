// Pairs the arrays of two meshes, and reads the values of both arrays of a pair in the same form,
// even if the two formats store them differently. For example, a vector v of one mesh may be stored
// as three arrays v_x, v_y and v_z in the other mesh, or as a vector padded with zeros. Block ids
// of one mesh may be an array in the other mesh.
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
  std::vector<Part> parts;  // for each component of the field, the array and the component that
                            // contain it; empty if the values are the block ids of the cells
  ScalarType type = ScalarType::float64;
  bool per_step = false;
  std::vector<std::uint32_t> blocks;  // indices of the blocks that the field covers, as in
                                      // ArrayInfo
};

struct FieldPair {
  std::string
      path;  // "point/T", "cell/T", "global/T" ...; repeated names are followed by "#2", "#3", ...
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

// Pairs the fields of two meshes. If `one_format` is true, both meshes have the same format: arrays
// with a role are also paired (unless `with_roles` is false), and differences in any property of
// paired arrays are reported. If `one_format` is false, only arrays without a role are paired (and
// arrays of strings, if both formats have them), and properties that one of the formats cannot
// represent are ignored.
FieldPairs pair_fields(const MeshInfo& a, const MeshInfo& b, bool one_format, bool with_roles);

// Reads the values of a field in one of the two meshes, and finds the vertices or cells to which
// they belong.
class FieldReader {
 public:
  // Borrows `mesh` and `spool`. If the block of each cell is needed, the constructor reads all
  // cells.
  FieldReader(MeshSource& mesh, const FieldPair& field, const FieldSide& side, Spool& spool);

  std::uint64_t elements() const { return elements_; }
  std::size_t stride() const { return stride_; }
  ScalarType type() const { return side_->type; }
  // Returns true if the field covers all vertices (or cells) of the mesh, so that element i belongs
  // to vertex (or cell) i.
  bool covers_all() const { return covers_all_; }
  void read(std::uint64_t step, std::uint64_t first, std::uint64_t count, std::byte* out);
  // Declares that the values are indices into a list of strings. Later reads convert them to
  // indices into the common list `strings`, which is borrowed. `is_a` is true if this reader reads
  // mesh A.
  void translate_by(const CommonStrings& strings, bool is_a) {
    strings_ = &strings;
    is_a_ = is_a;
  }
  // For each of the elements `first` to `first` + `count` - 1, stores the number of its cell or
  // vertex in `out`.
  void entities(std::uint64_t first, std::uint64_t count, std::vector<std::uint64_t>& out);
  // Returns the index of the element that belongs to a cell (or vertex). Returns nothing if the
  // field does not cover this cell.
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
  // Numbers of the covered cells if the field covers only some cells. Needs 16 bytes of temporary
  // storage per cell, in the spool.
  std::optional<NumberList> covered_;
  std::optional<NumberTable> rank_;     // 1 + element index of each cell; 0: cell not covered
  std::optional<PagedArray> block_id_;  // block id of each cell, int64
};

}  // namespace shm::converters
