// What verify and repair report of damage, in words and JSON.
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

// "1 block", "2 blocks"
std::string counted(std::uint64_t count, const std::string& one);

// "point/u"; where the schema is lost its number alone.
std::string array_label(const std::optional<Schema>& schema, std::uint32_t array);

// "point/u, point/v"; the first few of them.
std::string array_labels(const std::optional<Schema>& schema,
                         std::span<const std::uint32_t> arrays);

// "step 3", "steps 0 to 7, 9"; the first few ranges.
std::string steps_text(const std::set<std::uint64_t>& steps);

// One line for each damage, without an end; step values of a segment, groups that follow each other
// and the like go together. At most `most` lines, and one with the number of the others.
std::vector<std::string> damage_lines(const DamageReport& report, std::size_t most);
nlohmann::json damage_json(const DamageReport& report);

}  // namespace shm::converters
