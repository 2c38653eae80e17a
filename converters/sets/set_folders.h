// Where the extras of a mesh hold its sets, whatever format they came from: "FORMAT/KIND_set/N/id",
// "FORMAT/KIND_set/N/name" and so on, one folder of keys for each set.
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
  std::map<std::string_view, const Extra*> extras{};  // by what comes behind the number

  // Null when there is none.
  const Extra* find(std::string_view what) const {
    const auto found = extras.find(what);
    return found == extras.end() ? nullptr : found->second;
  }
};

// The set to which an extra of this key belongs, without its extras; nothing where it is of no set.
std::optional<SetFolder> set_folder_of(std::string_view key);

// In the order in which the sets begin. What they hold is not looked at; it refers to `info`.
std::vector<SetFolder> set_folders(const MeshInfo& info);

}  // namespace shm::converters
