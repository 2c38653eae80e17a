// Salvage: what is whole in a damaged .shm file as a .shm file of its own, and what is missing
// there. spec/decisions/0054-salvage.md
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
  std::uint64_t vertices = 0, cells = 0;  // that are left
  std::vector<std::string> missing;       // one sentence each
  std::string laid_out;                   // format of the source whose own layout is not kept
  nlohmann::json missing_json = nlohmann::json::array();
};

// Writes what is left of `file`, which has `damage`; `name` is for messages. Throws Failure.
SalvageReport salvage(RandomSource& file, const DamageReport& damage, const std::string& name,
                      ByteSink& sink, Spool& spool, const Progress& progress = {});

}  // namespace shm::converters
