// UniqueNames: makes array names unique, separately for point arrays and for cell arrays. For
// example, the second array with the name "v" becomes "v (2)".
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "shm/schema.h"

namespace shm::converters {

class UniqueNames {
 public:
  // Marks a name as used by an array that keeps its name.
  void keep(Location location, const std::string& name) { used_.emplace(location, name); }
  // Returns `wanted` if no array has this name yet. Otherwise appends a number that makes the name
  // unique, e.g. "v (2)".
  std::string take(Location location, const std::string& wanted) {
    std::string name = wanted;
    std::size_t& last = numbers_.try_emplace({location, wanted}, 1).first->second;
    while (!used_.emplace(location, name).second)
      name = wanted + " (" + std::to_string(++last) + ")";
    return name;
  }

 private:
  std::set<std::pair<Location, std::string>> used_;
  // The number that take() most recently tried to append to each name.
  std::map<std::pair<Location, std::string>, std::size_t> numbers_;
};

}  // namespace shm::converters
