// Salvage: writes the undamaged parts of a damaged .shm file as a new .shm file, and reports the
// missing parts. See spec/decisions/0054-salvage.md.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "shm/damage.h"
#include "shm/io.h"

namespace shm::converters {

struct SalvageReport {
  std::uint64_t vertices = 0, cells = 0;  // counts of the remaining vertices and cells
  std::vector<std::string> missing;       // descriptions of the missing parts, one sentence each
  // Format of the source file whose layout (e.g. the order of its sections) could not be kept;
  // empty if no layout was lost.
  std::string laid_out;
  nlohmann::json missing_json = nlohmann::json::array();
};

// Writes the undamaged parts of `file`. `damage` lists the damage that was found in `file`. `name`
// is the name of the file for messages. Throws Failure.
SalvageReport salvage(RandomSource& file, const DamageReport& damage, const std::string& name,
                      ByteSink& sink, Spool& spool, const Progress& progress = {});

}  // namespace shm::converters
