// Which array of one mesh belongs to which array of another, and how both are read as the same
// thing although their formats hold it differently: a vector in one is v_x, v_y and v_z in another,
// or has zeros behind it; the numbers of blocks may be an array.
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

// What one mesh holds of a field.
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
  std::string path;  // "point/T" or "cell/T", with "#2", ... where it stands again
  Location location = Location::point;
  std::uint32_t components = 1;
  FieldSide a, b;
};

// A property that two arrays of one name do not share.
struct FieldDifference {
  std::string path, a, b;
  bool is_type = false;  // scalar type only: their numbers can be compared
};

struct FieldPairs {
  std::vector<FieldPair> pairs;
  std::vector<std::string> only_a, only_b;  // paths
  std::vector<FieldDifference> differences;
};

// `one_format`: arrays with a role are compared too (unless `with_roles` is false), and must be
// alike in everything. Between formats, only fields are (of VTK's two, strings too), and what one
// format cannot hold is passed over.
FieldPairs pair_fields(const MeshInfo& a, const MeshInfo& b, bool one_format, bool with_roles);

// The values of one side, and which vertices or cells they belong to.
class FieldReader {
 public:
  // Borrows `mesh` and `spool`. Reads the cells through where the field needs to know their blocks.
  FieldReader(MeshSource& mesh, const FieldPair& field, const FieldSide& side, Spool& spool);

  std::uint64_t elements() const { return elements_; }
  std::size_t stride() const { return stride_; }
  ScalarType type() const { return side_->type; }
  // Elements are all vertices or cells, in their order.
  bool covers_all() const { return covers_all_; }
  void read(std::uint64_t step, std::uint64_t first, std::uint64_t count, std::byte* out);
  // Borrows: what is read are places of A's or B's array of strings, from now on the common ones.
  void translate_by(const CommonStrings& strings, bool is_a) {
    strings_ = &strings;
    is_a_ = is_a;
  }
  // The cell (vertex) of each of `count` elements.
  void entities(std::uint64_t first, std::uint64_t count, std::vector<std::uint64_t>& out);
  // The element of a cell; nothing when the field does not cover it.
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
  // Where it covers some cells only: 16 bytes a cell in the spool.
  std::optional<NumberList> covered_;
  std::optional<NumberTable> rank_;     // of each cell, from 1; 0: not covered
  std::optional<PagedArray> block_id_;  // int64, of each cell
};

}  // namespace shm::converters
