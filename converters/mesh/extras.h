// Extras of a mesh as text and integers, and extras made of these.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

// Null when there is none; looks at all of them (see ExtraIndex).
const Extra* find_extra(const MeshInfo& info, std::string_view key);

// Text and integers of an extra; empty when it holds something else.
std::string text_of_extra(const Extra& extra);
std::vector<std::int64_t> integers_of_extra(const Extra& extra);

Extra text_extra(std::string key, std::string_view text);
Extra integers_extra(std::string key, const std::vector<std::int64_t>& values,
                     Reference refers = Reference::nothing);
Extra integers_extra(std::string key, const std::vector<std::int32_t>& values,
                     Reference refers = Reference::nothing);

}  // namespace shm::converters
