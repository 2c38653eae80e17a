#include "sets/transfer_sets.h"

#include <algorithm>
#include <cstring>
#include <map>

#include "base/failure.h"
#include "gmsh/groups.h"
#include "mesh/extra_index.h"

namespace shm::converters {
namespace {

using Kind = TransferSet::Kind;

struct KindWords {
  Kind kind;
  const char *key, *members;
};
constexpr KindWords kExodusKinds[] = {{Kind::nodes, "node_set", "vertices"},
                                      {Kind::sides, "side_set", "cells"},
                                      {Kind::elements, "elem_set", "cells"}};

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

// One folder of extras, of Exodus or of our own.
bool read_set(const MeshInfo& info, const ExtraIndex& extras, const std::string& folder,
              const char* members, Kind kind, TransferSet& set, std::set<std::string>& told) {
  const auto take = [&](const char* what) {
    const Extra* extra = extras.find(folder + what);
    if (extra != nullptr) told.insert(extra->key);
    return extra;
  };
  const Extra* listed = extras.find(folder + members);
  const Extra* id = extras.find(folder + "id");
  if (listed == nullptr || listed->refers == Reference::nothing) return false;
  set.kind = kind;
  set.members = integers_of_extra(*listed);
  if (kind == Kind::sides) {
    const Extra* sides = extras.find(folder + "sides");
    if (sides != nullptr) set.sides = integers_of_extra(*sides);
    if (set.sides.size() != set.members.size()) return false;
  }
  if (!all_within(set.members, kind == Kind::nodes ? info.vertices : info.cells())) return false;
  if (id != nullptr)
    if (const auto values = integers_of_extra(*id); values.size() == 1) set.id = values[0];
  if (const Extra* name = take("name")) set.name = text_of_extra(*name);
  if (const Extra* factors = take("factors"))
    set.weighted = factors->type == ScalarType::float32 ? any_not_one<float>(*factors)
                                                        : any_not_one<double>(*factors);
  for (const char* what : {members, "id", "sides"}) take(what);
  return true;
}

void add_exodus_sets(const MeshInfo& info, std::vector<TransferSet>& sets,
                     std::set<std::string>& told) {
  const ExtraIndex extras(info.extras);
  for (const KindWords& words : kExodusKinds) {
    for (const Extra& extra : info.extras) {  // in the order of the file
      const std::string start = "exodus/" + std::string(words.key) + "/", end = "/id";
      if (!extra.key.starts_with(start) || !extra.key.ends_with(end)) continue;
      TransferSet set;
      const std::string folder = extra.key.substr(0, extra.key.size() - 2);
      if (read_set(info, extras, folder, words.members, words.kind, set, told))
        sets.push_back(std::move(set));
    }
  }
}

void add_gmsh_groups(const MeshInfo& info, std::vector<TransferSet>& sets) {
  for (const GmshGroup& group : gmsh_groups(info)) {
    // What the names of blocks already say.
    const bool said = !group.name.empty() &&
                      std::all_of(group.blocks.begin(), group.blocks.end(), [&](std::uint32_t b) {
                        return info.schema.blocks[b].name == group.name;
                      });
    if (said || group.blocks.empty()) continue;
    TransferSet set;
    set.kind = Kind::elements;
    set.id = group.tag;
    set.name = group.name;
    set.blocks = group.blocks;
    sets.push_back(std::move(set));
  }
}

Extra number_extra(std::string key, const std::vector<std::int64_t>& values, Reference refers) {
  Extra extra{std::move(key), ScalarType::int64, refers, {values.size()}, {}};
  extra.data.resize(values.size() * sizeof(std::int64_t));
  if (!values.empty()) std::memcpy(extra.data.data(), values.data(), extra.data.size());
  return extra;
}

}  // namespace

std::string TransferSet::label() const {
  std::string text = std::string(words_of(kind, true)) + ' ' + std::to_string(id);
  return name.empty() ? text : text + " '" + name + "'";
}

std::string TransferSet::short_name() const {
  return name.empty() ? std::string(words_of(kind, false)) + '_' + std::to_string(id) : name;
}

const Extra* find_extra(const MeshInfo& info, const std::string& key) {
  for (const Extra& extra : info.extras)
    if (extra.key == key) return &extra;
  return nullptr;
}

bool is_flat(const MeshInfo& info) {
  const Extra* skeleton = find_extra(info, "exodus/skeleton");
  return skeleton != nullptr &&
         text_of_extra(*skeleton).find("\nD\tnum_dim\t2\n") != std::string::npos;
}

std::string text_of_extra(const Extra& extra) {
  if (extra.type != ScalarType::uint8 || extra.data.empty()) return {};
  return {reinterpret_cast<const char*>(extra.data.data()), extra.data.size()};
}

std::vector<std::int64_t> integers_of_extra(const Extra& extra) {
  std::vector<std::int64_t> values;
  const auto read = [&](auto value) {
    for (std::size_t at = 0; at + sizeof value <= extra.data.size(); at += sizeof value) {
      std::memcpy(&value, extra.data.data() + at, sizeof value);
      values.push_back(value);
    }
  };
  if (extra.type == ScalarType::int32) read(std::int32_t{});
  if (extra.type == ScalarType::int64) read(std::int64_t{});
  return values;
}

std::vector<TransferSet> transfer_sets(const MeshInfo& info, std::set<std::string>& told) {
  std::vector<TransferSet> sets;
  if (info.schema.source_format == "exodus") add_exodus_sets(info, sets, told);
  if (info.schema.source_format == "gmsh") add_gmsh_groups(info, sets);
  for (TransferSet& set : sets_of_extras(info, told)) sets.push_back(std::move(set));
  return sets;
}

void list_members(MeshSource& mesh, std::vector<TransferSet>& sets) {
  std::vector<std::vector<TransferSet*>> of_block(mesh.info().schema.blocks.size());
  std::uint64_t members = 0;
  for (TransferSet& set : sets)
    for (const std::uint32_t block : set.blocks) {
      of_block.at(block).push_back(&set);
      members += mesh.info().block_cells[block];
      check_members(members, mesh.info().cells());
    }
  constexpr std::size_t kPiece = 16384;
  std::int64_t cell = 0;
  CellBatch batch;
  mesh.rewind_cells();
  while (members > 0 && mesh.next_cells(batch, kPiece))
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
    extras.push_back(number_extra(folder + "id", {set.id}, Reference::nothing));
    Extra name{folder + "name", ScalarType::uint8, Reference::nothing, {set.name.size()}, {}};
    name.data.resize(set.name.size());
    if (!set.name.empty()) std::memcpy(name.data.data(), set.name.data(), set.name.size());
    extras.push_back(std::move(name));
    extras.push_back(number_extra(folder + "members", set.members,
                                  set.kind == Kind::nodes ? Reference::vertex : Reference::cell));
    if (set.kind == Kind::sides)
      extras.push_back(number_extra(folder + "sides", set.sides, Reference::nothing));
  }
  return extras;
}

std::vector<TransferSet> sets_of_extras(const MeshInfo& info) {
  std::set<std::string> told;
  return sets_of_extras(info, told);
}

std::vector<TransferSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& told) {
  std::vector<TransferSet> sets;
  const ExtraIndex extras(info.extras);
  for (const Kind kind : {Kind::nodes, Kind::sides, Kind::elements}) {
    for (const Extra& extra : info.extras) {
      const std::string start = "mesh/" + std::string(words_of(kind, false)) + '/';
      if (!extra.key.starts_with(start) || !extra.key.ends_with("/id")) continue;
      TransferSet set;
      const std::string folder = extra.key.substr(0, extra.key.size() - 2);
      if (read_set(info, extras, folder, "members", kind, set, told))
        sets.push_back(std::move(set));
    }
  }
  return sets;
}

}  // namespace shm::converters
