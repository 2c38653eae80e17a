// Failure: something went wrong in the converters; thrown, caught once by the tool.
// The library itself never throws; converters parse deep and bail out from anywhere.
#pragma once

#include <exception>
#include <string>
#include <utility>

#include "shm/result.h"

namespace shm::converters {

class Failure : public std::exception {
 public:
  explicit Failure(Error error) : error_(std::move(error)), text_(error_.message()) {}
  const Error& error() const { return error_; }
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  Error error_;
  std::string text_;
};

// Throws what the user asked for wrongly.
[[noreturn]] inline void wrong_use(const std::string& sentence) {
  throw Failure(Error{ErrorCode::misuse, sentence, {}, kNoOffset, {}});
}

// Unwraps a library result; throws what went wrong, naming `file`.
template <class T>
T unwrap(Result<T> result, const std::string& file = {}) {
  if (!result) {
    Error error = result.error();
    if (error.file.empty()) error.file = file;
    throw Failure(std::move(error));
  }
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

}  // namespace shm::converters
