// What the field data of a VTK file says about the mesh as a whole: its time, names of its blocks.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "mesh_source.h"

namespace shm::converters {

// Of a mesh from VTK, out of its extras; `told` gets the keys of those that were understood.
std::optional<double> vtk_time(const MeshInfo& info, std::set<std::string>& told);
std::map<std::int64_t, std::string> vtk_block_names(const MeshInfo& info,
                                                    std::set<std::string>& told);

// Field data "BlockNames": for each block with a name its number, a blank, and the name; as the
// strings of a binary file are stored.
Extra vtk_block_names_extra(const MeshInfo& info, std::string key);
inline constexpr const char* kVtkBlockNames = "BlockNames";

}  // namespace shm::converters
