// Access to the field data of a mesh from a VTK file, legacy or XML.
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
// Returns all field data of a mesh that came from VTK. Returns nothing for other meshes.
std::vector<FieldArray> field_arrays(const MeshInfo& info);
std::vector<std::string> strings_of(const FieldArray& array);

// Returns an extra with the field data "BlockNames". It contains one string for each named block:
// the number of the block, a space, and the name. `form` says how the strings are encoded. The
// shape of the extra is {number of strings}.
Extra block_names_extra(const MeshInfo& info, std::string key, StringForm form);
inline constexpr const char* kBlockNames = "BlockNames";

}  // namespace shm::converters::vtk
