#include "transfer/named_groups.h"

#include <algorithm>
#include <set>
#include <utility>

#include "base/text_input.h"
#include "formats/formats.h"
#include "mesh/mesh_source.h"
#include "sets/set_folders.h"

namespace shm::converters {
namespace {

// Returns the id of a set for which no id is stored: the number of the set plus one, as in
// shm/sets.h.
std::string one_more(const std::string& number) {
  std::uint64_t value = 0;
  return TextInput::parse(number, value) ? std::to_string(value + 1) : number;
}

NamedGroup named_group(const SetFolder& folder, const MeshInfo& info) {
  std::string kind(folder.kind);
  std::replace(kind.begin(), kind.end(), '_', ' ');
  NamedGroup set{std::move(kind), std::string(folder.number), {}, {}};
  if (const Extra* id = folder.find("id")) {
    if (const auto values = integers_of_extra(*id); !values.empty())
      set.id = std::to_string(values[0]);
  } else if (folder.format == "mesh") {
    set.id = one_more(set.id);
  }
  if (const Extra* name = folder.find("name")) set.name = text_of_extra(*name);
  // A long list of members is stored in several extras.
  for (const auto& [what, extra] : folder.extras)
    if (extra->refers != Reference::nothing && !extra->shape.empty())
      set.members = set.members.value_or(0) + extra->shape[0];
  if (const Extra* blocks = folder.find("blocks"); blocks != nullptr && folder.format == "mesh") {
    set.members = set.members.value_or(0);
    for (const std::int64_t block : integers_of_extra(*blocks))
      if (block >= 0 && static_cast<std::uint64_t>(block) < info.block_cells.size())
        *set.members += info.block_cells[static_cast<std::size_t>(block)];
  }
  return set;
}

}  // namespace

std::vector<NamedGroup> named_groups_of(const MeshInfo& info) {
  std::vector<NamedGroup> sets, others = source_format(info).named_groups(info);
  // (id, name) of each group that is described by extras of the source format. A set of whole
  // blocks with the same id and name as one of these groups is omitted, so that it is not listed
  // twice.
  std::set<std::pair<std::string, std::string>> known;
  for (const NamedGroup& group : others) known.emplace(group.id, group.name);
  for (const SetFolder& folder : set_folders(info)) {
    NamedGroup set = named_group(folder, info);
    const bool of_blocks = folder.format == "mesh" && folder.find("blocks") != nullptr;
    if (!of_blocks || !known.contains({set.id, set.name})) sets.push_back(std::move(set));
  }
  for (NamedGroup& group : others) sets.push_back(std::move(group));
  return sets;
}

}  // namespace shm::converters
