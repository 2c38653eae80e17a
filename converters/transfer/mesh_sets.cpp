#include "transfer/mesh_sets.h"

#include <algorithm>
#include <utility>

#include "formats/formats.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

namespace {

// Returns true if a set consists of whole blocks, all of which have the same name as the set.
bool is_named_blocks(const MeshInfo& info, const MeshSet& set) {
  return set.members.empty() && !set.blocks.empty() && !set.name.empty() &&
         std::all_of(set.blocks.begin(), set.blocks.end(), [&](std::uint32_t block) {
           return info.schema.blocks[block].name == set.name;
         });
}

}  // namespace

std::vector<MeshSet> transfer_sets(const MeshInfo& info, Keys& used) {
  std::vector<MeshSet> sets = source_format(info).sets(info, used);
  for (MeshSet& set : sets_of_extras(info, used))
    if (!is_named_blocks(info, set)) sets.push_back(std::move(set));
  return sets;
}

}  // namespace shm::converters
