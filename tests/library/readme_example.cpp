// Writes a mesh of one hexahedron to memory and reads it back.
#include <iostream>
#include <span>

#include "shm/mesh.h"

int main() {
  const double xyz[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                            {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const auto bytes = std::as_bytes(std::span(xyz));
  shm::Mesh cube;
  cube.schema.blocks.resize(1);  // a block holds hexahedra of 8 nodes unless you change it
  cube.xyz.assign(bytes.begin(), bytes.end());
  cube.cell_blocks = {0};
  cube.corner_begin = {0, 8};
  cube.corners = {0, 1, 2, 3, 4, 5, 6, 7};

  shm::MemorySink file;  // or shm::FileSink::create("cube.shm")
  if (!shm::write_mesh(file, cube)) return 1;
  shm::MemorySource source(file.bytes);
  const auto mesh = shm::read_mesh(source);  // where it fails, mesh.error().message() is why
  if (!mesh || *mesh != cube) return 1;
  std::cout << mesh->vertex_count() << " vertices, " << mesh->cell_count() << " cells\n";
}
