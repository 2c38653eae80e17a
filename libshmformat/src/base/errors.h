// misuse_error(): the error of a call that the caller should not have made.
#pragma once

#include <string>
#include <utility>

#include "shm/result.h"

namespace shm {

/// Returns an error of code misuse. `section` names the function or the argument, as the section of
/// other errors names a part of the file.
inline Error misuse_error(std::string detail, std::string section) {
  return Error{ErrorCode::misuse, std::move(detail), std::move(section), kNoOffset, {}};
}

}  // namespace shm
