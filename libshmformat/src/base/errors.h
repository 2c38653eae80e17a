// Functions that make errors, one for each common error code. To make an error with a variable
// code, with a path, or with the code io or output, write an aggregate instead: Error{code, detail,
// section, offset} or Error{.code = code, ...}.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "shm/result.h"

namespace shm {

inline Error truncated(std::string detail, std::string section = {},
                       std::uint64_t offset = kNoOffset) {
  return {ErrorCode::truncated, std::move(detail), std::move(section), offset};
}

inline Error corrupt(std::string detail, std::string section = {},
                     std::uint64_t offset = kNoOffset) {
  return {ErrorCode::corrupt, std::move(detail), std::move(section), offset};
}

inline Error unsupported(std::string detail, std::string section = {},
                         std::uint64_t offset = kNoOffset) {
  return {ErrorCode::unsupported, std::move(detail), std::move(section), offset};
}

inline Error over_limit(std::string detail, std::string section = {},
                        std::uint64_t offset = kNoOffset) {
  return {ErrorCode::over_limit, std::move(detail), std::move(section), offset};
}

/// Returns an error that reports incorrect use of the API. `section` is the name of the function or
/// argument. (In all other errors, `section` is the name of a part of the file.)
inline Error misuse(std::string detail, std::string section = {}) {
  return {ErrorCode::misuse, std::move(detail), std::move(section)};
}

}  // namespace shm
