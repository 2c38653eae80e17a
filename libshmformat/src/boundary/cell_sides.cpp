#include "boundary/cell_sides.h"

#include <algorithm>
#include <utility>

#include "shm/cell_nodes.h"

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

// --- facets

/// Divides sides of a cell of order p at its nodes: a line into p lines, a triangle into p^2
/// triangles, a quadrilateral into p^2 quadrilaterals. Neighbouring cells divide a side alike.
class SideDivider {
 public:
  /// `places`: the places of the nodes that a cell has. Nodes inside quadrilaterals may be missing
  /// if the order is 2.
  SideDivider(std::vector<NodePlace> places, std::uint32_t order, std::vector<Facet>& facets)
      : places_(std::move(places)),
        order_(static_cast<int>(order)),
        positions_((order + 1) * (order + 1) * (order + 1), kNowhere),
        facets_(&facets) {
    for (std::uint16_t p = 0; p < places_.size(); ++p) positions_[index_of(places_[p])] = p;
  }

  void divide(std::uint8_t side, std::span<const std::uint16_t> corners) {
    side_ = side;
    const auto at = [&](int u, int v) { return position(corners, u, v); };
    const std::size_t size = corners.size();
    if (size == 4 && at(1, 1) == kNowhere) {
      const std::array<std::uint16_t, 4> middle = {at(1, 0), at(2, 1), at(1, 2), at(0, 1)};
      for (std::size_t i = 0; i < 4; ++i) add({{corners[i], middle[i], middle[(i + 3) % 4]}});
      return add(middle);
    }
    for (int v = 0; v < (size == 2 ? 1 : order_); ++v)
      for (int u = 0; u < (size == 3 ? order_ - v : order_); ++u) {
        if (size == 2) add({{at(u, 0), at(u + 1, 0)}});
        if (size == 3) add({{at(u, v), at(u + 1, v), at(u, v + 1)}});
        if (size == 3 && u + v + 1 < order_) add({{at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)}});
        if (size == 4) add({{at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)}});
      }
  }

 private:
  static constexpr std::uint16_t kNowhere = 0xffff;

  void add(std::span<const std::uint16_t> corners) {
    Facet facet{side_, static_cast<std::uint8_t>(corners.size()), {}};
    std::copy(corners.begin(), corners.end(), facet.at.begin());
    facets_->push_back(facet);
  }
  std::size_t index_of(const NodePlace& place) const {
    const std::size_t side = static_cast<std::size_t>(order_) + 1;
    return place[0] + side * (place[1] + side * place[2]);
  }
  /// Returns the node that is u steps from the first corner towards the second one, and v steps
  /// towards the last one.
  std::uint16_t position(std::span<const std::uint16_t> corners, int u, int v) const {
    NodePlace place{};
    for (std::size_t a = 0; a < 3; ++a) {
      // Corners are at the ends of the axes, so a step along a side is 0, 1 or -1 on each axis.
      const auto end = [&](std::size_t i) { return int{places_[corners[i]][a]}; };
      const int from = end(0), along_u = (end(1) - from) / order_,
                along_v = (end(corners.size() - 1) - from) / order_;
      place[a] = static_cast<std::uint8_t>(from + along_u * u + along_v * v);
    }
    return positions_[index_of(place)];
  }

  std::vector<NodePlace> places_;
  int order_;
  std::vector<std::uint16_t> positions_;  // of the node at each place
  std::vector<Facet>* facets_;
  std::uint8_t side_ = 0;
};

/// Returns the places of the nodes of a cell, as far as they are nodes of a complete cell. These
/// come first: the corners and the nodes on edges, then those on faces and inside. Some cells of
/// order 2 lack the last ones, or have others: centres of triangles and of cells.
std::vector<NodePlace> known_places(const BlockInfo& block, std::uint32_t order) {
  std::vector<NodePlace> places = node_places(block.shape, NodeScheme::lagrange, order);
  const bool has_other_faces = block.shape == CellShape::wedge && block.nodes_per_cell == 21;
  places.resize(std::min<std::size_t>(places.size(), has_other_faces ? 15 : block.nodes_per_cell));
  return places;
}

}  // namespace

std::vector<Facet> facets_of(const BlockInfo& block) {
  std::vector<Facet> facets;
  if (block.scheme != NodeScheme::lagrange) return facets;
  const std::uint32_t order = cell_order(block);
  if (order < 2) return facets;
  const CellForm form = form_of(block.shape, block.nodes_per_cell);
  SideDivider divider(known_places(block, order), order, facets);
  std::vector<std::uint16_t> corners;
  if (form.kind == CellForm::itself) {
    for (std::uint16_t i = 0; i < form.corners; ++i) corners.push_back(i);
    divider.divide(0, corners);
  }
  for (std::size_t k = 0; k < form.sides.size(); ++k) {
    const ShapeFace& side = form.sides[k];
    corners.assign(side.at.begin(), side.at.begin() + side.size);
    divider.divide(static_cast<std::uint8_t>(k + 1), corners);
  }
  return facets;
}

CellForm form_of(CellShape shape, std::uint64_t nodes) {
  const CellForm form = form_of_shape(shape, nodes);
  return form.corners <= nodes ? form : CellForm();
}

}  // namespace shm
