// Functions shared by the code that writes whole meshes and the code that reads them.
#pragma once

#include <cstddef>
#include <string>

#include "shm/result.h"
#include "shm/schema.h"

namespace shm {

/// Returns the size in bytes of one element of an array.
inline std::size_t stride_of(const ArrayInfo& info) {
  return scalar_bytes(info.type) * info.components;
}

/// Adds the path of the file to the error, unless the error already has a path.
template <class T>
Result<T> of_file(Result<T> result, const std::string& path) {
  if (result || !result.error().file.empty()) return result;
  Error error = result.error();
  error.file = path;
  return error;
}

}  // namespace shm
