// Node sets, side sets and groups of elements of a mesh, out of its extras, in a form that no
// format owns: what goes from one format to another.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

struct TransferSet {
  enum class Kind { nodes, sides, elements };
  Kind kind = Kind::nodes;
  std::int64_t id = 0;
  std::string name;
  std::vector<std::int64_t> members;  // vertices or cells, all of them in the mesh
  std::vector<std::int64_t> sides;    // of each cell of a side set, from 1, as Exodus counts them
  std::vector<std::uint32_t> blocks;  // elements: those of these blocks, instead of members
  bool weighted = false;              // it has distribution factors other than 1
  std::string label() const;          // "side set 3 'inlet'"
  std::string short_name() const;     // its name, or "side_set_3"
};

// Extras "mesh/node_set/<i>/...", "mesh/side_set/<i>/..." and "mesh/element_set/<i>/..." with id,
// name, members (references) and sides: how the sets reach a writer.
std::vector<Extra> extras_of_sets(const std::vector<TransferSet>& sets);
std::vector<TransferSet> sets_of_extras(const MeshInfo& info);
std::vector<TransferSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& used);

// Where the extras of a format have sets of one kind: "format/<folder>/<i>/...", members in
// ".../<members>".
struct SetKeys {
  TransferSet::Kind kind;
  const char *folder, *members;
};
std::vector<TransferSet> sets_in_folders(const MeshInfo& info, std::string_view format,
                                         std::span<const SetKeys> kinds,
                                         std::set<std::string>& used);

// Sets of whole blocks become lists of cells. Walks the cells when there are such sets.
void list_members(MeshSource& mesh, std::vector<TransferSet>& sets);

}  // namespace shm::converters
