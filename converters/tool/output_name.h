// Checks that the extension of an output agrees with --format. If the extension belongs to another
// format that can store more data, the command line is probably a mistake, which is reported before
// the command starts its work.
#pragma once

#include <optional>
#include <string>

#include "interface/format.h"
#include "mesh/chosen_steps.h"

namespace shm::converters {

// Throws Failure (misuse) if data of `mesh` would be lost in format `target`, but the extension of
// `output` belongs to a format that could store this data. `losses` lists the data that would be
// lost. If `steps` is empty and a file of format `target` can contain only one step, all steps
// except the final step would also be lost.
void check_output_name(const std::string& output, const Format& target, const MeshInfo& mesh,
                       std::optional<StepRange> steps, const LossList& losses = {});

}  // namespace shm::converters
