// SkeletonJoin: builds the netCDF structure of a whole mesh from the structures of the parts of a
// decomposed Exodus mesh. The result has every variable that occurs in any part, in the same order
// as in the parts. Variables that describe the decomposition (Nemesis data, number maps, the order
// map) are omitted.
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

// Specifies how the values of a variable of the whole mesh are formed from its values in the parts.
enum class Joining : std::uint8_t {
  dropped,   // the variable is omitted from the whole mesh
  elements,  // values of nodes or elements: sorted by global node or element number
  members,   // data of members of a set: the rows of all parts are combined
  any,       // status of blocks and sets, truth tables: a value is 1 if it is 1 in any part
  first,     // QA and info records: the values in the first part that has the variable
  same,      // all other variables: the values must be equal in all parts that have the variable
};

// A kind of set whose members are nodes or elements. Each set has a dimension that counts its
// members; the name of this dimension identifies the kind.
struct SetDimension {
  // Prefix of the name of the dimension that counts members. The number of the set, which starts at
  // 1, follows the prefix.
  std::string_view prefix;
  // Prefix of the name of the variable that contains the members. The number of the set follows.
  std::string_view members;
  // Prefix of the name of the dimension that counts distribution factors; empty if the kind has no
  // such dimension.
  std::string_view factors;
  bool of_nodes = false, has_sides = false;
};
// If `dimension` counts the members of a set, returns the kind of the set and stores the digits of
// its number in `number`. Otherwise returns null.
const SetDimension* set_dimension(std::string_view dimension, std::string& number);

// A dimension of a variable that counts the members or the distribution factors of a set. `at` is
// the index of the dimension among the variable's dimensions. `factors` is true if the dimension
// counts distribution factors.
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
  // Returns the structure of the whole mesh. `lengths` contains the lengths of dimensions that
  // cannot be derived from the parts' lengths: num_nodes, and the dimensions of sets.
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
