// What writing and reading a whole mesh share.
#pragma once

#include <cstddef>
#include <string>

#include "shm/result.h"
#include "shm/schema.h"

namespace shm {

/// Bytes of one element of an array.
inline std::size_t stride_of(const ArrayInfo& info) {
  return scalar_bytes(info.type) * info.components;
}

/// With the name of the file, where an error has none.
template <class T>
Result<T> of_file(Result<T> result, const std::string& path) {
  if (result || !result.error().file.empty()) return result;
  Error error = result.error();
  error.file = path;
  return error;
}

}  // namespace shm
