// Salvage: writes the undamaged parts of a damaged .shm file as a new .shm file, and reports the
// missing parts. spec/decisions/0054-salvage.md
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
  std::uint64_t vertices = 0, cells = 0;  // numbers of vertices and cells that remain
  std::vector<std::string> missing;       // one sentence per missing part
  std::string laid_out;                   // source format whose file layout is not kept
  nlohmann::json missing_json = nlohmann::json::array();
};

// Writes the remains of `file`, which has `damage`. `name` is used in messages. Throws Failure.
SalvageReport salvage(RandomSource& file, const DamageReport& damage, const std::string& name,
                      ByteSink& sink, Spool& spool, const Progress& progress = {});

}  // namespace shm::converters
