// Layout: the meaning that the variables of a netCDF file have in Exodus. It is derived from the
// structure only. The reader derives it from a file, and the writer derives the same layout again
// from a skeleton.
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
  extra,  // a list of values that is an extra, or is derived from the rest of the mesh
  coordinates,
  connectivity,
  node_counts,  // numbers of nodes of the polygons of a block
  array,
  faces,  // faces, which are derived from cells that are polyhedra (polyhedra.h)
};

struct BlockLayout {
  CellShape shape = CellShape::other;
  std::uint32_t nodes_per_cell = 0;
  std::uint64_t cells = 0;
  // Variable with the connectivity; -1: elements without nodes, or polyhedra.
  int connectivity = -1;
  // Variable with the number of nodes of each polygon, or of faces of each polyhedron.
  int counts = -1;
  int faces = -1;  // variable with the faces of all polyhedra
};

// The values of an array on all vertices, on all cells, or on the cells of one block.
struct ArrayPart {
  static constexpr std::uint32_t kEverything = ~std::uint32_t{0};
  std::uint32_t block = kEverything;
  // Variable with the values; -1: the values are the numbers of the block's cells, from 0.
  int variable = -1;
};
struct ArrayLayout {
  ArrayInfo info;  // description of the array; the name is empty if it is in a table of the file
  std::vector<ArrayPart> parts;  // parts of the array, in the order of blocks
  int field = 0;                 // number of the nodal or element variable, from 1

  // Number of dimensions between the step and the elements, and the array's index in these
  // dimensions. Used by the single variable for all nodal fields of old files, and by additional
  // variables of users.
  std::size_t leading = 0;
  std::uint64_t plane = 0;
  std::uint32_t column = 0;  // index of the array's first column in its variable
};

struct Layout {
  std::uint64_t vertices = 0, cells = 0, steps = 0;
  ScalarType coordinate_type = ScalarType::float64;
  // True: one variable contains all coordinates, first x of all nodes, then y, then z.
  bool coordinates_together = false;
  std::array<int, 3> coordinates{-1, -1, -1};  // variables with the coordinates
  std::vector<BlockLayout> blocks;
  std::vector<ArrayLayout> arrays;
  std::vector<Use> uses;  // use of each variable
};

// Finds the layout of a skeleton. Throws Failure (corrupt) if variables contradict each other.
Layout lay_out(const Skeleton& skeleton, const Place& place);

// Uses the first `nodes` columns of a block's connectivity as the nodes of its cells. The other
// columns, in which Bezier elements (BEX_HEX ...) number their coefficients, become an array with
// role "exodus:connectivity".
void narrow_connectivity(const Skeleton& skeleton, Layout& layout, std::uint32_t block,
                         std::uint32_t nodes);
// Returns the largest number of columns of a block that may be nodes, depending on its element type
// if that is known.
std::uint32_t node_columns(const Skeleton& skeleton, const BlockLayout& block);

CellShape shape_of(std::string_view element_type, std::uint32_t nodes);
// Returns, for each node in VTK's order, its position in Exodus' order. Returns an empty list if
// both orders are the same.
std::vector<std::uint8_t> node_places(CellShape shape, std::uint32_t nodes);

// The hyperslab of a part's variable that contains `count` values of the part at a step, starting
// with value `first`.
struct Slab {
  std::vector<std::size_t> start, count;
};
Slab slab_of(const Skeleton& skeleton, const ArrayLayout& array, const ArrayPart& part,
             std::uint64_t step, std::uint64_t first, std::uint64_t count);

// Returns the numbers of the first row of each extra that stores a part of a variable, followed by
// the total number of rows. Each extra has about 16 MiB, so no extra is large even if the variable
// is.
std::vector<std::uint64_t> rows_of_parts(const Skeleton& skeleton, const Variable& variable);
std::string part_key(const std::string& key, std::size_t part);  // returns KEY, KEY/1, KEY/2 ...

bool is_integer(int nc_type);

// Key of the extra that holds variable `name`.
std::string extra_key(std::string_view name);
std::string plain_key(std::string_view name);  // returns "exodus/variable/NAME"

// Returns the kind of entities to which the numbers in variable `name`, from 1, refer.
Reference reference_of(std::string_view name);

// Returns the type in which references are stored: int32 or int64, regardless of the integer type
// in the file.
ScalarType reference_type(ScalarType stored);
// Converts values to 64-bit integers. Returns nothing if `type` is not an integer type, or if a
// value does not fit in a signed 64-bit integer.
std::optional<std::vector<std::int64_t>> integers_of(ScalarType type,
                                                     const std::vector<std::byte>& values);
// Appends a value as `type`. Returns false if `type` is not an integer type or cannot hold the
// value.
bool append_integer(std::vector<std::byte>& out, ScalarType type, std::int64_t value);

// Returns the values of a variable that is determined by the rest of the mesh: ids, names, times,
// truth table, whether blocks and sets have members, distribution factors of 1. Returns nothing if
// `variable` is not such a variable, or if its type cannot hold the values.
std::optional<std::vector<std::byte>> derived_values(const Skeleton& skeleton, const Layout& layout,
                                                     std::size_t variable, const MeshInfo& info,
                                                     const ExtraIndex& extras);

// A kind of set: the prefix of the keys of its extras (`neutral`: the prefix of shm/sets.h), and
// the prefix in the names of its variables.
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
// A set of a neutral kind. set_factors_of() returns the set whose distribution factors are stored
// in variable `name`, if there is one.
struct SetFactors {
  const SetKind* kind;
  std::size_t index;
};
std::optional<SetFactors> set_factors_of(std::string_view name);

// Returns row `index` of a table of names, without padding.
std::string name_in_table(const std::vector<std::byte>& table, std::uint64_t width,
                          std::uint64_t index);

// Converts extras of files before 0.10 to the extras that reading the Exodus file gives now. Sets
// get the keys of shm/sets.h ("exodus/side_set/3/cells" becomes "mesh/side_set/3/members"). Extras
// that are determined by the sets and the blocks are removed. Other extras stay unchanged; if the
// mesh has none of the old keys, all extras stay unchanged. In the skeleton, references to
// dimensions by index are replaced by their names, so that equal meshes have equal skeletons
// regardless of the file's version.
void translate_old_extras(MeshInfo& info);

}  // namespace shm::converters::exodus
