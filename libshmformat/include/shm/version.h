// The version of these headers, and of the library that runs.
#pragma once

#include <cstdint>

#include "shm/result.h"

namespace shm {

inline constexpr std::uint32_t kVersionMajor = 0, kVersionMinor = 10, kVersionPatch = 0;

struct Version {
  std::uint32_t major = kVersionMajor, minor = kVersionMinor, patch = kVersionPatch;
  bool operator==(const Version&) const = default;
};
/// Of the library that is loaded: another one than Version() where programs find another library
/// than they were compiled with.
SHM_API Version library_version();

}  // namespace shm
