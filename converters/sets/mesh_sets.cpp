#include "sets/mesh_sets.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>
#include <map>
#include <sstream>
#include <string_view>

#include "mesh/extra_index.h"

namespace shm::converters {
namespace {

std::vector<std::string_view> path_parts(std::string_view key) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t slash = key.find('/');
    parts.push_back(key.substr(0, slash));
    if (slash == std::string_view::npos) return parts;
    key.remove_prefix(slash + 1);
  }
}

std::string text_of(const Extra& extra) {
  return {reinterpret_cast<const char*>(extra.data.data()), extra.data.size()};
}

std::string integer_text(const Extra& extra, std::size_t index) {
  const std::size_t bytes = scalar_bytes(extra.type);
  if ((index + 1) * bytes > extra.data.size()) return {};
  if (bytes == 4) {
    std::int32_t value;
    std::memcpy(&value, extra.data.data() + index * 4, 4);
    return std::to_string(value);
  }
  if (bytes == 8) {
    std::int64_t value;
    std::memcpy(&value, extra.data.data() + index * 8, 8);
    return std::to_string(value);
  }
  return {};
}

bool is_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

// Exodus: "exodus/<kind>_set/<index>/<field>".
void add_exodus_sets(const MeshInfo& info, std::vector<MeshSet>& sets) {
  std::map<std::string, std::size_t> place;  // "exodus/side_set/3" -> index in sets
  for (const Extra& extra : info.extras) {
    const auto parts = path_parts(extra.key);
    if (parts.size() < 4 || parts[0] != "exodus" || !is_number(parts[2])) continue;
    if (parts[1].size() < 4 || parts[1].substr(parts[1].size() - 4) != "_set") continue;
    const std::string prefix = "exodus/" + std::string(parts[1]) + "/" + std::string(parts[2]);
    const auto [found, fresh] = place.try_emplace(prefix, sets.size());
    if (fresh) {
      std::string kind(parts[1]);
      std::replace(kind.begin(), kind.end(), '_', ' ');
      sets.push_back({kind, std::string(parts[2]), {}, {}});
    }
    MeshSet& set = sets[found->second];
    if (parts[3] == "id") set.id = integer_text(extra, 0);
    if (parts[3] == "name") set.name = text_of(extra);
    if (extra.refers != Reference::nothing && !extra.shape.empty()) set.members = extra.shape[0];
  }
}

// Gmsh: the raw section $PhysicalNames, lines of `dimension tag "name"` after their count.
void add_physical_groups(const MeshInfo& info, std::vector<MeshSet>& sets) {
  const ExtraIndex extras(info.extras);
  const Extra* sections = extras.find("gmsh/sections");
  if (sections == nullptr) return;
  constexpr const char* kKinds[] = {"physical point", "physical curve", "physical surface",
                                    "physical volume"};
  std::istringstream list(text_of(*sections));
  std::string section;
  for (std::size_t k = 0; std::getline(list, section); ++k) {
    if (section.rfind("PhysicalNames", 0) != 0) continue;
    const Extra* content = extras.find("gmsh/section/" + std::to_string(k));
    if (content == nullptr) continue;
    std::istringstream lines(text_of(*content));
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      unsigned dimension = 0;
      std::string tag;
      const std::size_t begin = line.find('"'), end = line.rfind('"');
      if (!(words >> dimension >> tag) || dimension > 3 || begin == end) continue;
      sets.push_back({kKinds[dimension], tag, line.substr(begin + 1, end - begin - 1), {}});
    }
  }
}

}  // namespace

std::vector<MeshSet> mesh_sets(const MeshInfo& info) {
  std::vector<MeshSet> sets;
  add_exodus_sets(info, sets);
  add_physical_groups(info, sets);
  return sets;
}

}  // namespace shm::converters
