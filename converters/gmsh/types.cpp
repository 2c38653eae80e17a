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

// Element types without a shape in the model: types of order 0, and types whose elements are
// borders, children or parts of another element.
constexpr Run kRuns[] = {
    {67, 1, {2}},        // border of a line
    {68, 2, {3}},        // border of a triangle
    {70, 1, {2}},        // child of a line
    {84, 1, {1}},        // order 0: line,
    {85, 2, {1, 1}},     // triangle, quadrilateral,
    {87, 3, {1, 1, 1}},  // tetrahedron, hexahedron, prism
    {132, 3, {1}},       // order 0: pyramid
    {133, 0, {1}},       // parts of cut elements
    {134, 1, {2}},      {135, 2, {3}}, {136, 3, {4}}, {138, 2, {4}},  // triangle with a middle node
    {139, 3, {5}},  // tetrahedron with a middle node
    {140, 3, {4}},  // trihedron
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

// Consecutive type numbers of elements of order 3 and higher, from the type of order `order` on.
// Gmsh calls serendipity elements incomplete.
struct HighOrderRun {
  std::int32_t first;
  CellShape shape;
  NodeScheme scheme;
  std::uint32_t order, count;
};
constexpr auto kComplete = NodeScheme::lagrange, kIncomplete = NodeScheme::serendipity;
constexpr HighOrderRun kHighOrderRuns[] = {
    {26, CellShape::line, kComplete, 3, 3},
    {62, CellShape::line, kComplete, 6, 5},
    {21, CellShape::triangle, kComplete, 3, 1},
    {23, CellShape::triangle, kComplete, 4, 1},
    {25, CellShape::triangle, kComplete, 5, 1},
    {42, CellShape::triangle, kComplete, 6, 5},
    {36, CellShape::quad, kComplete, 3, 3},
    {47, CellShape::quad, kComplete, 6, 5},
    {29, CellShape::tetrahedron, kComplete, 3, 3},
    {71, CellShape::tetrahedron, kComplete, 6, 5},
    {90, CellShape::wedge, kComplete, 3, 2},
    {106, CellShape::wedge, kComplete, 5, 5},
    {92, CellShape::hexahedron, kComplete, 3, 7},
    {118, CellShape::pyramid, kComplete, 3, 7},
    {20, CellShape::triangle, kIncomplete, 3, 1},
    {22, CellShape::triangle, kIncomplete, 4, 1},
    {24, CellShape::triangle, kIncomplete, 5, 1},
    {52, CellShape::triangle, kIncomplete, 6, 5},
    {39, CellShape::quad, kIncomplete, 3, 3},
    {57, CellShape::quad, kIncomplete, 6, 5},
    {137, CellShape::tetrahedron, kIncomplete, 3, 1},
    {32, CellShape::tetrahedron, kIncomplete, 4, 2},
    {79, CellShape::tetrahedron, kIncomplete, 6, 5},
    {99, CellShape::hexahedron, kIncomplete, 3, 7},
    {111, CellShape::wedge, kIncomplete, 3, 7},
    {125, CellShape::pyramid, kIncomplete, 3, 7},
};

int dimension_of(CellShape shape) {
  const bool is_flat = shape == CellShape::triangle || shape == CellShape::quad;
  return shape == CellShape::line ? 1 : is_flat ? 2 : 3;
}

// Returns the element with the MSH number `type` if its order is at least 3; otherwise returns an
// unknown type.
GmshType high_order_type(std::int64_t type) {
  static const auto permutations = [] {
    std::map<std::int64_t, std::vector<std::uint16_t>> all;
    for (const HighOrderRun& run : kHighOrderRuns)
      for (std::uint32_t i = 0; i < run.count; ++i)
        all[run.first + i] = node_permutation(gmsh_places(run.shape, run.scheme, run.order + i),
                                              node_places(run.shape, run.scheme, run.order + i));
    return all;
  }();
  for (const HighOrderRun& run : kHighOrderRuns)
    if (type >= run.first && type < run.first + run.count) {
      const auto& permutation = permutations.at(type);
      return {dimension_of(run.shape), static_cast<std::uint32_t>(permutation.size()), run.shape,
              permutation, run.scheme};
    }
  return {};
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
  if (const GmshType high = high_order_type(type); high.known()) return high;
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

std::int32_t gmsh_type_for(const BlockInfo& block) {
  CellShape shape = block.shape;
  if (shape == CellShape::polygon)
    shape = block.nodes_per_cell == 3 ? CellShape::triangle : CellShape::quad;
  if (block.scheme == NodeScheme::lagrange)
    for (std::int32_t type = 1; type < 20; ++type) {
      const GmshType candidate = shaped_type(type);
      if (candidate.known() && candidate.shape == shape && candidate.nodes == block.nodes_per_cell)
        return type;
    }
  const std::uint32_t order = cell_order(block);
  for (const HighOrderRun& run : kHighOrderRuns)
    if (run.shape == shape && run.scheme == block.scheme && order >= run.order &&
        order < run.order + run.count)
      return run.first + static_cast<std::int32_t>(order - run.order);
  return 0;
}

}  // namespace shm::converters
