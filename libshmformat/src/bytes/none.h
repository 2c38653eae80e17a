// kNone: the slot or place that is not there.
#pragma once

#include <cstdint>

namespace shm {

inline constexpr std::uint32_t kNone = 0xffffffffu;

}  // namespace shm
