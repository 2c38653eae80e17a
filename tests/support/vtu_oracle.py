#!/usr/bin/python3
"""Compares two VTU files with VTK's own XML reader.

usage: vtu_oracle.py A.vtu B.vtu
       vtu_oracle.py --data A B                         compares only the grids of two .vtu or .vtk files
       vtu_oracle.py --legacy A B                       compares the grids of a .vtk (any data set) and a
           .vtu at the last step, arrays by name, without data that one of the two formats cannot store
       vtu_oracle.py --all DIRECTORY_A DIRECTORY_B      compares files of the same name
       vtu_oracle.py --samples DIRECTORY                lets VTK write a small grid with every feature in
           every encoding (MODE_COMPRESSOR_HEADER_ORDER.vtu), and a file of three time steps (steps.vtu)
       vtu_oracle.py --read A.vtu                       only reads the file with VTK

Compares points, cells, cell types, polyhedron faces, and all point, cell and field data: the order of arrays,
their names, types, components, component names, information keys, values (bit for bit) and attribute kinds.
This is done for the whole grid at every time step, and for each piece. Then the script compares the XML
elements in order, with all attributes, texts and comments. Offsets of appended data and white space are
ignored. Exit code 0: equal; 1: different (each difference is printed); 2: VTK could not read a file. Needs
Debian's python3-vtk9 and python3-numpy.
"""
import itertools
import os
import re
import sys
import xml.parsers.expat

import vtk
from vtk.util.numpy_support import vtk_to_numpy

import vtk_oracle
from vtk_oracle import Comparison, bits

MODES = {"ascii": (0, 1), "binary": (1, 1), "base64": (2, 1), "raw": (2, 0)}
COMPRESSORS = {"none": 0, "zlib": 1, "lz4": 2, "lzma": 3}


def open_reader(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    errors = []
    reader.AddObserver("ErrorEvent", lambda *_: errors.append("error"))
    reader.SetFileName(path)
    reader.UpdateInformation()
    return reader, errors


def checked(path, reader, errors):
    if errors or reader.GetErrorCode():
        print(f"{path}: VTK reports an error")
        sys.exit(2)
    copy = vtk.vtkUnstructuredGrid()
    copy.ShallowCopy(reader.GetOutput())
    return copy


def read(path):
    """Yields the whole grid at every time step, then each piece."""
    if path.endswith(".vtk"):
        return [vtk_oracle.read(path)[0]]
    reader, errors = open_reader(path)
    grids = []
    for step in range(max(reader.GetNumberOfTimeSteps(), 1)):
        reader.SetTimeStep(step)
        reader.Update()
        grids.append(checked(path, reader, errors))
    pieces = reader.GetNumberOfPieces()
    for piece in range(pieces if pieces > 1 else 0):
        reader.UpdatePiece(piece, pieces, 0)
        grids.append(checked(path, reader, errors))
    return grids


def tree(path):
    """Returns the XML before the appended data as a list of lines, without offsets and white space."""
    lines = []
    parser = xml.parsers.expat.ParserCreate()
    # The values of inline arrays are not compared as text, because they are compared as VTK reads them.
    inside = []

    class Stop(Exception):
        pass

    def start(name, attributes):
        if lines and lines[-1][0] == "text" and not lines[-1][1]:
            lines.pop()
        attributes.pop("offset", None)
        lines.append(("element", name, tuple(attributes.items())))
        inside.append(name)
        if name == "AppendedData":
            raise Stop

    def end(name):
        inside.pop()
        lines.append(("end", name))

    def text(data):
        data = data.strip()
        if data and inside[-1] not in ("DataArray", "Array"):
            if lines[-1][0] == "text":
                data = lines.pop()[1] + data
            lines.append(("text", data))

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = text
    parser.CommentHandler = lambda data: lines.append(("comment", data))
    parser.ProcessingInstructionHandler = lambda *data: lines.append(("instruction", *data))
    parser.ordered_attributes = False
    try:
        with open(path, "rb") as file:
            parser.ParseFile(file)
    except Stop:
        pass
    return lines


def compare_grids(check, a, b):
    if check.same("number of points", a.GetNumberOfPoints(), b.GetNumberOfPoints()):
        if a.GetPoints() is not None and a.GetNumberOfPoints() > 0:
            points = [g.GetPoints().GetData() for g in (a, b)]
            check.same("type of points", *(p.GetClassName() for p in points))
            check.same("points", *(bits(p) for p in points))
    check.cells(a, b)
    check.same("face locations", bits(a.GetFaceLocations()), bits(b.GetFaceLocations()))
    for kind in ("PointData", "CellData", "FieldData"):
        check.arrays(kind, getattr(a, f"Get{kind}")(), getattr(b, f"Get{kind}")())
    for kind in ("PointData", "CellData"):
        check.attributes(kind, getattr(a, f"Get{kind}")(), getattr(b, f"Get{kind}")())


def compare(path_a, path_b, with_xml):
    check = Comparison()
    a, b = read(path_a), read(path_b)
    if check.same("number of steps and pieces", len(a), len(b)):
        for one, other in zip(a, b):
            compare_grids(check, one, other)
    if with_xml:
        left, right = tree(path_a), tree(path_b)
        check.same("number of lines of XML", len(left), len(right))
        for one, other in zip(left, right):
            if not check.same("XML", one, other):
                break
    return 1 if check.differences else 0


def in_common(grid):
    """Returns the arrays of a grid by name, without data that one of the two formats cannot store."""
    found = {}
    for what in ("PointData", "CellData", "FieldData"):
        data = getattr(grid, f"Get{what}")()
        for i in range(data.GetNumberOfArrays()):
            array = data.GetAbstractArray(i)
            if isinstance(array, vtk.vtkVariantArray):
                continue
            name, values = array.GetName(), bits(array)
            is_bits = isinstance(array, vtk.vtkBitArray)
            if is_bits:
                values = tuple(map(str, values))
            elif isinstance(array, vtk.vtkDataArray):  # vtkIdType is narrow in legacy files
                values = tuple(map(repr, vtk_to_numpy(array).ravel()))
            components = array.GetNumberOfComponents()
            # VTU files cannot distinguish an empty name from a missing name.
            names = tuple(array.GetComponentName(c) or None for c in range(components))
            key = vtk.vtkDataArray.UNITS_LABEL()
            units = array.GetInformation().Get(key) if array.HasInformation() else None
            found[what, name] = (components, array.GetNumberOfTuples(), names, units, is_bits, values)
    for what in ("PointData", "CellData"):
        data = getattr(grid, f"Get{what}")()
        for kind in range(vtk.vtkDataSetAttributes.NUM_ATTRIBUTES):
            array = data.GetAbstractAttribute(kind)
            if array is not None:
                found[what, kind] = array.GetName()
    return found


def seen(path, step=-1):
    """Returns the grid of a file at a step. Its arrays include the time of the step as "TimeValue" and the
    title of the file as "Title"."""
    if path.endswith(".vtk"):
        grid, reader = vtk_oracle.read(path)
        found = in_common(grid)
        found["FieldData", "Title"] = reader.GetHeader()
    else:
        reader, errors = open_reader(path)
        steps = reader.GetNumberOfTimeSteps()
        reader.SetTimeStep(range(max(steps, 1))[step])
        reader.Update()
        grid = checked(path, reader, errors)
        found = in_common(grid)
        title = grid.GetFieldData().GetAbstractArray("Title")
        found["FieldData", "Title"] = title.GetValue(0) if title else "vtk output"
        if steps > 1:
            with open(path, "rb") as file:
                times = re.search(rb'TimeValues="([^"]*)"', file.read())[1].split()
            time = (repr(float(times[step])),)
            found["FieldData", "TimeValue"] = (1, 1, (None,), None, False, time)
    if ("FieldData", "TIME") in found and ("FieldData", "TimeValue") not in found:
        found["FieldData", "TimeValue"] = found.pop(("FieldData", "TIME"))
    return grid, found


def compare_legacy(path_a, path_b, unlike=(), step=-1):
    """Compares the grids of a .vtk and a .vtu file. Ignores the arrays named in `unlike`. `step` selects the
    step of file A that is compared."""
    check = Comparison()
    (a, left), (b, right) = seen(path_a, step), seen(path_b)
    if hasattr(a, "GetFaces") and hasattr(b, "GetFaces"):
        check.cells(a, b)
    else:  # structured data or polygonal data
        blanked = vtk_oracle.blanked_cells(a) | vtk_oracle.blanked_cells(b)
        check.same("cells", *(vtk_oracle.cells_of(grid, blanked) for grid in (a, b)))
    if check.same("number of points", a.GetNumberOfPoints(), b.GetNumberOfPoints()):
        check.same("points", *([g.GetPoint(i) for i in range(g.GetNumberOfPoints())]
                               for g in (a, b)))
    for key in sorted(left.keys() | right.keys(), key=str):
        if key[1] not in unlike:
            check.same(str(key), left.get(key), right.get(key))
    return 1 if check.differences else 0


def compare_all(directory_a, directory_b):
    worst = 0
    for name in sorted(os.listdir(directory_a)):
        result = compare(os.path.join(directory_a, name), os.path.join(directory_b, name), True)
        if result:
            print(f"{name}: failed, see above")
        worst = max(worst, result)
    return worst


def set_up(writer, mode, compressor, header, order, path):
    writer.SetDataMode(MODES[mode][0])
    writer.SetEncodeAppendedData(MODES[mode][1])
    writer.SetCompressorType(COMPRESSORS[compressor])
    writer.SetHeaderType(int(header))
    writer.SetByteOrder(0 if order == "big" else 1)
    writer.SetBlockSize(64)  # several blocks even in these small files
    writer.SetFileName(path)


def sample():
    grid = vtk_oracle.sample()
    grid.GetFieldData().RemoveArray("variants")  # the XML writer cannot write variant arrays
    time = vtk.vtkDoubleArray()
    time.SetName("TimeValue")
    time.InsertNextValue(2.5)
    grid.GetFieldData().AddArray(time)
    words = vtk.vtkStringArray()
    words.SetName("w\u00f6rter &lt;&amp;&gt;")  # VTK writes names without escaping them
    for i in range(grid.GetNumberOfPoints()):
        words.InsertNextValue("p" * i + "é")
    grid.GetPointData().AddArray(words)
    grid.GetPointData().AddArray(vtk_oracle.numbers("Float", "named &amp; &quot;quoted&quot;", 1,
                                                    grid.GetNumberOfPoints()))
    return grid


def write_samples(directory):
    grid = sample()
    for choice in itertools.product(MODES, COMPRESSORS, ("32", "64"), ("little", "big")):
        writer = vtk.vtkXMLUnstructuredGridWriter()
        set_up(writer, *choice, os.path.join(directory, "_".join(choice) + ".vtu"))
        writer.SetInputData(grid)
        if not writer.Write():
            sys.exit(2)
    write_steps(os.path.join(directory, "steps.vtu"))


def write_steps(path):
    grid = sample()
    writer = vtk.vtkXMLUnstructuredGridWriter()
    set_up(writer, "raw", "zlib", 64, "little", path)
    writer.SetInputData(grid)
    writer.SetNumberOfTimeSteps(3)
    writer.Start()
    scalars = grid.GetPointData().GetScalars()
    for step in range(3):
        for i in range(scalars.GetNumberOfTuples()):
            scalars.SetValue(i, i + step / 4)
        scalars.Modified()
        writer.WriteNextTime(step / 2)
    writer.Stop()


def main():
    arguments = sys.argv[1:]
    if len(arguments) == 2 and arguments[0] == "--samples":
        write_samples(arguments[1])
    elif len(arguments) == 3 and arguments[0] == "--legacy":
        sys.exit(compare_legacy(*arguments[1:]))
    elif len(arguments) == 3 and arguments[0] == "--all":
        sys.exit(compare_all(*arguments[1:]))
    elif len(arguments) == 2 and arguments[0] == "--read":
        read(arguments[1])
    elif len(arguments) == 3 and arguments[0] == "--data":
        sys.exit(compare(*arguments[1:], False))
    elif len(arguments) == 2 and all(os.path.exists(path) for path in arguments):
        sys.exit(compare(*arguments, True))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
