// Fields for the meshes of shm_make_mesh: smooth fields, turbulent fields, fields with a shock
// front, and fields that are constant in patches.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "programs/mesh_shapes.h"

namespace make_mesh {

struct Field {
  std::string name;
  std::string_view type;  // name of the type in VTK files, e.g. "float"
  std::size_t components = 1;
  std::vector<double> values;  // values, which are written as `type`
};

// cell_fields() returns the fields on cells, point_fields() the fields on points. `fields` is the
// value of the option --fields: "one", "basic" or "full".
std::vector<Field> cell_fields(const Mesh& mesh, std::string_view fields);
std::vector<Field> point_fields(const Mesh& mesh, std::string_view fields);

}  // namespace make_mesh
