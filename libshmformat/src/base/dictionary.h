// The dictionary for small packed blobs: entropy tables, then words that are frequent in mesh files
// of other formats. The dictionary is part of the format and must not change by a single byte.
// CMake generates the source from spec/dictionary_tables.bin and spec/dictionary.txt
// (dictionary.cpp.in).
// spec: "Packed blobs"
#pragma once

#include <cstddef>
#include <span>

namespace shm {

/// Returns the contents of both files, the tables first.
std::span<const std::byte> dictionary();

}  // namespace shm
