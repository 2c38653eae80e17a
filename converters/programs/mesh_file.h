// Writes a mesh of shm_make_mesh as binary legacy VTK 4.2.
#pragma once

#include <string_view>

#include "programs/mesh_shapes.h"

namespace make_mesh {

// Largest number of cells in a file. The limit exists because the CELLS section, which has nine
// 32-bit words per cell, states its number of words as a signed 32-bit number.
constexpr std::uint64_t kMaxCells = std::numeric_limits<std::int32_t>::max() / 9;

struct MeshFile {
  const char* path = nullptr;
  std::string_view title;
  bool doubles = false;
  std::string_view fields = "basic";  // none, one, basic or full
};
// Writes the mesh. Returns true if every byte has been written.
bool write_mesh(const Mesh& mesh, const MeshFile& file);

}  // namespace make_mesh
