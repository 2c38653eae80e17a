// The dictionary for small packed blobs. It contains entropy tables, then words that are frequent
// in mesh files of other formats. The dictionary is part of the format and must not change by a
// single byte. CMake generates its source file from spec/dictionary_tables.bin and
// spec/dictionary.txt (dictionary.cpp.in).
// spec: "Packed blobs"
#pragma once

#include <cstddef>
#include <span>

namespace shm {

/// Returns the contents of dictionary_tables.bin, followed by the contents of dictionary.txt.
std::span<const std::byte> dictionary();

}  // namespace shm
