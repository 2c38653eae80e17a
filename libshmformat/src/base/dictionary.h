// The dictionary of small packed blobs: entropy tables, then words that are frequent in the files
// that meshes come from. It is part of the format and must not change by a single byte. CMake makes
// the source from spec/dictionary_tables.bin and spec/dictionary.txt (dictionary.cpp.in).
// spec: "Packed blobs"
#pragma once

#include <cstddef>
#include <span>

namespace shm {

/// Returns the bytes of both files.
std::span<const std::byte> dictionary();

}  // namespace shm
