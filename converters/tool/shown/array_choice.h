// The array that an option names, at one time step: NAME, point/NAME or cell/NAME, v also for v_x,
// v_y, v_z; NAME@STEP.
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
  std::string name;  // as it was asked for, without where it is and without its step
  Location location = Location::point;
  // Indices of arrays whose components are together those of one value. Of a name that stands
  // again, as on other blocks, a list each: the first one that covers a cell has its value.
  std::vector<std::vector<std::uint32_t>> layers;
  std::optional<std::uint64_t> step;  // where any of them has steps
};

// What `words` of `option` mean; without a step the last one. `steps`: of the mesh. Throws Failure
// (misuse) where there is no such array or step, or one of vertices and another one of cells.
ArrayChoice array_named(const std::string& words, const std::string& option, const Schema& schema,
                        std::uint64_t steps);

}  // namespace shm::converters
