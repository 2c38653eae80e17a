#include "sets/transfer_sets.h"

#include <algorithm>
#include <cstring>
#include <map>

#include "base/failure.h"
#include "mesh/mesh_source.h"
#include "sets/set_folders.h"

namespace shm::converters {
namespace {

using Kind = TransferSet::Kind;

const char* words_of(Kind kind, bool spaced) {
  switch (kind) {
    case Kind::nodes: return spaced ? "node set" : "node_set";
    case Kind::sides: return spaced ? "side set" : "side_set";
    case Kind::elements: return spaced ? "element set" : "element_set";
  }
  return "";
}

bool all_within(const std::vector<std::int64_t>& members, std::uint64_t end) {
  return std::all_of(members.begin(), members.end(), [end](std::int64_t m) {
    return m >= 0 && static_cast<std::uint64_t>(m) < end;
  });
}

// Cells may belong to many sets, each of which becomes a list.
void check_members(std::uint64_t members, std::uint64_t cells) {
  constexpr std::uint64_t kAlwaysAllowed = 1 << 22, kMostSetsOfCell = 64;
  if (members > std::max(kAlwaysAllowed, kMostSetsOfCell * cells))
    throw Failure(Error{
        ErrorCode::over_limit,
        "cells are in more than " + std::to_string(kMostSetsOfCell) + " groups on the average",
        "groups",
        kNoOffset,
        {}});
}

template <class Real>
bool any_not_one(const Extra& extra) {
  for (std::size_t at = 0; at + sizeof(Real) <= extra.data.size(); at += sizeof(Real)) {
    Real value;
    std::memcpy(&value, extra.data.data() + at, sizeof(Real));
    if (!(value == 1)) return true;
  }
  return false;
}

// False where there are no members, or none that make sense.
bool read_set(const MeshInfo& info, const SetFolder& folder, const SetKeys& keys,
              TransferSet& set) {
  const Extra* members = folder.find(keys.members);
  const Extra* id = folder.find("id");
  if (id == nullptr || members == nullptr || members->refers == Reference::nothing) return false;
  set.kind = keys.kind;
  set.members = integers_of_extra(*members);
  if (set.kind == Kind::sides) {
    if (const Extra* sides = folder.find("sides")) set.sides = integers_of_extra(*sides);
    if (set.sides.size() != set.members.size()) return false;
  }
  if (!all_within(set.members, set.kind == Kind::nodes ? info.vertices : info.cells()))
    return false;
  if (const auto values = integers_of_extra(*id); values.size() == 1) set.id = values[0];
  if (const Extra* name = folder.find("name")) set.name = text_of_extra(*name);
  if (const Extra* factors = folder.find("factors"))
    set.weighted = factors->type == ScalarType::float32 ? any_not_one<float>(*factors)
                                                        : any_not_one<double>(*factors);
  return true;
}

}  // namespace

std::string TransferSet::label() const {
  std::string text = std::string(words_of(kind, true)) + ' ' + std::to_string(id);
  return name.empty() ? text : text + " '" + name + "'";
}

std::string TransferSet::short_name() const {
  return name.empty() ? std::string(words_of(kind, false)) + '_' + std::to_string(id) : name;
}

std::vector<TransferSet> sets_in_folders(const MeshInfo& info, std::string_view format,
                                         std::span<const SetKeys> kinds,
                                         std::set<std::string>& used) {
  std::vector<TransferSet> sets;
  const std::vector<SetFolder> folders = set_folders(info);
  for (const SetKeys& keys : kinds)
    for (const SetFolder& folder : folders) {
      if (folder.format != format || folder.kind != keys.folder) continue;
      TransferSet set;
      if (!read_set(info, folder, keys, set)) continue;
      for (const char* what : {"id", "name", "factors", "sides", keys.members})
        if (const Extra* extra = folder.find(what)) used.insert(extra->key);
      sets.push_back(std::move(set));
    }
  return sets;
}

void list_members(MeshSource& mesh, std::vector<TransferSet>& sets) {
  std::vector<std::vector<TransferSet*>> of_block(mesh.info().schema.blocks.size());
  std::uint64_t members = 0;
  const std::uint64_t cells = mesh.info().cells();  // a sum over all blocks
  for (TransferSet& set : sets)
    for (const std::uint32_t block : set.blocks) {
      of_block.at(block).push_back(&set);
      members += mesh.info().block_cells[block];
      check_members(members, cells);
    }
  std::int64_t cell = 0;
  CellBatch batch;
  mesh.rewind_cells();
  while (members > 0 && mesh.next_cells(batch, kCellsAtOnce))
    for (const std::uint32_t block : batch.blocks) {
      for (TransferSet* set : of_block[block]) set->members.push_back(cell);
      ++cell;
    }
  for (TransferSet& set : sets) set.blocks.clear();
}

std::vector<Extra> extras_of_sets(const std::vector<TransferSet>& sets) {
  std::vector<Extra> extras;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const TransferSet& set = sets[i];
    const std::string folder =
        std::string("mesh/") + words_of(set.kind, false) + '/' + std::to_string(i) + '/';
    extras.push_back(integers_extra(folder + "id", std::vector{set.id}));
    extras.push_back(text_extra(folder + "name", set.name));
    extras.push_back(integers_extra(folder + "members", set.members,
                                    set.kind == Kind::nodes ? Reference::vertex : Reference::cell));
    if (set.kind == Kind::sides) extras.push_back(integers_extra(folder + "sides", set.sides));
  }
  return extras;
}

std::vector<TransferSet> sets_of_extras(const MeshInfo& info) {
  std::set<std::string> used;
  return sets_of_extras(info, used);
}

std::vector<TransferSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& used) {
  constexpr SetKeys kKinds[] = {{Kind::nodes, "node_set", "members"},
                                {Kind::sides, "side_set", "members"},
                                {Kind::elements, "element_set", "members"}};
  return sets_in_folders(info, "mesh", kKinds, used);
}

}  // namespace shm::converters
