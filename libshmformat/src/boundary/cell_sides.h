// Cell forms. The form of a cell determines its role in a boundary: the cell is either itself a
// face, or a solid with sides. Sides are numbered as in side sets.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/open_faces.h"
#include "shm/schema.h"

namespace shm {

struct CellForm {
  enum Kind : std::uint8_t {
    unknown,  ///< the sides of the cell cannot be determined
    itself,  ///< the cell itself is a face, an edge or a point; the first nodes of the cell are its
             ///< corners
    solid,   ///< the cell has sides; the first nodes of the cell are its corners
    polyhedron,  ///< the node list of the cell contains its faces; each face ends with a repeat of
                 ///< its first vertex
  };
  Kind kind = unknown;
  /// Number of nodes that are corners; set for the kinds `itself` and `solid`.
  std::uint32_t corners = 0;
  std::span<const ShapeFace> sides;  ///< corners of each side, counter-clockwise seen from outside;
                                     ///< set for the kind `solid`
  /// True for wedges, which occur with two orders of corners. In some files, the corners of the
  /// first triangle are in counter-clockwise order seen from inside, as in `sides`. In other files
  /// they are in counter-clockwise order seen from outside, as VTK's manual states. The coordinates
  /// of a cell show which order it has.
  bool has_two_orders = false;
};

/// Returns the form of a cell with `nodes` nodes.
CellForm form_of(CellShape shape, std::uint64_t nodes);

/// A flat piece of a side of a cell of higher order, or of a cell that itself is a face or an edge.
struct Facet {
  std::uint8_t side = 0;  ///< number of the side, counted from 1; 0 if the cell itself is the face
  std::uint8_t size = 0;  ///< number of corners: 2, 3 or 4
  std::array<std::uint16_t, 4> at{};  ///< nodes at the corners, in the direction of the side
};

/// Returns the facets of the cells of a block, sorted by side. Returns an empty list if all nodes
/// of the cells are corners, if the places of the others are unknown, and for serendipity cells of
/// order 3 and higher and Bezier cells.
std::vector<Facet> facets_of(const BlockInfo& block);

/// Calls visit(first, size) for each face of a polyhedron. The nodes of the face are nodes[first],
/// ..., nodes[first + size - 1]; nodes[first + size] repeats nodes[first]. Returns false if the
/// node list does not have this form.
template <class Visit>
bool for_each_face(std::span<const std::uint32_t> nodes, Visit&& visit) {
  for (std::size_t first = 0; first < nodes.size();) {
    std::size_t end = first + 1;
    while (end < nodes.size() && nodes[end] != nodes[first]) ++end;
    if (end == nodes.size()) return false;
    visit(first, end - first);
    first = end + 1;
  }
  return true;
}

}  // namespace shm
