// Node sets, side sets and groups of elements of a mesh, out of its extras, in a form that no
// format owns: what goes from one format to another.
#pragma once

#include <cstdint>
#include <set>
#include <string>
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

// Those of the format that the mesh came from, and those of extras_of_sets(). `told` gets the keys
// of the extras whose content the result has.
std::vector<TransferSet> transfer_sets(const MeshInfo& info, std::set<std::string>& told);

// Extras "mesh/node_set/<i>/...", "mesh/side_set/<i>/..." and "mesh/element_set/<i>/..." with id,
// name, members (references) and sides: how the sets reach a writer.
std::vector<Extra> extras_of_sets(const std::vector<TransferSet>& sets);
std::vector<TransferSet> sets_of_extras(const MeshInfo& info);
std::vector<TransferSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& told);

// Sets of whole blocks become lists of cells. Walks the cells when there are such sets.
void list_members(MeshSource& mesh, std::vector<TransferSet>& sets);

// Whether the mesh is one of two dimensions, so that sides of its triangles and quads are edges.
bool is_flat(const MeshInfo& info);

// Text and integers of an extra; empty when it holds something else.
std::string text_of_extra(const Extra& extra);
std::vector<std::int64_t> integers_of_extra(const Extra& extra);
// Null when there is none; looks at all of them (see ExtraIndex).
const Extra* find_extra(const MeshInfo& info, const std::string& key);

}  // namespace shm::converters
