// What MSH element types are: dimension, number of nodes, and how their nodes stand in VTK.
#pragma once

#include <cstdint>
#include <span>

#include "shm/schema.h"

namespace shm::converters {

struct GmshType {
  int dimension = -1;       // -1: there is no such type
  std::uint32_t nodes = 0;  // 0: varies from element to element
  CellShape shape = CellShape::other;
  // Place k of VTK's order is place permutation[k] of Gmsh's; empty: the same order.
  std::span<const std::uint8_t> permutation;
  bool known() const { return dimension >= 0; }
};

GmshType gmsh_type(std::int64_t type);

// The MSH type for a cell of this shape; 0 when there is none.
std::int32_t gmsh_type_for(CellShape shape, std::uint64_t nodes);

}  // namespace shm::converters
