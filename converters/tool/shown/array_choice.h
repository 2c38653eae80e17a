// The array that an option names: NAME, point/NAME or cell/NAME, or v for v_x, v_y and v_z. @STEP
// may follow, to choose a time step.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

// "point/NAME", "cell/NAME".
std::string array_label(const ArrayInfo& array);

struct ArrayChoice {
  std::string name;  // as given, without location and step
  Location location = Location::point;
  // Indices of arrays whose components together form one value. If the name occurs several times,
  // for example on different blocks, there are several lists: a cell has the value of the first
  // list that covers it.
  std::vector<std::vector<std::uint32_t>> layers;
  std::optional<std::uint64_t> step;  // if any of the arrays has steps
};

// Parses `words`, the value of `option`. Without @STEP the last step is chosen. `steps`: number of
// steps of the mesh. Throws Failure (misuse) if there is no such array or step, or if the name
// means both an array of vertices and one of cells.
ArrayChoice array_named(const std::string& words, const std::string& option, const Schema& schema,
                        std::uint64_t steps);

}  // namespace shm::converters
