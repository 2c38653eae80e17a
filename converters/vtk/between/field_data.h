// Field data of a VTK file, legacy or XML.
#pragma once

#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "vtk/strings.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

struct FieldArray {
  std::string name;
  ValueForm form = ValueForm::number;
  StringForm strings = StringForm::lines;  // of the form `string`
  const Extra* values = nullptr;
};
// All field data of a mesh from VTK; none of other meshes.
std::vector<FieldArray> field_arrays(const MeshInfo& info);
std::vector<std::string> strings_of(const FieldArray& array);

// Field data "BlockNames": for each block with a name its number, a blank, and the name, as strings
// in the form that is asked for. Its shape is how many there are.
Extra block_names_extra(const MeshInfo& info, std::string key, StringForm form);
inline constexpr const char* kBlockNames = "BlockNames";

}  // namespace shm::converters::vtk
