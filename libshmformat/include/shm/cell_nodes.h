// Nodes of cells of higher order: the order of a cell, and the places of its nodes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "shm/schema.h"

namespace shm {

/// Largest order of a cell whose nodes have places.
inline constexpr std::uint32_t kMostCellOrder = 10;

/// The place of a node in a cell of order p: its steps along each axis, each from 0 to p. Lines
/// have one axis, flat cells two; the other steps are 0. The axes lead from corner 0 to its
/// neighbours, the lowest corner first: to corners 1, 2 and 3 of a tetrahedron and of a wedge, to
/// corners 1, 3 and 4 of a pyramid and of a hexahedron. In a pyramid, the nodes k steps along the
/// third axis have at most p - k steps along the others.
using NodePlace = std::array<std::uint8_t, 3>;

/// Returns the order of the polynomials on the cells of a block, 1 to kMostCellOrder. Returns 0 if
/// no such cell has the shape, scheme and number of nodes of the block. Second-order cells may lack
/// some nodes: hexahedra with 20 and with 27 nodes have order 2. Thread-safe.
SHM_API std::uint32_t cell_order(const BlockInfo& block);

/// Returns the places of the nodes of a cell, in the order of its node list (spec "Nodes of cells
/// of higher order"). Returns an empty list if `order` is not 1 to kMostCellOrder, or if the shape
/// has no order. NodeScheme::serendipity: the corners and the nodes on the edges; otherwise the
/// nodes on faces and inside are included. Thread-safe.
SHM_API std::vector<NodePlace> node_places(CellShape shape, NodeScheme scheme, std::uint32_t order);

}  // namespace shm
