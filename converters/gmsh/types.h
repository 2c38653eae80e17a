// Element types of MSH: their dimension, number of nodes, and the permutation of their nodes to
// VTK's order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/schema.h"

namespace shm::converters {

struct GmshType {
  int dimension = -1;       // -1: unknown type
  std::uint32_t nodes = 0;  // 0: varies from element to element
  CellShape shape = CellShape::other;
  // Node k in VTK's order is node permutation[k] in Gmsh's order. The permutation is empty if the
  // two orders are equal.
  std::span<const std::uint16_t> permutation;
  NodeScheme scheme = NodeScheme::lagrange;
  bool known() const { return dimension >= 0; }
};

GmshType gmsh_type(std::int64_t type);

// Returns ten times the version of a file, from the number that it states: 10, 20 (for all versions
// 2.x), 30, 40 or 41.
constexpr int gmsh_version(double number) {
  return number < 2 ? 10 : number < 3 ? 20 : number < 4 ? 30 : number < 4.05 ? 40 : 41;
}

// Returns the number of parametric coordinates of a node on an entity of this dimension. Nodes in
// volumes have such coordinates only in MSH 4.1.
constexpr std::size_t gmsh_parameters(std::int32_t dimension, bool parametric, bool v41) {
  if (!parametric || dimension < 1 || dimension > (v41 ? 3 : 2)) return 0;
  return static_cast<std::size_t>(dimension);
}

// Returns true if one of the tags of an MSH 2 element of this type may be the number of its parent
// element.
bool gmsh_type_has_parent(std::int64_t type);

// Returns the MSH type of the cells of a block, or 0 if no such type exists.
std::int32_t gmsh_type_for(const BlockInfo& block);

}  // namespace shm::converters
