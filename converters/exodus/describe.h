// Description: derives the blocks, arrays, times and extras of an Exodus mesh from its structure
// and the values of its smaller variables. The variables may be in one file or be assembled from
// parts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "exodus/layout.h"
#include "exodus/skeleton.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// The values of the variables of a skeleton. Variables are identified by their index there.
class VariableValues {
 public:
  virtual ~VariableValues() = default;
  // Returns `count` rows of the first dimension, starting at row `first`, in row-major order and
  // the variable's own type; for a variable without dimensions, its value. For strings, always
  // returns all of them, each terminated by a zero. Throws Failure.
  virtual std::vector<std::byte> rows(int variable, std::uint64_t first,
                                      std::uint64_t count) const = 0;
};

// Returns all values of a variable.
std::vector<std::byte> whole_variable(const Skeleton& skeleton, const VariableValues& values,
                                      int variable);

// Describes the mesh. Reads no large variables except extras. Throws Failure.
MeshInfo describe(const Skeleton& skeleton, const Layout& layout, const VariableValues& values,
                  const Place& place);

}  // namespace shm::converters::exodus
