// Derives the blocks, arrays, times and extras of an Exodus mesh from the netCDF structure of the
// file and from the values of its smaller variables. The values come from one file, or from the
// parts of a decomposed mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "exodus/layout.h"
#include "exodus/skeleton.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// Interface that returns the values of variables. A variable is identified by its index in the
// skeleton (the netCDF structure of the file).
class VariableValues {
 public:
  virtual ~VariableValues() = default;
  // Returns the values at the indices `first` to `first` + `count` - 1 of the first dimension, in
  // row-major order and in the variable's own type. If the variable has no dimensions, returns its
  // single value. If the variable contains strings, always returns all of them, each terminated by
  // a zero byte. Throws Failure.
  virtual std::vector<std::byte> rows(int variable, std::uint64_t first,
                                      std::uint64_t count) const = 0;
};

// Returns all values of a variable.
std::vector<std::byte> whole_variable(const Skeleton& skeleton, const VariableValues& values,
                                      int variable);

// Derives the MeshInfo of the mesh. Does not read large variables, unless they become extras.
// Throws Failure.
MeshInfo describe(const Skeleton& skeleton, const Layout& layout, const VariableValues& values,
                  const Place& place);

}  // namespace shm::converters::exodus
