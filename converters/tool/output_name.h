// Checks that the extension of an output agrees with --format. If the extension belongs to another
// format that can store more data, the command line is probably a mistake, which is reported before
// any work.
#pragma once

#include <optional>
#include <string>

#include "interface/format.h"
#include "mesh/chosen_steps.h"

namespace shm::converters {

// Throws Failure (misuse) if data of `mesh` is lost in format `target`, and the extension of
// `output` belongs to a format that could store it. `losses` lists the lost data. In addition, all
// steps except the last are lost if `steps` is empty and a file of format `target` contains a
// single step.
void check_output_name(const std::string& output, const Format& target, const MeshInfo& mesh,
                       std::optional<StepRange> steps, const LossList& losses = {});

}  // namespace shm::converters
