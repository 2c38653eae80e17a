// SkeletonJoin: builds the netCDF structure of a whole mesh from the structures of the parts of a
// decomposed Exodus mesh. The whole mesh has every variable that a part has, in the order of the
// parts. However, variables that describe the decomposition (Nemesis data, number maps, the order
// map) are dropped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exodus/skeleton.h"

namespace shm::converters::exodus {

// How the values of a variable of the whole mesh are formed from the values in the parts.
enum class Joining : std::uint8_t {
  dropped,   // no values: the variable is dropped
  elements,  // values of nodes or elements, arranged by the numbers of the nodes or elements
  members,   // members of a set: the rows of all parts are combined
  any,       // 1 if the value is 1 in any part: status of blocks and sets, truth tables
  first,     // values of the first part that has the variable: QA and info records
  same,      // values that are equal in all parts that have the variable
};

// A kind of set whose members are nodes or elements. The kind is recognized by the dimension that
// counts the members of a set.
struct SetDimension {
  // Prefix of the dimension's name. The number of the set, from 1, follows the prefix.
  std::string_view prefix;
  // Name of the variable that contains the members, without the number of the set.
  std::string_view members;
  // Name of the dimension that counts distribution factors; empty if none exists.
  std::string_view factors;
  bool of_nodes = false, has_sides = false;
};
// Returns the kind of set whose members `dimension` counts, and stores the number of the set in
// `number`. Returns null if `dimension` does not count members of a set.
const SetDimension* set_dimension(std::string_view dimension, std::string& number);

// The dimension of a variable that belongs to a set. Members: its index among the variable's
// dimensions, and whether it counts distribution factors.
struct SetPlace {
  const SetDimension* set = nullptr;
  std::string number;
  std::size_t at = 0;
  bool factors = false;
};
std::optional<SetPlace> set_place(const Skeleton& skeleton, const Variable& variable);

Joining joining_of(const Skeleton& skeleton, const Variable& variable);

class SkeletonJoin {
 public:
  // Adds the next part. Throws Failure if the structure of the part contradicts an earlier part, or
  // if the part contains data that cannot be joined. The error names `file`.
  void add(const Skeleton& part, const std::string& file);
  // Returns the structure of the whole mesh. `lengths` contains the lengths of the dimensions that
  // are not sums over the parts: num_nodes, and the dimensions of sets.
  Skeleton joined(const std::map<std::string, std::uint64_t>& lengths) const;

 private:
  struct Named {
    Variable variable;
    std::vector<std::string> dimensions;
  };
  void add_dimension(const Dimension& dimension, bool is_sum, const std::string& file,
                     std::list<Dimension>::iterator& next);
  void add_variable(const Skeleton& part, const Variable& variable, const std::string& file,
                    std::list<Named>::iterator& next);

  bool begun_ = false;
  Kind kind_ = Kind::classic;
  std::vector<Attribute> attributes_;
  std::list<Dimension> dimensions_;
  std::list<Named> variables_;
  std::map<std::string, std::list<Dimension>::iterator> dimension_at_;
  std::map<std::string, std::list<Named>::iterator> variable_at_;
};

}  // namespace shm::converters::exodus
