// Layout: the meaning that the variables of a netCDF file have in Exodus. The layout depends only
// on the structure of the file. The reader derives it from a file, and the writer derives the same
// layout again from a skeleton (the stored structure).
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
  extra,  // values that become an extra, or are derived from the rest of the mesh
  coordinates,
  connectivity,
  node_counts,  // the number of nodes of each polygon of a block
  array,
  faces,  // faces that are derived from cells that are polyhedra (polyhedra.h)
};

struct BlockLayout {
  CellShape shape = CellShape::other;
  std::uint32_t nodes_per_cell = 0;
  std::uint64_t cells = 0;
  // Index of the variable with the connectivity; -1 for polyhedra and for elements without nodes.
  int connectivity = -1;
  // Index of the variable with the number of nodes of each polygon, or the number of faces of each
  // polyhedron.
  int counts = -1;
  int faces = -1;  // index of the variable with the faces of all polyhedra
};

// A part of an array: its values on all vertices, on all cells, or on the cells of one block.
struct ArrayPart {
  static constexpr std::uint32_t kEverything = ~std::uint32_t{0};
  std::uint32_t block = kEverything;
  // Index of the variable with the values. If it is -1, the values are the numbers of the block's
  // cells, from 0.
  int variable = -1;
};
struct ArrayLayout {
  // Description of the array; its name is empty if a table of the file contains the name.
  ArrayInfo info;
  std::vector<ArrayPart> parts;  // parts of the array, in the order of blocks
  int field = 0;                 // number of the nodal or element variable in the file, from 1

  // Number of dimensions between the dimension of steps and the dimension of elements, and the
  // index of the array in these dimensions. Needed for the single variable of all nodal fields in
  // old files, and for variables that users add.
  std::size_t leading = 0;
  std::uint64_t plane = 0;
  std::uint32_t column = 0;  // index of the array's first column in its variable
};

struct Layout {
  std::uint64_t vertices = 0, cells = 0, steps = 0;
  ScalarType coordinate_type = ScalarType::float64;
  // True if a single variable contains all coordinates: x of all nodes, then y, then z.
  bool coordinates_together = false;
  std::array<int, 3> coordinates{-1, -1, -1};  // indices of the variables with the coordinates
  std::vector<BlockLayout> blocks;
  std::vector<ArrayLayout> arrays;
  std::vector<Use> uses;  // use of each variable of the file
};

// Finds the layout of a skeleton. Throws Failure (corrupt) if variables contradict each other.
Layout lay_out(const Skeleton& skeleton, const Place& place);

// Declares that only the first `nodes` columns of a block's connectivity are the nodes of its
// cells. Bezier elements (BEX_HEX ...) number their coefficients in the other columns, which become
// an array with the role "exodus:connectivity".
void narrow_connectivity(const Skeleton& skeleton, Layout& layout, std::uint32_t block,
                         std::uint32_t nodes);
// Returns the largest number of columns of a block's connectivity that may be nodes. The element
// type determines this number if the type is known.
std::uint32_t node_columns(const Skeleton& skeleton, const BlockLayout& block);

CellShape shape_of(std::string_view element_type, std::uint32_t nodes);
// Returns the position in Exodus' order of each node in VTK's order. Returns an empty list if the
// two orders are equal.
std::vector<std::uint8_t> node_places(CellShape shape, std::uint32_t nodes);

// The hyperslab (start and count per dimension) of the variable that stores a part of an array. It
// contains `count` values of the part at a step, starting with value `first`.
struct Slab {
  std::vector<std::size_t> start, count;
};
Slab slab_of(const Skeleton& skeleton, const ArrayLayout& array, const ArrayPart& part,
             std::uint64_t step, std::uint64_t first, std::uint64_t count);

// A variable is stored in extras of about 16 MiB each, so that no extra is large. Returns the
// number of the first row of each extra, followed by the total number of rows.
std::vector<std::uint64_t> rows_of_parts(const Skeleton& skeleton, const Variable& variable);
std::string part_key(const std::string& key, std::size_t part);  // returns KEY, KEY/1, KEY/2 ...

bool is_integer(int nc_type);

// Returns the key of the extra that contains variable `name`.
std::string extra_key(std::string_view name);
std::string plain_key(std::string_view name);  // returns "exodus/variable/NAME"

// Returns the kind of entities (vertices, cells or none) to which the numbers in variable `name`
// refer. The numbers start at 1.
Reference reference_of(std::string_view name);

// Returns the type in which references are stored: int32 or int64, whatever the integer type in the
// file is.
ScalarType reference_type(ScalarType stored);
// Converts values of type `type` to 64-bit integers. Returns nothing if `type` is not an integer
// type, or if a value does not fit into a signed 64-bit integer.
std::optional<std::vector<std::int64_t>> integers_of(ScalarType type,
                                                     const std::vector<std::byte>& values);
// Appends a value as a value of `type`. Returns false if `type` is not an integer type or cannot
// represent the value.
bool append_integer(std::vector<std::byte>& out, ScalarType type, std::int64_t value);

// Returns the values of a variable that is determined by the rest of the mesh: ids, names, times,
// truth table, flags that state whether blocks and sets have members, distribution factors of 1.
// Returns nothing if `variable` is not such a variable, or if its type cannot represent the values.
std::optional<std::vector<std::byte>> derived_values(const Skeleton& skeleton, const Layout& layout,
                                                     std::size_t variable, const MeshInfo& info,
                                                     const ExtraIndex& extras);

// A kind of set. Its extras have keys that begin with a prefix (the prefix of shm/sets.h if
// `neutral` is true), and its variables have names that begin with another prefix.
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
// A set of a kind that shm/sets.h covers (a neutral kind). set_factors_of() returns the set whose
// distribution factors are stored in variable `name`, if there is such a set.
struct SetFactors {
  const SetKind* kind;
  std::size_t index;
};
std::optional<SetFactors> set_factors_of(std::string_view name);

// Returns row `index` of a table of names, without padding.
std::string name_in_table(const std::vector<std::byte>& table, std::uint64_t width,
                          std::uint64_t index);

// Converts extras of .shm files before 0.10 to the extras that reading the Exodus file produces
// now. Sets receive the keys of shm/sets.h ("exodus/side_set/3/cells" becomes
// "mesh/side_set/3/members"). Extras that are determined by the sets and the blocks are removed.
// Other extras stay unchanged; if the mesh has no old keys, all extras stay unchanged. In the
// skeleton, the names of dimensions replace references by index, so that equal meshes have equal
// skeletons whatever the version of the file is.
void translate_old_extras(MeshInfo& info);

}  // namespace shm::converters::exodus
