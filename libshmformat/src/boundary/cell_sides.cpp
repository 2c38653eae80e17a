#include "boundary/cell_sides.h"

namespace shm {
namespace {

// Sides of each shape, in the order that side sets use (shm/sets.h).
constexpr std::array<ShapeFace, 6> kHexahedronSides = {{{4, {0, 1, 5, 4}},
                                                        {4, {1, 2, 6, 5}},
                                                        {4, {2, 3, 7, 6}},
                                                        {4, {0, 4, 7, 3}},
                                                        {4, {0, 3, 2, 1}},
                                                        {4, {4, 5, 6, 7}}}};
constexpr std::array<ShapeFace, 4> kTetrahedronSides = {
    {{3, {0, 1, 3}}, {3, {1, 2, 3}}, {3, {0, 3, 2}}, {3, {0, 2, 1}}}};
constexpr std::array<ShapeFace, 5> kPyramidSides = {
    {{3, {0, 1, 4}}, {3, {1, 2, 4}}, {3, {2, 3, 4}}, {3, {3, 0, 4}}, {4, {0, 3, 2, 1}}}};
constexpr std::array<ShapeFace, 5> kWedgeSides = {
    {{4, {0, 1, 4, 3}}, {4, {1, 2, 5, 4}}, {4, {0, 3, 5, 2}}, {3, {0, 2, 1}}, {3, {3, 4, 5}}}};

CellForm itself(std::uint32_t corners) { return {CellForm::itself, corners, {}, false}; }
CellForm solid(std::uint32_t corners, std::span<const ShapeFace> sides) {
  return {CellForm::solid, corners, sides, false};
}

CellForm form_of_shape(CellShape shape, std::uint64_t nodes) {
  switch (shape) {
    case CellShape::vertex: return itself(1);
    case CellShape::line: return itself(2);
    case CellShape::triangle: return itself(3);
    case CellShape::quad: return itself(4);
    case CellShape::polygon: return itself(nodes < 3 ? 3 : static_cast<std::uint32_t>(nodes));
    case CellShape::tetrahedron: return solid(4, kTetrahedronSides);
    case CellShape::pyramid: return solid(5, kPyramidSides);
    case CellShape::wedge: return {CellForm::solid, 6, kWedgeSides, true};
    case CellShape::hexahedron: return solid(8, kHexahedronSides);
    case CellShape::faces: return {CellForm::polyhedron, 0, {}, false};
    case CellShape::other:
    case CellShape::polyhedron: break;
  }
  return {};
}

}  // namespace

CellForm form_of(CellShape shape, std::uint64_t nodes) {
  const CellForm form = form_of_shape(shape, nodes);
  return form.corners <= nodes ? form : CellForm();
}

}  // namespace shm
