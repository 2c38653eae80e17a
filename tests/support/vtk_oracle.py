#!/usr/bin/python3
"""Compares two legacy VTK files with VTK's own readers.

usage: vtk_oracle.py A.vtk B.vtk
       vtk_oracle.py --rewrite 42|51 ASCII|BINARY IN.vtk OUT.vtk   VTK reads IN and writes OUT
       vtk_oracle.py --sample 42|51 ASCII|BINARY OUT.vtk           writes a small grid with every feature
       vtk_oracle.py --samples FOLDER          writes small grids of every data set, version and encoding
       vtk_oracle.py --folders FOLDER FOLDER   compares files of the same name in two folders
       vtk_oracle.py --cells FOLDER FOLDER     does the same, but compares only points and nodes of cells;
                                               the kinds of data set may differ

Compares the kind of data set, points, cells, cell types, polyhedron faces, extents, spacing,
origin, axes, and all point, cell and field data: the order of arrays, their names, types, components,
component names, values (bit for bit), attribute kinds and lookup tables. Exit code 0: equal; 1: different
(each difference is printed); 2: VTK could not read a file. Needs Debian's python3-vtk9 and python3-numpy.
"""
import os
import sys

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy


READERS = {"UNSTRUCTURED_GRID": vtk.vtkUnstructuredGridReader,
           "STRUCTURED_GRID": vtk.vtkStructuredGridReader,
           "RECTILINEAR_GRID": vtk.vtkRectilinearGridReader,
           "STRUCTURED_POINTS": vtk.vtkStructuredPointsReader,
           "POLYDATA": vtk.vtkPolyDataReader}


def kind_of(path):
    with open(path, "rb") as file:
        for line in file:
            words = line.upper().split()
            if len(words) > 1 and words[0] == b"DATASET":
                return words[1].decode()
    return "none"


def read(path):
    errors = []
    reader = READERS[kind_of(path)]()
    reader.SetFileName(path)
    for kind in ("Scalars", "Vectors", "Normals", "Tensors", "ColorScalars", "TCoords", "Fields"):
        getattr(reader, f"ReadAll{kind}On")()
    reader.AddObserver("ErrorEvent", lambda *_: errors.append("error"))
    reader.Update()
    if errors:
        print(f"{path}: VTK reports an error")
        sys.exit(2)
    return reader.GetOutput(), reader


def bits(array):
    """Returns values as bytes, so that a comparison treats NaNs with the same bits as equal and distinguishes
    -0 from 0."""
    if array is None:
        return b""
    if isinstance(array, vtk.vtkBitArray):
        return bytes(array.GetValue(i) for i in range(array.GetNumberOfValues()))
    if isinstance(array, vtk.vtkDataArray):
        return numpy.ascontiguousarray(vtk_to_numpy(array)).tobytes()
    if isinstance(array, vtk.vtkVariantArray):
        values = [array.GetValue(i) for i in range(array.GetNumberOfValues())]
        return repr([(v.GetType(), v.ToString()) if isinstance(v, vtk.vtkVariant) else v
                     for v in values]).encode()
    return repr([array.GetValue(i) for i in range(array.GetNumberOfValues())]).encode()


def information(array):
    keys = vtk.vtkInformationIterator()
    keys.SetInformation(array.GetInformation() if array.HasInformation() else vtk.vtkInformation())
    keys.InitTraversal()
    found = []
    while not keys.IsDoneWithTraversal():
        found.append(f"{keys.GetCurrentKey().GetLocation()}::{keys.GetCurrentKey().GetName()}")
        keys.GoToNextItem()
    return sorted(found)


def describe(array):
    components = array.GetNumberOfComponents()
    return (array.GetName(), array.GetClassName(), components, array.GetNumberOfTuples(),
            tuple(array.GetComponentName(c) for c in range(components)), information(array))


class Comparison:
    def __init__(self):
        self.differences = 0

    def same(self, title, a, b):
        if a == b:
            return True
        self.differences += 1
        print(f"{title} differs" + ("" if isinstance(a, bytes) else f": {a!r} against {b!r}"))
        return False

    def arrays(self, title, a, b):
        if not self.same(f"{title}: number of arrays", a.GetNumberOfArrays(), b.GetNumberOfArrays()):
            return
        for i in range(a.GetNumberOfArrays()):
            left, right = a.GetAbstractArray(i), b.GetAbstractArray(i)
            name = f"{title} array {i} '{left.GetName()}'"
            if self.same(name, describe(left), describe(right)):
                self.same(f"{name}: values", bits(left), bits(right))
            self.lookup_tables(name, left, right)

    def lookup_tables(self, name, a, b):
        tables = [x.GetLookupTable() if isinstance(x, vtk.vtkDataArray) else None for x in (a, b)]
        if self.same(f"{name}: has a lookup table", *(t is not None for t in tables)) and tables[0]:
            self.same(f"{name}: lookup table", *(bits(t.GetTable()) for t in tables))

    def attributes(self, title, a, b):
        for kind in range(vtk.vtkDataSetAttributes.NUM_ATTRIBUTES):
            names = [x.GetAbstractAttribute(kind) for x in (a, b)]
            names = [None if x is None else x.GetName() for x in names]
            label = vtk.vtkDataSetAttributes.GetAttributeTypeAsString(kind)
            self.same(f"{title}: {label}", *names)

    def geometry(self, a, b):
        if hasattr(a, "GetExtent"):
            self.same("extent", a.GetExtent(), b.GetExtent())
        if hasattr(a, "GetSpacing"):
            self.same("spacing", a.GetSpacing(), b.GetSpacing())
            self.same("origin", a.GetOrigin(), b.GetOrigin())
        if hasattr(a, "GetXCoordinates"):
            for axis in "XYZ":
                axes = [getattr(g, f"Get{axis}Coordinates")() for g in (a, b)]
                self.same(f"type of {axis}", *(describe(x) for x in axes))
                self.same(f"values of {axis}", *(bits(x) for x in axes))
        if hasattr(a, "GetPolys"):
            for kind in ("Verts", "Lines", "Polys", "Strips"):
                self.cell_arrays(kind, *(getattr(g, f"Get{kind}")() for g in (a, b)))
        if hasattr(a, "GetFaces"):
            self.cells(a, b)

    def cell_arrays(self, title, a, b):
        for part in ("Offsets", "Connectivity"):
            values = [vtk_to_numpy(getattr(c, f"Get{part}Array")()).astype("int64")
                      for c in (a, b)]
            self.same(f"{title}: {part.lower()}", values[0].tobytes(), values[1].tobytes())

    def cells(self, a, b):
        if not self.same("number of cells", a.GetNumberOfCells(), b.GetNumberOfCells()):
            return
        if a.GetNumberOfCells() == 0:
            return
        self.same("cell types", bits(a.GetCellTypesArray()), bits(b.GetCellTypesArray()))
        self.cell_arrays("cells", a.GetCells(), b.GetCells())
        self.same("faces", bits(a.GetFaces()), bits(b.GetFaces()))


def write(grid, version, encoding, path, extent=False):
    kind = grid.GetClassName()
    kind = "vtkStructuredPoints" if kind == "vtkImageData" else kind
    writer = getattr(vtk, f"{kind}Writer")()
    writer.SetFileVersion(int(version))
    writer.SetFileType(1 if encoding == "ASCII" else 2)
    writer.SetFileName(path)
    writer.SetInputData(grid)
    if extent:
        writer.SetWriteExtent(True)
    if not writer.Write():
        sys.exit(2)


def numbers(kind, name, components, tuples):
    array = getattr(vtk, f"vtk{kind}Array")()
    array.SetName(name)
    array.SetNumberOfComponents(components)
    array.SetNumberOfTuples(tuples)
    for i in range(tuples):
        for c in range(components):
            at = i * components + c
            array.SetComponent(i, c, (at - 3) / 7 if kind in ("Float", "Double") else at % 100)
    return array


# For each VTK cell type that is not linear: its number of nodes. If cells of a type can have any number of
# nodes, the number is an example.
HIGHER_CELLS = {21: 3, 22: 6, 23: 8, 24: 10, 25: 20, 26: 15, 27: 13, 28: 9, 29: 27, 30: 6, 31: 12,
                32: 18, 33: 24, 34: 7, 35: 4, 36: 7, 37: 19, 41: 6, 4: 3, 1: 1, 3: 2, 5: 3, 10: 4,
                13: 6, 15: 10, 16: 12, 68: 4, 69: 10, 70: 16, 71: 20, 72: 64, 73: 40, 74: 30,
                75: 5, 76: 15, 77: 9, 78: 10, 79: 27, 80: 18, 81: 14}


def sample_cells(grid):
    for kind, count in HIGHER_CELLS.items():
        grid.InsertNextCell(kind, count, [i % 9 for i in range(count)])
    hexahedron = [0, 1, 2, 3, 4, 5, 6, 7]
    for kind, nodes in ((vtk.VTK_HEXAHEDRON, hexahedron), (vtk.VTK_VOXEL, [0, 1, 3, 2, 4, 5, 7, 6]),
                        (vtk.VTK_PYRAMID, [4, 5, 6, 7, 8]), (vtk.VTK_PIXEL, [0, 1, 3, 2]),
                        (vtk.VTK_QUAD, [0, 1, 2, 3]), (vtk.VTK_POLYGON, [0, 1, 2]),
                        (vtk.VTK_POLYGON, [4, 5, 6, 7]), (vtk.VTK_POLY_VERTEX, [8, 0]),
                        (vtk.VTK_TRIANGLE_STRIP, [0, 1, 2, 3, 4]), (vtk.VTK_EMPTY_CELL, []),
                        (vtk.VTK_HEXAHEDRON, hexahedron)):
        grid.InsertNextCell(kind, len(nodes), nodes)
    faces = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    stream = vtk.vtkIdList()
    stream.InsertNextId(len(faces))
    for face in faces:
        for value in [len(face)] + face:
            stream.InsertNextId(value)
    grid.InsertNextCell(vtk.VTK_POLYHEDRON, stream)


def sample_attributes(data, count):
    for kind in ("Char", "UnsignedChar", "Short", "UnsignedShort", "Int", "UnsignedInt", "Long",
                 "UnsignedLong", "Float", "Double", "IdType", "Bit"):
        # Bit arrays have a single component, because VTK's writer loses bits of arrays with several
        # components.
        data.AddArray(numbers(kind, f"of type {kind}", 1 if kind == "Bit" else 2, count))
    names = numbers("Double", "named", 3, count)
    for c, name in enumerate(("first one", "", "third%")):
        names.SetComponentName(c, name)
    names.GetInformation().Set(vtk.vtkDataArray.UNITS_LABEL(), "m/s")
    names.GetRange(-1)
    data.AddArray(names)
    scalars = numbers("Float", "scalars", 1, count)
    table = vtk.vtkLookupTable()
    table.SetNumberOfTableValues(3)
    table.Build()
    scalars.SetLookupTable(table)
    data.SetScalars(scalars)
    data.SetVectors(numbers("Double", "vec tors", 3, count))
    data.SetNormals(numbers("Float", "normals", 3, count))
    data.SetTensors(numbers("Double", "tensors", 9, count))
    data.SetTCoords(numbers("Float", "texture", 2, count))
    data.SetGlobalIds(numbers("IdType", "global", 1, count))
    data.SetPedigreeIds(numbers("IdType", "pedigree", 1, count))


def sample():
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    for xyz in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1),
                (0, 1, 1), (.5, .5, 2.1)):
        points.InsertNextPoint(xyz)
    grid.SetPoints(points)
    sample_cells(grid)
    return with_data(grid)


def with_data(grid):
    sample_attributes(grid.GetPointData(), grid.GetNumberOfPoints())
    sample_attributes(grid.GetCellData(), grid.GetNumberOfCells())
    strings = vtk.vtkStringArray()
    strings.SetName("some strings")
    for text in ("a b", "", "50%", "x" * 100):
        strings.InsertNextValue(text)
    variants = vtk.vtkVariantArray()
    variants.SetName("variants")
    for value in (3, "hi there", 2.5):
        variants.InsertNextValue(vtk.vtkVariant(value))
    for array in (strings, variants, numbers("Double", "TIME", 1, 1), numbers("Int", "none", 1, 0)):
        grid.GetFieldData().AddArray(array)
    return grid


# For each kind of structured sample: number of points along each axis. The file of the sample "extent" has a
# line EXTENT instead of the line DIMENSIONS.
SHAPES = {"": (4, 3, 5), "extent": (4, 3, 5), "flat": (4, 1, 5), "line": (1, 6, 1),
          "point": (1, 1, 1), "empty": (0, 0, 0)}


def sample_of(kind):
    kind, _, shape = kind.partition("-")
    if kind == "polydata":
        return with_data(sample_polydata())
    size = SHAPES[shape]
    grid = {"structured_grid": vtk.vtkStructuredGrid, "rectilinear_grid": vtk.vtkRectilinearGrid,
            "structured_points": vtk.vtkImageData}[kind]()
    first = (2, -3, 0) if shape == "extent" else (0, 0, 0)
    grid.SetExtent(*(x for axis in zip(first, size) for x in (axis[0], axis[0] + axis[1] - 1)))
    if kind == "structured_points":
        grid.SetSpacing(0.1, 1 / 3, 7)
        grid.SetOrigin(1e-3, -2, 1e6)
    elif kind == "rectilinear_grid":
        for axis, count, of in zip("XYZ", size, ("Float", "Int", "Double")):
            values = numbers(of, f"{axis} values", 1, count)
            values.SetComponentName(0, "some name")
            getattr(grid, f"Set{axis}Coordinates")(values)
    else:
        points = vtk.vtkPoints()
        points.SetDataTypeToDouble()
        for i in range(size[0] * size[1] * size[2]):
            points.InsertNextPoint(i / 7, i % 5, i * i)
        grid.SetPoints(points)
        if shape in ("", "flat"):
            grid.BlankPoint(1)
            grid.BlankCell(2)
    return with_data(grid)


def sample_polydata():
    mesh = vtk.vtkPolyData()
    points = vtk.vtkPoints()
    for i in range(9):
        points.InsertNextPoint(i / 3, i % 4, i)
    mesh.SetPoints(points)
    for kind, cells in (("Verts", ([0], [1, 2, 3], [4])), ("Lines", ([0, 1], [2, 3, 4], [5, 6])),
                        ("Polys", ([0, 1, 2], [0, 1, 2, 3], [4, 5, 6, 7, 8], [6, 7, 8])),
                        ("Strips", ([0, 1, 2, 3], [4, 5, 6, 7, 8]))):
        array = vtk.vtkCellArray()
        for nodes in cells:
            array.InsertNextCell(len(nodes), nodes)
        getattr(mesh, f"Set{kind}")(array)
    return mesh


# Returns the nodes of a cell. For voxels and pixels, returns them in the order of hexahedra and quads.
def nodes_of(grid, cell):
    ids = grid.GetCell(cell).GetPointIds()
    nodes = [ids.GetId(i) for i in range(ids.GetNumberOfIds())]
    kind = grid.GetCellType(cell)
    if kind in (vtk.VTK_PIXEL, vtk.VTK_VOXEL):
        nodes[2:4] = nodes[3:1:-1]
    if kind == vtk.VTK_VOXEL:
        nodes[6:8] = nodes[7:5:-1]
    return nodes


# Returns the kind and the nodes of each cell. Voxels and pixels are converted to hexahedra and quads. If the
# index of a cell is in `places`, its entry is None.
def cells_of(grid, places=()):
    kinds = {vtk.VTK_VOXEL: vtk.VTK_HEXAHEDRON, vtk.VTK_PIXEL: vtk.VTK_QUAD}
    return [None if c in places else
            (kinds.get(grid.GetCellType(c), grid.GetCellType(c)), nodes_of(grid, c))
            for c in range(grid.GetNumberOfCells())]


# Returns the indices of the blanked cells of structured data. VTK does not return the nodes of these cells.
def blanked_cells(grid):
    if isinstance(grid, (vtk.vtkUnstructuredGrid, vtk.vtkPolyData)):
        return set()
    return {c for c in range(grid.GetNumberOfCells()) if grid.GetCellType(c) == vtk.VTK_EMPTY_CELL}


def write_samples(folder):
    structured = ("structured_grid", "rectilinear_grid", "structured_points")
    kinds = [f"{kind}-{shape}" if shape else kind for kind in structured for shape in SHAPES]
    for kind in kinds + ["polydata"]:
        grid = sample_of(kind)
        for version in (42, 51):
            for encoding in ("ASCII", "BINARY"):
                path = os.path.join(folder, f"{kind}-{version}-{encoding}.vtk")
                write(grid, version, encoding, path, extent=kind.endswith("-extent"))


def compare_folders(folder_a, folder_b, comparison):
    names = sorted(os.listdir(folder_a))
    different = [n for n in names
                 if comparison(*(os.path.join(f, n) for f in (folder_a, folder_b)))]
    for name in different:
        print(f"{name} differs")
    return 1 if different or not names else 0


def compare_cells(path_a, path_b):
    a, b = read(path_a)[0], read(path_b)[0]
    check = Comparison()
    if check.same("number of points", a.GetNumberOfPoints(), b.GetNumberOfPoints()):
        for i in range(a.GetNumberOfPoints()):
            check.same(f"point {i}", a.GetPoint(i), b.GetPoint(i))
    if check.same("number of cells", a.GetNumberOfCells(), b.GetNumberOfCells()):
        for i in range(a.GetNumberOfCells()):
            if a.GetCellType(i) == vtk.VTK_EMPTY_CELL:
                continue  # blanked: VTK does not return its nodes
            check.same(f"cell {i}", nodes_of(a, i), nodes_of(b, i))
    return 1 if check.differences else 0


def compare(path_a, path_b):
    (a, reader_a), (b, reader_b) = read(path_a), read(path_b)
    check = Comparison()
    check.same("title", reader_a.GetHeader(), reader_b.GetHeader())
    check.same("encoding", reader_a.GetFileType(), reader_b.GetFileType())
    check.same("version", *(r.GetFileMajorVersion() * 10 + r.GetFileMinorVersion()
                            for r in (reader_a, reader_b)))
    if not check.same("data set", a.GetClassName(), b.GetClassName()):
        return 1
    if check.same("number of points", a.GetNumberOfPoints(), b.GetNumberOfPoints()):
        if isinstance(a, vtk.vtkPointSet) and a.GetPoints() and a.GetNumberOfPoints() > 0:
            points = [g.GetPoints().GetData() for g in (a, b)]
            check.same("type of points", *(p.GetClassName() for p in points))
            check.same("points", *(bits(p) for p in points))
    check.geometry(a, b)
    check.arrays("point data", a.GetPointData(), b.GetPointData())
    check.arrays("cell data", a.GetCellData(), b.GetCellData())
    check.arrays("field data", a.GetFieldData(), b.GetFieldData())
    check.attributes("point data", a.GetPointData(), b.GetPointData())
    check.attributes("cell data", a.GetCellData(), b.GetCellData())
    return 1 if check.differences else 0


def main():
    arguments = sys.argv[1:]
    if len(arguments) == 5 and arguments[0] == "--rewrite":
        write(read(arguments[3])[0], arguments[1], arguments[2], arguments[4])
    elif len(arguments) == 4 and arguments[0] == "--sample":
        write(sample(), *arguments[1:])
    elif len(arguments) == 2 and arguments[0] == "--samples":
        write_samples(arguments[1])
    elif len(arguments) == 3 and arguments[0] in ("--folders", "--cells"):
        comparison = compare if arguments[0] == "--folders" else compare_cells
        sys.exit(compare_folders(*arguments[1:], comparison))
    elif len(arguments) == 2:
        sys.exit(compare(*arguments))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
