// Writes a hexahedron with a temperature to a file, and reads both back.
#include <iostream>

#include "shm/shm.h"

int main() {
  const std::vector<std::array<double, 3>> points{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                                  {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const std::vector<std::array<std::uint64_t, 8>> hexahedra{{0, 1, 2, 3, 4, 5, 6, 7}};
  auto cube = shm::Mesh::of_hexahedra(points, hexahedra);
  cube.add_array<double>("temperature", shm::Location::cell, std::vector{300.0});
  const auto written = shm::write_file("cube.shm", cube, {}, shm::FileSink::Existing::replace);
  if (!written) return std::cerr << written.error().message() << '\n', 1;

  const auto mesh = shm::read_file("cube.shm");
  if (!mesh) return std::cerr << mesh.error().message() << '\n', 1;
  std::cout << mesh->vertex_count() << " vertices, " << mesh->hexahedra().size() << " hexahedra";
  if (const auto array = mesh->find_array(shm::Location::cell, "temperature"))
    std::cout << ", " << mesh->values_as<float>(*array)[0] << " degrees\n";
}
