#include "mesh/cell_rotations.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

namespace shm::converters {
namespace {

// The nodes of a cell that are not corners, in VTK's order. Each of these nodes is at the centre of
// an edge, of a face or of the cell, and is represented by the list of the corners of this edge,
// face or cell.
using Between = std::vector<std::vector<std::uint8_t>>;

struct Kind {
  CellShape shape;
  std::uint8_t corners;
  std::vector<Rotation> generators;  // rotations from which all other rotations can be composed
  Between between;                   // the nodes that are not corners

  // Valid node counts of a cell of this kind. A cell with n nodes has the first n nodes of this
  // list: the corners, followed by the nodes in `between`.
  std::vector<std::size_t> sizes;
};

const Between kHexahedron{{0, 1},
                          {1, 2},
                          {2, 3},
                          {3, 0},
                          {4, 5},
                          {5, 6},
                          {6, 7},
                          {7, 4},
                          {0, 4},
                          {1, 5},
                          {2, 6},
                          {3, 7},
                          {0, 3, 4, 7},
                          {1, 2, 5, 6},
                          {0, 1, 4, 5},
                          {2, 3, 6, 7},
                          {0, 1, 2, 3},
                          {4, 5, 6, 7},
                          {0, 1, 2, 3, 4, 5, 6, 7}};
const Between kTetrahedron{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
const Between kWedge{{0, 1}, {1, 2}, {2, 0}, {3, 4},       {4, 5},       {5, 3},
                     {0, 3}, {1, 4}, {2, 5}, {0, 1, 3, 4}, {1, 2, 4, 5}, {0, 2, 3, 5}};
const Between kPyramid{{0, 1}, {1, 2}, {2, 3}, {3, 0},      {0, 4},
                       {1, 4}, {2, 4}, {3, 4}, {0, 1, 2, 3}};
const Between kQuad{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 1, 2, 3}};
const Between kTriangle{{0, 1}, {1, 2}, {2, 0}, {0, 1, 2}};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {CellShape::hexahedron,
       8,
       {{1, 2, 3, 0, 5, 6, 7, 4}, {3, 2, 6, 7, 0, 1, 5, 4}},
       kHexahedron,
       {8, 20, 27}},
      {CellShape::tetrahedron, 4, {{1, 2, 0, 3}, {1, 0, 3, 2}}, kTetrahedron, {4, 10}},
      {CellShape::wedge, 6, {{1, 2, 0, 4, 5, 3}, {3, 5, 4, 0, 2, 1}}, kWedge, {6, 15, 18}},
      {CellShape::pyramid, 5, {{1, 2, 3, 0, 4}}, kPyramid, {5, 13, 14}},
      {CellShape::quad, 4, {{1, 2, 3, 0}}, kQuad, {4, 8, 9}},
      {CellShape::triangle, 3, {{1, 2, 0}}, kTriangle, {3, 6, 7}},
  };
  return all;
}

std::vector<Rotation> corner_rotations(const Kind& kind) {
  Rotation identity(kind.corners);
  for (std::uint8_t i = 0; i < kind.corners; ++i) identity[i] = i;
  std::vector<Rotation> found{identity};
  for (std::size_t i = 0; i < found.size(); ++i)
    for (const Rotation& generator : kind.generators) {
      Rotation next(kind.corners);
      for (std::size_t c = 0; c < next.size(); ++c) next[c] = found[i][generator[c]];
      if (std::find(found.begin(), found.end(), next) == found.end()) found.push_back(next);
    }
  return found;
}

// Extends a rotation of the corners to all nodes. A node that is not a corner moves with the
// corners of its edge, face or cell.
Rotation with_all_nodes(Rotation rotation, const Kind& kind, std::size_t nodes) {
  const auto sorted = [](std::vector<std::uint8_t> list) {
    std::sort(list.begin(), list.end());
    return list;
  };
  const std::size_t behind = nodes - kind.corners;
  for (std::size_t i = 0; i < behind; ++i) {
    std::vector<std::uint8_t> image;
    for (const std::uint8_t corner : kind.between[i]) image.push_back(rotation[corner]);
    image = sorted(std::move(image));
    for (std::size_t k = 0; k < behind; ++k)
      if (sorted(kind.between[k]) == image)
        rotation.push_back(static_cast<std::uint8_t>(kind.corners + k));
  }
  return rotation;
}

std::map<std::pair<CellShape, std::size_t>, std::vector<Rotation>> all_rotations() {
  std::map<std::pair<CellShape, std::size_t>, std::vector<Rotation>> all;
  for (const Kind& kind : kinds())
    for (const std::size_t nodes : kind.sizes)
      for (const Rotation& rotation : corner_rotations(kind))
        all[{kind.shape, nodes}].push_back(with_all_nodes(rotation, kind, nodes));
  return all;
}

}  // namespace

const std::vector<Rotation>& rotations_of(CellShape shape, std::size_t nodes) {
  static const auto all = all_rotations();
  static const std::vector<Rotation> none;
  const auto found = all.find({shape, nodes});
  return found == all.end() ? none : found->second;
}

}  // namespace shm::converters
