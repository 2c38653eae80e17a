// The array that the value of an option names: NAME, point/NAME or cell/NAME, or v for v_x, v_y and
// v_z. The name may be followed by @STEP, which chooses a time step.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

// Formats "point/NAME" or "cell/NAME".
std::string array_label(const ArrayInfo& array);

struct ArrayChoice {
  std::string name;  // name as the user gave it, without location and step
  Location location = Location::point;
  // Indices of arrays whose components together form one value. If the name occurs several times,
  // for example on different blocks, there are several lists of indices. The value of a cell comes
  // from the first list that covers the cell.
  std::vector<std::vector<std::uint32_t>> layers;
  std::optional<std::uint64_t> step;  // chosen time step; nothing if none of the arrays has steps
};

// Parses `words`, the value of `option`. Without @STEP the last step is chosen. `steps`: number of
// steps of the mesh. Throws Failure (misuse) if no such array or step exists, or if the name
// means both a point array and a cell array.
ArrayChoice array_named(const std::string& words, const std::string& option, const Schema& schema,
                        std::uint64_t steps);

}  // namespace shm::converters
