// What packing and unpacking share. spec: "Packed blobs"
#pragma once

#include <zstd.h>
#include <zstd_errors.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

#include "bytes/dictionary.h"

namespace shm {

/// Methods of packed blobs.
inline constexpr std::uint8_t kRaw = 0, kFrame = 1, kPlanes = 2, kWithDictionary = 3;
/// With the dictionary only small blobs are packed: of large ones it is no part worth mentioning.
inline constexpr std::uint64_t kMostWithDictionary = std::uint64_t{1} << 20;
/// As it stands in the file of the text of the format: tables, then words.
inline const std::vector<std::byte>& the_dictionary() {
  static const std::vector<std::byte> whole = [] {
    std::vector<std::byte> bytes;
    for (const std::uint8_t byte : kDictionaryTables) bytes.push_back(static_cast<std::byte>(byte));
    const auto words = std::as_bytes(std::span(kDictionaryText));
    bytes.insert(bytes.end(), words.begin(), words.end());
    return bytes;
  }();
  return whole;
}

/// What is left out of frames with the dictionary: the magic number that all frames begin with.
inline constexpr std::array<std::byte, 4> kMagic = {std::byte{0x28}, std::byte{0xb5},
                                                    std::byte{0x2f}, std::byte{0xfd}};

/// zstd returns a null, or an error of its own, where there is no more memory. Callers get what
/// they get for any other memory (shm/result.h).
template <class Context>
Context* made_by_zstd(Context* context) {
  if (context == nullptr) throw std::bad_alloc();
  return context;
}
/// Whether zstd failed otherwise.
inline bool zstd_failed(std::size_t result) {
  if (ZSTD_isError(result) == 0) return false;
  if (ZSTD_getErrorCode(result) == ZSTD_error_memory_allocation) throw std::bad_alloc();
  return true;
}

}  // namespace shm
