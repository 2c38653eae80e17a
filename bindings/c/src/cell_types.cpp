#include "cell_types.h"

#include <limits>

#include "shmformat.h"

namespace shmf {
namespace {

/// Returns VTK's type of Lagrange cells with this shape and number of nodes, of orders 3 to 10, or
/// 0 if VTK has no such cells.
std::uint8_t lagrange_type(shm::CellShape shape, std::uint64_t nodes) {
  using shm::CellShape;
  for (std::uint64_t n = 4; n <= 11; ++n) {  // nodes along an edge
    const std::uint64_t triangle = n * (n + 1) / 2;
    if (shape == CellShape::line && nodes == n) return 68;
    if (shape == CellShape::triangle && nodes == triangle) return 69;
    if (shape == CellShape::quad && nodes == n * n) return 70;
    if (shape == CellShape::tetrahedron && nodes == triangle * (n + 2) / 3) return 71;
    if (shape == CellShape::hexahedron && nodes == n * n * n) return 72;
    if (shape == CellShape::wedge && nodes == triangle * n) return 73;
  }
  return 0;
}

}  // namespace

std::uint8_t vtk_cell_type(shm::CellShape shape, std::uint64_t nodes) {
  using shm::CellShape;
  struct Kind {
    CellShape shape;
    std::uint64_t nodes;
    std::uint8_t type;
  };
  constexpr std::uint8_t kPolyVertex = 2;
  constexpr Kind kKinds[] = {
      {CellShape::vertex, 1, 1},       {CellShape::line, 2, 3},
      {CellShape::line, 3, 21},        {CellShape::line, 4, 35},
      {CellShape::triangle, 3, 5},     {CellShape::triangle, 6, 22},
      {CellShape::triangle, 7, 34},    {CellShape::quad, 4, 9},
      {CellShape::quad, 8, 23},        {CellShape::quad, 9, 28},
      {CellShape::tetrahedron, 4, 10}, {CellShape::tetrahedron, 10, 24},
      {CellShape::pyramid, 5, 14},     {CellShape::pyramid, 13, 27},
      {CellShape::pyramid, 19, 37},    {CellShape::wedge, 6, 13},
      {CellShape::wedge, 15, 26},      {CellShape::wedge, 18, 32},
      {CellShape::hexahedron, 8, 12},  {CellShape::hexahedron, 20, 25},
      {CellShape::hexahedron, 24, 33}, {CellShape::hexahedron, 27, 29},
  };
  if (shape == CellShape::polygon) return 7;
  if (shape == CellShape::polyhedron) return 41;
  if (shape == CellShape::faces) return 42;
  for (const Kind& kind : kKinds)
    if (kind.shape == shape && kind.nodes == nodes) return kind.type;
  const std::uint8_t lagrange = lagrange_type(shape, nodes);
  return lagrange != 0 ? lagrange : kPolyVertex;
}

}  // namespace shmf

int32_t shmf_vtk_cell_type(int32_t shape, uint32_t nodes) {
  if (shape < 0 || shape > std::numeric_limits<std::uint8_t>::max()) return 2;
  return shmf::vtk_cell_type(static_cast<shm::CellShape>(shape), nodes);
}

size_t shmf_type_bytes(int32_t type) {
  if (type < 0 || type > std::numeric_limits<std::uint8_t>::max()) return 0;
  return shm::scalar_bytes(static_cast<shm::ScalarType>(type));
}
