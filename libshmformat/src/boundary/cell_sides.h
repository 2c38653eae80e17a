// What cells are for a boundary: faces themselves, or solids with sides, which are counted as side
// sets count them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "shm/schema.h"
#include "surface/open_faces.h"

namespace shm {

struct CellForm {
  enum Kind : std::uint8_t {
    unknown,     ///< nothing is known of its sides
    itself,      ///< a face, an edge or a point: its first nodes
    solid,       ///< its first nodes are corners, of which it has sides
    polyhedron,  ///< its nodes are faces, each closed by its first vertex again
  };
  Kind kind = unknown;
  std::uint32_t corners = 0;         ///< itself, solid: how many of its nodes
  std::span<const ShapeFace> sides;  ///< solid: each seen from outside, counter-clockwise
  /// Wedges: there are files with the first triangle seen from inside, as here, and others with it
  /// seen from outside, as VTK's manual has it; coordinates tell.
  bool has_two_orders = false;
};

/// Of a cell with so many nodes.
CellForm form_of(CellShape shape, std::uint64_t nodes);

/// The faces of a polyhedron: calls visit(first, size), places among its nodes, for each, whose
/// first node stands again behind it. False where the nodes are no such faces.
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
