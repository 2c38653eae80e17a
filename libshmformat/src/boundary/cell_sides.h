// The role of cells in a boundary: they are faces themselves, or solids with sides, which are
// numbered as in side sets.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "mesh/open_faces.h"
#include "shm/schema.h"

namespace shm {

struct CellForm {
  enum Kind : std::uint8_t {
    unknown,     ///< its sides are not known
    itself,      ///< its first nodes are a face, an edge or a point
    solid,       ///< its first nodes are corners, which form its sides
    polyhedron,  ///< its nodes list faces, and the first vertex of each is repeated after its last
  };
  Kind kind = unknown;
  std::uint32_t corners = 0;         ///< itself, solid: number of nodes that are corners
  std::span<const ShapeFace> sides;  ///< solid: corners counter-clockwise, seen from outside
  /// Wedges: in some files the corners of the first triangle go counter-clockwise seen from inside,
  /// as here, and in others seen from outside, as VTK's manual says. The coordinates show which.
  bool has_two_orders = false;
};

/// Returns the form of a cell with `nodes` nodes.
CellForm form_of(CellShape shape, std::uint64_t nodes);

/// Calls visit(first, size) for each face of a polyhedron, whose nodes are nodes[first], ...,
/// nodes[first + size - 1]; nodes[first + size] repeats the first of them. Returns false if the
/// nodes do not have this form.
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
