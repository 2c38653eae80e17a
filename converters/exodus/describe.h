// Description: derives the blocks, arrays, times and extras of an Exodus mesh from its netCDF
// structure and the values of its smaller variables. The variables may be in one file or be
// assembled from the parts of a decomposed mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "exodus/layout.h"
#include "exodus/skeleton.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// The values of the variables of a skeleton. Variables are identified by their index in the
// skeleton.
class VariableValues {
 public:
  virtual ~VariableValues() = default;
  // Returns `count` rows of the first dimension, starting at row `first`, in row-major order and in
  // the variable's own type. For a variable without dimensions, returns its value. For strings,
  // always returns all strings, each terminated by a zero byte. Throws Failure.
  virtual std::vector<std::byte> rows(int variable, std::uint64_t first,
                                      std::uint64_t count) const = 0;
};

// Returns all values of a variable.
std::vector<std::byte> whole_variable(const Skeleton& skeleton, const VariableValues& values,
                                      int variable);

// Describes the mesh. Does not read large variables, except those that become extras. Throws
// Failure.
MeshInfo describe(const Skeleton& skeleton, const Layout& layout, const VariableValues& values,
                  const Place& place);

}  // namespace shm::converters::exodus
