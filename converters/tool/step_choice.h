// The time steps that --step and --time ask for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/chosen_steps.h"

namespace shm::converters {

// What the words of --step mean where there are `steps`: N, first, last, or A:B, the steps A to
// B - 1; steps count from 0. `where`: of what, for messages. Throws Failure (misuse).
StepRange steps_named(const std::string& words, std::uint64_t steps, const std::string& where);

struct StepChoice {
  std::string words;           // of --step; empty: not given
  std::optional<double> time;  // of --time, which excludes it

  // Nothing: all. Throws Failure (misuse) where there are no such steps.
  std::optional<StepRange> in(const std::vector<double>& times) const;
};

}  // namespace shm::converters
