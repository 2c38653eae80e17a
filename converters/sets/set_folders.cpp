#include "sets/set_folders.h"

#include <cstddef>
#include <tuple>

namespace shm::converters {
namespace {

// What stands in front of the next slash, and that slash, taken off.
std::string_view take_part(std::string_view& key) {
  const std::size_t slash = key.find('/');
  const std::string_view part = key.substr(0, slash);
  key.remove_prefix(slash == std::string_view::npos ? key.size() : slash + 1);
  return part;
}

bool is_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

}  // namespace

std::vector<SetFolder> set_folders(const MeshInfo& info) {
  std::vector<SetFolder> folders;
  std::map<std::tuple<std::string_view, std::string_view, std::string_view>, std::size_t> places;
  for (const Extra& extra : info.extras) {
    std::string_view what = extra.key;
    const std::string_view format = take_part(what), kind = take_part(what),
                           number = take_part(what);
    if (!kind.ends_with("_set") || !is_number(number) || what.empty()) continue;
    const auto [place, fresh] = places.try_emplace({format, kind, number}, folders.size());
    if (fresh) folders.push_back({format, kind, number});
    folders[place->second].extras.try_emplace(what, &extra);
  }
  return folders;
}

}  // namespace shm::converters
