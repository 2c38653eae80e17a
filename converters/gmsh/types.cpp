#include "gmsh/types.h"

#include <array>
#include <vector>

#include "mesh/node_orders.h"

namespace shm::converters {
namespace {

struct Run {  // consecutive type numbers of one dimension
  std::int32_t first;
  int dimension;
  // for each type of the run, its number of nodes; entries after the final type are 0
  std::array<std::uint16_t, 8> nodes;
};

// Element types without a shape in the model: types of order 0, types of order 3 and above except
// complete hexahedra, and types whose elements are borders, children or parts of another element.
constexpr Run kRuns[] = {
    {20, 2, {9, 10, 12, 15, 15, 21}},            // triangles
    {26, 1, {4, 5, 6}},                          // lines
    {29, 3, {20, 35, 56, 22, 28}},               // tetrahedra
    {36, 2, {16, 25, 36, 12, 16, 20}},           // quadrilaterals
    {42, 2, {28, 36, 45, 55, 66}},               // triangles
    {47, 2, {49, 64, 81, 100, 121}},             // quadrilaterals
    {52, 2, {18, 21, 24, 27, 30}},               // triangles, incomplete
    {57, 2, {24, 28, 32, 36, 40}},               // quadrilaterals, incomplete
    {62, 1, {7, 8, 9, 10, 11}},                  // lines
    {67, 1, {2}},                                // border of a line
    {68, 2, {3}},                                // border of a triangle
    {70, 1, {2}},                                // child of a line
    {71, 3, {84, 120, 165, 220, 286}},           // tetrahedra
    {79, 3, {34, 40, 46, 52, 58}},               // tetrahedra, incomplete
    {84, 1, {1}},                                // order 0: line,
    {85, 2, {1, 1}},                             // triangle, quadrilateral,
    {87, 3, {1, 1, 1}},                          // tetrahedron, hexahedron, prism
    {90, 3, {40, 75}},                           // prisms
    {99, 3, {32, 44, 56, 68, 80, 92, 104}},      // hexahedra, incomplete
    {106, 3, {126, 196, 288, 405, 550}},         // prisms
    {111, 3, {24, 33, 42, 51, 60, 69, 78}},      // prisms, incomplete
    {118, 3, {30, 55, 91, 140, 204, 285, 385}},  // pyramids
    {125, 3, {21, 29, 37, 45, 53, 61, 69}},      // pyramids, incomplete
    {132, 3, {1}},                               // order 0: pyramid
    {133, 0, {1}},                               // parts of cut elements
    {134, 1, {2}},
    {135, 2, {3}},
    {136, 3, {4}},
    {137, 3, {16}},  // tetrahedron of order 3, incomplete
    {138, 2, {4}},   // triangle with a middle node
    {139, 3, {5}},   // tetrahedron with a middle node
    {140, 3, {4}},   // trihedron
};

constexpr std::uint16_t kTetrahedron10[] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};
constexpr std::uint16_t kHexahedron20[] = {0,  1, 2,  3,  4,  5,  6,  7,  8,  11,
                                           13, 9, 16, 18, 19, 17, 10, 12, 14, 15};
constexpr std::uint16_t kHexahedron27[] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  11, 13, 9,  16, 18,
                                           19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26};
constexpr std::uint16_t kWedge15[] = {0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11};
constexpr std::uint16_t kWedge18[] = {0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16};
constexpr std::uint16_t kPyramid13[] = {0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12};
constexpr std::uint16_t kPyramid14[] = {0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12, 13};

// MSH type of complete hexahedra of order 3; the types of higher orders follow.
constexpr std::int32_t kHexahedronOfOrder3 = 92;

// Returns the permutation of the nodes of a complete hexahedron of order 3 to kMostOrder.
std::span<const std::uint16_t> hexahedron_permutation(std::uint32_t order) {
  static const auto permutations = [] {
    std::array<std::vector<std::uint16_t>, kMostOrder + 1> all;
    for (std::uint32_t p = 3; p <= kMostOrder; ++p)
      all[p] = node_permutation(gmsh_hexahedron(p), vtk_hexahedron(p));
    return all;
  }();
  return permutations[order];
}

// Returns the element type with the MSH number `type` if the model has a shape for it; otherwise
// returns an unknown type.
GmshType shaped_type(std::int64_t type) {
  switch (type) {
    case 15: return {0, 1, CellShape::vertex, {}};
    case 1: return {1, 2, CellShape::line, {}};
    case 8: return {1, 3, CellShape::line, {}};
    case 2: return {2, 3, CellShape::triangle, {}};
    case 9: return {2, 6, CellShape::triangle, {}};
    case 3: return {2, 4, CellShape::quad, {}};
    case 16: return {2, 8, CellShape::quad, {}};
    case 10: return {2, 9, CellShape::quad, {}};
    case 34: return {2, 0, CellShape::polygon, {}};
    case 4: return {3, 4, CellShape::tetrahedron, {}};
    case 11: return {3, 10, CellShape::tetrahedron, kTetrahedron10};
    case 7: return {3, 5, CellShape::pyramid, {}};
    case 19: return {3, 13, CellShape::pyramid, kPyramid13};
    case 14: return {3, 14, CellShape::pyramid, kPyramid14};
    case 6: return {3, 6, CellShape::wedge, {}};
    case 18: return {3, 15, CellShape::wedge, kWedge15};
    case 13: return {3, 18, CellShape::wedge, kWedge18};
    case 5: return {3, 8, CellShape::hexahedron, {}};
    case 17: return {3, 20, CellShape::hexahedron, kHexahedron20};
    case 12: return {3, 27, CellShape::hexahedron, kHexahedron27};
    default: return {};
  }
}

}  // namespace

GmshType gmsh_type(std::int64_t type) {
  if (const GmshType shaped = shaped_type(type); shaped.known()) return shaped;
  if (type >= kHexahedronOfOrder3 && type <= kHexahedronOfOrder3 + kMostOrder - 3) {
    const auto order = static_cast<std::uint32_t>(type - kHexahedronOfOrder3 + 3);
    return {3, (order + 1) * (order + 1) * (order + 1), CellShape::hexahedron,
            hexahedron_permutation(order)};
  }
  if (type == 35) return {3, 0, CellShape::other, {}};  // polyhedron, made of tetrahedra
  if (type == 69) return {2, 0, CellShape::other, {}};  // border of a polygon
  for (const Run& run : kRuns) {
    if (type < run.first || type >= run.first + 8) continue;
    // A run has at most 7 types, so its array `nodes` ends with zeros. If the entry for `type` is
    // 0, the run does not contain `type`, but a later run may contain it.
    const std::uint32_t nodes = run.nodes[static_cast<std::size_t>(type - run.first)];
    if (nodes != 0) return {run.dimension, nodes, CellShape::other, {}};
  }
  return {};
}

// Returns true if elements of this type may have a parent element: polygons and polyhedra, borders,
// children, and parts of cut elements.
bool gmsh_type_has_parent(std::int64_t type) {
  return type == 34 || type == 35 || (type >= 67 && type <= 70) || (type >= 133 && type <= 136);
}

std::int32_t gmsh_type_for(CellShape shape, std::uint64_t nodes) {
  if (shape == CellShape::polygon) shape = nodes == 3 ? CellShape::triangle : CellShape::quad;
  for (std::int32_t type = 1; type < 20; ++type) {
    const GmshType candidate = shaped_type(type);
    if (candidate.known() && candidate.shape == shape && candidate.nodes == nodes) return type;
  }
  const std::uint32_t order = shape == CellShape::hexahedron ? order_of_hexahedron(nodes) : 0;
  return order >= 3 ? kHexahedronOfOrder3 + static_cast<std::int32_t>(order) - 3 : 0;
}

}  // namespace shm::converters
