// Description: derives the blocks, arrays, times and extras of an Exodus mesh from its netCDF
// structure and the values of its smaller variables. The values come from one file, or from the
// parts of a decomposed mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "exodus/layout.h"
#include "exodus/skeleton.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// Interface that returns the values of the variables of a skeleton. A variable is identified by its
// index in the skeleton.
class VariableValues {
 public:
  virtual ~VariableValues() = default;
  // Returns `count` rows along the first dimension, starting at row `first`, in row-major order and
  // in the variable's own type. If the variable has no dimensions, returns its single value. If it
  // contains strings, always returns all strings, each terminated by a zero byte. Throws Failure.
  virtual std::vector<std::byte> rows(int variable, std::uint64_t first,
                                      std::uint64_t count) const = 0;
};

// Returns all values of a variable.
std::vector<std::byte> whole_variable(const Skeleton& skeleton, const VariableValues& values,
                                      int variable);

// Derives the description of the mesh. Does not read large variables, except variables that become
// extras. Throws Failure.
MeshInfo describe(const Skeleton& skeleton, const Layout& layout, const VariableValues& values,
                  const Place& place);

}  // namespace shm::converters::exodus
