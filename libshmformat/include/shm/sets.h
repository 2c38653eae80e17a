// Sets of a mesh: nodes, sides of cells, or cells that have a number and a name together. In a file
// they are extras "mesh/node_set/I/...", "mesh/side_set/I/..." and "mesh/element_set/I/...",
// whatever format they came from (spec/registry.md, "Open names"); here extras become sets, and
// sets extras. Files before 0.10 have sets under keys of their source format, which these functions
// pass over: `shm compress old.shm -o new.shm` gives them the others.
//   shm::Mesh mesh = ...;
//   const auto sets = shm::sets_of(mesh);           // out of mesh.extras
//   auto extras = shm::extras_of_sets({&inlet, 1});  // for mesh.extras, or Writer::add_extra
// Plain values: what a call gives owns what it holds, and borrows nothing of its arguments. Calls
// in several threads are independent.
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
  std::int64_t id = 0;  ///< any; of several sets of a kind it need not be unique
  std::string name;     ///< may be empty
  /// From 0, in any order: vertices of node sets, cells of the others. Follow a renumbering of the
  /// mesh as long as they are extras.
  std::vector<std::uint64_t> members;
  /// Of side sets: which side of each member, from 1 to 2^31 - 1, as Exodus counts. Of a
  /// hexahedron: 1 {0 1 5 4}, 2 {1 2 6 5}, 3 {2 3 7 6}, 4 {0 4 7 3}, 5 {0 3 2 1}, 6 {4 5 6 7}.
  std::vector<std::int32_t> sides;
  /// Of element sets: indices into Schema::blocks. All cells of these belong to it, beside members.
  std::vector<std::uint32_t> blocks;
  /// Distribution factors, where not all of them are 1; else empty. Of nodes and elements one for
  /// each member; of sides one for each node of each side, one side behind the other. There are
  /// files with other numbers of them, so this is not checked.
  std::vector<double> factors;
  bool operator==(const MeshSet&) const = default;
};

/// How many vertices, cells and blocks a mesh has: members are below.
struct SetBounds {
  std::uint64_t vertices = 0, cells = 0, blocks = 0;
};

/// All sets, in the order in which they begin. ErrorCode::corrupt where one makes no sense: members
/// or blocks that the mesh has not, sides that are not as many as the members, values of a wrong
/// type. Error::section then is its folder of keys. Takes as much memory as the sets,
/// which is at most 8 times that of their extras.
SHM_API Result<std::vector<MeshSet>> sets_of_extras(std::span<const Extra> extras,
                                                    const SetBounds& bounds);
/// Those of mesh.extras.
SHM_API Result<std::vector<MeshSet>> sets_of(const Mesh& mesh);

/// What holds the sets: id (left out where it is 1 more than the number of the folder, and members
/// or blocks show that there is a set), name where there is one, members, sides, blocks, factors.
/// Folders are numbered from 0 for each kind, in the order of `sets`. Integers have 32 bits where
/// those hold all of an extra, factors are float32 where those do. ErrorCode::misuse where there
/// are not as many sides as members, or a kind has what it cannot have.
SHM_API Result<std::vector<Extra>> extras_of_sets(std::span<const MeshSet> sets);

// One by one, for who wants to go on where a set makes no sense.

/// Where one set stands: which of the extras hold it.
struct SetPlace {
  MeshSet::Kind kind = MeshSet::Kind::nodes;
  std::uint64_t number = 0;  ///< of its folder: the I in its keys
  std::vector<std::size_t>
      extras;  ///< indices, ascending; what is not known in a folder is no part
};

/// In the order in which they begin. A second extra with a key that was there already is passed
/// over.
SHM_API std::vector<SetPlace> find_sets(std::span<const Extra> extras);
/// `place`: one that find_sets() gave for the same extras. Errors as those of sets_of_extras().
SHM_API Result<MeshSet> read_set(std::span<const Extra> extras, const SetPlace& place,
                                 const SetBounds& bounds);

/// "mesh/side_set/3/": what the keys of a set begin with.
SHM_API std::string set_folder(MeshSet::Kind kind, std::uint64_t number);

}  // namespace shm
