// The error of a call that its caller should not have made.
#pragma once

#include <string>
#include <utility>

#include "shm/result.h"

namespace shm {

/// `section`: what was called, as in the errors of files.
inline Error misuse_error(std::string detail, std::string section) {
  return Error{ErrorCode::misuse, std::move(detail), std::move(section), kNoOffset, {}};
}

}  // namespace shm
