// The extension of an output promises a file of a certain format. If --format names another format,
// which can store less, this is probably a mistake, and it is reported before any work.
#pragma once

#include <optional>
#include <string>

#include "interface/format.h"
#include "mesh/chosen_steps.h"

namespace shm::converters {

// Throws Failure (misuse) if a file of the format that `output` is named for could store data that
// a file of `target` cannot: the time steps of a mesh of which only `steps`, or the last step, is
// written, or some of `losses`.
void check_output_name(const std::string& output, const Format& target, const MeshInfo& mesh,
                       std::optional<StepRange> steps, const LossList& losses = {});

}  // namespace shm::converters
