// The text and the JSON in which verify and repair report damage.
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

// Returns text such as "point/u", or only the array's number if the schema is lost.
std::string array_label(const std::optional<Schema>& schema, std::uint32_t array);

// Returns text such as "point/u, point/v" for the first few arrays.
std::string array_labels(const std::optional<Schema>& schema,
                         std::span<const std::uint32_t> arrays);

// Returns text such as "step 3" or "steps 0 to 7, 9" for the first few ranges.
std::string steps_text(const std::set<std::uint64_t>& steps);

// Returns one line per damage, without a line end. Related damages, such as step values of a
// segment or consecutive groups, share a line. There are at most `most` lines, and one more with
// the number of remaining damages.
std::vector<std::string> damage_lines(const DamageReport& report, std::size_t most);
nlohmann::json damage_json(const DamageReport& report);

}  // namespace shm::converters
