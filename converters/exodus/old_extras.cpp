#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "exodus/layout.h"
#include "exodus/skeleton.h"
#include "mesh/extra_index.h"
#include "sets/set_folders.h"

namespace shm::converters::exodus {
namespace {

struct OldKind {
  std::string_view kind, members;
  const SetKind* now;
};
constexpr OldKind kOldKinds[] = {{"node_set", "vertices", &kSetKinds[0]},
                                 {"side_set", "cells", &kSetKinds[1]},
                                 {"elem_set", "cells", &kSetKinds[4]}};

// Returns the current key for an old key. Returns an empty string if the key has not changed.
std::string new_key(std::string_view key) {
  if (!key.starts_with("exodus/")) return {};
  const auto set = set_folder_of(key);
  if (!set) return {};
  for (const OldKind& old : kOldKinds) {
    if (set->kind != old.kind) continue;
    std::string_view field =
        key.substr(set->format.size() + set->kind.size() + set->number.size() + 3);
    std::string now(old.now->folder);
    now.append(set->number).append("/");
    // A field such as "cells/1", a further part of a large variable, also begins with the old name.
    if (field.starts_with(old.members)) {
      now.append(kMembersField);
      field.remove_prefix(old.members.size());
    }
    return now.append(field);
  }
  return {};
}

// Converts a skeleton from a version before 0.10, in which variables refer to dimensions by index,
// to the current form. An invalid skeleton stays unchanged.
void renew_skeleton(Extra& skeleton) {
  const std::string text = text_of_extra(skeleton);
  if (!text.starts_with("N\t")) return;
  try {
    skeleton = text_extra(skeleton.key, to_text(from_text(text, {{}, ErrorCode::corrupt})));
  } catch (const Failure&) {  // the writer reports this error later
  }
}

// Returns the keys of extras that versions since 0.10 do not store, because the values of their
// variables can be derived from the rest of the mesh.
std::vector<std::string> keys_that_follow(const MeshInfo& info, const Extra& text) {
  const Place nowhere{{}, ErrorCode::corrupt};
  std::vector<std::string> keys;
  try {
    const Skeleton skeleton =
        from_text({reinterpret_cast<const char*>(text.data.data()), text.data.size()}, nowhere);
    const Layout layout = lay_out(skeleton, nowhere, false);
    const ExtraIndex extras(info.extras);
    std::set<std::string> asked;
    for (std::size_t v = 0; v < skeleton.variables.size(); ++v) {
      const std::string& name = skeleton.variables[v].name;
      if (layout.uses[v] != Use::extra) continue;
      if (!set_factors_of(name) && !name.ends_with("_status")) continue;
      const std::string key = extra_key(name);
      const Extra* extra = extras.find(key);
      // Derive the values of each variable at most once, and only if the variable and the extra
      // have the same number of values. Otherwise a damaged file could cause too much work.
      if (extra == nullptr || !asked.insert(key).second ||
          skeleton.size(skeleton.variables[v]) != extra->data.size() / scalar_bytes(extra->type))
        continue;
      if (extras.find(part_key(key, 1)) == nullptr &&
          derived_values(skeleton, layout, v, info, extras) == extra->data)
        keys.push_back(key);
    }
  } catch (const Failure&) {  // the writer reports this error later
    return {};
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

// Returns true if the extra contains the id of a set (e.g. "mesh/side_set/3/id") and need not be
// stored. This is the case if the set has members and the id is the default id, i.e. the index of
// the set plus one.
bool is_id_that_follows(const Extra& extra, const ExtraIndex& extras) {
  const auto set = set_folder_of(extra.key);
  if (!set || set->format != "mesh" || !extra.key.ends_with("/id")) return false;
  const auto id = integers_of_extra(extra);
  if (id.size() != 1 || id[0] < 1 || std::to_string(id[0] - 1) != set->number) return false;
  const std::string folder = extra.key.substr(0, extra.key.size() - 2);
  const Extra* members = extras.find(folder + std::string(kMembersField));
  return members != nullptr && !members->data.empty();
}

}  // namespace

void translate_old_extras(MeshInfo& info) {
  bool any = false;
  for (Extra& extra : info.extras) {
    if (extra.key == "exodus/skeleton") renew_skeleton(extra);
    std::string key = new_key(extra.key);
    any |= !key.empty() || extra.key.ends_with("_status");
    if (!key.empty()) extra.key = std::move(key);
  }
  const Extra* skeleton = find_extra(info, "exodus/skeleton");
  if (!any || skeleton == nullptr) return;
  const std::vector<std::string> follow = keys_that_follow(info, *skeleton);
  std::vector<bool> goes;
  const ExtraIndex extras(info.extras);
  for (const Extra& extra : info.extras)
    goes.push_back(std::binary_search(follow.begin(), follow.end(), extra.key) ||
                   is_id_that_follows(extra, extras));
  std::size_t index = 0;
  std::erase_if(info.extras, [&](const Extra&) { return goes[index++]; });
}

}  // namespace shm::converters::exodus
