// Description: blocks, arrays, times and extras of an Exodus mesh, from its structure and the
// values of its smaller variables; whether these stand in one file or are put together of parts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "exodus/layout.h"
#include "exodus/skeleton.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// The values of variables of a skeleton, which are called by their index there.
class VariableValues {
 public:
  virtual ~VariableValues() = default;
  // `count` rows of the first dimension from row `first` on, row-major, in the variable's own type;
  // of a variable without dimensions its value. Strings are always all, each ended by a zero.
  // Throws Failure.
  virtual std::vector<std::byte> rows(int variable, std::uint64_t first,
                                      std::uint64_t count) const = 0;
};

// All values of a variable.
std::vector<std::byte> whole_variable(const Skeleton& skeleton, const VariableValues& values,
                                      int variable);

// Nothing of what is large but extras is asked for. Throws Failure.
MeshInfo describe(const Skeleton& skeleton, const Layout& layout, const VariableValues& values,
                  const Place& place);

}  // namespace shm::converters::exodus
