// Node orders of Lagrange cells, as the formats define them. The nodes of a Lagrange cell of order
// p are at regular positions: p + 1 along each edge, on the faces and inside. Each format lists
// them in another order. The order of the mesh model is that of VTK.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

// Position of a node in a cell of order p: 0 to p along each axis of the cell. Lines have one axis,
// flat cells two. The axes of triangles and tetrahedra lead from corner 0 to the other corners.
using NodePosition = std::array<std::uint8_t, 3>;
using NodePositions = std::vector<NodePosition>;

// Largest order of a cell with a known node order.
inline constexpr std::uint32_t kMostOrder = 10;

// Returns the order p of a Lagrange cell with this shape and number of nodes, 1 to kMostOrder, or 0
// if no order has this number of nodes. Pyramids and shapes without corners have order 0.
std::uint32_t order_of_cell(CellShape shape, std::uint64_t nodes);

// Returns the order of the polynomials on a cell with this shape and number of nodes: that of
// order_of_cell(), or 2 for second-order cells that lack some nodes, such as hexahedra with 20
// nodes. Returns 0 if the order is unknown.
std::uint32_t polynomial_order(CellShape shape, std::uint64_t nodes);

// Return the positions of the nodes of a cell of order `order`, in the order of a format.
// `vtk_positions`: of a line, triangle, quad, tetrahedron, wedge or hexahedron; in legacy files
// from version 5.1 on, and in XML files from version 2.1 on. `gmsh_positions`: of these shapes
// except wedges.
NodePositions vtk_positions(CellShape shape, std::uint32_t order);
NodePositions gmsh_positions(CellShape shape, std::uint32_t order);
// Exodus defines the order of hexahedra of order 3, HEX64 (SEACAS, Ioss_Hex64).
NodePositions exodus_hex64();

// Returns the permutation between two orders of the same nodes: node i of `to` is node result[i] of
// `from`.
std::vector<std::uint16_t> node_permutation(const NodePositions& from, const NodePositions& to);

}  // namespace shm::converters
