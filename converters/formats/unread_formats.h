// Mesh formats that are recognized but cannot be read. Because they are recognized, an error
// message can name the format, and a file is not mistaken for a file of another format with the
// same extension.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace shm::converters {

// Returns the name of the format of a file that begins with `head`, such as "Abaqus or CalculiX
// input". Returns an empty string if the format is unknown or can be read.
std::string_view unread_format(std::span<const std::byte> head);

// Returns true if a file that begins with `head` is a CGNS file, stored in HDF5 or in its
// predecessor ADF.
bool is_cgns(std::span<const std::byte> head);

}  // namespace shm::converters
