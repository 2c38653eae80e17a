#include "gmsh/types.h"

#include <array>
#include <map>
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

// Element types without a shape in the model: types of order 0, incomplete types and prisms of
// order 3 and above, and types whose elements are borders, children or parts of another element.
constexpr Run kRuns[] = {
    {20, 2, {9}},  // triangles, incomplete
    {22, 2, {12}},
    {24, 2, {15}},
    {32, 3, {22, 28}},                           // tetrahedra, incomplete
    {39, 2, {12, 16, 20}},                       // quadrilaterals, incomplete
    {52, 2, {18, 21, 24, 27, 30}},               // triangles, incomplete
    {57, 2, {24, 28, 32, 36, 40}},               // quadrilaterals, incomplete
    {67, 1, {2}},                                // border of a line
    {68, 2, {3}},                                // border of a triangle
    {70, 1, {2}},                                // child of a line
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

// Consecutive type numbers of complete Lagrange elements, from the type of order `order` on.
struct LagrangeRun {
  std::int32_t first;
  CellShape shape;
  std::uint32_t order, count;
};
constexpr LagrangeRun kLagrangeRuns[] = {
    {26, CellShape::line, 3, 3},        {62, CellShape::line, 6, 5},
    {21, CellShape::triangle, 3, 1},    {23, CellShape::triangle, 4, 1},
    {25, CellShape::triangle, 5, 1},    {42, CellShape::triangle, 6, 5},
    {36, CellShape::quad, 3, 3},        {47, CellShape::quad, 6, 5},
    {29, CellShape::tetrahedron, 3, 3}, {71, CellShape::tetrahedron, 6, 5},
    {92, CellShape::hexahedron, 3, 7},
};

// Returns the Lagrange element with the MSH number `type` if its order is at least 3; otherwise
// returns an unknown type.
GmshType lagrange_type(std::int64_t type) {
  static const auto types = [] {
    struct Known {
      CellShape shape;
      std::vector<std::uint16_t> permutation;
    };
    std::map<std::int64_t, Known> all;
    for (const LagrangeRun& run : kLagrangeRuns)
      for (std::uint32_t i = 0; i < run.count; ++i)
        all[run.first + i] = {run.shape, node_permutation(gmsh_positions(run.shape, run.order + i),
                                                          vtk_positions(run.shape, run.order + i))};
    return all;
  }();
  const auto found = types.find(type);
  if (found == types.end()) return {};
  const auto& [shape, permutation] = found->second;
  const bool is_flat = shape == CellShape::triangle || shape == CellShape::quad;
  return {shape == CellShape::line ? 1
          : is_flat                ? 2
                                   : 3,
          static_cast<std::uint32_t>(permutation.size()), shape, permutation};
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
  if (const GmshType lagrange = lagrange_type(type); lagrange.known()) return lagrange;
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
  const std::uint32_t order = order_of_cell(shape, nodes);
  for (const LagrangeRun& run : kLagrangeRuns)
    if (run.shape == shape && order >= run.order && order < run.order + run.count)
      return run.first + static_cast<std::int32_t>(order - run.order);
  return 0;
}

}  // namespace shm::converters
