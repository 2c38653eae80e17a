#include "shm/cell_nodes.h"

#include <span>
#include <utility>

#include "mesh/cell_frame.h"

namespace shm {
namespace {

using Ends = CellFrame::Ends;

constexpr std::array<NodePlace, 8> kCorners = {
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
constexpr std::array<NodePlace, 4> kSimplexCorners = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
constexpr std::array<NodePlace, 6> kWedgeCorners = {
    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}};
constexpr std::array<Ends, 12> kHexahedronRows = {{{0, 1},
                                                   {1, 2},
                                                   {3, 2},
                                                   {0, 3},
                                                   {4, 5},
                                                   {5, 6},
                                                   {7, 6},
                                                   {4, 7},
                                                   {0, 4},
                                                   {1, 5},
                                                   {2, 6},
                                                   {3, 7}}};
constexpr std::array<Ends, 8> kPyramidRows = {
    {{0, 1}, {1, 2}, {3, 2}, {0, 3}, {0, 4}, {1, 4}, {2, 4}, {3, 4}}};
constexpr std::array<Ends, 9> kWedgeRows = {
    {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}}};
constexpr std::array<Ends, 6> kTetrahedronRows = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
constexpr std::array<CellFrame::Face, 6> kHexahedronQuads = {
    {{0, 3, 4}, {1, 2, 5}, {0, 1, 4}, {3, 2, 7}, {0, 1, 3}, {4, 5, 7}}};
constexpr std::array<CellFrame::Face, 3> kWedgeQuads = {{{0, 1, 3}, {1, 2, 4}, {2, 0, 5}}};
constexpr std::array<CellFrame::Face, 2> kWedgeTriangles = {{{0, 1, 2}, {3, 4, 5}}};
constexpr std::array<CellFrame::Face, 1> kBase = {{{0, 1, 3}}};
constexpr std::array<CellFrame::Face, 4> kPyramidTriangles = {
    {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}};
constexpr std::array<CellFrame::Face, 1> kWholeTriangle = {{{0, 1, 2}}};
constexpr std::array<CellFrame::Face, 4> kTetrahedronTriangles = {
    {{0, 1, 3}, {2, 3, 1}, {0, 3, 2}, {0, 2, 1}}};

}  // namespace

CellFrame frame_of(CellShape shape) {
  const std::span corners(kCorners);
  const std::span simplex(kSimplexCorners);
  const std::span rows(kTetrahedronRows);
  switch (shape) {
    case CellShape::line: return {simplex.first(2), rows.first(1), {}, {}};
    case CellShape::triangle: return {simplex.first(3), rows.first(3), kWholeTriangle, {}};
    case CellShape::quad: return {corners.first(4), std::span(kHexahedronRows).first(4), {}, kBase};
    case CellShape::tetrahedron: return {simplex, rows, kTetrahedronTriangles, {}};
    case CellShape::pyramid: return {corners.first(5), kPyramidRows, kPyramidTriangles, kBase};
    case CellShape::wedge: return {kWedgeCorners, kWedgeRows, kWedgeTriangles, kWedgeQuads};
    case CellShape::hexahedron: return {corners, kHexahedronRows, {}, kHexahedronQuads};
    default: return {};
  }
}

namespace {

/// Lists the places of the nodes of a cell.
class PlaceList {
 public:
  PlaceList(CellShape shape, bool is_complete)
      : shape_(shape), frame_(frame_of(shape)), is_complete_(is_complete) {}

  /// Appends the nodes of a cell of order `order`, `in` steps inside the cell along each axis.
  void add_cell(std::uint32_t order, std::uint32_t in) {
    order_ = order;
    in_ = in;
    for (std::uint8_t c = 0; c < frame_.corners.size(); ++c) {
      add(c, c, c, 0, 0);
      if (order == 0) return;
    }
    for (const auto& [from, to] : frame_.edges)
      for (std::uint32_t i = 1; i < order; ++i) add(from, to, to, i, 0);
    if (!is_complete_) return;
    if (shape_ == CellShape::wedge) {
      for (const auto& face : frame_.triangles) add_rows(face, true);
      for (const auto& face : frame_.quads) add_rows(face, false);
      for (std::uint32_t k = 1; k < order; ++k) {
        const std::size_t first = places_.size();
        add_rows(frame_.triangles[0], true);
        for (std::size_t p = first; p < places_.size(); ++p)
          places_[p][2] = static_cast<std::uint8_t>(k);
      }
      return;
    }
    for (const auto& face : frame_.quads) add_rows(face, false);
    for (const auto& face : frame_.triangles) add_nested(face);
    if (shape_ == CellShape::hexahedron)
      for (std::uint32_t k = 1; k < order; ++k)
        for (std::uint32_t j = 1; j < order; ++j)
          for (std::uint32_t i = 1; i < order; ++i)
            places_.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j),
                               static_cast<std::uint8_t>(k)});
    if (shape_ == CellShape::tetrahedron && order >= 4) add_cell(order - 4, in + 1);
    if (shape_ == CellShape::pyramid && order >= 3) add_cell(order - 3, in + 1);
  }
  std::vector<NodePlace> take() { return std::move(places_); }

 private:
  /// Appends the place that is u steps from corner `from` towards `first` and v steps towards
  /// `second`.
  void add(std::uint8_t from, std::uint8_t first, std::uint8_t second, std::uint32_t u,
           std::uint32_t v) {
    NodePlace place{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto at = [&](std::uint8_t corner) { return int{frame_.corners[corner][a]}; };
      place[a] =
          static_cast<std::uint8_t>(static_cast<int>(in_) + at(from) * static_cast<int>(order_) +
                                    (at(first) - at(from)) * static_cast<int>(u) +
                                    (at(second) - at(from)) * static_cast<int>(v));
    }
    places_.push_back(place);
  }

  /// Appends the nodes inside a face, row by row.
  void add_rows(const CellFrame::Face& face, bool is_triangle) {
    for (std::uint32_t v = 1; v < order_; ++v)
      for (std::uint32_t u = 1; u < order_ && (!is_triangle || u + v < order_); ++u)
        add(face[0], face[1], face[2], u, v);
  }
  /// Appends the nodes inside a triangle: those of a triangle whose order is lower by 3, corners
  /// and edges first.
  void add_nested(const CellFrame::Face& face) {
    for (std::uint32_t in = 1; 3 * in <= order_; ++in) {
      const std::uint32_t p = order_ - 3 * in;
      const auto add_inner = [&](std::uint32_t u, std::uint32_t v) {
        add(face[0], face[1], face[2], in + u, in + v);
      };
      add_inner(0, 0);
      if (p == 0) return;
      add_inner(p, 0);
      add_inner(0, p);
      for (std::uint32_t i = 1; i < p; ++i) add_inner(i, 0);
      for (std::uint32_t i = 1; i < p; ++i) add_inner(p - i, i);
      for (std::uint32_t i = 1; i < p; ++i) add_inner(0, p - i);
    }
  }

  CellShape shape_;
  CellFrame frame_;
  bool is_complete_;
  std::uint32_t order_ = 0, in_ = 0;
  std::vector<NodePlace> places_;
};

/// A second-order cell that lacks some nodes of the Lagrange cell, or has more nodes.
struct SecondOrder {
  CellShape shape;
  std::uint8_t nodes;
};
constexpr std::array<SecondOrder, 10> kSecondOrder = {{{CellShape::triangle, 7},
                                                       {CellShape::quad, 8},
                                                       {CellShape::tetrahedron, 15},
                                                       {CellShape::pyramid, 13},
                                                       {CellShape::pyramid, 19},
                                                       {CellShape::wedge, 15},
                                                       {CellShape::wedge, 21},
                                                       {CellShape::hexahedron, 20},
                                                       {CellShape::hexahedron, 24},
                                                       {CellShape::hexahedron, 26}}};

/// Returns the number of nodes of a cell with all nodes of an order, or 0 if the shape has no
/// order.
std::uint32_t complete_nodes(CellShape shape, std::uint32_t p) {
  switch (shape) {
    case CellShape::line: return p + 1;
    case CellShape::triangle: return (p + 1) * (p + 2) / 2;
    case CellShape::quad: return (p + 1) * (p + 1);
    case CellShape::tetrahedron: return (p + 1) * (p + 2) * (p + 3) / 6;
    case CellShape::pyramid: return (p + 1) * (p + 2) * (2 * p + 3) / 6;
    case CellShape::wedge: return (p + 1) * (p + 1) * (p + 2) / 2;
    case CellShape::hexahedron: return (p + 1) * (p + 1) * (p + 1);
    default: return 0;
  }
}

/// Returns the lowest order for which a block states this scheme.
std::uint32_t least_order(NodeScheme scheme) {
  return scheme == NodeScheme::lagrange ? 1 : scheme == NodeScheme::bezier ? 2 : 3;
}

}  // namespace

std::uint32_t cell_order(const BlockInfo& block) {
  const CellShape shape = block.shape;
  const bool is_serendipity = block.scheme == NodeScheme::serendipity;
  if (block.nodes_per_cell == 0) return 0;
  if (block.scheme == NodeScheme::lagrange)
    for (const SecondOrder& kind : kSecondOrder)
      if (kind.shape == shape && kind.nodes == block.nodes_per_cell) return 2;
  // All nodes of a line are on its edge, so no line is a serendipity cell.
  if (is_serendipity && shape == CellShape::line) return 0;
  const CellFrame frame = frame_of(shape);
  for (std::uint32_t p = least_order(block.scheme); p <= kMostCellOrder; ++p) {
    const std::size_t nodes = is_serendipity ? frame.corners.size() + frame.edges.size() * (p - 1)
                                             : complete_nodes(shape, p);
    if (nodes == block.nodes_per_cell) return p;
  }
  return 0;
}

std::vector<NodePlace> node_places(CellShape shape, NodeScheme scheme, std::uint32_t order) {
  if (order < 1 || order > kMostCellOrder) return {};
  PlaceList places(shape, scheme != NodeScheme::serendipity);
  places.add_cell(order, 0);
  return places.take();
}

}  // namespace shm
