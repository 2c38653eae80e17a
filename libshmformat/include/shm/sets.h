// Sets of a mesh: nodes, sides of cells, or cells, each set with a number and a name. A file stores
// sets as extras "mesh/node_set/I/...", "mesh/side_set/I/..." and "mesh/element_set/I/...",
// whatever the source format (spec/registry.md, "Open names"). The functions below convert extras
// to sets and back. Files of format versions before 0.10 store sets under keys of their source
// format. These functions ignore such keys; `shm compress old.shm -o new.shm` converts them.
//   shm::Mesh mesh = ...;
//   const auto sets = shm::sets_of(mesh);            // from mesh.extras
//   auto extras = shm::extras_of_sets({&inlet, 1});  // for mesh.extras, or Writer::add_extra
// Results are plain values: they own their data and do not refer to the arguments. Calls in several
// threads are independent.
// spec: "Extras"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "shm/result.h"
#include "shm/schema.h"

namespace shm {

struct Mesh;

struct MeshSet {
  enum class Kind : std::uint8_t { nodes = 0, sides = 1, elements = 2 };
  Kind kind = Kind::nodes;
  std::int64_t id = 0;  ///< number of the set; need not be unique, even within a kind
  std::string name;     ///< name of the set; may be empty
  /// Numbers of the members, from 0, in any order. The members of a node set are vertices, those of
  /// other sets are cells. If the mesh is renumbered, the member numbers in the extras that store
  /// the set are changed too.
  std::vector<std::uint64_t> members;
  /// Sides of the member cells, for side sets: one side for each member, from 1 to 2^31 - 1,
  /// numbered as in Exodus. Sides of a hexahedron: 1 {0 1 5 4}, 2 {1 2 6 5}, 3 {2 3 7 6}, 4 {0 4 7
  /// 3}, 5 {0 3 2 1}, 6 {4 5 6 7}.
  std::vector<std::int32_t> sides;
  /// Blocks of an element set (indices into Schema::blocks). All cells of these blocks belong to
  /// the set, in addition to the members.
  std::vector<std::uint32_t> blocks;
  /// Distribution factors; empty if all factors are 1. Node and element sets have one factor per
  /// member. Side sets have one factor per node of each side, side after side. Some files contain a
  /// different number of factors, so the number is not checked.
  std::vector<double> factors;
  bool operator==(const MeshSet&) const = default;
};

/// Counts of the vertices, cells and blocks of a mesh. Numbers in sets must be smaller than these
/// counts.
struct SetBounds {
  std::uint64_t vertices = 0, cells = 0, blocks = 0;
};

/// Returns all sets, in the order of their first extras. Fails with ErrorCode::corrupt if a set is
/// invalid: it has members or blocks that the mesh does not have, the number of its sides differs
/// from the number of its members, or its values have a wrong type. Error::section is then the
/// common prefix of the set's keys. The sets need at most 8 times the memory of their extras.
SHM_API Result<std::vector<MeshSet>> sets_of_extras(std::span<const Extra> extras,
                                                    const SetBounds& bounds);
/// Returns the sets of mesh.extras.
SHM_API Result<std::vector<MeshSet>> sets_of(const Mesh& mesh);

/// Returns the extras that store the sets: id, name (if there is one), members, sides, blocks,
/// factors. The id is omitted if it equals 1 plus the number of the set in the keys. The id of a
/// set with neither members nor blocks is always stored, because otherwise the file would not show
/// that the set exists. The sets of each kind are numbered from 0, in the order of `sets`. Integers
/// are stored with 32 bits if all numbers of an extra fit. Factors are stored as float32 if no
/// precision is lost. Fails with ErrorCode::misuse if the number of sides differs from the number
/// of members, or if a set has data that its kind cannot have.
SHM_API Result<std::vector<Extra>> extras_of_sets(std::span<const MeshSet> sets);

// Functions that convert single sets, for callers that continue after an invalid set.

/// Extras that store one set.
struct SetPlace {
  MeshSet::Kind kind = MeshSet::Kind::nodes;
  std::uint64_t number = 0;  ///< number I of the set in its keys, e.g. 3 in "mesh/side_set/3/"
  /// Indices of the set's extras, ascending. Extras with unknown fields are not listed.
  std::vector<std::size_t> extras;
};

/// Finds all sets, in the order of their first extras. If a key occurs twice, the second extra is
/// ignored.
SHM_API std::vector<SetPlace> find_sets(std::span<const Extra> extras);
/// Reads one set. `place` must come from find_sets() for the same extras. Fails under the same
/// conditions as sets_of_extras().
SHM_API Result<MeshSet> read_set(std::span<const Extra> extras, const SetPlace& place,
                                 const SetBounds& bounds);

/// Returns the prefix of the keys of a set, e.g. "mesh/side_set/3/".
SHM_API std::string set_folder(MeshSet::Kind kind, std::uint64_t number);

}  // namespace shm
