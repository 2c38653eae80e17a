// Failure: the exception that reports every error in the converters. The tool catches it in one
// place. The library (libshmformat) returns its errors instead. The converters throw, because they
// parse deeply nested input, and an exception can leave a parser from any depth.
#pragma once

#include <exception>
#include <string>
#include <utility>

#include "shm/result.h"

namespace shm::converters {

class Failure : public std::exception {
 public:
  explicit Failure(Error error) : error_(std::move(error)), text_(error_.message()) {}
  // An error that names no section and no offset. `file` is empty if the file is unknown.
  Failure(ErrorCode code, std::string detail, std::string file = {})
      : Failure(Error{.code = code, .detail = std::move(detail), .file = std::move(file)}) {}
  const Error& error() const { return error_; }
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  Error error_;
  std::string text_;
};

// Throws Failure (misuse). Used if the user asked for something that is not possible.
[[noreturn]] inline void wrong_use(const std::string& sentence) {
  throw Failure(ErrorCode::misuse, sentence);
}

// Returns the value in a library result. If the result contains an error instead, throws it as
// Failure. `file` becomes the file of the error if the error does not name a file.
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
