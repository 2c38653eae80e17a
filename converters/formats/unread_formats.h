// Formats of meshes that are known by sight and not read, so that a file of one is called what it
// is and not taken for another of the same extension.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace shm::converters {

// The name of the format of a file that begins with `head`, such as "Abaqus input"; empty for all
// that is not known, formats that are read among them.
std::string_view unread_format(std::span<const std::byte> head);

// Whether it is one of CGNS, in HDF5 or in ADF, which came before.
bool is_cgns(std::span<const std::byte> head);

}  // namespace shm::converters
