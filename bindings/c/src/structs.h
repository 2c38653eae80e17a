// Structs of the interface, which begin with their size: a caller may have been compiled with a
// header that knew fewer members, or more.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>

#include "errors.h"
#include "shm/result.h"

namespace shmf {

/// What the caller's struct holds; members that it has not are 0. `name` is for the complaint.
template <class Struct>
shm::Result<Struct> taken(const Struct* from, const char* name) {
  static_assert(std::is_trivially_copyable_v<Struct>);
  if (from == nullptr) return misuse(std::string(name) + " is NULL");
  if (from->struct_size < sizeof(std::size_t))
    return misuse(std::string(name) + " has no struct_size");
  Struct own{};
  std::memcpy(&own, from, std::min(from->struct_size, sizeof own));
  own.struct_size = sizeof own;
  return own;
}

/// The same of a struct that may be left out: all 0 then.
template <class Struct>
shm::Result<Struct> taken_or_default(const Struct* from, const char* name) {
  if (from != nullptr) return taken(from, name);
  Struct own{};
  own.struct_size = sizeof own;
  return own;
}

/// Fills as much of the caller's struct as he knows.
template <class Struct>
shm::Result<void> give(Struct* to, Struct value, const char* name) {
  static_assert(std::is_trivially_copyable_v<Struct>);
  if (to == nullptr) return misuse(std::string(name) + " is NULL");
  if (to->struct_size < sizeof(std::size_t))
    return misuse(std::string(name) + " has no struct_size");
  value.struct_size = to->struct_size;
  std::memcpy(to, &value, std::min(to->struct_size, sizeof value));
  return {};
}

/// The i-th of several structs, each as long as the first says.
template <class Struct>
Struct* at(Struct* first, std::size_t i) {
  using Byte = std::conditional_t<std::is_const_v<Struct>, const std::byte, std::byte>;
  return reinterpret_cast<Struct*>(reinterpret_cast<Byte*>(first) + i * first->struct_size);
}

}  // namespace shmf
