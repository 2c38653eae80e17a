#include "sets/transfer_sets.h"

#include <algorithm>
#include <utility>

#include "base/failure.h"
#include "mesh/mesh_source.h"
#include "sets/set_folders.h"

namespace shm::converters {
namespace {

using Kind = MeshSet::Kind;

const char* words_of(Kind kind, bool spaced) {
  switch (kind) {
    case Kind::nodes: return spaced ? "node set" : "node_set";
    case Kind::sides: return spaced ? "side set" : "side_set";
    case Kind::elements: return spaced ? "element set" : "element_set";
  }
  return "";
}

// Throws Failure if the sets have too many members in total. Each set is converted to a list of its
// cells, and a cell may belong to many sets, so a small file could result in very long lists.
void check_members(std::uint64_t members, std::uint64_t cells) {
  constexpr std::uint64_t kAlwaysAllowed = 1 << 22, kMostSetsOfCell = 64;
  if (members > std::max(kAlwaysAllowed, kMostSetsOfCell * cells))
    throw Failure(Error{.code = ErrorCode::over_limit,
                        .detail = "cells are in more than " + std::to_string(kMostSetsOfCell) +
                                  " groups on the average",
                        .section = "groups"});
}

}  // namespace

Location location_of(MeshSet::Kind kind) {
  if (kind == MeshSet::Kind::nodes) return Location::node_set;
  return kind == MeshSet::Kind::sides ? Location::side_set : Location::element_set;
}

std::string label_of(const MeshSet& set) {
  std::string text = std::string(words_of(set.kind, true)) + ' ' + std::to_string(set.id);
  return set.name.empty() ? text : text + " '" + set.name + "'";
}

std::string short_name_of(const MeshSet& set) {
  return set.name.empty() ? std::string(words_of(set.kind, false)) + '_' + std::to_string(set.id)
                          : set.name;
}

bool has_usual_factors(const MeshSet& set) {
  if (!set.blocks.empty()) return false;
  return set.kind == MeshSet::Kind::sides ? set.factors.size() >= set.members.size()
                                          : set.factors.size() == set.members.size();
}

std::vector<Extra> set_extras(const std::vector<MeshSet>& sets) {
  return unwrap(extras_of_sets(sets), {});
}

std::vector<MeshSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& used) {
  const SetBounds bounds{info.vertices, info.cells(), info.schema.blocks.size()};
  std::vector<MeshSet> sets;
  for (const SetPlace& place : find_sets(info.extras)) {
    auto set = read_set(info.extras, place, bounds);
    if (!set) continue;
    for (const std::size_t index : place.extras) used.insert(info.extras[index].key);
    sets.push_back(std::move(*set));
  }
  return sets;
}

std::vector<MeshSet> sets_of_extras(const MeshInfo& info) {
  std::set<std::string> used;
  return sets_of_extras(info, used);
}

void erase_set_folders(std::vector<Extra>& extras) {
  std::erase_if(extras, [](const Extra& extra) {
    const auto folder = set_folder_of(extra.key);
    return folder && folder->format == "mesh";
  });
}

void list_members(MeshSource& mesh, std::vector<MeshSet>& sets) {
  std::vector<std::vector<MeshSet*>> of_block(mesh.info().schema.blocks.size());
  std::uint64_t members = 0;
  // Compute the number of cells only once, because cells() adds up the cells of all blocks.
  const std::uint64_t cells = mesh.info().cells();
  for (MeshSet& set : sets)
    for (const std::uint32_t block : set.blocks) {
      of_block.at(block).push_back(&set);
      members += mesh.info().block_cells[block];
      check_members(members, cells);
    }
  std::uint64_t cell = 0;
  CellBatch batch;
  mesh.rewind_cells();
  while (members > 0 && mesh.next_cells(batch, kCellsAtOnce))
    for (const std::uint32_t block : batch.blocks) {
      for (MeshSet* set : of_block[block]) set->members.push_back(cell);
      ++cell;
    }
  for (MeshSet& set : sets) set.blocks.clear();
}

}  // namespace shm::converters
