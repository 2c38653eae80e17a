// Version of these headers and of the loaded library.
#pragma once

#include <cstdint>

#include "shm/result.h"

namespace shm {

inline constexpr std::uint32_t kVersionMajor = 0, kVersionMinor = 10, kVersionPatch = 0;

struct Version {
  std::uint32_t major = kVersionMajor, minor = kVersionMinor, patch = kVersionPatch;
  bool operator==(const Version&) const = default;
};
/// Returns the version of the loaded library. It differs from Version() if the program was compiled
/// with the headers of another version.
SHM_API Version library_version();

}  // namespace shm
