// What verify and repair report of damage, in words and JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "shm/damage.h"

namespace shm::converters {

// "1 block", "2 blocks"
std::string counted(std::uint64_t count, const std::string& one);

// "point/u"; where the schema is lost its number alone.
std::string array_label(const std::optional<Schema>& schema, std::uint32_t array);

// One line for each, without an end; at most `most` of them, and one with the number of the others.
std::vector<std::string> damage_lines(const DamageReport& report, std::size_t most);
nlohmann::json damage_json(const DamageReport& report);

}  // namespace shm::converters
