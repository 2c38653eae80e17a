// The keys of the extras in which meshes of all formats store sets. The keys of a set begin with
// the same folder: "FORMAT/KIND_set/N/id", "FORMAT/KIND_set/N/name" and so on.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

struct SetFolder {
  std::string_view format, kind, number;  // "exodus", "node_set", "3"

  // Extras of the set, by the part of their key after the number, e.g. "id" or "name".
  std::map<std::string_view, const Extra*> extras{};

  // Returns the extra whose key ends with `what`, such as "id", or null if the set has no such
  // extra.
  const Extra* find(std::string_view what) const {
    const auto found = extras.find(what);
    return found == extras.end() ? nullptr : found->second;
  }
};

// Returns the folder to which a key belongs, with an empty list of extras. Returns nothing if the
// key belongs to no set.
std::optional<SetFolder> set_folder_of(std::string_view key);

// Returns true if an extra with this key belongs to a side set, or stores the `sides` of a set of
// edges or faces (Exodus).
bool is_about_sides(std::string_view key);

// Returns the folders of all sets, in the order of their first extras. Does not check the contents
// of the extras. The result refers to `info`.
std::vector<SetFolder> set_folders(const MeshInfo& info);

}  // namespace shm::converters
