// The families of meshes that shm_make_mesh generates. Each family can be generated in any size.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "programs/mesh_shapes.h"

namespace make_mesh {

struct Family {
  std::string_view name, meaning;
  Mesh (*make)(std::uint64_t cells);
};
const std::array<Family, 8>& families();

}  // namespace make_mesh
