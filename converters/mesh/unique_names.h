// UniqueNames: names of arrays of which each stands once on points and once on cells: the second
// "v" is called "v (2)".
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
  // A name that stays as it is.
  void keep(Location location, const std::string& name) { used_.emplace(location, name); }
  // `wanted`, or with the first number behind it that makes it another name.
  std::string take(Location location, const std::string& wanted) {
    std::string name = wanted;
    std::size_t& last = numbers_.try_emplace({location, wanted}, 1).first->second;
    while (!used_.emplace(location, name).second)
      name = wanted + " (" + std::to_string(++last) + ")";
    return name;
  }

 private:
  std::set<std::pair<Location, std::string>> used_;
  std::map<std::pair<Location, std::string>, std::size_t> numbers_;  // that were tried
};

}  // namespace shm::converters
