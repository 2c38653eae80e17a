// Layout: the meaning of the variables of a netCDF file in Exodus. It is derived from the structure
// only, so the reader finds it in a file and the writer finds the same layout again in a skeleton.
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
  extra,  // list of values, or derived from the rest of the mesh
  coordinates,
  connectivity,
  node_counts,  // of the polygons of a block
  array,
  faces,  // follows from the cells, which are polyhedra (polyhedra.h)
};

struct BlockLayout {
  CellShape shape = CellShape::other;
  std::uint32_t nodes_per_cell = 0;
  std::uint64_t cells = 0;
  int connectivity = -1;  // variable; -1: elements without nodes, or polyhedra
  int counts = -1;  // variable: number of nodes of each polygon, or of faces of each polyhedron
  int faces = -1;   // variable: faces of all polyhedra
};

// The values of an array on some of its elements: on all vertices, all cells, or the cells of a
// block.
struct ArrayPart {
  static constexpr std::uint32_t kEverything = ~std::uint32_t{0};
  std::uint32_t block = kEverything;
  int variable = -1;  // -1: the cells of the block, numbered from 0
};
struct ArrayLayout {
  ArrayInfo info;                // without a name if tables of the file give it
  std::vector<ArrayPart> parts;  // by block
  int field = 0;                 // number of the nodal or element variable, from 1
  // Number of dimensions between the step and the elements, and the array's index in them: used by
  // the single variable for all nodal fields of old files, and by additional variables of users.
  std::size_t leading = 0;
  std::uint64_t plane = 0;
  std::uint32_t column = 0;  // first of the array's columns in its variable
};

struct Layout {
  std::uint64_t vertices = 0, cells = 0, steps = 0;
  ScalarType coordinate_type = ScalarType::float64;
  bool coordinates_together = false;           // one variable, coordinate by coordinate
  std::array<int, 3> coordinates{-1, -1, -1};  // variables
  std::vector<BlockLayout> blocks;
  std::vector<ArrayLayout> arrays;
  std::vector<Use> uses;  // by variable
};

// Finds the layout of a skeleton. Throws corrupt if variables contradict each other.
Layout lay_out(const Skeleton& skeleton, const Place& place);

// Uses the first `nodes` columns of a block's connectivity as the nodes of its cells, and makes an
// array with role "exodus:connectivity" of the other columns, in which Bezier elements (BEX_HEX
// ...) number their coefficients.
void narrow_connectivity(const Skeleton& skeleton, Layout& layout, std::uint32_t block,
                         std::uint32_t nodes);
// Returns the maximum number of columns of a block that may be nodes, as far as its element type is
// known.
std::uint32_t node_columns(const Skeleton& skeleton, const BlockLayout& block);

CellShape shape_of(std::string_view element_type, std::uint32_t nodes);
// Returns for each node in VTK's order its position in Exodus' order; empty: the same order.
std::vector<std::uint8_t> node_places(CellShape shape, std::uint32_t nodes);

// The hyperslab of a part's variable with `count` values from `first` on (of the part, at a step).
struct Slab {
  std::vector<std::size_t> start, count;
};
Slab slab_of(const Skeleton& skeleton, const ArrayLayout& array, const ArrayPart& part,
             std::uint64_t step, std::uint64_t first, std::uint64_t count);

// Returns the first rows of the extras that hold a variable, followed by the number of rows. Each
// extra has about 16 MiB, so that no extra is large, however large the variable is.
std::vector<std::uint64_t> rows_of_parts(const Skeleton& skeleton, const Variable& variable);
std::string part_key(const std::string& key, std::size_t part);  // KEY, KEY/1, KEY/2 ...

bool is_integer(int nc_type);

// Key of the extra that holds variable `name`.
std::string extra_key(std::string_view name);
std::string plain_key(std::string_view name);  // "exodus/variable/NAME"
// Returns the kind of entities whose numbers, from 1, variable `name` holds.
Reference reference_of(std::string_view name);

// References are stored as int32 or int64, regardless of the integer type in the file.
ScalarType reference_type(ScalarType stored);
// Returns null if `type` is not an integer type, or if a value does not fit in a signed 64-bit
// integer.
std::optional<std::vector<std::int64_t>> integers_of(ScalarType type,
                                                     const std::vector<std::byte>& values);
// Returns false if `type` is not an integer type or cannot hold the value.
bool append_integer(std::vector<std::byte>& out, ScalarType type, std::int64_t value);

// Returns the values of a variable that follows from the rest of the mesh: ids, names, times, truth
// table, whether blocks and sets have members, distribution factors of 1. Returns null if
// `variable` is not such a variable, or if its type cannot hold the values.
std::optional<std::vector<std::byte>> derived_values(const Skeleton& skeleton, const Layout& layout,
                                                     std::size_t variable, const MeshInfo& info,
                                                     const ExtraIndex& extras);

// Kinds of sets: the folder of their extras (`neutral`: that of shm/sets.h), and the prefix in the
// names of their variables.
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
// A neutral set; set_factors_of() returns the set if variable `name` holds its distribution
// factors.
struct SetFactors {
  const SetKind* kind;
  std::size_t index;
};
std::optional<SetFactors> set_factors_of(std::string_view name);

// Returns row `index` of a table of names, without padding.
std::string name_in_table(const std::vector<std::byte>& table, std::uint64_t width,
                          std::uint64_t index);

// Converts extras of files before 0.10 to the extras that reading the Exodus file gives now. Sets
// get the keys of shm/sets.h ("exodus/side_set/3/cells" becomes "mesh/side_set/3/members"), and
// extras that follow from the sets and the blocks are removed. Other extras stay unchanged; so do
// all extras if the mesh has none of the old keys. The skeleton is changed to name its dimensions,
// so that equal meshes have equal skeletons regardless of the file's version.
void translate_old_extras(MeshInfo& info);

}  // namespace shm::converters::exodus
