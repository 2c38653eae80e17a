// What the field data of a VTK file, legacy or XML, says about the mesh as a whole: its time, its
// title, names of its blocks.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "vtk/strings.h"

namespace shm::converters {

struct FieldArray {
  std::string name;
  vtk::ValueForm form = vtk::ValueForm::number;
  vtk::StringForm strings = vtk::StringForm::lines;  // of the form `string`
  const Extra* values = nullptr;
};
// All field data of a mesh from VTK; none of other meshes.
std::vector<FieldArray> field_arrays(const MeshInfo& info);

// Of a mesh from VTK, out of its extras; `told` gets the keys of those that were understood.
// A time is a single number, whatever its type. A title that says nothing is empty.
std::optional<double> vtk_time(const MeshInfo& info, std::set<std::string>& told);
std::string vtk_title(const MeshInfo& info, std::set<std::string>& told);
std::map<std::int64_t, std::string> vtk_block_names(const MeshInfo& info,
                                                    std::set<std::string>& told);

// Field data "BlockNames": for each block with a name its number, a blank, and the name, as strings
// in the form that is asked for. Its shape tells how many.
Extra vtk_block_names_extra(const MeshInfo& info, std::string key, vtk::StringForm form);
inline constexpr const char* kVtkBlockNames = "BlockNames";

}  // namespace shm::converters
