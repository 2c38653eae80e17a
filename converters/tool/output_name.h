// What the name of an output promises: a file of the format that its extension belongs to. Where
// --format says another one, which holds less, that is a slip of the hand, and found before the
// work.
#pragma once

#include <optional>
#include <string>

#include "mesh/chosen_steps.h"
#include "transfer/format.h"

namespace shm::converters {

// Throws Failure (misuse) where a file of the format that `output` has its name of would hold what
// one of `target` would not: the time steps of a mesh of which `steps`, or the last, is written, or
// some of `losses`.
void check_output_name(const std::string& output, const Format& target, const MeshInfo& mesh,
                       std::optional<StepRange> steps, const LossList& losses = {});

}  // namespace shm::converters
