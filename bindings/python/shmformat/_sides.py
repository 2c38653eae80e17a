"""Finds the nodes of a side of a cell. Sides are numbered from 1 as in Exodus.

The tables are the same as in converters/sets/cell_sides.cpp, which `shm extract --set` uses; a test compares them.
"""
from __future__ import annotations

from functools import lru_cache

import numpy as np

from ._library import cell_order, node_places, vtk_type
from ._mesh import Block, Cells, Mesh

# For each shape: the corners of each side. Sides and corners are numbered as in the Exodus manual, but from 0.
_SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    # In three-dimensional meshes, triangles and quads are shells. Side 1 is the front, side 2 is the back, and the
    # other sides are the edges.
    "triangle": ((0, 1, 2), (0, 2, 1), (0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1, 2, 3), (0, 3, 2, 1), (0, 1), (1, 2), (2, 3), (3, 0)),
    "tetrahedron": ((0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)),
    "pyramid": ((0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (0, 3, 2, 1)),
    "wedge": ((0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)),
    "hexahedron": ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7)),
}
_CORNERS = {"triangle": 3, "quad": 4, "tetrahedron": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8}

# The edges of each shape, as pairs of corners. In the node list of a second-order cell, the corners are followed by the
# midpoints of the edges in this order, which is VTK's.
_EDGES: dict[str, tuple[tuple[int, int], ...]] = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetrahedron": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "pyramid": ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    "hexahedron": ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
}
# The quadrilateral sides of each shape, as sorted lists of corners. In the node list of a second-order cell, the
# midpoints of the edges are followed by the midpoints of these sides. Midpoints of triangular sides are not supported.
_MIDDLES: dict[str, tuple[tuple[int, ...], ...]] = {
    "quad": ((0, 1, 2, 3),),
    "pyramid": ((0, 1, 2, 3),),
    "wedge": ((0, 1, 3, 4), (1, 2, 4, 5), (0, 2, 3, 5)),
    "hexahedron": ((0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)),
}
_SHAPE_OF_SIDE = {2: "line", 3: "triangle", 4: "quad"}  # shape of a side, for each number of corners


def is_flat(mesh: Mesh) -> bool:
    """Returns True if the mesh is recorded as two-dimensional. Only files converted from Exodus record this."""
    return any(extra.key == "exodus/skeleton" and b"\nD\tnum_dim\t2\n" in extra.values.tobytes() for extra in mesh.extras)


@lru_cache(maxsize=None)
def side_of(shape: str, nodes: int, scheme: str, side: int, flat: bool) -> tuple[str, str, tuple[int, ...]]:
    """Returns the shape, the node scheme and the nodes of a side. A node is given by its index in the node list of the cell. The
    list of nodes is empty if the side is unknown.

    flat: true if the mesh is two-dimensional, so that the sides of triangles and quads are edges.
    """
    sides = _SIDES.get(shape, ())
    if flat and shape in ("triangle", "quad"):
        sides = sides[2:]
    if side < 1 or side > len(sides) or nodes < _CORNERS[shape]:
        return "other", "lagrange", ()
    corners = sides[side - 1]
    kind = _SHAPE_OF_SIDE[len(corners)]
    of_side = "lagrange" if kind == "line" and scheme == "serendipity" else scheme
    order = cell_order(shape, nodes, scheme)
    if order >= 3:
        return kind, of_side, _high_order(shape, scheme, order, corners)
    # The order is 0 if the places of the nodes after the corners are unknown.
    return kind, of_side, _second_order(shape, nodes, corners) if order == 2 else corners


def _second_order(shape: str, nodes: int, corners: tuple[int, ...]) -> tuple[int, ...]:
    edges = _EDGES[shape]
    first_edge = _CORNERS[shape]
    first_middle = first_edge + len(edges)
    if (shape, nodes) == ("wedge", 21):  # the centres of the triangles come first
        first_middle += 2
    around = list(zip(corners, corners[1:] + corners[:1]))[:1 if len(corners) == 2 else None]
    found = list(corners)
    for a, b in around:
        found.append(first_edge + (edges.index((a, b)) if (a, b) in edges else edges.index((b, a))))
    middle = tuple(sorted(corners))
    middles = _MIDDLES.get(shape, ())
    if middle in middles and first_middle + middles.index(middle) < nodes:
        found.append(first_middle + middles.index(middle))
    return tuple(found)


def _high_order(shape: str, scheme: str, order: int, corners: tuple[int, ...]) -> tuple[int, ...]:
    """Returns the nodes of a side of a cell of order 3 or higher. The side has the same order."""
    places = node_places(shape, scheme, order).astype(np.int64)
    index = {tuple(place): i for i, place in enumerate(places.tolist())}
    first = places[corners[0]]
    along = (places[[corners[1], corners[-1]]] - first) // order
    on_side = node_places(_SHAPE_OF_SIDE[len(corners)], scheme, order)[:, :2]
    return tuple(index[tuple(place)] for place in (first + on_side @ along).tolist())


def sides_as_cells(cells: Cells, blocks: list[Block], rows: np.ndarray, sides: np.ndarray,
                   flat: bool) -> tuple[Cells, np.ndarray]:
    """Converts sides to cells: each known side becomes a cell. Returns these cells, and for each of them the index of
    its side in `sides`. Unknown sides are left out.

    rows: for each side, the index of its cell. sides: for each side,
    its number within the cell.
    """
    begin = np.asarray(cells.offsets, np.int64)[rows]
    size = np.asarray(cells.offsets, np.int64)[rows + 1] - begin
    keys = np.column_stack([cells.blocks[rows], size, sides]).astype(np.int64)
    groups, group_of = np.unique(keys, axis=0, return_inverse=True)
    found = [side_of(blocks[block].shape, size, blocks[block].node_scheme, side, flat) for block, size, side in groups.tolist()]
    lengths = np.array([len(places) for _, _, places in found], np.int64)
    types = np.array([vtk_type(shape, len(places), scheme) if places else 0 for shape, scheme, places in found], np.uint8)
    group_of = group_of.reshape(-1)
    known = np.flatnonzero(lengths[group_of])
    group_of, begin = group_of[known], begin[known]
    offsets = np.concatenate([[0], np.cumsum(lengths[group_of])])
    nodes = np.empty(offsets[-1], np.int64)
    for group in np.unique(group_of).tolist():
        own, places = np.flatnonzero(group_of == group), np.array(found[group][2])
        nodes[offsets[own][:, None] + np.arange(len(places))] = cells.connectivity[begin[own][:, None] + places]
    return Cells(offsets, nodes, types[group_of], keys[known, 0]), known
