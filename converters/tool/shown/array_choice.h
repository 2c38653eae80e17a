// Finds the array that the user named in an option: NAME, point/NAME or cell/NAME. The name v also
// means the arrays v_x, v_y and v_z together. The name may be followed by @STEP, which chooses a
// time step.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

struct ArrayChoice {
  std::string name;  // name that the user gave, without location and step
  Location location = Location::point;
  // The chosen arrays. Each inner list contains the indices of arrays whose components together
  // form one value, e.g. v_x, v_y and v_z. If several arrays have the same name, for example on
  // different blocks, there are several lists. The value of a cell comes from the first list whose
  // arrays cover the cell.
  std::vector<std::vector<std::uint32_t>> layers;
  std::optional<std::uint64_t> step;  // chosen time step; empty if none of the arrays has steps
};

// Parses `words`, the value of the option `option`. If @STEP is missing, the last step is chosen.
// `steps` is the number of steps of the mesh. Throws Failure (misuse) if the array or the step does
// not exist, or if both a point array and a cell array have this name.
ArrayChoice array_named(const std::string& words, const std::string& option, const Schema& schema,
                        std::uint64_t steps);

}  // namespace shm::converters
