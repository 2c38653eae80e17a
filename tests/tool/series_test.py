#!/usr/bin/env python3
"""Tests time series: commands that select some steps of a mesh, and series of files with one step each.

Usage: series_test.py PATH_OF_SHM     (exit code 77, skipped, if VTK or NumPy is missing)
"""
import json
import os
import subprocess
import sys
import unittest
from xml.etree import ElementTree

try:
    import numpy
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy
except ImportError as missing:
    print(missing)
    sys.exit(77)

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import exodus_text, write_vtk

SHM = "shm"


class SeriesTest(FolderTest):
    def shm(self, *words, code=0, stderr=None):
        """Runs the tool in the folder of the test. Returns its output."""
        done = subprocess.run([SHM, *words], cwd=self.directory.name, capture_output=True, text=True,
                              timeout=120)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stdout}{done.stderr}")
        if stderr is not None:
            self.assertIn(stderr, done.stderr)
        elif code == 0:
            self.assertEqual(done.stderr, "", words)
        return done.stdout

    def exodus(self, name, steps, **how):
        return self.ncgen(name, exodus_text(steps, 2, **how))

    def times(self, name):
        return json.loads(self.shm("info", name, "--json"))["step_times"]


class Steps(SeriesTest):
    """--step and --time."""

    CHOICES = ((["--step", "0"], (0,)), (["--step", "first"], (0,)), (["--step", "last"], (5,)),
               (["--step", "3"], (3,)), (["--step", "2:5"], (2, 3, 4)), (["--step", "0:6"], range(6)),
               (["--time", "1.5"], (3,)), (["--time", "1.5000001"], (3,)))

    def test_of_one_format(self):
        """If only some steps are selected, the result must be the same as for a source with only these steps.
        This includes global variables."""
        self.exodus("run.e", range(6))
        self.shm("compress", "run.e", "-q")
        for words, steps in self.CHOICES:
            self.exodus("some.e", steps)
            self.shm("convert", "run.e", "out.e", "-q", "-f", *words)
            self.shm("diff", "some.e", "out.e")
            self.shm("decompress", "run.e.shm", "-o", "out.e", "-q", "-f", *words)
            self.shm("diff", "some.e", "out.e")
            self.shm("convert", "run.e.shm", "out.shm", "-q", "-f", *words)
            self.shm("diff", "some.e", "out.shm")
            self.shm("extract", "run.e.shm", "piece.shm", "-q", "-f", *words, stderr="global")
            self.assertEqual(self.times("piece.shm"), [step / 2 for step in steps])

    def test_of_gmsh(self):
        """The sections of a Gmsh file list every step, so a selection of steps must change the sections,
        too."""
        self.exodus("run.e", range(6))
        self.shm("convert", "run.e", "run.msh", "-q", stderr="not in")
        self.shm("convert", "run.msh", "some.msh", "-q", "--step", "2:5")
        self.assertEqual(self.times("some.msh"), [1, 1.5, 2])
        self.exodus("some.e", range(2, 5))
        self.shm("convert", "some.e", "expected.msh", "-q", stderr="not in")
        # The headers of the Gmsh views contain step numbers. "some.msh" contains the step numbers of its
        # source, "expected.msh" may contain others. The comparison therefore ignores the stored Gmsh sections.
        self.shm("diff", "expected.msh", "some.msh", "--ignore", "gmsh/section")

    def test_appended(self):
        self.exodus("run.e", range(6))
        self.shm("compress", self.exodus("first.e", range(2)), "-q", "-o", "run.shm")
        for words in (["--step", "3:5"], ["--step", "3", "--step", "4"]):
            self.shm("append", "run.shm", "run.e", "-q", "-f", "-o", "more.shm", *words)
            self.assertEqual(self.times("more.shm"), [0, 0.5, 1.5, 2])
        self.shm("append", "run.shm", "run.e", "-q", "--step", "last")
        self.assertEqual(self.times("run.shm"), [0, 0.5, 2.5])

    def test_what_there_is_not(self):
        self.exodus("run.e", range(6))
        write_vtk(self.path("none.vtk"), 2)
        self.shm("compress", "run.e", "-q")
        six = "the mesh has 6, counted from 0 (0:6)"
        for words, said in ((["--step", "6"], six), (["--step", "2:7"], six),
                            (["--step", "3:3"], "the range is empty; the mesh has steps 0:6"),
                            (["--step", "4:2"], "the range is empty"), (["--step=-1"], "first, last or A:B"),
                            (["--step", "2:"], "first, last or A:B"), (["--step", "2x"], "A:B"),
                            (["--time", "1.2"], "times nearby are 0 (step 0), 0.5 (step 1), 1 (step 2)"),
                            (["--time", "9"], "2.5 (step 5)"), (["--time", "nan"], "nearby"),
                            (["--step", "1", "--time", "1"], "--time")):
            for command in (["convert", "run.e", "out.e"], ["extract", "run.e.shm", "out.e"],
                            ["decompress", "run.e.shm", "-o", "out.vtu"]):
                self.shm(*command, *words, code=2, stderr=said)
        for words in (["--step", "0"], ["--step", "last"], ["--time", "0"]):
            self.shm("convert", "none.vtk", "out.e", *words, code=2, stderr="no time steps")
        for target in ("out.vtk", "out.vtu", "out.inp"):
            self.shm("convert", "run.e", target, "--step", "2:4", code=2, stderr="holds one")
            self.shm("extract", "run.e.shm", target, "--step", "2:4", code=2, stderr="holds one")
        self.assertEqual(sorted(os.listdir(self.directory.name)), ["none.vtk", "run.e", "run.e.shm"])


def nodal(step, v):
    """Returns the nodal values of exodus_text()."""
    return [round((node % 97) * .01 * (v + 1) + step * (.5 + node % 5), 4) for node in range(27)]


class Files(SeriesTest):
    """A file for each step."""

    def listed(self, folder="."):
        return sorted(os.listdir(self.path(folder)))

    def assert_step(self, name, step):
        """Checks the data of one step with VTK, which is independent of this project."""
        legacy = name.endswith(".vtk")
        reader = vtk.vtkUnstructuredGridReader() if legacy else vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(self.path(name))
        if legacy:
            reader.ReadAllScalarsOn()
            reader.ReadAllFieldsOn()
        reader.Update()
        grid = reader.GetOutput()
        self.assertEqual((grid.GetNumberOfPoints(), grid.GetNumberOfCells()), (27, 8), name)
        data = grid.GetPointData()
        self.assertEqual(list(vtk_to_numpy(data.GetArray("u"))), nodal(step, 0), name)
        self.assertEqual(list(vtk_to_numpy(data.GetArray("p"))),
                         [float(numpy.float32(v)) for v in nodal(step, 1)], name)
        time = grid.GetFieldData().GetArray("TIME" if legacy else "TimeValue")
        self.assertEqual(time.GetValue(0), step / 2, name)

    def test_each_step(self):
        self.exodus("run.e", range(12))
        self.shm("compress", "run.e", "-q")
        for command in (["convert", "run.e"], ["decompress", "run.e.shm", "-o"],
                        ["extract", "run.e.shm"]):
            for name in ("a_%04d.vtu", "a %d.vtk", "100%%_%3d.vtu", "%02d"):
                before = self.listed()
                words = ["--format", "vtu"] if "." not in name else []
                out = self.shm(*command, name, *words, stderr="blocks that array")
                self.assertIn(f"{name % 0} to {name % 11}: 27 vertices, 8 hexahedra, ", out)
                self.assertIn("12 time steps", out)
                made = [name % step for step in range(12)]
                self.assertEqual(sorted(set(self.listed()) - set(before)), sorted(made))
                for step, file in enumerate(made):
                    self.assert_step(file, step)
                    os.remove(self.path(file))

    def test_some_steps(self):
        """The numbers in file names are step numbers. Other files in the folder are unchanged."""
        self.exodus("run.e", range(6))
        self.write("a_0000.vtu.bak", "old")
        self.write("a_000.vtu", "old")
        self.shm("convert", "run.e", "a_%04d.vtu", "-q", "--step", "2:4", stderr="blocks that array")
        self.shm("convert", "run.e", "a_%04d.vtu", "-q", "--time", "2.5", "-f", stderr="blocks that array")
        self.assertEqual(self.listed(), ["a_000.vtu", "a_0000.vtu.bak", "a_0002.vtu", "a_0003.vtu",
                                         "a_0005.vtu", "run.e"])
        for step in (2, 3, 5):
            self.assert_step(f"a_000{step}.vtu", step)

    def test_formats_that_hold_many(self):
        """If the output name has a pattern, the tool writes one file per step, even in formats that store several steps."""
        self.exodus("run.e", range(3))
        self.shm("convert", "run.e", "one_%d.e", "-q")
        self.shm("convert", "run.e", "one_%d.shm", "-q")
        for step in range(3):
            self.exodus("expected.e", (step,))
            self.shm("diff", "expected.e", f"one_{step}.e")
            self.shm("diff", "expected.e", f"one_{step}.shm")

    def test_a_mesh_without_steps(self):
        write_vtk(self.path("none.vtk"), 2)
        self.shm("convert", "none.vtk", "a_%04d.vtu", "-q")
        self.shm("convert", "none.vtk", "b.pvd", "-q")
        self.assertEqual(self.listed(), ["a_0000.vtu", "b", "b.pvd", "none.vtk"])
        self.shm("diff", "a_0000.vtu", "b/b_0000.vtu")
        self.shm("convert", "none.vtk", "c_%d.vtu", "--step", "0", code=2, stderr="no time steps")

    def collection(self, name):
        root = ElementTree.parse(self.path(name)).getroot()
        self.assertEqual((root.tag, root.get("type")), ("VTKFile", "Collection"))
        sets = root.find("Collection").findall("DataSet")
        self.assertEqual({each.get("part") for each in sets}, {"0"})
        return [(float(each.get("timestep")), each.get("file")) for each in sets]

    def test_collections(self):
        self.exodus("run.e", range(6))
        os.mkdir(self.path("of <R&D>"))
        for name, stem in (("run.pvd", "run"), ("of <R&D>/a&b.PVD", "a&b")):
            self.shm("convert", "run.e", name, "-q", stderr="blocks that array")
            self.assertEqual(self.collection(name),
                             [(step / 2, f"{stem}/{stem}_000{step}.vtu") for step in range(6)])
            folder = os.path.dirname(name)
            for step in range(6):
                self.assert_step(os.path.join(folder, stem, f"{stem}_000{step}.vtu"), step)
        self.shm("convert", "run.e", "run.pvd", "-q", "--step", "last", code=4, stderr="5 other files of run.pvd")
        self.shm("convert", "run.e", "run.pvd", "-q", "-f", "--step", "last", stderr="blocks that array")
        self.assertEqual(self.collection("run.pvd"), [(2.5, "run/run_0005.vtu")])
        self.shm("convert", "run.e", "x.pvd", "--format", "vtk", code=2, stderr="of VTU files")
        self.write("y", "a file")
        self.shm("convert", "run.e", "y.pvd", code=4, stderr="y: is not a folder, but y.pvd needs one")

    def test_nothing_is_lost(self):
        """Before it writes any file, the tool detects existing files, outputs that are inputs, and data that
        the output files cannot store."""
        self.exodus("run.e", range(6))
        self.shm("convert", "run.e", "a_%d.vtu", "--strict", code=6, stderr="blocks that array 'heat' covers")
        self.shm("convert", "run.e", "a_%d_%d.vtu", code=2, stderr="one %d")
        self.shm("convert", "run.e", "a_%s_%d.vtu", code=2, stderr="one %d")
        self.shm("convert", "run.e", "a_%999d.vtu", code=2, stderr="one %d")
        self.shm("convert", "run.e", "no/a_%d.vtu", code=4, stderr="no folder no")
        self.assertEqual(self.listed(), ["run.e"])
        self.write("a_7.vtu", "of another series")
        self.write("a_3.vtu", "of another series")
        self.shm("convert", "run.e", "a_%d.vtu", code=4, stderr="a_3.vtu: exists already, as well as 1 other file of")
        os.link(self.path("run.e"), self.path("b_2.e"))
        self.shm("convert", "run.e", "b_%d.e", "-f", code=4, stderr="same file as run.e")
        os.mkdir(self.path("c_4.e"))
        self.shm("convert", "run.e", "c_%d.e", "-f", code=4, stderr="c_4.e: is a folder")
        self.assertEqual(self.listed(), ["a_3.vtu", "a_7.vtu", "b_2.e", "c_4.e", "run.e"])
        # In a name, a percent sign that does not begin a pattern is an ordinary character.
        self.shm("convert", "run.e", "50%.e", "-q")
        self.shm("convert", "run.e", "50%%.e", "-q")
        self.assertEqual(self.listed()[:2], ["50%%.e", "50%.e"])


def grid_at(step, **how):
    """Returns a mesh of two hexahedra with the fields of a step, as a VTK grid. `how` selects the properties
    in which the mesh differs from the other meshes of the series."""
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for i in range(12):
        points.InsertNextPoint(i // 4 + (how.get("moved", 0) if i == 5 else 0), i % 4 in (1, 2), i % 4 > 1)
    if step > 0:
        points.GetData().GetRange(-1)  # makes VTK write the range of the points, unlike other programs
    grid.SetPoints(points)
    for cell in range(how.get("cells", 2)):
        corners = [4 * cell + i for i in (0, 1, 2, 3, 4, 5, 6, 7)]
        if how.get("turned"):
            corners = corners[4:] + corners[:4]
        grid.InsertNextCell(vtk.VTK_HEXAHEDRON, 8, corners)

    def add(data, name, values, kind=numpy.float64):
        array = numpy_to_vtk(numpy.array(values, dtype=kind), deep=True)
        array.SetName(name)
        array.GetRange(-1)  # VTK then writes the range
        data.AddArray(array)

    add(grid.GetPointData(), how.get("name", "T"), [i * .1 + step ** 2 for i in range(12)])
    add(grid.GetPointData(), "v", [[i, step, -i * step] for i in range(12)], numpy.float32)
    add(grid.GetCellData(), "material", [how.get("material", 7)] * how.get("cells", 2), numpy.int32)
    if how.get("more"):
        add(grid.GetCellData(), "more", [1.] * 2)
    labels = vtk.vtkStringArray()
    labels.SetName("label")
    for cell in range(how.get("cells", 2)):
        labels.InsertNextValue(how.get("label", "steel"))
    grid.GetCellData().AddArray(labels)
    for name in ("TimeValue", "TIME"):
        if how.get("time", name) == name:
            add(grid.GetFieldData(), name, [.25 * step])
    if "cycle" in how:
        add(grid.GetFieldData(), "CYCLE", [how["cycle"]], numpy.int32)
    return grid


class Meshes(SeriesTest):
    """Tests of series of files with one step each, which the tool reads as one mesh with several steps."""

    def vtk_file(self, file, step, mode="appended", **how):
        if file.endswith(".vtk"):
            writer = vtk.vtkUnstructuredGridWriter()
            if mode != "ascii":
                writer.SetFileTypeToBinary()
            how.setdefault("time", "TIME")
        else:
            writer = vtk.vtkXMLUnstructuredGridWriter()
            {"appended": writer.SetDataModeToAppended, "ascii": writer.SetDataModeToAscii,
             "binary": writer.SetDataModeToBinary}[mode]()
            how.setdefault("time", "TimeValue")
        writer.SetFileName(self.path(file))
        writer.SetInputData(grid_at(step, **how))
        writer.Write()
        return file

    def series(self, name, steps=range(5), **how):
        for step in steps:
            self.vtk_file(name % step, step, **how)

    def read(self, name):
        reader = (vtk.vtkUnstructuredGridReader() if name.endswith(".vtk")
                  else vtk.vtkXMLUnstructuredGridReader())
        reader.SetFileName(self.path(name))
        if name.endswith(".vtk"):
            reader.ReadAllFieldsOn()
        reader.Update()
        return reader.GetOutput()

    def values(self, name):
        """Returns all data that VTK reads from a file."""
        grid = self.read(name)
        found = {"points": vtk_to_numpy(grid.GetPoints().GetData()).tolist(),
                 "cells": vtk_to_numpy(grid.GetCells().GetConnectivityArray()).tolist()}
        for of, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData()),
                         ("field", grid.GetFieldData())):
            for i in range(data.GetNumberOfArrays()):
                array = data.GetAbstractArray(i)
                of_numbers = not isinstance(array, vtk.vtkStringArray)
                found[of, array.GetName()] = (
                    array.GetDataTypeAsString(),
                    vtk_to_numpy(array).tolist() if of_numbers
                    else [array.GetValue(k) for k in range(array.GetNumberOfValues())])
        return found

    def test_there_and_back(self):
        for name in ("a_%04d.vtu", "a_%d.vtk"):
            for mode in ("appended", "binary", "ascii"):
                with self.subTest(name=name, mode=mode):
                    self.series(name, mode=mode)
                    self.shm("compress", name, "-o", "a.shm", "-q", "-f")
                    report = json.loads(self.shm("info", "a.shm", "--json"))
                    self.assertEqual(report["step_times"], [.25 * step for step in range(5)])
                    stepped = {a["name"]: a["per_step"] for a in report["arrays"]}
                    self.assertEqual(stepped, {"T": True, "v": True, "material": False, "label": False})
                    self.shm("verify", "a.shm", "--against", name)
                    self.shm("diff", name, "a.shm")
                    self.shm("decompress", "a.shm", "-o", "b_" + name, "-q", "-f")
                    for step in range(5):
                        before, after = self.values(name % step), self.values("b_" + name % step)
                        self.assertEqual(before[("field", "TimeValue" if "vtu" in name else "TIME")][1],
                                         [.25 * step])
                        self.assertEqual(before, after)
                        self.shm("diff", name % step, "b_" + name % step, "--no-extras")

    def test_through_other_formats(self):
        """Conversions through all formats do not change values and times."""
        self.series("a_%d.vtu")
        self.shm("convert", "a_%d.vtu", "a.e", "-q", stderr="strings of array 'label'")
        self.shm("convert", "a.e", "b.pvd", "-q", stderr="")
        self.shm("convert", "a_%d.vtu", "c_%d.vtk", "-q")
        self.shm("convert", "c_%d.vtk", "d_%d.vtu", "-q")
        self.assertEqual(self.times("b.pvd"), [.25 * step for step in range(5)])
        for step in range(5):
            before = self.values(f"a_{step}.vtu")
            for name in (f"b/b_000{step}.vtu", f"c_{step}.vtk", f"d_{step}.vtu"):
                after = self.values(name)
                time = "TIME" if name.endswith("vtk") else "TimeValue"
                self.assertEqual(after["field", time][1], [.25 * step], name)
                for field in ("T", "v"):
                    self.assertEqual(before["point", field][1], after["point", field][1], name)
                self.assertEqual(before["cells"], after["cells"])
                if not name.startswith("b"):
                    self.assertEqual(before["cell", "label"], after["cell", "label"])

    def test_one_file_of_many_steps(self):
        """If a format stores only one step, the last step is written. The tool reports the lost steps, even
        if the format of the source is the same."""
        self.series("a_%d.vtu")
        self.shm("compress", "a_%d.vtu", "-o", "a.shm", "-q")
        self.shm("decompress", "a.shm", "-o", "last.vtu", "-q", stderr="time steps 0 to 3 of 5")
        self.shm("decompress", "a.shm", "-o", "no.vtu", "-q", "--strict", code=6, stderr="0 to 3 of 5")
        self.shm("decompress", "a.shm", "-o", "no.vtu", "-q", "--step", "1:3", code=2, stderr="holds one")
        self.shm("decompress", "a.shm", "-o", "third.vtu", "-q", "--time", ".5")
        self.shm("decompress", "a.shm", "-o", "some.shm", "-q", "--step", "1:3")
        self.assertEqual(self.values("last.vtu"), self.values("a_4.vtu"))
        self.assertEqual(self.values("third.vtu"), self.values("a_2.vtu"))
        self.assertEqual(self.times("some.shm"), [.25, .5])

    def test_appended(self):
        """Appends single files and series of files, no matter how the .shm file was created."""
        self.series("a_%d.vtu", range(6))
        self.series("all_%d.vtu", range(9))
        for order in ("keep", "stream"):
            self.shm("compress", "a_%d.vtu", "-o", "a.shm", "-q", "-f", "--order", order)
            self.shm("append", "a.shm", "all_6.vtu", "-q")
            self.shm("append", "a.shm", "all_%d.vtu", "-q")
            self.shm("verify", "a.shm", "--against", "all_%d.vtu")
            self.assertIn("nothing to do", self.shm("append", "a.shm", "all_8.vtu"))
            self.vtk_file("late.vtu", 9, time="none")
            self.shm("append", "a.shm", "late.vtu", code=2, stderr="--time")
            self.shm("append", "a.shm", "late.vtu", "-q", "--time", "9", stderr="another 'vtu/skeleton'")
            self.assertEqual(self.times("a.shm")[-2:], [2, 9])
            self.shm("append", "a.shm", self.vtk_file("moved.vtu", 10, moved=.5), code=1,
                     stderr="coordinates")

    def test_names_beside(self):
        """Default names of outputs."""
        self.series("a_%d.vtu", range(2))
        self.series("b_%d.vtk", range(2))
        self.shm("convert", "a_%d.vtu", "c.pvd", "-q")
        self.shm("compress", "c.pvd", "-q")
        self.shm("compress", "a_%d.vtu", "-q", "-o", "a.shm")
        self.shm("compress", "b_%d.vtk", "-q", "-o", "b.shm")
        before = set(os.listdir(self.directory.name))
        self.shm("decompress", "a.shm", "b.shm", "-q")
        self.assertEqual(set(os.listdir(self.directory.name)) - before,
                         {"a.pvd", "a", "b_0000.vtk", "b_0001.vtk"})
        self.shm("decompress", "c.pvd.shm", "-q", "-f")
        self.shm("diff", "c.pvd", "a_%d.vtu")
        self.shm("diff", "a.pvd", "a_%d.vtu")

    def test_removed(self):
        """--rm removes sources only if the tool knows that all of their steps are stored."""
        self.series("a_%d.vtu", range(3))
        for words in (["a_%d.vtu", "-o", "a.shm"], ["c.pvd"]):
            self.write("c.pvd", self.collection_of([(step, f"a_{step}.vtu") for step in range(3)]))
            self.shm("compress", *words, "--rm", code=4, stderr="is a series of files")
        self.shm("compress", "a_%d.vtu", "-o", "a.shm", "-q")
        for words, code in ((["-o", "last.vtu"], 4), (["--step", "0:2", "-o", "b_%d.vtu"], 2)):
            self.shm("decompress", "a.shm", "--rm", "-q", *words, code=code, stderr="")
            self.assertTrue(os.path.exists(self.path("a.shm")))
        self.shm("decompress", "a.shm", "--rm", "-q", "-o", "b_%d.vtu")
        self.assertFalse(os.path.exists(self.path("a.shm")))
        self.shm("diff", "a_%d.vtu", "b_%d.vtu")

    def test_times(self):
        """The time of a step is taken from the collection or from field data. If neither states a time, the
        times are 0, 1, 2, and so on."""
        self.series("a_%d.vtu", (0, 2, 10))
        self.assertEqual(self.times("a_%d.vtu"), [0, .5, 2.5])
        self.series("b_%d.vtu", (3, 4), time="none")
        self.assertEqual(self.times("b_%d.vtu"), [0, 1])
        os.mkdir(self.path("far"))
        sets = ((7.5, "a_2.vtu"), (-1, self.path("a_0.vtu")), (9, "far/../a_10.vtu"))
        self.write("c.pvd", self.collection_of(sets))
        self.assertEqual(self.times("c.pvd"), [-1, 7.5, 9])
        self.shm("compress", "c.pvd", "-q")
        self.shm("verify", "c.pvd.shm", "--against", "c.pvd")
        self.shm("decompress", "c.pvd.shm", "-o", "d.pvd", "-q")
        self.shm("diff", "c.pvd", "d.pvd")
        self.assertEqual(self.values("d/d_0001.vtu")["field", "TimeValue"][1], [7.5])
        # A file without a time is written without a time, unless the collection states one.
        self.shm("convert", "b_%d.vtu", "e_%d.vtu", "-q")
        self.assertNotIn(("field", "TimeValue"), self.values("e_1.vtu"))
        for name, field in (("b_%d.vtu", "TimeValue"), ("l_%d.vtk", "TIME")):
            for how in ({}, {"cycle": 5}):
                self.series(name, (3, 4), time="none", **how)
                self.write("f.pvd", self.collection_of(((.5, name % 3), (8.5, name % 4))))
                self.shm("convert", "f.pvd", "g_" + name, "-q", "-f")
                self.shm("convert", "f.pvd", "h_%d.vtu", "-q", "-f")
                self.assertEqual(self.times("g_" + name), [.5, 8.5])
                before, after = self.values(name % 4), self.values("g_" + name % 1)
                self.assertEqual(after.pop(("field", field)), ("double", [8.5]))
                self.assertEqual(before, after)
                self.assertEqual(self.values("h_1.vtu")["field", "TimeValue"][1], [8.5])
        self.vtk_file("b_5.vtu", 5)
        self.shm("info", "b_%d.vtu", code=3,
                 stderr="b_5.vtu: does not belong to the same series as b_3.vtu: it has a time value")

    @staticmethod
    def collection_of(sets):
        return ('<?xml version="1.0"?><VTKFile type="Collection" version="0.1"><Collection>' + "".join(
            f'<DataSet timestep="{time}" group="" part="0" file="{file}"/>' for time, file in sets)
            + "</Collection></VTKFile>")

    def test_what_is_no_series(self):
        """If the mesh in a file differs from the mesh in the other files of the series, the error names the
        file and the first difference. No output is written."""
        self.series("a_%d.vtu", (0, 1))
        for how, said in (({"moved": .5}, "coordinates: 1 of 36 differ; points that move"),
                          ({"cells": 1}, "cells: 2, 1"), ({"turned": True}, "cells: 2 of 2 differ"),
                          ({"name": "U"}, "it has array 'U' on points, 1 x float64"),
                          ({"more": True}, "it has array 'more' on cells"),
                          ({"label": "brass"}, "label"), ({"time": "none"}, "it has no time value")):
            self.vtk_file("a_2.vtu", 2, **how)
            for command in (["compress", "a_%d.vtu", "-o", "a.shm"], ["info", "a_%d.vtu"],
                            ["diff", "a_0.vtu", "a_%d.vtu"], ["convert", "a_%d.vtu", "b_%d.vtk"]):
                self.shm(*command, code=3, stderr="a_2.vtu: does not belong to the same series as a_0.vtu: " +
                         (said if "label" not in said else ""))
        self.vtk_file("c_0.vtk", 0)
        self.vtk_file("c_1.vtk", 1)
        os.rename(self.path("c_1.vtk"), self.path("a_2.vtu"))
        self.shm("info", "a_%d.vtu", code=3, stderr="a_2.vtu: has a different format from a_0.vtu")
        self.shm("compress", "a_%d.vtk", "-o", "a.shm", code=3, stderr="no file matches this name")
        self.shm("compress", "c_%d.vtk", code=2, stderr="-o must name")
        self.exodus("e_0.e", range(2))
        self.shm("info", "e_%d.e", code=3, stderr="e_0.e: contains time steps itself")
        self.assertEqual(sorted(os.listdir(self.directory.name)),
                         ["a_0.vtu", "a_1.vtu", "a_2.vtu", "c_0.vtk", "e_0.e"])

    def test_what_is_not_kept(self):
        """Field data is taken from the first file. If other files have different field data, the tool reports
        this once."""
        for step in range(4):
            self.vtk_file(f"a_{step}.vtk", step, cycle=100 * step)
        done = subprocess.run([SHM, "compress", "a_%d.vtk", "-o", "a.shm", "-q"], text=True,
                              cwd=self.directory.name, capture_output=True, check=True)
        self.assertRegex(done.stderr, r"^shm: a_1.vtk: 'vtk/data/\d' differs from the one in a_0.vtk, "
                                      r"which is used for all files\n$")

    def test_hostile_collections(self):
        self.series("a_%d.vtu", (0, 1))
        os.mkfifo(self.path("pipe"))
        good = [(0, "a_0.vtu"), (1, "a_1.vtu")]
        for sets, said in (([], "lists no files"), ([*good, (2, "a_2.vtu")], "a_2.vtu: cannot be"),
                           ([*good, (2, "")], "without a file"), ([("nan", "a_0.vtu")], "timestep is"),
                           ([("", "a_0.vtu")], "timestep is ''"), ([*good, (3, ".")], "is not a regular file"),
                           ([*good, (3, "pipe")], "is not a regular file"),
                           ([*good, (1, "a_0.vtu")], "several parts"), ([(0, "b.pvd")], "b.pvd")):
            self.write("b.pvd", self.collection_of(sets))
            self.shm("info", "b.pvd", code=3, stderr=said)
            self.shm("compress", "b.pvd", "-q", code=3, stderr=said)
        text = self.collection_of(good)
        self.write("b.pvd", text.replace("Collection>", "Other>"))
        self.shm("info", "b.pvd", code=3, stderr="no element Collection")
        self.write("b.pvd", '<!DOCTYPE a [<!ENTITY b "c">]>' + text)
        self.shm("info", "b.pvd", code=3, stderr="DOCTYPE")
        for cut in range(60, len(text) - 12, 7):
            self.write("b.pvd", text[:cut])
            self.shm("info", "b.pvd", code=3, stderr="b.pvd: ")
        # Inputs are not overwritten.
        self.write("b.pvd", text)
        for target in ("b.pvd", "a_0.vtu"):
            self.shm("convert", "b.pvd", target, "-f", code=4, stderr="an input")
        self.shm("convert", "a_%d.vtu", "a_%d.vtu", "-f", code=4, stderr="is an input")
        self.shm("convert", "b.pvd", "a_%d.vtu", "-f", code=4, stderr="an input")
        self.shm("compress", "b.pvd", "-q", "-f", "-o", "a_1.vtu", code=4, stderr="an input")


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
