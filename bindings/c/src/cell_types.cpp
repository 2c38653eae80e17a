#include "cell_types.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <optional>
#include <vector>

#include "shm/cell_nodes.h"
#include "shmformat.h"

namespace shmf {
namespace {

/// Returns the block of a cell, or nothing if its numbers are out of range.
std::optional<shm::BlockInfo> block_from(int32_t shape, uint32_t nodes, int32_t node_scheme) {
  if (shape < SHMF_OTHER || shape > SHMF_FACES || node_scheme < SHMF_LAGRANGE ||
      node_scheme > SHMF_BEZIER)
    return std::nullopt;
  return shm::BlockInfo{
      0, {}, static_cast<shm::CellShape>(shape), nodes, static_cast<shm::NodeScheme>(node_scheme)};
}

/// Returns VTK's type of Lagrange or Bezier cells of a block, or 0 if VTK has no such cells.
std::uint8_t high_order_type(const shm::BlockInfo& block) {
  // VTK's types 68 to 73 are Lagrange cells of these shapes, types 75 to 80 Bezier cells.
  constexpr shm::CellShape kShapes[] = {shm::CellShape::line,       shm::CellShape::triangle,
                                        shm::CellShape::quad,       shm::CellShape::tetrahedron,
                                        shm::CellShape::hexahedron, shm::CellShape::wedge};
  const bool is_bezier = block.scheme == shm::NodeScheme::bezier;
  if (block.scheme == shm::NodeScheme::serendipity || cell_order(block) < (is_bezier ? 2u : 3u))
    return 0;
  for (std::uint8_t i = 0; i < std::size(kShapes); ++i)
    if (kShapes[i] == block.shape) return static_cast<std::uint8_t>((is_bezier ? 75 : 68) + i);
  return 0;
}

}  // namespace

std::uint8_t vtk_cell_type(const shm::BlockInfo& of_block, std::uint64_t nodes) {
  shm::BlockInfo block = of_block;
  block.nodes_per_cell = static_cast<std::uint32_t>(nodes);
  const shm::CellShape shape = block.shape;
  using shm::CellShape;
  struct Kind {
    CellShape shape;
    std::uint8_t nodes, type;
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
  if (block.scheme == shm::NodeScheme::lagrange)
    for (const Kind& kind : kKinds)
      if (kind.shape == shape && kind.nodes == nodes) return kind.type;
  const std::uint8_t high_order = high_order_type(block);
  return high_order != 0 ? high_order : kPolyVertex;
}

}  // namespace shmf

int32_t shmf_vtk_cell_type(int32_t shape, uint32_t nodes, int32_t node_scheme) {
  const auto block = shmf::block_from(shape, nodes, node_scheme);
  return block ? shmf::vtk_cell_type(*block, nodes) : 2;
}

uint32_t shmf_cell_order(int32_t shape, uint32_t nodes, int32_t node_scheme) {
  const auto block = shmf::block_from(shape, nodes, node_scheme);
  return block ? shm::cell_order(*block) : 0;
}

uint32_t shmf_node_places(int32_t shape, int32_t node_scheme, uint32_t order, uint8_t* places) {
  const auto block = shmf::block_from(shape, 0, node_scheme);
  if (!block) return 0;
  const std::vector<shm::NodePlace> all = shm::node_places(block->shape, block->scheme, order);
  if (places != nullptr)
    for (const shm::NodePlace& place : all) places = std::copy(place.begin(), place.end(), places);
  return static_cast<uint32_t>(all.size());
}

size_t shmf_type_bytes(int32_t type) {
  if (type < 0 || type > std::numeric_limits<std::uint8_t>::max()) return 0;
  return shm::scalar_bytes(static_cast<shm::ScalarType>(type));
}
