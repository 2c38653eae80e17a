// SkeletonJoin: the netCDF structure of the mesh that the parts of a decomposed Exodus mesh make.
// A variable of the parts is a variable of the mesh, in the order in which the parts have them;
// what describes the decomposition (Nemesis data, number maps, the order map) goes.
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

// How the values of a variable of the mesh come from those of the parts.
enum class Joining : std::uint8_t {
  dropped,   // not at all
  elements,  // values of nodes or elements: by their numbers
  members,   // of a set: rows of all parts
  any,       // 1 where a part has one: status of blocks and sets, truth tables
  first,     // those of the first part that has it: QA and info records
  same,      // alike in all parts that have it
};

// A set whose members are nodes or elements, by the dimension that counts them.
struct SetDimension {
  std::string_view prefix;   // of the dimension's name; the set's number from 1 follows
  std::string_view members;  // and so of the variable with the members
  std::string_view factors;  // of a dimension of distribution factors; may be none
  bool of_nodes = false, has_sides = false;
};
// Null when `dimension` counts no members of such a set; else `number` is the set's.
const SetDimension* set_dimension(std::string_view dimension, std::string& number);

// The set dimension of a variable, its place among the variable's dimensions, and whether the
// dimension is that of factors.
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
  // Parts in their order. Throws Failure, naming `file`: where its structure contradicts that of a
  // part before, or it has what cannot be joined.
  void add(const Skeleton& part, const std::string& file);
  // The structure of the mesh. `lengths` of dimensions that are no sums over parts: num_nodes, and
  // those of sets.
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
