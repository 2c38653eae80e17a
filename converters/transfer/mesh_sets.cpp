#include "transfer/mesh_sets.h"

#include <algorithm>
#include <utility>

#include "mesh/mesh_source.h"
#include "sets/set_folders.h"

namespace shm::converters {
namespace {

MeshSet mesh_set(const SetFolder& folder) {
  std::string kind(folder.kind);
  std::replace(kind.begin(), kind.end(), '_', ' ');
  MeshSet set{std::move(kind), std::string(folder.number), {}, {}};
  if (const Extra* id = folder.find("id"))
    if (const auto values = integers_of_extra(*id); !values.empty())
      set.id = std::to_string(values[0]);
  if (const Extra* name = folder.find("name")) set.name = text_of_extra(*name);
  for (const auto& [what, extra] : folder.extras)
    if (extra->refers != Reference::nothing && !extra->shape.empty()) set.members = extra->shape[0];
  return set;
}

}  // namespace

std::vector<MeshSet> mesh_sets(const MeshInfo& info) {
  std::vector<MeshSet> sets;
  for (const SetFolder& folder : set_folders(info)) sets.push_back(mesh_set(folder));
  for (MeshSet& group : source_format(info).named_groups(info)) sets.push_back(std::move(group));
  return sets;
}

}  // namespace shm::converters
