// Progress: a callback through which long-running jobs report their progress. A job calls the
// callback every few thousand elements. The callback may be empty.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

namespace shm::converters {

using Progress =
    std::function<void(std::string_view phase, std::uint64_t done, std::uint64_t total)>;

}  // namespace shm::converters
