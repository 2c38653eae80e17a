// The keys under which the extras of a mesh hold its sets, for all formats: "FORMAT/KIND_set/N/id",
// "FORMAT/KIND_set/N/name" and so on, i.e. one folder of keys per set.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

struct SetFolder {
  std::string_view format, kind, number;              // "exodus", "node_set", "3"
  std::map<std::string_view, const Extra*> extras{};  // by the part of the key after the number

  // Returns null if the set has no such extra.
  const Extra* find(std::string_view what) const {
    const auto found = extras.find(what);
    return found == extras.end() ? nullptr : found->second;
  }
};

// Returns the set to which an extra with this key belongs, without its extras; nothing if it
// belongs to no set.
std::optional<SetFolder> set_folder_of(std::string_view key);

// Returns true if an extra with this key belongs to a set of sides of cells, or holds the sides of
// the members of another set (those of Exodus edges and faces).
bool is_about_sides(std::string_view key);

// Returns the folders in the order of their first extras, without looking at the contents. The
// result refers to `info`.
std::vector<SetFolder> set_folders(const MeshInfo& info);

}  // namespace shm::converters
