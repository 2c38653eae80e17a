#include "boundary/cell_sides.h"

#include <algorithm>
#include <utility>

#include "mesh/node_layout.h"

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

/// Divides sides of a second-order cell at its mid nodes.
class SideDivider {
 public:
  SideDivider(const NodeLayout& layout, std::vector<Facet>& facets)
      : layout_(&layout), facets_(&facets) {}

  /// Appends the facets of a side. Appends the side itself if its edges have no mid nodes.
  void divide(std::uint8_t side, std::span<const std::uint16_t> corners) {
    side_ = side;
    const std::size_t size = corners.size();
    std::array<std::uint16_t, 4> middle{};
    for (std::size_t i = 0; i < size; ++i) {
      middle[i] = middle_of_edge(corners[i], corners[(i + 1) % size]);
      if (middle[i] == kNowhere) return add(corners);
    }
    if (size == 2) {
      add({{corners[0], middle[0]}});
      add({{middle[0], corners[1]}});
      return;
    }
    const std::uint16_t centre = middle_of_face(corners);
    for (std::size_t i = 0; i < size; ++i) {
      const std::uint16_t before = middle[(i + size - 1) % size];
      if (centre == kNowhere)
        add({{corners[i], middle[i], before}});
      else
        add({{corners[i], middle[i], centre, before}});
    }
    if (centre == kNowhere) add(std::span(middle).first(size));
  }

 private:
  static constexpr std::uint16_t kNowhere = 0xffff;

  void add(std::span<const std::uint16_t> corners) {
    Facet facet{side_, static_cast<std::uint8_t>(corners.size()), {}};
    std::copy(corners.begin(), corners.end(), facet.at.begin());
    facets_->push_back(facet);
  }
  std::uint16_t middle_of_edge(std::uint16_t a, std::uint16_t b) const {
    return position([&](const MidNode& node) {
      return node.kind == MidNode::edge && ((node.corner[0] == a && node.corner[1] == b) ||
                                            (node.corner[0] == b && node.corner[1] == a));
    });
  }
  /// Returns the node in the middle of a face. The node of a flat cell is the one of its body.
  std::uint16_t middle_of_face(std::span<const std::uint16_t> corners) const {
    const bool is_flat = layout_->side_count == 0;
    return position([&](const MidNode& node) {
      if (node.kind == MidNode::edge) return false;
      if (is_flat) return true;
      return node.kind == MidNode::face && corners.size() == 4 &&
             std::all_of(node.corner.begin(), node.corner.end(), [&](std::uint16_t corner) {
               return std::find(corners.begin(), corners.end(), corner) != corners.end();
             });
    });
  }
  template <class Is>
  std::uint16_t position(Is&& is) const {
    for (std::uint16_t p = layout_->corners; p < layout_->nodes; ++p)
      if (is(layout_->mid[p])) return p;
    return kNowhere;
  }

  const NodeLayout* layout_;
  std::vector<Facet>* facets_;
  std::uint8_t side_ = 0;
};

/// Appends the facets of a side of a grid: order * order quadrilaterals.
void divide_grid(const NodeGrid& grid, std::uint8_t side, const ShapeFace& face,
                 std::vector<Facet>& facets) {
  const auto at = [&](std::uint32_t u, std::uint32_t v) {
    NodeGrid::Place place{};
    for (std::size_t a = 0; a < 3; ++a) {
      // Corners are at the ends of the axes, so a step along the side is 0, 1 or -1 on each axis.
      const auto from = static_cast<int>(grid.places[face.at[0]][a]);
      const auto order = static_cast<int>(grid.order);
      const int along_u = (grid.places[face.at[1]][a] - from) / order,
                along_v = (grid.places[face.at[3]][a] - from) / order;
      place[a] = static_cast<std::uint8_t>(from + along_u * static_cast<int>(u) +
                                           along_v * static_cast<int>(v));
    }
    return static_cast<std::uint16_t>(grid.position(place));
  };
  for (std::uint32_t v = 0; v < grid.order; ++v)
    for (std::uint32_t u = 0; u < grid.order; ++u)
      facets.push_back({side, 4, {at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)}});
}

/// Places of the nodes of a flat cell, as steps along two edges from corner 0. The nodes are in
/// VTK's order of Lagrange cells.
class FlatPlaces {
 public:
  explicit FlatPlaces(std::uint32_t order) : order_(order) {}

  void add(std::uint32_t i, std::uint32_t j) { places_.push_back(i + (order_ + 1) * j); }
  std::uint16_t position(std::uint32_t i, std::uint32_t j) const {
    const auto found = std::find(places_.begin(), places_.end(), i + (order_ + 1) * j);
    return static_cast<std::uint16_t>(found - places_.begin());
  }
  std::uint32_t order() const { return order_; }

 private:
  std::uint32_t order_;
  std::vector<std::uint32_t> places_;
};

FlatPlaces places_of_quad(std::uint32_t order) {
  const std::uint32_t p = order;
  FlatPlaces places(p);
  for (const auto& [i, j] :
       {std::pair(0u, 0u), std::pair(p, 0u), std::pair(p, p), std::pair(0u, p)})
    places.add(i, j);
  for (std::uint32_t k = 1; k < p; ++k) places.add(k, 0);
  for (std::uint32_t k = 1; k < p; ++k) places.add(p, k);
  for (std::uint32_t k = 1; k < p; ++k) places.add(k, p);
  for (std::uint32_t k = 1; k < p; ++k) places.add(0, k);
  for (std::uint32_t j = 1; j < p; ++j)
    for (std::uint32_t i = 1; i < p; ++i) places.add(i, j);
  return places;
}

/// The nodes inside a triangle form a triangle whose order is smaller by 3.
FlatPlaces places_of_triangle(std::uint32_t order) {
  FlatPlaces places(order);
  for (std::uint32_t in = 0; 3 * in <= order; ++in) {
    const std::uint32_t p = order - 3 * in;
    places.add(in, in);
    if (p == 0) break;
    places.add(in + p, in);
    places.add(in, in + p);
    for (std::uint32_t k = 1; k < p; ++k) places.add(in + k, in);
    for (std::uint32_t k = 1; k < p; ++k) places.add(in + p - k, in + k);
    for (std::uint32_t k = 1; k < p; ++k) places.add(in, in + p - k);
  }
  return places;
}

void divide_quad(const FlatPlaces& at, std::vector<Facet>& facets) {
  for (std::uint32_t j = 0; j < at.order(); ++j)
    for (std::uint32_t i = 0; i < at.order(); ++i)
      facets.push_back({0,
                        4,
                        {at.position(i, j), at.position(i + 1, j), at.position(i + 1, j + 1),
                         at.position(i, j + 1)}});
}

void divide_triangle(const FlatPlaces& at, std::vector<Facet>& facets) {
  for (std::uint32_t j = 0; j < at.order(); ++j)
    for (std::uint32_t i = 0; i + j < at.order(); ++i) {
      facets.push_back({0, 3, {at.position(i, j), at.position(i + 1, j), at.position(i, j + 1)}});
      if (i + j + 1 < at.order())
        facets.push_back(
            {0, 3, {at.position(i + 1, j), at.position(i + 1, j + 1), at.position(i, j + 1)}});
    }
}

/// Appends the facets of a flat Lagrange cell of order 3 to 10, or nothing if the cell is none.
void divide_flat_cell(CellShape shape, std::uint32_t nodes, std::vector<Facet>& facets) {
  for (std::uint32_t order = 3; order <= 10; ++order) {
    const std::uint32_t edge = order + 1;
    if (shape == CellShape::line && nodes == edge) {
      std::uint16_t last = 0;
      for (std::uint16_t p = 2; p <= nodes; ++p) {
        const std::uint16_t next = p < nodes ? p : 1;
        facets.push_back({0, 2, {last, next}});
        last = next;
      }
    }
    if (shape == CellShape::quad && nodes == edge * edge)
      divide_quad(places_of_quad(order), facets);
    if (shape == CellShape::triangle && nodes == edge * (edge + 1) / 2)
      divide_triangle(places_of_triangle(order), facets);
  }
}

}  // namespace

std::vector<Facet> facets_of(CellShape shape, std::uint32_t nodes) {
  const NodeLayout* const layout = node_layout(shape, nodes);
  const CellForm form = form_of(shape, nodes);
  std::vector<Facet> facets;
  if (layout == nullptr) {
    divide_flat_cell(shape, nodes, facets);
    return facets;
  }
  if (layout->is_grid()) {
    for (std::uint8_t k = 0; k < form.sides.size(); ++k)
      divide_grid(layout->grid, static_cast<std::uint8_t>(k + 1), form.sides[k], facets);
    return facets;
  }
  SideDivider divider(*layout, facets);
  std::vector<std::uint16_t> corners;
  if (form.kind == CellForm::itself) {
    for (std::uint16_t i = 0; i < form.corners; ++i) corners.push_back(i);
    divider.divide(0, corners);
    return facets;
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
