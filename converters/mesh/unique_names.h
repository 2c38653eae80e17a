// UniqueNames: makes array names unique among points and among cells: a second "v" becomes "v (2)".
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
  // Reserves a name, which then stays unchanged.
  void keep(Location location, const std::string& name) { used_.emplace(location, name); }
  // Returns `wanted`, with the first number appended that makes it unique if it is taken.
  std::string take(Location location, const std::string& wanted) {
    std::string name = wanted;
    std::size_t& last = numbers_.try_emplace({location, wanted}, 1).first->second;
    while (!used_.emplace(location, name).second)
      name = wanted + " (" + std::to_string(++last) + ")";
    return name;
  }

 private:
  std::set<std::pair<Location, std::string>> used_;
  // Last number tried for each name.
  std::map<std::pair<Location, std::string>, std::size_t> numbers_;
};

}  // namespace shm::converters
