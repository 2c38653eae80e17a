#!/usr/bin/env python3
"""Time series: some steps of a mesh, and one file a step.

Usage: series_test.py PATH_OF_SHM     (exit code 77, skipped, where VTK or NumPy is missing)
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
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError as missing:
    print(missing)
    sys.exit(77)

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import exodus_text, write_vtk

SHM = "shm"


class SeriesTest(FolderTest):
    def shm(self, *words, code=0, stderr=None):
        """Runs the tool in the folder of the test; what it prints."""
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
        """The same file as one that had no other steps, values of the whole mesh at each among it."""
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
        """Its sections list every step."""
        self.exodus("run.e", range(6))
        self.shm("convert", "run.e", "run.msh", "-q", stderr="not in")
        self.shm("convert", "run.msh", "some.msh", "-q", "--step", "2:5")
        self.assertEqual(self.times("some.msh"), [1, 1.5, 2])
        self.exodus("some.e", range(2, 5))
        self.shm("convert", "some.e", "expected.msh", "-q", stderr="not in")
        # Headers of views have the number of the step, which stays.
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
                            (["--step", "3:3"], "nothing in it; the mesh has steps 0:6"),
                            (["--step", "4:2"], "nothing in it"), (["--step=-1"], "first, last or A:B"),
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
    """What exodus_text() has there."""
    return [round((node % 97) * .01 * (v + 1) + step * (.5 + node % 5), 4) for node in range(27)]


class Files(SeriesTest):
    """A file for each step."""

    def listed(self, folder="."):
        return sorted(os.listdir(self.path(folder)))

    def assert_step(self, name, step):
        """As VTK reads it, which knows nothing of this program."""
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
                out = self.shm(*command, name, *words, stderr="which blocks")
                self.assertIn(f"{name % 0} to {name % 11}: 27 vertices, 8 hexahedra, ", out)
                self.assertIn("12 time steps", out)
                made = [name % step for step in range(12)]
                self.assertEqual(sorted(set(self.listed()) - set(before)), sorted(made))
                for step, file in enumerate(made):
                    self.assert_step(file, step)
                    os.remove(self.path(file))

    def test_some_steps(self):
        """Their numbers are those of the steps; other files stay as they are."""
        self.exodus("run.e", range(6))
        self.write("a_0000.vtu.bak", "old")
        self.write("a_000.vtu", "old")
        self.shm("convert", "run.e", "a_%04d.vtu", "-q", "--step", "2:4", stderr="which blocks")
        self.shm("convert", "run.e", "a_%04d.vtu", "-q", "--time", "2.5", "-f", stderr="which blocks")
        self.assertEqual(self.listed(), ["a_000.vtu", "a_0000.vtu.bak", "a_0002.vtu", "a_0003.vtu",
                                         "a_0005.vtu", "run.e"])
        for step in (2, 3, 5):
            self.assert_step(f"a_000{step}.vtu", step)

    def test_formats_that_hold_many(self):
        """Who asks for a file a step gets it."""
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
            self.shm("convert", "run.e", name, "-q", stderr="which blocks")
            self.assertEqual(self.collection(name),
                             [(step / 2, f"{stem}/{stem}_000{step}.vtu") for step in range(6)])
            folder = os.path.dirname(name)
            for step in range(6):
                self.assert_step(os.path.join(folder, stem, f"{stem}_000{step}.vtu"), step)
        self.shm("convert", "run.e", "run.pvd", "-q", "--step", "last", code=4, stderr="5 more of run.pvd")
        self.shm("convert", "run.e", "run.pvd", "-q", "-f", "--step", "last", stderr="which blocks")
        self.assertEqual(self.collection("run.pvd"), [(2.5, "run/run_0005.vtu")])
        self.shm("convert", "run.e", "x.pvd", "--format", "vtk", code=2, stderr="of VTU files")
        self.write("y", "a file")
        self.shm("convert", "run.e", "y.pvd", code=4, stderr="y: is no folder")

    def test_nothing_is_lost(self):
        """What is there, what is read, what the files would lack: all of it is known before."""
        self.exodus("run.e", range(6))
        self.shm("convert", "run.e", "a_%d.vtu", "--strict", code=6, stderr="global variables")
        self.shm("convert", "run.e", "a_%d_%d.vtu", code=2, stderr="one %d")
        self.shm("convert", "run.e", "a_%s_%d.vtu", code=2, stderr="one %d")
        self.shm("convert", "run.e", "a_%999d.vtu", code=2, stderr="one %d")
        self.shm("convert", "run.e", "no/a_%d.vtu", code=4, stderr="no folder no")
        self.assertEqual(self.listed(), ["run.e"])
        self.write("a_7.vtu", "of another series")
        self.write("a_3.vtu", "of another series")
        self.shm("convert", "run.e", "a_%d.vtu", code=4, stderr="a_3.vtu: is there already and 1 more of")
        os.link(self.path("run.e"), self.path("b_2.e"))
        self.shm("convert", "run.e", "b_%d.e", "-f", code=4, stderr="same file as run.e")
        os.mkdir(self.path("c_4.e"))
        self.shm("convert", "run.e", "c_%d.e", "-f", code=4, stderr="c_4.e: is a folder")
        self.assertEqual(self.listed(), ["a_3.vtu", "a_7.vtu", "b_2.e", "c_4.e", "run.e"])
        # A percent sign alone names one file.
        self.shm("convert", "run.e", "50%.e", "-q")
        self.shm("convert", "run.e", "50%%.e", "-q")
        self.assertEqual(self.listed()[:2], ["50%%.e", "50%.e"])


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
