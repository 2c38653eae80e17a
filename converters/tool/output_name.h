// Checks the extension of an output against --format. If the extension belongs to another format,
// which can store more data, the command line is probably a mistake. The mistake is reported before
// any work.
#pragma once

#include <optional>
#include <string>

#include "interface/format.h"
#include "mesh/chosen_steps.h"

namespace shm::converters {

// Throws Failure (misuse) if the extension of `output` belongs to a format that could store data
// which `target` cannot store. Such data is some of `losses`, or time steps of the mesh if only
// `steps`, or the last step, is written.
void check_output_name(const std::string& output, const Format& target, const MeshInfo& mesh,
                       std::optional<StepRange> steps, const LossList& losses = {});

}  // namespace shm::converters
