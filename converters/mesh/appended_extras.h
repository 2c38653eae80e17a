// The extras of a mesh that gets more time steps from another file.
#pragma once

#include <string>
#include <vector>

#include "base/failure.h"
#include "shm/schema.h"

namespace shm::converters {

struct AppendedExtras {
  bool changed = false;             // they are not those of the mesh as it was
  std::vector<Extra> extras;        // all of them, where they changed
  std::vector<std::string> losses;  // what the other file has otherwise: the mesh keeps its own
};

// An extra keeps steps from being appended.
[[noreturn]] inline void does_not_fit(const std::string& key, const std::string& why) {
  throw Failure(Error{ErrorCode::unsupported, why, "extra '" + key + "'", kNoOffset, {}});
}

}  // namespace shm::converters
