// Layout: the meaning of each netCDF variable in an Exodus file. The layout depends only on the
// netCDF structure of the file. The reader derives it from the file, and the writer derives the
// same layout again from the stored structure (the skeleton).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exodus/skeleton.h"
#include "mesh/extra_index.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

enum class Use : std::uint8_t {
  extra,  // the values become an extra, unless they can be derived from the rest of the mesh
  coordinates,
  connectivity,
  node_counts,  // the number of nodes of each polygon of a block
  array,
  faces,  // face data that is derived from the cells of polyhedra (polyhedra.h)
};

struct BlockLayout {
  CellShape shape = CellShape::other;
  NodeScheme scheme = NodeScheme::lagrange;
  std::uint32_t nodes_per_cell = 0;
  std::uint64_t cells = 0;
  // Index of the variable with the connectivity; -1 for polyhedra and for elements without nodes.
  int connectivity = -1;
  // Index of the variable with the number of nodes of each polygon, or the number of faces of each
  // polyhedron.
  int counts = -1;
  int faces = -1;  // index of the variable with the faces of all polyhedra

  BlockInfo elements() const { return {0, {}, shape, nodes_per_cell, scheme}; }
};

// A part of an array: its values on all vertices, on all cells, on the cells of one block, on the
// members of one set, or for the whole mesh.
struct ArrayPart {
  static constexpr std::uint32_t kEverything = ~std::uint32_t{0};
  std::uint32_t block = kEverything;  // index of the block or of the set
  // Index of the variable that contains the values. If it is -1, no variable contains the values;
  // they are the indices of the cells in the block, from 0.
  int variable = -1;
  std::uint64_t elements = 0;  // number of elements, if the array is neither on points nor on cells
};
struct ArrayLayout {
  // Description of the array. Its name is empty if the file stores the name of the array in a table
  // of names.
  ArrayInfo info;
  std::vector<ArrayPart> parts;  // parts of the array, in block order
  int field = 0;                 // number of the nodal, element, global or set variable, from 1; 0
                                 // for other arrays

  // A variable may have dimensions between the time dimension and the dimension of nodes or
  // elements. `leading` is the number of these dimensions. Each combination of indices into them
  // belongs to a separate array. `plane` is the number, from 0, of the combination to which this
  // array belongs. Old files store all nodal variables in one netCDF variable with such a
  // dimension, and users may add other variables of this kind.
  std::size_t leading = 0;
  std::uint64_t plane = 0;
  std::uint32_t column = 0;  // index of the first component of the array in its variable
};

struct Layout {
  std::uint64_t vertices = 0, cells = 0, steps = 0;
  ScalarType coordinate_type = ScalarType::float64;
  // True if a single variable contains the x coordinates of all nodes, followed by all y and all z
  // coordinates.
  bool coordinates_together = false;
  std::array<int, 3> coordinates{-1, -1, -1};  // indices of the variables with the coordinates
  std::vector<BlockLayout> blocks;
  std::vector<ArrayLayout> arrays;
  std::vector<Use> uses;  // use of each variable of the file
};

// Variables with values of all cells of a block or of all members of a set. The variable
// "<values>K<place>I" contains field K of block or set I, both numbered from 1. Its dimensions are
// time_step and "<count>I". The dimension `places` counts the blocks or sets. The variable `names`
// contains the names of the fields, `table` for each block or set the fields that it has.
struct FieldKind {
  Location location;
  std::string_view values, place, count, places, names, table;
};
inline constexpr std::array<FieldKind, 4> kFieldKinds{
    {{Location::cell, "vals_elem_var", "eb", "num_el_in_blk", "num_el_blk", "name_elem_var",
      "elem_var_tab"},
     {Location::node_set, "vals_nset_var", "ns", "num_nod_ns", "num_node_sets", "name_nset_var",
      "nset_var_tab"},
     {Location::side_set, "vals_sset_var", "ss", "num_side_ss", "num_side_sets", "name_sset_var",
      "sset_var_tab"},
     {Location::element_set, "vals_elset_var", "els", "num_ele_els", "num_elem_sets",
      "name_elset_var", "elset_var_tab"}}};
// Returns the name of the variable that contains the names of the fields at this location.
std::string_view names_of_fields(Location location);

// Derives the layout from a skeleton. Throws Failure (corrupt) if variables contradict each other.
// If `beside_mesh` is false, global and set variables are not arrays but extras. This is the case
// in .shm files of meshes without vertices and cells, and in files of versions before 0.10.
Layout lay_out(const Skeleton& skeleton, const Place& place, bool beside_mesh);

// Returns the number of elements of a part of an array.
std::uint64_t elements_of(const Layout& layout, const ArrayLayout& array, const ArrayPart& part);

// Changes the layout so that only the first `nodes` columns of a block's connectivity are nodes.
// The other columns become an array with the role "exodus:connectivity". In blocks of Bezier
// elements (BEX_HEX ...), these columns contain indices of coefficients.
void narrow_connectivity(const Skeleton& skeleton, Layout& layout, std::uint32_t block,
                         std::uint32_t nodes);
// Returns an upper bound on the number of columns of a block's connectivity that contain nodes:
// half of the columns for Bezier elements, otherwise all columns.
std::uint32_t node_columns(const Skeleton& skeleton, const BlockLayout& block);

// Returns the shape, the scheme and the number of nodes of the elements of a type.
BlockInfo element_block(std::string_view element_type, std::uint32_t nodes);
// Returns true if Exodus (SEACAS, Ioss) has an element type for the cells of a block, and
// exodus_permutation() returns the order of their nodes.
bool has_element_type(const BlockInfo& block);
// Returns the permutation between two node orders: node i in VTK's order is node result[i] in
// Exodus' order. Returns an empty list if the two orders are equal, or if the order of the nodes is
// that of the file because Exodus alone has such elements.
std::vector<std::uint16_t> exodus_permutation(const BlockInfo& block);

// A netCDF hyperslab: the start index and the count in each dimension of a variable. slab_of()
// returns the hyperslab that contains the elements `first` to `first` + `count` - 1 of a part of an
// array at a step.
struct Slab {
  std::vector<std::size_t> start, count;
};
Slab slab_of(const Skeleton& skeleton, const ArrayLayout& array, const ArrayPart& part,
             std::uint64_t step, std::uint64_t first, std::uint64_t count);

// A large variable is stored as several extras of about 16 MiB each. Returns the index of the first
// row of each extra, followed by the total number of rows.
std::vector<std::uint64_t> rows_of_parts(const Skeleton& skeleton, const Variable& variable);
std::string part_key(const std::string& key, std::size_t part);  // returns KEY, KEY/1, KEY/2 ...

bool is_integer(int nc_type);

// Returns the key of the extra that contains the values of variable `name`.
std::string extra_key(std::string_view name);
std::string plain_key(std::string_view name);  // returns "exodus/variable/NAME"

// Returns whether the values of variable `name` are vertex numbers, cell numbers or other data. In
// the file, vertex and cell numbers start at 1.
Reference reference_of(std::string_view name);

// Returns the type of an extra with references: int32 or int64. `stored` is the integer type in the
// file.
ScalarType reference_type(ScalarType stored);
// Converts values of type `type` to 64-bit integers. Returns nothing if `type` is not an integer
// type, or if a value does not fit into a signed 64-bit integer.
std::optional<std::vector<std::int64_t>> integers_of(ScalarType type,
                                                     const std::vector<std::byte>& values);
// Appends `value` to `out`, converted to `type`. Returns false if `type` is not an integer type or
// cannot represent the value.
bool append_integer(std::vector<std::byte>& out, ScalarType type, std::int64_t value);

// Returns the values of a variable, derived from the rest of the mesh. This is possible for ids,
// names, times, the truth table, flags that state whether blocks and sets have members, and
// distribution factors that are all 1. Returns nothing if the values of `variable` cannot be
// derived, or if its type cannot represent them.
std::optional<std::vector<std::byte>> derived_values(const Skeleton& skeleton, const Layout& layout,
                                                     std::size_t variable, const MeshInfo& info,
                                                     const ExtraIndex& extras);

// A kind of set. Keys of its extras begin with `folder`, and names of its netCDF variables with
// `prefix`. If `neutral` is true, shm/sets.h defines the keys, so that other formats know them too.
struct SetKind {
  std::string_view folder, prefix;
  bool neutral;
};
inline constexpr std::array<SetKind, 5> kSetKinds{{{"mesh/node_set/", "ns", true},
                                                   {"mesh/side_set/", "ss", true},
                                                   {"exodus/edge_set/", "es", false},
                                                   {"exodus/face_set/", "fs", false},
                                                   {"mesh/element_set/", "els", true}}};
inline constexpr std::string_view kMembersField = "members", kFactorsField = "factors";
std::string set_key(const SetKind& kind, std::size_t index, std::string_view field);
// Identifies a set. set_factors_of() returns the node, side or element set whose distribution
// factors are in the variable `name`. Returns nothing if no such set exists.
struct SetFactors {
  const SetKind* kind;
  std::size_t index;
};
std::optional<SetFactors> set_factors_of(std::string_view name);

// Returns row `index` of a table of names, without padding.
std::string name_in_table(const std::vector<std::byte>& table, std::uint64_t width,
                          std::uint64_t index);

// Converts the extras of .shm files from versions before 0.10 to the current form. Keys of sets
// become keys of shm/sets.h: "exodus/side_set/3/cells" becomes "mesh/side_set/3/members". Extras
// that can now be derived from the sets and the blocks are removed. In the skeleton, references to
// dimensions by index become references by name. Equal meshes therefore have equal skeletons,
// whatever the version of their files. Other extras stay unchanged.
void translate_old_extras(MeshInfo& info);

}  // namespace shm::converters::exodus
