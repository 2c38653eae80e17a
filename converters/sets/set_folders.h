// Parses the keys of the extras (data other than mesh and arrays) that store sets. All extras of
// one set are in the same folder, i.e. their keys begin with the same path: "FORMAT/KIND_set/N/id",
// "FORMAT/KIND_set/N/name" and so on. Meshes of all formats use keys of this form.
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

  // Extras of the set. The keys of this map are the parts of the extras' keys that follow the set's
  // number, e.g. "id" or "name".
  std::map<std::string_view, const Extra*> extras{};

  // Returns the extra whose key ends with `what`, such as "id", or null if the set has no such
  // extra.
  const Extra* find(std::string_view what) const {
    const auto found = extras.find(what);
    return found == extras.end() ? nullptr : found->second;
  }
};

// Returns the folder that contains the extra with this key. Does not fill SetFolder::extras.
// Returns nothing if the extra does not belong to a set.
std::optional<SetFolder> set_folder_of(std::string_view key);

// Returns true if this is the key of an Extra record that belongs to a side set, or of the record
// "sides" of an edge set or face set (Exodus).
bool is_about_sides(std::string_view key);

// Returns the folders of all sets. They are in the order in which their first extras occur in
// `info`. Does not check the contents of the extras. The result contains pointers into `info`.
std::vector<SetFolder> set_folders(const MeshInfo& info);

}  // namespace shm::converters
