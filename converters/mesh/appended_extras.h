// Computes the extras (all data except vertices, cells and arrays) that a file has after the time
// steps of another file have been appended to it.
#pragma once

#include <string>
#include <vector>

#include "base/failure.h"
#include "shm/schema.h"

namespace shm::converters {

struct AppendedExtras {
  bool changed = false;       // true if appending changes the extras of the mesh
  std::vector<Extra> extras;  // all extras after appending; used only if `changed` is true

  // Descriptions of data in the other file that differs from the mesh's data and is therefore
  // dropped.
  std::vector<std::string> losses;
};

// Throws Failure (unsupported), which reports that the extra `key` prevents time steps from being
// appended. `why` is the reason.
[[noreturn]] inline void does_not_fit(const std::string& key, const std::string& why) {
  throw Failure(
      Error{.code = ErrorCode::unsupported, .detail = why, .section = "extra '" + key + "'"});
}

}  // namespace shm::converters
