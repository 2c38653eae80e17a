"""meshio reads and writes .shm files once this module is imported.

    import meshio
    import shmformat.meshio

    mesh = meshio.read("run.shm")
    meshio.write("again.shm", mesh)

As in meshio's own readers, a cell block is a run of cells with the same block and the same type. For an array with
time steps, read() returns the values of the first step, as meshio does for Exodus files; read(path, step=...) returns
another step. Node sets become point_sets, element sets become cell_sets; meshio cannot represent side sets.
"""
from __future__ import annotations

import os
from typing import Any

import meshio
import numpy as np

from . import Block, Cells, Mesh, Set, Steps
from . import open as open_shm
from . import write as write_shm
from ._library import HIGH_ORDER, KINDS, POLYGON, vtk_type
from ._mesh import high_order_block


def _name(shape: str, nodes: int) -> str:
    """Returns meshio's name of a cell type, e.g. "hexahedron" or "hexahedron20". It consists of the shape and the
    number of nodes. The number is omitted if it is the smallest one for this shape."""
    fewest = min(n for s, n in KINDS if s == shape)
    return ("tetra" if shape == "tetrahedron" else shape) + ("" if nodes == fewest else str(nodes))


# meshio has no type for pyramids with 19 nodes
_SHAPES = {_name(*kind): kind for kind in KINDS if kind != ("pyramid", 19)}
_NAMES = {vtk_type(*kind): name for name, kind in _SHAPES.items()} | {
    kind: f"VTK_{scheme}_".upper() + {"line": "CURVE", "quad": "QUADRILATERAL"}.get(shape, shape.upper())
    for kind, (shape, scheme) in HIGH_ORDER.items()}
_HIGH_ORDER = {_NAMES[kind]: kind for kind in HIGH_ORDER}
# The corner order of linear wedges in meshio has the opposite orientation from that in VTK.
_ORDERS = {"wedge": [0, 2, 1, 3, 5, 4]}


def _runs(cells: Cells) -> list[tuple[int, int]]:
    """Returns (first, end) of each run of cells with the same block, type and number of nodes."""
    if not len(cells):
        return []
    sizes = np.diff(cells.offsets)
    differs = np.zeros(len(cells) - 1, bool)
    for of_cells in (cells.blocks, cells.types, sizes):
        differs |= of_cells[1:] != of_cells[:-1]
    ends = np.flatnonzero(differs) + 1
    return list(zip([0, *ends.tolist()], [*ends.tolist(), len(cells)]))


def _cell_block(cells: Cells, first: int, end: int) -> meshio.CellBlock:
    kind = int(cells.types[first])
    name = "polygon" if kind == POLYGON else _NAMES.get(kind)
    if name is None:
        raise meshio.ReadError(f"meshio has no cell type for VTK cell type {kind}")
    corners = cells.connectivity[cells.offsets[first]:cells.offsets[end]].reshape(end - first, -1)
    try:
        return meshio.CellBlock(name, corners[:, _ORDERS[name]] if name in _ORDERS else corners)
    except KeyError as why:  # meshio 5.0 does not know some types, e.g. wedges with 15 nodes and triangles with 7 nodes
        raise meshio.ReadError(f"this version of meshio has no cell type '{name}'") from why


def _values(data: Any, name: str, step: int | None) -> np.ndarray | None:
    values = data[name]
    if not isinstance(values, Steps):
        return values
    step = next(iter(values), None) if step is None else step
    return values[step] if step in values else None


def _sets(mesh: Mesh, cells: Cells, runs: list[tuple[int, int]]) -> tuple[dict[str, Any], dict[str, Any]]:
    points: dict[str, Any] = {}
    groups: dict[str, Any] = {}
    for own in mesh.sets:
        name = own.name or f"{own.kind}_set_{own.id}"
        if own.kind == "node":
            points[name] = own.numbers.astype(np.int64)
        elif own.kind == "element":
            inside = np.zeros(len(cells), bool)
            inside[own.numbers.astype(np.int64)] = True
            if own.blocks is not None:
                inside |= np.isin(cells.blocks, own.blocks)
            groups[name] = [np.flatnonzero(inside[first:end]) for first, end in runs]
    return points, groups


def read(filename: str | os.PathLike[str], step: int | None = None) -> meshio.Mesh:
    """Reads a file as a meshio mesh, with the values at one time step. Arrays without values at this step are
    omitted."""
    with open_shm(filename) as mesh:
        if not isinstance(mesh, Mesh):
            raise meshio.ReadError(f"{filename} is an archive of several meshes")
        whole = mesh.read()
        runs = _runs(whole.cells)
        point_data = {name: _values(mesh.point_data, name, step) for name in mesh.point_data}
        cell_data = {name: _values(mesh.cell_data, name, step) for name in mesh.cell_data}
        point_sets, cell_sets = _sets(mesh, whole.cells, runs)
    return meshio.Mesh(whole.points, [_cell_block(whole.cells, first, end) for first, end in runs],
                       point_data={name: values for name, values in point_data.items() if values is not None},
                       cell_data={name: [values[first:end] for first, end in runs]
                                  for name, values in cell_data.items() if values is not None},
                       point_sets=point_sets, cell_sets=cell_sets)


def _block(index: int, block: meshio.CellBlock) -> Block:
    if block.type == "polygon":
        return Block(index + 1, "", "polygon", 0, len(block))
    if block.type in _HIGH_ORDER:
        return high_order_block(index + 1, "", _HIGH_ORDER[block.type], np.asarray(block.data).shape[1], len(block))
    if block.type not in _SHAPES:
        raise meshio.WriteError(f".shm files have no cell type for meshio's '{block.type}'")
    return Block(index + 1, "", *_SHAPES[block.type], len(block))


def write(filename: str | os.PathLike[str], mesh: meshio.Mesh, level: str = "default") -> None:
    """Writes a meshio mesh. Each cell block of meshio becomes a block of the file. Replaces an existing file, as
    meshio's own writers do."""
    points = np.asarray(mesh.points)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points), points.dtype)])
    blocks = [_block(i, block) for i, block in enumerate(mesh.cells)]
    corners = [np.asarray(block.data)[:, _ORDERS[block.type]] if block.type in _ORDERS else np.asarray(block.data)
               for block in mesh.cells]
    sizes = [np.full(len(own), own.shape[1], np.int64) for own in corners]
    empty = [np.zeros(0, np.int64)]
    counts = [len(own) for own in corners]
    cells = Cells(np.concatenate([[0], np.cumsum(np.concatenate(sizes or empty))]),
                  np.concatenate([own.reshape(-1) for own in corners] or empty), np.zeros(sum(counts), np.uint8),
                  np.repeat(np.arange(len(counts), dtype=np.uint32), counts))
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    sets = [Set("node", i + 1, name, np.asarray(numbers)) for i, (name, numbers) in enumerate(mesh.point_sets.items())]
    for i, (name, groups) in enumerate(mesh.cell_sets.items()):
        numbers = [np.asarray(group, np.int64) + first[b] for b, group in enumerate(groups) if group is not None]
        sets.append(Set("element", i + 1, name, np.concatenate(numbers or empty)))
    write_shm(filename, points, cells, blocks=blocks, point_data=mesh.point_data,
              cell_data={name: np.concatenate(values) for name, values in mesh.cell_data.items()}, sets=sets,
              level=level, replace=True)


meshio.register_format("shm", [".shm"], read, {"shm": write})
