// Node orders of Lagrange cells, as the formats define them. The nodes of a Lagrange cell of order
// p are at regular places: p + 1 along each edge, on the faces and inside. Each format lists them
// in another order. The order of the mesh model is that of node_places().
#pragma once

#include <cstdint>
#include <vector>

#include "shm/cell_nodes.h"

namespace shm::converters {

using NodePlaces = std::vector<NodePlace>;

// Returns the places of the nodes of a cell of order `order`, in the order of Gmsh.
NodePlaces gmsh_places(CellShape shape, NodeScheme scheme, std::uint32_t order);
// Returns the places of the nodes of an element of order 3, in the order of Exodus (SEACAS, Ioss):
// BAR4, TRI9, QUAD12, QUAD16, TETRA16, WEDGE24, HEX32 or HEX64.
NodePlaces exodus_cubic(CellShape shape, NodeScheme scheme);

// Returns the permutation between two orders of the same nodes: node i of `to` is node result[i] of
// `from`.
std::vector<std::uint16_t> node_permutation(const NodePlaces& from, const NodePlaces& to);

}  // namespace shm::converters
