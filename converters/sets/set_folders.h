// The keys of extras that store the sets of a mesh, for all formats. Each set has a folder of keys:
// "FORMAT/KIND_set/N/id", "FORMAT/KIND_set/N/name" and so on.
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

  // Extras by the part of the key after the number.
  std::map<std::string_view, const Extra*> extras{};

  // Returns the extra of the set with this part of the key, or null if there is none.
  const Extra* find(std::string_view what) const {
    const auto found = extras.find(what);
    return found == extras.end() ? nullptr : found->second;
  }
};

// Returns the set to which an extra with this key belongs, without the set's extras. Returns
// nothing if the extra belongs to no set.
std::optional<SetFolder> set_folder_of(std::string_view key);

// Returns true if an extra with this key belongs to a set of sides of cells, or holds the sides of
// the members of another set (those of Exodus edges and faces).
bool is_about_sides(std::string_view key);

// Returns the folders in the order of their first extras, without looking at the contents. The
// result refers to `info`.
std::vector<SetFolder> set_folders(const MeshInfo& info);

}  // namespace shm::converters
