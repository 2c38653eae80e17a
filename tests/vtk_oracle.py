#!/usr/bin/python3
"""Tells whether two VTK legacy files are the same unstructured grid to VTK's own reader.

usage: vtk_oracle.py A.vtk B.vtk
       vtk_oracle.py --rewrite 42|51 ASCII|BINARY IN.vtk OUT.vtk   VTK reads IN and writes OUT
       vtk_oracle.py --sample 42|51 ASCII|BINARY OUT.vtk           a small grid with everything in it
Compares points, cells, cell types, polyhedron faces, and all point, cell and field data: order,
names, types, components, component names, values (bit for bit), attribute kinds, lookup tables.
Exit code 0: equal; 1: different (each difference is printed); 2: VTK could not read a file.
Needs Debian's python3-vtk9 and python3-numpy.
"""
import sys

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy


def read(path):
    errors = []
    reader = vtk.vtkUnstructuredGridReader()
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
    """Values as bytes, so that NaN equals itself and -0 differs from 0."""
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

    def same(self, what, a, b):
        if a == b:
            return True
        self.differences += 1
        print(f"{what} differs" + ("" if isinstance(a, bytes) else f": {a!r} against {b!r}"))
        return False

    def arrays(self, what, a, b):
        if not self.same(f"{what}: number of arrays", a.GetNumberOfArrays(), b.GetNumberOfArrays()):
            return
        for i in range(a.GetNumberOfArrays()):
            left, right = a.GetAbstractArray(i), b.GetAbstractArray(i)
            name = f"{what} array {i} '{left.GetName()}'"
            if self.same(name, describe(left), describe(right)):
                self.same(f"{name}: values", bits(left), bits(right))
            self.lookup_tables(name, left, right)

    def lookup_tables(self, name, a, b):
        tables = [x.GetLookupTable() if isinstance(x, vtk.vtkDataArray) else None for x in (a, b)]
        if self.same(f"{name}: has a lookup table", *(t is not None for t in tables)) and tables[0]:
            self.same(f"{name}: lookup table", *(bits(t.GetTable()) for t in tables))

    def attributes(self, what, a, b):
        for kind in range(vtk.vtkDataSetAttributes.NUM_ATTRIBUTES):
            names = [x.GetAbstractAttribute(kind) for x in (a, b)]
            names = [None if x is None else x.GetName() for x in names]
            label = vtk.vtkDataSetAttributes.GetAttributeTypeAsString(kind)
            self.same(f"{what}: {label}", *names)

    def cells(self, a, b):
        if not self.same("number of cells", a.GetNumberOfCells(), b.GetNumberOfCells()):
            return
        if a.GetNumberOfCells() == 0:
            return
        self.same("cell types", bits(a.GetCellTypesArray()), bits(b.GetCellTypesArray()))
        for part in ("Offsets", "Connectivity"):
            values = [vtk_to_numpy(getattr(g.GetCells(), f"Get{part}Array")()).astype("int64")
                      for g in (a, b)]
            self.same(part.lower(), values[0].tobytes(), values[1].tobytes())
        self.same("faces", bits(a.GetFaces()), bits(b.GetFaces()))


def write(grid, version, encoding, path):
    writer = vtk.vtkUnstructuredGridWriter()
    writer.SetFileVersion(int(version))
    writer.SetFileType(1 if encoding == "ASCII" else 2)
    writer.SetFileName(path)
    writer.SetInputData(grid)
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


def sample_cells(grid):
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
        data.AddArray(numbers(kind, f"of type {kind}", 2, count))
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


def compare(path_a, path_b):
    (a, reader_a), (b, reader_b) = read(path_a), read(path_b)
    check = Comparison()
    check.same("title", reader_a.GetHeader(), reader_b.GetHeader())
    check.same("encoding", reader_a.GetFileType(), reader_b.GetFileType())
    check.same("version", *(r.GetFileMajorVersion() * 10 + r.GetFileMinorVersion()
                            for r in (reader_a, reader_b)))
    if check.same("number of points", a.GetNumberOfPoints(), b.GetNumberOfPoints()):
        if a.GetPoints() is not None and a.GetNumberOfPoints() > 0:
            points = [g.GetPoints().GetData() for g in (a, b)]
            check.same("type of points", *(p.GetClassName() for p in points))
            check.same("points", *(bits(p) for p in points))
    check.cells(a, b)
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
    elif len(arguments) == 2:
        sys.exit(compare(*arguments))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
