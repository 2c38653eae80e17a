// Detects mesh formats that this library cannot read. Error messages can then name the format, and
// such a file is not mistaken for one in another format with the same extension.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace shm::converters {

// Returns the name of the format of a file that begins with `head`, such as "Abaqus or CalculiX
// input". Returns an empty string if the format is unknown, or if this library can read it.
std::string_view unread_format(std::span<const std::byte> head);

// Returns true if a file that begins with `head` is a CGNS file, stored in HDF5 or in CGNS's older
// file format ADF.
bool is_cgns(std::span<const std::byte> head);

}  // namespace shm::converters
