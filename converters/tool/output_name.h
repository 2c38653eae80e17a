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
// which is lost in format `target`. Lost data is listed in `losses`; if the user chose no `steps`
// and a file of format `target` holds a single step, all steps except the last are lost, too.
void check_output_name(const std::string& output, const Format& target, const MeshInfo& mesh,
                       std::optional<StepRange> steps, const LossList& losses = {});

}  // namespace shm::converters
