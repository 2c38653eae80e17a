#!/usr/bin/env python3
"""Time series: some steps of a mesh, and one file a step.

Usage: series_test.py PATH_OF_SHM
"""
import json
import os
import subprocess
import sys
import unittest

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


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
