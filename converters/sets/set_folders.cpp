#include "sets/set_folders.h"

#include <cstddef>
#include <tuple>

namespace shm::converters {
namespace {

// Removes the part of `key` before the next slash, together with the slash, and returns this part.
std::string_view take_part(std::string_view& key) {
  const std::size_t slash = key.find('/');
  const std::string_view part = key.substr(0, slash);
  key.remove_prefix(slash == std::string_view::npos ? key.size() : slash + 1);
  return part;
}

bool is_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

// Returns the part of a key after the number, e.g. "members" for "mesh/node_set/3/members".
std::string_view rest_of(std::string_view key, const SetFolder& folder) {
  return key.substr(folder.format.size() + folder.kind.size() + folder.number.size() + 3);
}

}  // namespace

std::optional<SetFolder> set_folder_of(std::string_view key) {
  const std::string_view format = take_part(key), kind = take_part(key), number = take_part(key);
  if (!kind.ends_with("_set") || !is_number(number) || key.empty()) return std::nullopt;
  return SetFolder{format, kind, number};
}

bool is_about_sides(std::string_view key) {
  const auto set = set_folder_of(key);
  return set && (set->kind == "side_set" || rest_of(key, *set) == "sides");
}

std::vector<SetFolder> set_folders(const MeshInfo& info) {
  std::vector<SetFolder> folders;
  std::map<std::tuple<std::string_view, std::string_view, std::string_view>, std::size_t> places;
  for (const Extra& extra : info.extras) {
    const auto folder = set_folder_of(extra.key);
    if (!folder) continue;
    const auto [place, fresh] =
        places.try_emplace({folder->format, folder->kind, folder->number}, folders.size());
    if (fresh) folders.push_back(*folder);
    folders[place->second].extras.try_emplace(rest_of(extra.key, *folder), &extra);
  }
  return folders;
}

}  // namespace shm::converters
