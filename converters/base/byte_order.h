// Converts numbers between the byte order of a file and the byte order of the machine.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace shm::converters {

template <class Word>
void swap_words(std::byte* values, std::size_t count, Word (*swap)(Word)) {
  for (std::size_t i = 0; i < count; ++i, values += sizeof(Word)) {
    Word word;
    std::memcpy(&word, values, sizeof word);
    word = swap(word);
    std::memcpy(values, &word, sizeof word);
  }
}

// Converts values from the byte order of a file to that of the machine, or the reverse.
inline void swap_from_file(std::byte* values, std::size_t count, std::size_t value_bytes,
                           bool big_endian) {
  if (big_endian == (std::endian::native == std::endian::big)) return;
  using U16 = std::uint16_t;
  using U32 = std::uint32_t;
  using U64 = std::uint64_t;
  if (value_bytes == 2)
    swap_words<U16>(values, count, [](U16 w) { return static_cast<U16>(__builtin_bswap16(w)); });
  if (value_bytes == 4)
    swap_words<U32>(values, count, [](U32 w) { return static_cast<U32>(__builtin_bswap32(w)); });
  if (value_bytes == 8)
    swap_words<U64>(values, count, [](U64 w) { return static_cast<U64>(__builtin_bswap64(w)); });
}

}  // namespace shm::converters
