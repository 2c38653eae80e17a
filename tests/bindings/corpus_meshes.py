"""Reads meshes with different readers and converts them to a common form, so that the results of any two
readers can be compared.

Each reading function returns an object of class Seen. If an independent reader cannot read a file, the function raises
Refused.
"""
import contextlib
import io
from dataclasses import dataclass, field

import gmsh
import meshio
import meshio._vtk_common  # defines VTK's type numbers of meshio's cells
import netCDF4
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkBitArray, vtkDataArray, vtkLogger
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkIOExodus import vtkExodusIIReader
from vtkmodules.vtkIOGeometry import vtkAVSucdReader
from vtkmodules.vtkIOLegacy import vtkUnstructuredGridReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

import shmformat
import shmformat.meshio
import shmformat.vtk

vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
# Maps a linear cell type and a number of nodes to the second-order cell type with that number of nodes. Some programs
# write second-order cells with the linear type.
HIGHER = {(12, 20): 25, (12, 27): 29, (13, 15): 26}
POLY_VERTEX, PIXEL, QUAD, VOXEL, HEXAHEDRON = 2, 8, 9, 11, 12


class Refused(Exception):
    """An independent reader cannot read a file."""


@dataclass
class Seen:
    """A mesh with cells in VTK's form. `steps` contains one entry per time step, or one entry if the mesh has
    no time steps. Each entry is a dictionary of arrays; the key is the pair of location ("point" or "cell")
    and name."""
    points: np.ndarray
    offsets: np.ndarray
    corners: np.ndarray
    types: np.ndarray
    steps: list = field(default_factory=list)
    # Index of the block of each cell.
    blocks: np.ndarray | None = None
    # Number, name and members of each set.
    sets: list | None = None
    # Time of each step.
    times: np.ndarray | None = None
    # For each cell: the id of its block in the source file.
    block_ids: np.ndarray | None = None
    # True if `steps` contains only the first step.
    first: bool = False
    # True if the source may contain arrays that .shm files do not store.
    more: bool = False
    # True if the reader merges several arrays into one, and converts float32 to float64.
    joined: bool = False


def by_own_types(offsets, corners, types):
    """Converts cells to the form used in .shm files: replaces voxels and pixels with hexahedra and quads, and
    corrects types that do not match the number of nodes."""
    corners, types = corners.astype(np.int64), types.astype(np.uint8)
    for kind, instead, swapped in ((PIXEL, QUAD, (2,)), (VOXEL, HEXAHEDRON, (2, 6))):
        first = offsets[:-1][types == kind]
        for at in swapped:
            corners[first + at], corners[first + at + 1] = corners[first + at + 1], corners[first + at]
        types[types == kind] = instead
    sizes = np.diff(offsets)
    for (kind, nodes), instead in HIGHER.items():
        types[(types == kind) & (sizes == nodes)] = instead
    return corners, types


# --- readers of this project


def by_python(path):
    """Reads every array at every step with the Python package."""
    with shmformat.open(path) as mesh:
        cells = mesh.cells
        places = (("point", mesh.point_data), ("cell", mesh.cell_data))
        arrays = [(place, name, data[name]) for place, data in places for name in data]
        steps = [{(place, name): values[step] if hasattr(values, "keys") else values for place, name, values in arrays
                  if not hasattr(values, "keys") or step in values} for step in range(max(mesh.step_count, 1))]
        return Seen(mesh.points, cells.offsets, cells.connectivity, cells.types, steps, blocks=cells.blocks,
                    sets=[(own.id, own.name, own.numbers) for own in mesh.sets], times=mesh.step_times,
                    block_ids=np.array([block.id for block in mesh.blocks], np.int64)[cells.blocks])


def roles_of(path):
    """Returns the arrays that only describe the source format, such as ids, and are not data of the mesh."""
    with shmformat.open(path) as mesh:
        return {(place, name) for place, data in (("point", mesh.point_data), ("cell", mesh.cell_data)) for name in data
                if data.role(name)}


def by_our_vtk(path):
    reader = shmformat.vtk.Reader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    times = times_of(reader)
    steps = []
    for time in times.tolist() or [None]:
        reader.Update() if time is None else reader.UpdateTimeStep(time)
        steps.append(arrays_of(reader.GetOutput(), without="block"))
    blocks = vtk_to_numpy(reader.GetOutput().GetCellData().GetArray("block"))
    return from_grid(reader.GetOutput(), steps, blocks=blocks, times=times)


def times_of(reader):
    information, key = reader.GetOutputInformation(0), Pipeline.TIME_STEPS()
    return np.array([information.Get(key, i) for i in range(information.Length(key))], float)


def by_our_meshio(path, steps):
    try:
        meshes = [shmformat.meshio.read(path, step=step) for step in range(steps)]
    except meshio.ReadError as why:
        raise Refused(why) from why
    return from_meshio(meshes)


def by_c(output, steps):
    """Parses the output of read_all, which consists of header lines that are each followed by values."""
    dtypes = [None, *map(np.dtype, ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"))]
    mesh, static, stepped, sets = {}, {}, {}, []
    at = 0
    while at < len(output):
        of_step = output.startswith(b"step ", at)
        at, end = at + 5 * of_step, output.index(b"\n", at)
        what, kind, step, size, name = output[at:end].decode("utf-8", "surrogateescape").split(" ", 4)
        values = np.frombuffer(output, dtypes[int(kind)], int(size) // dtypes[int(kind)].itemsize, end + 1)
        at = end + 1 + int(size)
        if what in ("point", "cell"):
            to = stepped.setdefault(int(step), {}) if of_step else static
            to.setdefault((what, name), values)
        elif what in ("global", "node_set", "side_set", "element_set"):
            continue  # other readers do not return these arrays, or not as arrays
        elif what == "set":
            sets.append((int(step), name, values))
        else:
            mesh[what] = values
    if max(stepped, default=0) >= steps:
        raise ValueError("read_all prints values of steps that the file does not have")
    return Seen(mesh["points"].reshape(-1, 3), mesh["offsets"], mesh["corners"], mesh["types"],
                [static | stepped.get(step, {}) for step in range(steps)], blocks=mesh["blocks"], sets=sets)


# --- independent readers


def arrays_of(grid, without=""):
    """Returns the numeric arrays that have a name. If several arrays have the same name, returns only the
    first of them."""
    found = {}
    for place, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData())):
        for index in range(data.GetNumberOfArrays()):
            array, name = data.GetAbstractArray(index), data.GetArrayName(index)
            if not name or name == without or not isinstance(array, vtkDataArray):
                continue  # strings are extras in .shm files
            values = np.array([array.GetValue(i) for i in range(array.GetNumberOfValues())], np.uint8) \
                if isinstance(array, vtkBitArray) else vtk_to_numpy(array)
            found.setdefault((place, name), values)
    return found


def from_grid(grid, steps, **more):
    points = vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetNumberOfPoints() else np.empty((0, 3))
    if not grid.GetNumberOfCells():
        return Seen(points, np.zeros(1, int), np.empty(0, int), np.empty(0, np.uint8), steps, **more)
    offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray()).astype(np.int64)
    return Seen(points, offsets, *by_own_types(offsets, vtk_to_numpy(grid.GetCells().GetConnectivityArray()),
                                               vtk_to_numpy(grid.GetCellTypesArray())), steps, **more)


def updated(reader, path):
    errors = []
    reader.AddObserver("ErrorEvent", lambda *_: errors.append(1))
    reader.SetFileName(str(path))
    reader.Update()
    if errors or reader.GetOutput() is None:
        raise Refused("VTK reports an error")
    return reader.GetOutput()


def by_vtk(path):
    """Reads a file with VTK's reader for its format."""
    with open(path, "rb") as file:
        head = file.read(1 << 12)
    if head.startswith(b"# vtk"):
        reader = vtkUnstructuredGridReader()
        for all_of in ("Scalars", "Vectors", "Normals", "Tensors", "TCoords", "Fields", "ColorScalars"):
            getattr(reader, f"ReadAll{all_of}On")()
    elif b"<VTKFile" in head:
        reader = vtkXMLUnstructuredGridReader()
    elif head.startswith((b"CDF", b"\x89HDF")):
        return by_vtks_exodus(path)
    elif path.suffix in (".inp", ".ucd"):
        reader = vtkAVSucdReader()
    else:
        raise Refused("VTK has no reader of such files")
    grid = updated(reader, path)
    return with_block_ids(from_grid(grid, [arrays_of(grid)]))


def with_block_ids(seen):
    """Removes arrays that .shm files do not store as arrays: the block numbers of cells, and group numbers,
    which .shm files store as sets."""
    for name in ("gmsh:geometrical", "avsucd:material", "Material Id"):
        seen.block_ids = seen.steps[0].pop(("cell", name), seen.block_ids)
    seen.steps[0].pop(("cell", "gmsh:physical"), None)
    seen.steps[0].pop(("point", "gmsh:dim_tags"), None)
    return seen


def by_vtu(paths):
    """Reads one .vtu file per time step with VTK. In .vtu files, sets are stored as arrays."""
    steps = []
    for path in paths:
        grid = updated(vtkXMLUnstructuredGridReader(), path)
        steps.append(arrays_of(grid))
    return from_grid(grid, steps, more=True, joined=True)


def by_vtks_exodus(path):
    """Reads an Exodus file with VTK. VTK sorts the blocks by id; this function restores the order of the
    file."""
    reader = vtkExodusIIReader()
    reader.SetFileName(str(path))
    reader.ApplyDisplacementsOff()
    reader.SetSqueezePoints(False)
    reader.GenerateObjectIdCellArrayOn()
    reader.UpdateInformation()
    times = times_of(reader)
    reader.SetAllArrayStatus(reader.ELEM_BLOCK, 1)
    reader.SetAllArrayStatus(reader.NODAL, 1)
    for block in range(reader.GetNumberOfObjects(reader.ELEM_BLOCK)):
        reader.SetObjectStatus(reader.ELEM_BLOCK, block, 1)
    steps = []
    for step in range(max(reader.GetNumberOfTimeSteps(), 1)):
        reader.SetTimeStep(step)
        grids = {}
        for grid in grids_of(updated(reader, path)):
            if grid.GetNumberOfCells():
                grids[int(grid.GetCellData().GetArray("ObjectId").GetValue(0))] = grid
        with netCDF4.Dataset(path) as file:
            order = [int(number) for number in file.variables["eb_prop1"][:]]
        if not grids:
            raise Refused("VTK gives no cells")
        grids = [grids[number] for number in order if number in grids]
        steps.append(joined([(grid.GetNumberOfCells(), arrays_of(grid, "ObjectId")) for grid in grids]))
    parts = [from_grid(grid, []) for grid in grids]
    sizes = np.concatenate([np.diff(part.offsets) for part in parts])
    return Seen(parts[0].points, np.concatenate([[0], np.cumsum(sizes)]), np.concatenate([p.corners for p in parts]),
                np.concatenate([part.types for part in parts]), steps, times=times, joined=True)


def grids_of(tree):
    iterator = tree.NewTreeIterator()
    iterator.InitTraversal()
    while not iterator.IsDoneWithTraversal():
        yield iterator.GetCurrentDataObject()
        iterator.GoToNextItem()


def joined(blocks):
    """Joins the arrays that have the same name in different blocks. For a block without an array of that name,
    fills in NaN, or 0 if the values are integers."""
    found = {}
    for at, (_, arrays) in enumerate(blocks):
        for key, values in arrays.items():
            if key[0] == "point":
                found[key] = values
            elif key not in found:
                rows = [np.full((n, *values.shape[1:]), np.nan if values.dtype.kind == "f" else 0, values.dtype)
                        if key not in others else others[key] for n, others in blocks]
                found[key] = np.concatenate(rows)
    return found


def by_meshio(path, kind):
    """Reads a file with meshio. `kind` is the name of the format as printed by `shm info`."""
    kind = {"ucd": "avsucd"}.get(kind, kind)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            mesh = meshio.read(path, kind)
    except (Exception, SystemExit) as why:
        raise Refused(f"{type(why).__name__}: {why}") from why
    seen = with_block_ids(from_meshio([mesh]))
    seen.first = seen.joined = kind == "exodus"
    return seen


# For each Gmsh cell type: VTK's cell type, and for each node in VTK's order its position in Gmsh's order.
# EDGES contains the positions of the edge nodes of hexahedra, which follow the eight corners.
EDGES = [*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]
OF_GMSH = {1: (3, 2), 2: (5, 3), 3: (QUAD, 4), 4: (10, 4), 5: (HEXAHEDRON, 8), 6: (13, 6), 7: (14, 5), 8: (21, 3), 10: (28, 9),
           12: (29, [*EDGES, 22, 23, 21, 24, 20, 25, 26]), 16: (23, 8), 17: (25, EDGES), 36: (POLY_VERTEX, 16),
           92: (POLY_VERTEX, 64)}


def by_gmsh(path, mesh):
    """Reads a file with Gmsh. Gmsh returns nodes and elements in its own order; this function sorts them by
    tag into the order of `mesh`."""
    gmsh.initialize(["gmsh"], False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        node_tags, xyz, _ = gmsh.model.mesh.getNodes()
        kinds, cell_tags, nodes = gmsh.model.mesh.getElements()
    finally:
        gmsh.finalize()
    tags = mesh.steps[0].get(("point", "gmsh:node_tag"), np.arange(len(mesh.points)) + 1)
    index = np.full(int(max(node_tags.max(), tags.max())) + 1, -1)
    index[tags] = np.arange(len(tags))
    points = np.full((len(node_tags), 3), np.nan)
    points[index[node_tags]] = xyz.reshape(-1, 3)
    cells = {}
    for kind, own, of_cells in zip(kinds, cell_tags, nodes):
        vtk_type, order = OF_GMSH[int(kind)]
        order = range(order) if isinstance(order, int) else order
        corners = index[of_cells].reshape(len(own), -1)[:, order]
        cells.update(zip(own.tolist(), ((vtk_type, row) for row in corners)))
    tags = mesh.steps[0].get(("cell", "gmsh:element_tag"), np.arange(len(mesh.types)) + 1)
    rows = [cells[tag] for tag in tags.tolist() if tag in cells] if len(tags) == len(cells) else list(cells.values())
    offsets = np.concatenate([[0], np.cumsum([len(row) for _, row in rows])])
    return Seen(points, offsets, np.concatenate([row for _, row in rows]), np.array([kind for kind, _ in rows], np.uint8),
                [{}], first=True)


def from_meshio(meshes):
    """Converts several meshio meshes, each of which is the same mesh at a different time step, to one mesh
    with steps."""
    sizes, corners, types = [], [], []
    for block in meshes[0].cells:
        data = np.asarray(block.data)
        turned = meshio._vtk_common.meshio_to_vtk_order(block.type)  # for wedges
        sizes.append(np.full(len(data), data.shape[1]))
        corners.append((data if turned is None else data[:, turned]).reshape(-1))
        types.append(np.full(len(data), meshio._vtk_common.meshio_to_vtk_type.get(block.type, POLY_VERTEX), np.uint8))
    offsets = np.concatenate([[0], np.cumsum(np.concatenate(sizes or [[]]))]).astype(np.int64)
    steps = [{("point", name): np.asarray(values) for name, values in mesh.point_data.items()}
             | {("cell", name): np.concatenate(values) for name, values in mesh.cell_data.items()} for mesh in meshes]
    points = np.asarray(meshes[0].points)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points), points.dtype)])
    return Seen(points, offsets, *by_own_types(offsets, np.concatenate(corners or [[]]),
                                               np.concatenate(types or [[]])), steps)


# --- comparing


def differences(seen, mesh, roles=frozenset()):
    """Compares two meshes and returns their differences. Each difference is a pair of a subject ("points",
    "cells", "sets", "times" or "arrays") and a sentence. `mesh` is the .shm file as read by the Python
    package. `roles` contains the arrays of `mesh` that other readers need not return (see
    roles_of)."""
    wrong = []
    points = native(np.asarray(seen.points))
    if mesh.points.shape != points.shape or mesh.points.astype(points.dtype).tobytes() != points.tobytes():
        wrong.append(("points", f"differ: {points.dtype} {points.shape} against {mesh.points.dtype} {mesh.points.shape}"))
    for name in ("offsets", "corners", "types", "blocks", "block_ids"):
        ours, theirs = getattr(mesh, name), getattr(seen, name)
        if theirs is not None and not np.array_equal(ours, theirs):
            wrong.append(("cells", f"{name} differ, {len(theirs)} against {len(ours)}"))
    if seen.sets is not None and not same_sets(seen.sets, mesh.sets):
        wrong.append(("sets", "differ"))
    if seen.times is not None and seen.times.tobytes() != mesh.times.tobytes():
        wrong.append(("times", f"{seen.times} against {mesh.times}"))
    if not seen.first and len(seen.steps) != len(mesh.steps):
        wrong.append(("arrays", f"{len(seen.steps)} time steps against {len(mesh.steps)}"))
    for step, (theirs, ours) in enumerate(zip(seen.steps, mesh.steps)):
        wrong += [("arrays", f"at step {step}: {sentence}") for sentence in different_arrays(seen, theirs, ours, roles)]
    return wrong


def same_sets(a, b):
    return len(a) == len(b) and all(one[:2] == other[:2] and np.array_equal(one[2], other[2]) for one, other in zip(a, b))


def different_arrays(seen, theirs, ours, roles):
    wrong, left = [], set(ours) - roles
    for key, values in theirs.items():
        parts = [key] if key in ours else parts_of(key, values, ours) if seen.joined else []
        left -= set(parts)
        if not parts and not seen.more:
            wrong.append(f"{key[0]}/{key[1]} is not in the .shm file")
        for part, column in zip(parts, native(values).reshape(-1, len(parts)).T if len(parts) > 1 else [values]):
            if not same_values(column.reshape(-1), ours[part].reshape(-1), seen.joined):
                wrong.append(f"{part[0]}/{part[1]} differs, {values.dtype} against {ours[part].dtype}")
    return wrong + [f"{place}/{name} is only in the .shm file" for place, name in sorted(left)]


def parts_of(key, values, ours):
    """Some readers merge several arrays into one array with several components. Returns the keys in `ours`
    of the arrays that were merged into the array `key`, or an empty list if no arrays were merged into it."""
    count = values.shape[1] if values.ndim > 1 else 1
    names = [other for other in ours if other[0] == key[0]]
    for first in range(len(names) - count + 1):
        if count > 1 and all(name[1].startswith(key[1]) for name in names[first:first + count]):
            return names[first:first + count]
    return []


def native(values):
    return values.astype(values.dtype.newbyteorder("="))


def same_values(theirs, ours, widened):
    """Compares values bit for bit. Integers are compared by value, because some readers convert them to wider
    types."""
    theirs = native(theirs)
    if theirs.dtype.kind != "f" or ours.dtype.kind != "f":
        return theirs.dtype.kind in "iub" and ours.dtype.kind in "iu" and np.array_equal(theirs, ours)
    if widened and ours.dtype == np.float32:
        ours = ours.astype(theirs.dtype)
    return theirs.dtype == ours.dtype and theirs.tobytes() == ours.tobytes()
