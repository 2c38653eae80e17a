"""A reader and a writer for VTK's pipelines (python3-vtk9).

    reader = shmformat.vtk.Reader()
    reader.SetFileName("run.shm")
    reader.Update()
    grid = reader.GetOutput()

The library decodes arrays directly into VTK's memory. Only the points and the values of node sets and side sets are
copied. Arrays, blocks and sets that are switched off are not read. In a parallel pipeline, each process reads a
separate piece of the mesh, which consists of consecutive segments.
"""
from __future__ import annotations

import bisect
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from vtkmodules.util.numpy_support import get_vtk_array_type, vtk_to_numpy
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import (vtkDataArray, vtkDataArraySelection, vtkIdTypeArray, vtkPoints,
                                      vtkTypeInt32Array, vtkTypeInt64Array)
from vtkmodules.vtkCommonDataModel import (vtkCellArray, vtkDataAssembly, vtkDataObject, vtkMultiBlockDataSet,
                                           vtkPartitionedDataSet, vtkPartitionedDataSetCollection, vtkUnstructuredGrid)
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

from . import Arrays, Block, Cells, Mesh, Set
from . import open as open_shm
from . import write as write_shm
from ._library import CONVEX_POINT_SET, DTYPES, HIGH_ORDER, KINDS, POLYGON, POLYHEDRON, lib, vtk_type
from ._mesh import high_order_block
from ._sides import is_flat, sides_as_cells

# For each VTK cell type: shape and number of nodes. If this number is 0, cells can have any number of nodes.
_SHAPES = {vtk_type(*kind): kind for kind in KINDS} | {POLYGON: ("polygon", 0)}

# Names of the groups in a collection. They are the same as in VTK's reader of Exodus files (vtkIOSSReader).
_GROUPS = {"block": "element_blocks", "node": "node_sets", "side": "side_sets", "element": "element_sets"}
VERTEX_NUMBERS = "shm_vertex_number"  # name of the array of original vertex numbers, which `shm extract` also writes


def _array(dtype: np.dtype, count: int, components: int = 1) -> tuple[Any, np.ndarray]:
    """Returns a new VTK array, and a NumPy array that shares its memory."""
    made = vtkDataArray.CreateDataArray(get_vtk_array_type(dtype))
    made.SetNumberOfComponents(components)
    made.SetNumberOfTuples(count)
    if count == 0:
        return made, np.empty((0, components) if components > 1 else 0, dtype)
    return made, vtk_to_numpy(made)


def _filled(values: np.ndarray, name: str | None = None) -> Any:
    """Returns a copy of `values` as a VTK array."""
    made, memory = _array(values.dtype, len(values), values.shape[1] if values.ndim == 2 else 1)
    memory[...] = values
    made.SetName(name)
    return made


def _cell_array(offsets: Any, corners: Any) -> vtkCellArray:
    """Makes a vtkCellArray that shares the memory of two VTK arrays. They are first wrapped in the array classes that
    vtkCellArray requires."""
    own = vtkTypeInt32Array if offsets.GetDataTypeSize() == 4 else vtkTypeInt64Array
    kept = own(), own()
    for made, array in zip(kept, (offsets, corners)):
        made.ShallowCopy(array)
    cells = vtkCellArray()
    cells.SetData(*kept)
    return cells


def _grid_of(points: np.ndarray, cells: Cells, point_data: dict[str, np.ndarray]) -> vtkUnstructuredGrid:
    """Makes a grid. The NumPy arrays are copied."""
    xyz = vtkPoints()
    xyz.SetData(_filled(points))
    grid = vtkUnstructuredGrid()
    grid.SetPoints(xyz)
    grid.SetCells(_filled(cells.types), _cell_array(_filled(cells.offsets), _filled(cells.connectivity)))
    for name, values in point_data.items():
        grid.GetPointData().AddArray(_filled(values, name))
    return grid


class _Wanted:
    """A grid and the VTK arrays that will be filled for it, in one pass over a mesh."""

    def __init__(self, mesh: Mesh):
        self._mesh = mesh
        self._wanted: list[tuple[int, np.ndarray, int, int]] = []
        self.point_data: list[Any] = []
        self.cell_data: list[Any] = []
        index = np.dtype(np.int32 if max(mesh.vertex_count, mesh._count().corners) < 2**31 else np.int64)
        points = self._want(lib.SHMF_POINTS, DTYPES[mesh._info.coordinate_type], mesh.vertex_count, 3)
        self.points = vtkPoints()
        self.points.SetData(points)
        self.offsets = self._want(lib.SHMF_CORNER_BEGIN, index, mesh.cell_count + 1)
        self.corners = self._want(lib.SHMF_CORNERS, index, mesh._count().corners)
        self.types = self._want(lib.SHMF_CELL_TYPES, np.dtype(np.uint8), mesh.cell_count)
        self.blocks = self._want(lib.SHMF_CELL_BLOCKS, np.dtype(np.int32), mesh.cell_count)
        self.blocks.SetName("block")
        self.numbers: Any = None

    def _want(self, what: int, dtype: np.dtype, count: int, components: int = 1, array: int = 0, step: int = 0) -> Any:
        made, memory = _array(dtype, count, components)
        self._wanted.append((what, memory, array, step))
        return made

    def add_numbers(self) -> None:
        """Adds an array of global ids of the points. The global id of a point is its vertex number in the file."""
        self.numbers = vtkIdTypeArray()
        self.numbers.SetName(VERTEX_NUMBERS)
        self.numbers.SetNumberOfTuples(self._mesh.vertex_count)
        if self._mesh.vertex_count:
            self._wanted.append((lib.SHMF_VERTEX_NUMBERS, vtk_to_numpy(self.numbers), 0, 0))

    def add(self, array: int, step: int) -> None:
        info = self._mesh._arrays[array]
        of_points = info.location == lib.SHMF_POINT_DATA
        count = self._mesh.vertex_count if of_points else self._mesh.cell_count
        made = self._want(lib.SHMF_VALUES, DTYPES[info.type], count, info.components, array, step)
        made.SetName(info.name)
        (self.point_data if of_points else self.cell_data).append(made)

    def read(self) -> vtkUnstructuredGrid:
        self._mesh._read(self._wanted)
        grid = vtkUnstructuredGrid()
        grid.SetPoints(self.points)
        kinds = vtk_to_numpy(self.types) if self.types.GetNumberOfTuples() else np.empty(0, np.uint8)
        if (kinds == POLYHEDRON).any():
            self._set_polyhedra(grid, kinds)
        else:
            grid.SetCells(self.types, _cell_array(self.offsets, self.corners))
        for to, arrays in ((grid.GetPointData(), self.point_data), (grid.GetCellData(), [self.blocks, *self.cell_data])):
            for array in arrays:
                to.AddArray(array)
        if self.numbers is not None:
            grid.GetPointData().SetGlobalIds(self.numbers)
        return grid

    def _set_polyhedra(self, grid: vtkUnstructuredGrid, kinds: np.ndarray) -> None:
        """Converts polyhedra to VTK's face lists. VTK stores the number of vertices of each face; in the file, each
        face instead ends with its first vertex again. A polyhedron that is not stored in this form becomes a convex
        point set."""
        offsets, corners = vtk_to_numpy(self.offsets), vtk_to_numpy(self.corners)
        cells, faces, places = vtkCellArray(), vtkIdTypeArray(), vtkIdTypeArray()
        for index, (kind, first, end) in enumerate(zip(kinds.tolist(), offsets[:-1], offsets[1:])):
            own = corners[first:end].tolist()
            listed = _faces(own) if kind == POLYHEDRON else None
            nodes = own if kind != POLYHEDRON else list(dict.fromkeys(own))
            cells.InsertNextCell(len(nodes), nodes)
            if listed is None:
                places.InsertNextValue(-1)
                if kind == POLYHEDRON:
                    kinds[index] = CONVEX_POINT_SET
                continue
            places.InsertNextValue(faces.GetNumberOfValues())
            for number in [len(listed), *(word for face in listed for word in (len(face), *face))]:
                faces.InsertNextValue(number)
        grid.SetCells(self.types, cells, places, faces)


def _faces(closed: list[int]) -> list[list[int]] | None:
    faces: list[list[int]] = []
    position = 0
    while position < len(closed):
        try:
            end = closed.index(closed[position], position + 1)
        except ValueError:
            return None
        faces.append(closed[position:end])
        position = end + 1
    return faces


class Reader(VTKPythonAlgorithmBase):
    """Reads a .shm file as a vtkUnstructuredGrid, or with blocks=True as a vtkPartitionedDataSetCollection. The collection
    contains a grid for each block, node set (vertices), side set (edges and faces) and element set (cells), and an
    assembly with a group for each of these kinds, as in vtkIOSSReader.

    Arrays of the whole mesh are field data of the output. Arrays of node sets are point data of the grids of these sets,
    and arrays of side and element sets are cell data.

    After UpdateInformation(), GetPointDataArraySelection() and GetCellDataArraySelection() list the arrays, and switch
    them on and off. In collections, GetElementBlockSelection(), GetNodeSetSelection(), GetSideSetSelection() and
    GetElementSetSelection() do the same for blocks and sets. Sets are off by default, unless sets=True, because their
    cells have to be decoded once more.

    Points of blocks and element sets have global ids, "shm_vertex_number", which identify vertices that several blocks
    use. The cell array "block" contains the block index of each cell. Side sets have two cell arrays: for each side,
    "shm_cell_number" is the number of its cell in the file, and "shm_side" is its number in that cell, from 1. Sides of
    lines, polygons and polyhedra are not supported and are omitted.
    """

    def __init__(self, blocks: bool = False, sets: bool = False):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkDataObject")
        self._blocks, self._sets_at_first = blocks, sets
        self._name: str | None = None
        self._mesh: Mesh | None = None
        self._sets: list[Set] = []
        self._flat: bool | None = None
        # which point arrays and which cell arrays are switched on
        self._selections = (vtkDataArraySelection(), vtkDataArraySelection())
        self._parts = {kind: vtkDataArraySelection() for kind in _GROUPS}
        for selection in (*self._selections, *self._parts.values()):
            selection.AddObserver("ModifiedEvent", lambda *_: self.Modified())

    def SetFileName(self, name: str) -> None:
        if name != self._name:
            self._name, self._mesh = name, None
            for selection in (*self._selections, *self._parts.values()):
                selection.RemoveAllArrays()
            self.Modified()

    def GetFileName(self) -> str | None:
        return self._name

    def SetBlocks(self, blocks: bool) -> None:
        """Chooses the kind of output. If `blocks` is true, the output is a collection with a grid for each block and
        set; otherwise it is a single grid."""
        if blocks != self._blocks:
            self._blocks = blocks
            self.Modified()

    def GetOutput(self) -> Any:
        return self.GetOutputDataObject(0)

    def GetPointDataArraySelection(self) -> vtkDataArraySelection:
        return self._selections[0]

    def GetCellDataArraySelection(self) -> vtkDataArraySelection:
        return self._selections[1]

    def GetElementBlockSelection(self) -> vtkDataArraySelection:
        return self._parts["block"]

    def GetNodeSetSelection(self) -> vtkDataArraySelection:
        return self._parts["node"]

    def GetSideSetSelection(self) -> vtkDataArraySelection:
        return self._parts["side"]

    def GetElementSetSelection(self) -> vtkDataArraySelection:
        return self._parts["element"]

    def _opened(self) -> Mesh:
        if self._mesh is None:
            if self._name is None:
                raise ValueError("call SetFileName() first")
            mesh = open_shm(self._name)
            if not isinstance(mesh, Mesh):
                raise ValueError(f"{self._name} is an archive of several meshes")
            self._mesh, self._sets, self._flat = mesh, mesh.sets, None
            for array in mesh._arrays:
                if array.location in (lib.SHMF_POINT_DATA, lib.SHMF_CELL_DATA):
                    self._selections[array.location].AddArray(array.name)
            for block in mesh.blocks:
                self._parts["block"].AddArray(_name_of(block))
            for own in self._sets:
                self._parts[own.kind].AddArray(_name_of(own), self._sets_at_first)
        return self._mesh

    def _times(self) -> list[float]:
        """Returns the time of each step. If the file has no times, returns the indices of the steps instead."""
        mesh = self._opened()
        times = mesh.step_times.tolist()
        return times if len(times) >= mesh.step_count else list(map(float, range(mesh.step_count)))

    def RequestDataObject(self, request: Any, inputs: Any, outputs: Any) -> int:
        made = vtkPartitionedDataSetCollection() if self._blocks else vtkUnstructuredGrid()
        information = outputs.GetInformationObject(0)
        there = information.Get(vtkDataObject.DATA_OBJECT())
        if there is None or not there.IsA(made.GetClassName()):
            information.Set(vtkDataObject.DATA_OBJECT(), made)
        return 1

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        information, times = outputs.GetInformationObject(0), self._times()
        information.Remove(Pipeline.TIME_STEPS())
        information.Remove(Pipeline.TIME_RANGE())
        for time in times:
            information.Append(Pipeline.TIME_STEPS(), time)
        for time in (times[0], times[-1]) if times else ():
            information.Append(Pipeline.TIME_RANGE(), time)
        information.Set(vtkAlgorithm.CAN_HANDLE_PIECE_REQUEST(), 1)
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        information = outputs.GetInformationObject(0)
        mesh, times = self._opened(), self._times()
        step = 0
        if times and information.Has(Pipeline.UPDATE_TIME_STEP()):
            step = max(bisect.bisect_right(times, information.Get(Pipeline.UPDATE_TIME_STEP())) - 1, 0)
        piece, first, end = self._piece(mesh, information)
        if self._blocks:
            out = vtkPartitionedDataSetCollection.GetData(outputs, 0)
            self._collect(mesh, (first, end), step, out)
        else:
            out = vtkUnstructuredGrid.GetData(outputs, 0)
            out.ShallowCopy(self._grid(piece, step))
        for name, steps in mesh.global_data.items():
            if step in steps:
                out.GetFieldData().AddArray(_filled(steps[step], name))
        if times:
            out.GetInformation().Set(out.DATA_TIME_STEP(), times[step])
        return 1

    @staticmethod
    def _piece(mesh: Mesh, information: Any) -> tuple[Mesh, int, int]:
        """Returns (piece, first, end): the requested piece of the mesh, which consists of consecutive segments, and the
        range of its cell numbers, first to end - 1."""
        pieces = information.Get(Pipeline.UPDATE_NUMBER_OF_PIECES()) or 1
        number = information.Get(Pipeline.UPDATE_PIECE_NUMBER()) or 0
        if pieces <= 1:
            return mesh, 0, mesh.cell_count
        segments = mesh.segments
        own = segments[len(segments) * number // pieces:len(segments) * (number + 1) // pieces]
        first, end = (own[0].first_cell, own[-1].first_cell + own[-1].cells) if own else (0, 0)
        return mesh.select(cells=(first, end)), first, end

    def _arrays_at(self, mesh: Mesh, step: int) -> list[int]:
        """Returns the indices of the arrays that are switched on and have values at the time step. Static arrays have
        values at all steps."""
        return [index for index, array in enumerate(mesh._arrays)
                if array.location in (lib.SHMF_POINT_DATA, lib.SHMF_CELL_DATA)
                and self._selections[array.location].ArrayIsEnabled(array.name)
                and (not array.per_step or step in mesh._steps_of(index))]

    def _grid(self, mesh: Mesh, step: int) -> vtkUnstructuredGrid:
        wanted = _Wanted(mesh)
        # a file written by `shm extract` already contains the array of original vertex numbers
        if self._blocks and VERTEX_NUMBERS not in mesh.point_data:
            wanted.add_numbers()
        for index in self._arrays_at(mesh, step):
            wanted.add(index, step if mesh._arrays[index].per_step else 0)
        return wanted.read()

    def _collect(self, mesh: Mesh, cells: tuple[int, int], step: int, out: vtkPartitionedDataSetCollection) -> None:
        """Fills the collection `out` with the grids of blocks and sets, and adds a vtkDataAssembly with their names."""
        assembly = vtkDataAssembly()
        assembly.SetRootNodeName("shm")
        next_part = 0
        for kind, group in _GROUPS.items():
            parts = self._parts_of(kind, mesh, cells, step)
            node = assembly.AddNode(group) if parts else -1
            for name, part in parts:
                out.SetPartition(next_part, 0, part)
                out.GetMetaData(next_part).Set(out.NAME(), name)
                own = assembly.AddNode(vtkDataAssembly.MakeValidNodeName(name), node)
                assembly.SetAttribute(own, "label", name)
                assembly.AddDataSetIndex(own, next_part)
                next_part += 1
        out.SetDataAssembly(assembly)

    def _parts_of(self, kind: str, mesh: Mesh, cells: tuple[int, int], step: int) -> list[tuple[str, vtkUnstructuredGrid]]:
        chosen = self._parts[kind].ArrayIsEnabled
        if kind == "block":
            return [(_name_of(block), self._grid(mesh.select(cells=cells, blocks=[index]), step))
                    for index, block in enumerate(mesh.blocks) if chosen(_name_of(block))]
        sets = [own for own in self._sets if own.kind == kind and chosen(_name_of(own))]
        if not sets:
            return []
        make = {"node": self._node_sets, "side": self._side_sets, "element": self._element_sets}[kind]
        return list(zip(map(_name_of, sets), make(sets, mesh, cells, step)))

    def _points_of(self, mesh: Mesh, step: int, cells: bool) -> Arrays:
        """Reads points and point data into NumPy arrays. The grids of sets receive copies of parts of these arrays."""
        names = [mesh._arrays[index].name for index in self._arrays_at(mesh, step)
                 if mesh._arrays[index].location == lib.SHMF_POINT_DATA]
        return mesh.read(cells=cells, point_data=list(dict.fromkeys(names)), step=step)

    def _node_sets(self, sets: list[Set], mesh: Mesh, cells: tuple[int, int], step: int) -> list[vtkUnstructuredGrid]:
        """Makes a grid for each node set. The grid has a vertex cell for each node of the set. If the mesh is read in
        pieces, only the grids of the first piece contain the nodes."""
        if cells[0] != 0:
            return [vtkUnstructuredGrid() for _ in sets]
        all_of = self._points_of(mesh, step, cells=False)
        made = []
        for own in sets:
            count = len(own.numbers)
            vertices = Cells(np.arange(count + 1), np.arange(count), np.full(count, vtk_type("vertex", 1), np.uint8),
                             np.zeros(count, np.uint32))
            made.append(_grid_of(all_of.points[own.numbers], vertices,
                                 {name: values[own.numbers] for name, values in all_of.point_data.items()}
                                 | self._values_on(own, mesh, step)))
        return made

    def _side_sets(self, sets: list[Set], mesh: Mesh, cells: tuple[int, int], step: int) -> list[vtkUnstructuredGrid]:
        """Makes a grid for each side set. The cells of all sets are decoded in one pass."""
        if self._flat is None:
            self._flat = is_flat(mesh)
        numbers = np.unique(np.concatenate([own.numbers for own in sets])).astype(np.int64)
        numbers = numbers[(numbers >= cells[0]) & (numbers < cells[1])]
        all_of = self._points_of(mesh.select(numbers=numbers), step, cells=True)
        blocks = mesh.blocks
        made = []
        for own in sets:
            inside = np.flatnonzero(np.isin(own.numbers, numbers))
            rows = np.searchsorted(numbers, own.numbers[inside].astype(np.int64))
            # `sides` is None for an empty set
            numbers_of_sides = np.zeros(0, np.int32) if own.sides is None else own.sides[inside]
            sides, known = sides_as_cells(all_of.cells, blocks, rows, numbers_of_sides, self._flat)
            used, corners = np.unique(sides.connectivity, return_inverse=True)
            grid = _grid_of(all_of.points[used], replace(sides, connectivity=corners),
                            {name: values[used] for name, values in all_of.point_data.items()})
            for name, values in (("shm_cell_number", own.numbers[inside]), ("shm_side", numbers_of_sides)):
                grid.GetCellData().AddArray(_filled(values[known].astype(np.int64), name))
            for name, values in self._values_on(own, mesh, step).items():
                grid.GetCellData().AddArray(_filled(values[inside][known], name))
            made.append(grid)
        return made

    def _values_on(self, own: Set, mesh: Mesh, step: int) -> dict[str, np.ndarray]:
        """Returns the arrays with values for the members of a set, in the order of the members."""
        of_kind = [other for other in self._sets if other.kind == own.kind]
        number = next(n for n, other in enumerate(of_kind) if other is own)
        data = {"node": mesh.node_set_data, "side": mesh.side_set_data, "element": mesh.element_set_data}[own.kind]
        values = {}
        for name, steps in data.items():
            covered = data.on_sets(name)
            covered = list(range(len(of_kind))) if covered is None else covered
            if number not in covered or step not in steps or covered[-1] >= len(of_kind):
                continue
            first = sum(len(of_kind[n].numbers) for n in covered if n < number)
            here = steps[step][first:first + len(own.numbers)]
            if len(here) == len(own.numbers):
                values[name] = here
        return values

    def _element_sets(self, sets: list[Set], mesh: Mesh, cells: tuple[int, int], step: int) -> list[vtkUnstructuredGrid]:
        made = []
        for own in sets:
            numbers = own.numbers
            if own.blocks is not None:
                of_blocks = mesh.select(blocks=own.blocks.tolist()).cell_numbers
                numbers = np.union1d(numbers, of_blocks.astype(np.uint64))
            piece = mesh.select(cells=cells, numbers=numbers)
            grid = self._grid(piece, step)
            if own.blocks is None and len(np.unique(own.numbers)) == len(own.numbers):
                order = np.argsort(own.numbers)
                rows = order[np.searchsorted(own.numbers[order], piece.cell_numbers.astype(np.uint64))]
                for name, values in self._values_on(own, mesh, step).items():
                    grid.GetCellData().AddArray(_filled(values[rows], name))
            made.append(grid)
        return made


def _name_of(part: Block | Set) -> str:
    return part.name or (f"block {part.id}" if isinstance(part, Block) else f"{part.kind} set {part.id}")


class Writer:
    """Writes a vtkUnstructuredGrid, or a collection of such grids. Replaces an existing file, as VTK's own writers do.

    All cells with the same type form a block. If the grid has an integer cell array "block", the cells of a block also
    have the same value in this array. Raises ValueError for VTK polyhedra and for cell types that .shm files do not
    support.

    Cells from different grids of a collection are in different blocks. Grids of sets are not written. An array is
    written only if all grids have it. Points with the same global id are merged if all their values are equal. Without
    global ids, each grid keeps its own points.
    """

    def __init__(self) -> None:
        self._name: str | None = None
        self._input: Any = None
        self._producer: Any = None
        self.level = "default"

    def SetFileName(self, name: str) -> None:
        self._name = name

    def GetFileName(self) -> str | None:
        return self._name

    def SetInputData(self, data: vtkDataObject) -> None:
        self._input, self._producer = data, None

    def SetInputConnection(self, port: Any) -> None:
        self._producer = port

    def Write(self) -> int:
        """Writes the file, and returns its size in bytes."""
        if self._producer is not None:
            algorithm = self._producer.GetProducer()
            algorithm.Update()
            self._input = algorithm.GetOutputDataObject(self._producer.GetIndex())
        if self._name is None or self._input is None:
            raise ValueError("call SetFileName() and SetInputData() first")
        one = _merged(_joined(list(_leaves(self._input))))
        return write_shm(self._name, one.points, one.cells, blocks=one.blocks, point_data=one.point_data,
                         cell_data=one.cell_data, level=self.level, replace=True)


def _leaves(data: Any, name: str = "") -> Iterator[tuple[str, vtkUnstructuredGrid]]:
    """Yields the name and the grid of each part of a collection, except the parts that are sets."""
    if data is None:
        return
    if isinstance(data, vtkUnstructuredGrid):
        yield name, data
    elif isinstance(data, vtkPartitionedDataSetCollection):
        of_sets = _in_groups_of_sets(data.GetDataAssembly())
        for index in range(data.GetNumberOfPartitionedDataSets()):
            if index not in of_sets:
                yield from _leaves(data.GetPartitionedDataSet(index), _name_in(data, index) or name)
    elif isinstance(data, vtkMultiBlockDataSet):
        for index in range(data.GetNumberOfBlocks()):
            yield from _leaves(data.GetBlock(index), _name_in(data, index) or name)
    elif isinstance(data, vtkPartitionedDataSet):
        for index in range(data.GetNumberOfPartitions()):
            yield from _leaves(data.GetPartitionAsDataObject(index), name)
    else:
        raise ValueError(f"a {data.GetClassName()} is not an unstructured grid and cannot be written")


def _name_in(data: Any, index: int) -> str | None:
    return data.GetMetaData(index).Get(data.NAME()) if data.HasMetaData(index) else None


def _in_groups_of_sets(assembly: vtkDataAssembly | None) -> set[int]:
    if assembly is None:
        return set()
    groups = [node for node in assembly.GetChildNodes(0, False) if assembly.GetNodeName(node).endswith("_sets")]
    return {index for node in groups for index in assembly.GetDataSetIndices(node)}


@dataclass(frozen=True)
class _Joined:
    """One grid, or several grids joined into one mesh, with all data that write() needs."""
    points: np.ndarray
    cells: Cells
    blocks: list[Block]
    point_data: dict[str, np.ndarray]
    cell_data: dict[str, np.ndarray]
    vertices: np.ndarray | None  # global ids of the points


def _joined(leaves: list[tuple[str, vtkUnstructuredGrid]]) -> _Joined:
    """Joins grids, one after the other, into one mesh. Each grid keeps its own points."""
    leaves = [(name, grid) for name, grid in leaves if grid.GetNumberOfPoints()] or [("", vtkUnstructuredGrid())]
    grids = [grid for _, grid in leaves]
    made = [_cells_of(grid) for grid in grids]
    blocks: list[Block] = []
    of_cells = []
    for (name, _), (cells, listed) in zip(leaves, made):
        of_cells.append(cells.blocks + np.uint32(len(blocks)))
        blocks += [_named(block, name, blocks) for block in listed]
    points = [vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetNumberOfPoints() else np.empty((0, 3)) for grid in grids]
    first_point, first_corner = (np.cumsum([0] + [len(part) for part in parts[:-1]])
                                 for parts in (points, [cells.connectivity for cells, _ in made]))
    cells = Cells(np.concatenate([[0]] + [cells.offsets[1:] + first for (cells, _), first in zip(made, first_corner)]),
                  np.concatenate([cells.connectivity + first for (cells, _), first in zip(made, first_point)]),
                  np.concatenate([cells.types for cells, _ in made]), np.concatenate(of_cells))
    ids = [grid.GetPointData().GetGlobalIds() for grid in grids]
    known = len(ids) > 1 and all(own is not None for own in ids)
    point_data = _common([_data_of(grid.GetPointData(), VERTEX_NUMBERS if own is not None else "")
                          for grid, own in zip(grids, ids)])
    return _Joined(np.concatenate(points), cells, blocks, point_data,
                   _common([_data_of(grid.GetCellData(), "block") for grid in grids]),
                   np.concatenate([vtk_to_numpy(own) for own in ids]) if known else None)


def _named(block: Block, name: str, others: list[Block]) -> Block:
    """Returns a copy of a block, named `name` after its grid. If `name` has the form "block N", which Reader gives to
    unnamed blocks, the copy has the id N and no name. If a block in `others` already has this id, the copy has an
    unused id."""
    number = re.fullmatch(r"block (\d+)", name)
    wanted = int(number[1]) if number else block.id
    used = {other.id for other in others}
    return replace(block, id=wanted if wanted not in used else max(used) + 1, name="" if number else name)


def _common(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Joins the arrays of all parts. An array is omitted unless all parts have it, with the same number of
    components."""
    return {name: np.concatenate([part[name] for part in parts]) for name, first in parts[0].items()
            if all(name in part and part[name].shape[1:] == first.shape[1:] for part in parts)}


def _merged(joined: _Joined) -> _Joined:
    """Merges points with the same global id. If any two of these points differ in a coordinate or value, nothing is
    merged."""
    if joined.vertices is None:
        return joined
    _, first, vertex_of = np.unique(joined.vertices, return_index=True, return_inverse=True)
    for values in (joined.points, *joined.point_data.values()):
        if not np.array_equal(values[first][vertex_of], values, equal_nan=values.dtype.kind == "f"):
            return joined
    return replace(joined, points=joined.points[first], vertices=None,
                   cells=replace(joined.cells, connectivity=vertex_of[joined.cells.connectivity]),
                   point_data={name: values[first] for name, values in joined.point_data.items()})


def _block_of(index: int, kind: int, nodes: int, cells: int) -> Block:
    """Returns the block for cells of a VTK type. `nodes`: the number of nodes of Lagrange and Bezier cells."""
    if kind in HIGH_ORDER:
        return high_order_block(index, "", kind, nodes, cells)
    return Block(index, "", *_SHAPES[kind], cells)


def _cells_of(grid: vtkUnstructuredGrid) -> tuple[Cells, list[Block]]:
    count = grid.GetNumberOfCells()
    if count == 0:
        nothing = np.zeros(0, np.int64)
        return Cells(np.zeros(1, np.int64), nothing, nothing.astype(np.uint8), nothing.astype(np.uint32)), []
    types = vtk_to_numpy(grid.GetCellTypesArray())
    unknown = set(np.unique(types).tolist()) - set(_SHAPES) - set(HIGH_ORDER)
    if unknown:
        raise ValueError(f"cells of VTK type {min(unknown)} cannot be written")
    if grid.GetCellData().GetHigherOrderDegrees() is not None:
        raise ValueError("Lagrange cells with several orders cannot be written")
    named = grid.GetCellData().GetArray("block")
    offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    sizes = np.where(np.isin(types, list(HIGH_ORDER)), np.diff(offsets), 0)  # cells of each order are a block
    keys = np.column_stack([vtk_to_numpy(named) if named is not None else np.zeros(count, int), types, sizes]).astype(np.int64)
    kinds, blocks = np.unique(keys, axis=0, return_inverse=True)
    listed = [_block_of(index + 1, kind, nodes, int((blocks == index).sum()))
              for index, (_, kind, nodes) in enumerate(kinds.tolist())]
    return Cells(offsets, corners, types, blocks.reshape(-1).astype(np.uint32)), listed


def _data_of(data: Any, without: str = "") -> dict[str, np.ndarray]:
    """Returns the numeric arrays by name, except the array `without`. If several arrays have the same name, returns the
    first of them."""
    arrays: dict[str, np.ndarray] = {}
    for index in range(data.GetNumberOfArrays()):
        array = data.GetArray(index)  # GetArray() returns None for an array of strings
        if array is None or not array.GetName() or array.GetName() in (without, *arrays):
            continue
        values = vtk_to_numpy(array)
        arrays[array.GetName()] = values if values.dtype.kind in "iuf" else values.astype(np.int64)
    return arrays
