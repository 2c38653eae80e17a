#!/usr/bin/python3
"""Compares two AVS UCD files with VTK's own reader.

usage: ucd_oracle.py A.inp B.inp

Compares points, cells, cell types, and all point and cell data: the order of arrays, their names, components
and values (in single precision, as VTK reads them). The lines before the counts are compared as text, and so
is the text after the data, which VTK does not read. Exit code 0: equal; 1: different (each difference is
printed); 2: VTK could not read a file. Needs Debian's python3-vtk9 and python3-numpy.
"""
import sys

import vtk
from vtk.util.numpy_support import vtk_to_numpy


def read(path):
    errors = []
    reader = vtk.vtkAVSucdReader()
    reader.SetFileName(path)
    reader.AddObserver("ErrorEvent", lambda *_: errors.append("error"))
    reader.Update()
    if errors or reader.GetOutput().GetNumberOfPoints() == 0:
        print(f"{path}: VTK cannot read it")
        sys.exit(2)
    return reader.GetOutput()


def texts(path):
    """Returns the lines before the counts, and the text after the data."""
    with open(path, encoding="latin-1") as file:
        lines = file.read().splitlines()
    comments = 0
    while lines[comments].startswith("#"):
        comments += 1
    counts = [int(word) for word in lines[comments].split()]
    end = comments + 1 + counts[0] + counts[1]
    for values, elements in ((counts[2], counts[0]), (counts[3], counts[1])):
        if values:
            end += 1 + int(lines[end].split()[0]) + elements
    return lines[:comments], counts, [line.split() for line in lines[end:] if line.split()]


def contents(path):
    grid = read(path)
    found = {"text": texts(path)}
    found["points"] = vtk_to_numpy(grid.GetPoints().GetData()).tobytes()
    found["types"] = vtk_to_numpy(grid.GetCellTypesArray()).tobytes()
    for part in ("Offsets", "Connectivity"):
        values = vtk_to_numpy(getattr(grid.GetCells(), f"Get{part}Array")())
        found[part.lower()] = values.astype("int64").tobytes()
    for place, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData())):
        for i in range(data.GetNumberOfArrays()):
            array = data.GetArray(i)
            found[f"{place} data {i}"] = (array.GetName(), array.GetNumberOfComponents(),
                                         vtk_to_numpy(array).tobytes())
    return found


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    a, b = contents(sys.argv[1]), contents(sys.argv[2])
    wrong = [item for item in sorted(a.keys() | b.keys()) if a.get(item) != b.get(item)]
    for item in wrong:
        print(f"{item} differs")
    sys.exit(1 if wrong else 0)


main()
