// Layout: what the variables of a netCDF file mean in Exodus. Derived from the structure alone, so
// the reader finds it in a file and the writer finds the same again in a skeleton.
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
  extra,  // a value list, or derived from the rest of the mesh
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
  int counts = -1;        // variable: nodes of each polygon, faces of each polyhedron
  int faces = -1;         // variable: faces of all polyhedra
};

// The values of an array on some of its elements: all vertices, all cells, or the cells of a block.
struct ArrayPart {
  static constexpr std::uint32_t kEverything = ~std::uint32_t{0};
  std::uint32_t block = kEverything;
  int variable = -1;  // none: the cells of the block, numbered from 0
};
struct ArrayLayout {
  ArrayInfo info;                // without a name when the file's tables have it
  std::vector<ArrayPart> parts;  // by block
  int field = 0;                 // number of the nodal or element variable, from 1
  // Dimensions between the step and the elements, and the array's place in them: the one variable
  // for all nodal fields of old files, or what users add.
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
  std::vector<Use> uses;  // of each variable
};

// Throws corrupt when variables contradict each other.
Layout lay_out(const Skeleton& skeleton, const Place& place);

// Takes the first `nodes` columns of the connectivity of a block as the nodes of its cells, and
// makes the others an array with role "exodus:connectivity": Bezier elements (BEX_HEX ...) number
// their coefficients there.
void narrow_connectivity(const Skeleton& skeleton, Layout& layout, std::uint32_t block,
                         std::uint32_t nodes);
// How many columns of a block may be nodes, as far as the element type is known.
std::uint32_t node_columns(const Skeleton& skeleton, const BlockLayout& block);

CellShape shape_of(std::string_view element_type, std::uint32_t nodes);
// For each node in VTK's order its place in Exodus' order; empty: the same.
std::vector<std::uint8_t> node_places(CellShape shape, std::uint32_t nodes);

// Where `count` values from `first` on (of the part, at a step) lie in the part's variable.
struct Slab {
  std::vector<std::size_t> start, count;
};
Slab slab_of(const Skeleton& skeleton, const ArrayLayout& array, const ArrayPart& part,
             std::uint64_t step, std::uint64_t first, std::uint64_t count);

// First rows of the parts that carry a variable, and behind them the end: each of about 16 MiB, so
// that no extra is large, however large the variable.
std::vector<std::uint64_t> rows_of_parts(const Skeleton& skeleton, const Variable& variable);
std::string part_key(const std::string& key, std::size_t part);  // KEY, KEY/1, KEY/2 ...

bool is_integer(int nc_type);

// Key of the extra that carries variable `name`.
std::string extra_key(std::string_view name);
std::string plain_key(std::string_view name);  // "exodus/variable/NAME"
// What the numbers of variable `name` count from 1.
Reference reference_of(std::string_view name);

// References travel as int32 or int64, whatever integers the file has.
ScalarType reference_type(ScalarType stored);
// Null when `type` is no integer or a value is beyond 64 bits with a sign.
std::optional<std::vector<std::int64_t>> integers_of(ScalarType type,
                                                     const std::vector<std::byte>& values);
// False when `type` is no integer or cannot hold the value.
bool append_integer(std::vector<std::byte>& out, ScalarType type, std::int64_t value);

// Values of a variable that follows from the rest of the mesh: ids, names, times, truth table,
// whether blocks and sets have members, distribution factors of 1.
// Null when `variable` is no such one or its type cannot hold them.
std::optional<std::vector<std::byte>> derived_values(const Skeleton& skeleton, const Layout& layout,
                                                     std::size_t variable, const MeshInfo& info,
                                                     const ExtraIndex& extras);

// Sets of entities: where their extras are (those of shm/sets.h are neutral), what their variables
// are called.
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
// Of a neutral set, when variable `name` has its distribution factors.
struct SetFactors {
  const SetKind* kind;
  std::size_t index;
};
std::optional<SetFactors> set_factors_of(std::string_view name);

// Row `index` of a table of names, without padding.
std::string name_in_table(const std::vector<std::byte>& table, std::uint64_t width,
                          std::uint64_t index);

// Extras as files before 0.10 have them: sets get the keys of shm/sets.h, "exodus/side_set/3/cells"
// those of "mesh/side_set/3/members", and what follows from them and the blocks goes, so that the
// extras are those that an Exodus file gives now. Others stay as they are, all of them where the
// mesh has none of the old keys. The skeleton names its dimensions, so that the same mesh has the
// same one whatever file it is in.
void translate_old_extras(MeshInfo& info);

}  // namespace shm::converters::exodus
