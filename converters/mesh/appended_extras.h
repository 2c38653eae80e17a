// The extras of a mesh after time steps have been appended from another file.
#pragma once

#include <string>
#include <vector>

#include "base/failure.h"
#include "shm/schema.h"

namespace shm::converters {

struct AppendedExtras {
  bool changed = false;       // true if `extras` differ from the mesh's own extras
  std::vector<Extra> extras;  // all extras of the mesh, if they changed

  // Data of the other file that differs from the mesh's data and is dropped.
  std::vector<std::string> losses;
};

// Throws Failure (unsupported), because the extra `key` does not allow appending the steps.
[[noreturn]] inline void does_not_fit(const std::string& key, const std::string& why) {
  throw Failure(
      Error{.code = ErrorCode::unsupported, .detail = why, .section = "extra '" + key + "'"});
}

}  // namespace shm::converters
