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
  StringForm strings = StringForm::lines;  // used only if `form` is string
  const Extra* values = nullptr;
};
// Returns all field data of a mesh from VTK, and nothing for other meshes.
std::vector<FieldArray> field_arrays(const MeshInfo& info);
std::vector<std::string> strings_of(const FieldArray& array);

// Field data "BlockNames": for each named block its number, a blank, and the name, as strings in
// form `form`. The shape of the extra is the number of strings.
Extra block_names_extra(const MeshInfo& info, std::string key, StringForm form);
inline constexpr const char* kBlockNames = "BlockNames";

}  // namespace shm::converters::vtk
