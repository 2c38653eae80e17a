// Node orders of Lagrange hexahedra, as the formats define them. A Lagrange hexahedron of order p
// has (p + 1)^3 nodes on a grid: corners, nodes on edges, nodes on faces, and nodes inside. Each
// format lists the nodes in another order. The order of the mesh model is that of VTK.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace shm::converters {

// Position of a node in a cell of order p: 0 to p along each of the three axes.
using NodePosition = std::array<std::uint8_t, 3>;
using NodePositions = std::vector<NodePosition>;

// Largest order of a cell with a known node order.
inline constexpr std::uint32_t kMostOrder = 9;

// Returns the order p of a Lagrange hexahedron with this number of nodes, 1 to kMostOrder, or 0 if
// none has it.
std::uint32_t order_of_hexahedron(std::uint64_t nodes);

// Return the positions of the nodes of a hexahedron of order `order`, in the order of a format.
// `vtk`: in legacy files from version 5.1 on, and in XML files from version 2.1 on.
NodePositions vtk_hexahedron(std::uint32_t order);
NodePositions gmsh_hexahedron(std::uint32_t order);
// Exodus defines the order of a hexahedron of order 3, HEX64 (SEACAS, Ioss_Hex64).
NodePositions exodus_hex64();

// Returns the permutation between two orders of the same nodes: node i of `to` is node result[i] of
// `from`.
std::vector<std::uint16_t> node_permutation(const NodePositions& from, const NodePositions& to);

}  // namespace shm::converters
