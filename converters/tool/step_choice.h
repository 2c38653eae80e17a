// Selects time steps by the options --step and --time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/chosen_steps.h"

namespace shm::converters {

// Parses the value of --step for a mesh with `steps` steps: N, first, last, or A:B for the steps A
// to B - 1; steps count from 0. `where` is the name of the mesh in messages. Throws Failure
// (misuse).
StepRange steps_named(const std::string& words, std::uint64_t steps, const std::string& where);

struct StepChoice {
  std::string words;           // value of --step; empty if the option was not given
  std::optional<double> time;  // value of --time, which excludes --step

  // Returns the range of chosen steps, or nothing if neither --step nor --time was given. Throws
  // Failure (misuse) if the chosen steps do not exist.
  std::optional<StepRange> in(const std::vector<double>& times) const;
};

}  // namespace shm::converters
