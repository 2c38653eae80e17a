// Copies structs of the interface between the caller and the library. Each struct begins with its
// size, because the caller may have been compiled with another version of the header, in which the
// struct has fewer or more members.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>

#include "errors.h"
#include "shm/result.h"

namespace shmf {

/// Returns a copy of the caller's struct. Members that are missing in the caller's version become
/// 0. `name` describes the struct in error messages.
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

/// Like taken(), returns a copy of a struct of the caller, but the struct is optional: if `from` is
/// null, all members of the copy except struct_size are 0.
template <class Struct>
shm::Result<Struct> taken_or_default(const Struct* from, const char* name) {
  if (from != nullptr) return taken(from, name);
  Struct own{};
  own.struct_size = sizeof own;
  return own;
}

/// Copies `value` to the caller's struct, except for members that are missing in the caller's
/// version.
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

/// Returns element `i` of an array of structs. The struct_size of the first element is the size of
/// each element.
template <class Struct>
Struct* at(Struct* first, std::size_t i) {
  using Byte = std::conditional_t<std::is_const_v<Struct>, const std::byte, std::byte>;
  return reinterpret_cast<Struct*>(reinterpret_cast<Byte*>(first) + i * first->struct_size);
}

}  // namespace shmf
