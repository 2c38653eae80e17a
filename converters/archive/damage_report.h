// Formats damage as text and as JSON, for the reports of `shm verify` and `shm repair`.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "shm/damage.h"

namespace shm::converters {

// Returns text such as "1 block" or "2 blocks".
std::string counted(std::uint64_t count, const std::string& one);

// Returns the name of an array, such as "point/u", or its index if the schema is lost.
std::string array_label(const std::optional<Schema>& schema, std::uint32_t array);

// Returns the names of arrays, such as "point/u, point/v". Only the first few names are listed.
std::string array_labels(const std::optional<Schema>& schema,
                         std::span<const std::uint32_t> arrays);

// Returns text such as "step 3" or "steps 0 to 7, 9". Only the first few ranges of steps are
// listed.
std::string steps_text(const std::set<std::uint64_t>& steps);

// Returns the lines of the report, without newlines. Related damage, such as lost step values of
// one segment or damage in consecutive groups, is combined on one line. Returns at most `most`
// lines, followed by one line with the number of remaining entries if there are more.
std::vector<std::string> damage_lines(const DamageReport& report, std::size_t most);
nlohmann::json damage_json(const DamageReport& report);

}  // namespace shm::converters
