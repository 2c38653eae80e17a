#!/usr/bin/env python3
"""Tests shm without sufficient memory. If an allocation fails, or if it and all later allocations fail, the
tool must either end with exit code 5 and a message, or produce the same result as with enough memory.

Usage: scarce_memory_test.py PATH_OF_SHM PATH_OF_SCARCE_MEMORY
"""
import glob
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import tell

SHM = SCARCE = None
# Number of tested failures while a command is executed, for each command and each kind of failure. In each
# test, a different allocation is the first one that fails.
FALLS = 24
# Commands that are also tested with failing allocations in C libraries. Commands that use netCDF and HDF5 are
# not in the list, because these two libraries crash if an allocation fails.
WITHOUT_NETCDF = {"compress", "decompress", "info", "verify", "against", "convert", "diff", "extract", "join", "split",
                  "damaged", "repair", "layout", "preview", "many"}

CUBES = """# vtk DataFile Version 3.0
cubes
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 12 float
0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0
0 0 1 1 0 1 2 0 1 0 1 1 1 1 1 2 1 1
CELLS 2 18
8 0 1 4 3 6 7 10 9
8 1 2 5 4 7 8 11 10
CELL_TYPES 2
12 12
POINT_DATA 12
SCALARS heat float 1
LOOKUP_TABLE default
1 2 3 4 5 6 7 8 9 10 11 12
"""


class ScarceMemory(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        with open(self.path("a.vtk"), "w", encoding="ascii") as out:
            out.write(CUBES)
        self.run_tool("compress", "a.vtk", "-o", "a.shm", "-q")
        self.run_tool("convert", "a.vtk", "a.vtu", "-q")
        self.run_tool("join", "-o", "both.shm", "a.shm", "a.vtk", "-q")
        with open(self.path("a.shm"), "rb") as file:
            damaged = bytearray(file.read())
        damaged[len(damaged) // 2] ^= 1
        with open(self.path("damaged.shm"), "wb") as out:
            out.write(damaged)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run_tool(self, *words, **scarce):
        environment = {**os.environ, "LD_PRELOAD": SCARCE, **{name: str(value) for name, value in scarce.items()}}
        return subprocess.run([SHM, *words], cwd=self.folder.name, env=environment, capture_output=True, timeout=120)

    def count(self, *words, **scarce):
        """Runs a command. Returns the number of allocations, the exit code, and the output."""
        done = self.run_tool(*words, SHM_COUNT=self.path("count"), **scarce)
        with open(self.path("count"), encoding="ascii") as file:
            return int(file.read()), done.returncode, done.stdout, self.outputs()

    def outputs(self):
        """Returns the written files, and removes them."""
        found = {}
        for path in glob.glob(self.path("out*")):
            with open(path, "rb") as file:
                found[os.path.basename(path)] = file.read()
            os.remove(path)
        return found

    def check(self, name, *words):
        kinds = [{}, {"SHM_FOR_GOOD": 1}]
        if name in WITHOUT_NETCDF:
            kinds += [{"SHM_MALLOC": 1}, {"SHM_MALLOC": 1, "SHM_FOR_GOOD": 1}]
        start, *_ = self.count("--version")
        refused = right = 0
        for scarce in kinds:
            total, code, text, written = self.count(*words, **scarce)
            self.assertIn(code, (0, 3), name)
            self.assertGreater(total, start)
            # In a few runs, the first failure occurs while the tool starts; in most runs, it occurs while the
            # tool executes the command.
            places = {start * k // 6 for k in range(6)}
            places |= {start + (total - start) * k // FALLS for k in range(FALLS)} | {total - 1}
            for allowed in sorted(places):
                done = self.run_tool(*words, SHM_ALLOCATIONS=allowed, **scarce)
                outputs = self.outputs()
                with self.subTest(name, allowed=allowed, of=total, **scarce):
                    if done.returncode == 5:
                        refused += 1
                        self.assertIn(b"shm: ", done.stderr)
                        self.assertEqual({key: value for key, value in outputs.items() if value != written.get(key)}, {})
                        continue
                    self.assertEqual(done.returncode, code, done.stderr[-500:])
                    self.assertEqual(done.stdout, text)
                    self.assertEqual(outputs, written)
                    right += 1
        self.assertGreater(refused, 10, name)
        tell("scarce", commands=1, refused=refused, right=right)
        self.assertEqual(glob.glob(self.path(".*")), [])

    def test_each_command(self):
        for name, words in {
            "compress": ("compress", "a.vtk", "-o", "out.shm", "-q"),
            "decompress": ("decompress", "a.shm", "-o", "out.vtk"),
            "info": ("info", "-v", "a.shm"),
            "verify": ("verify", "a.shm", "-T", "1"),
            "against": ("verify", "a.shm", "--against", "a.vtk"),
            "convert": ("convert", "a.shm", "out.vtu"),
            "diff": ("diff", "a.vtk", "a.vtu", "--no-extras"),
            "extract": ("extract", "a.shm", "out.msh", "--cells", "0:1"),
            "join": ("join", "-o", "out.shm", "a.shm", "a.vtk", "-q"),
            "split": ("info", "both.shm"),
            "damaged": ("verify", "damaged.shm"),
            "repair": ("repair", "a.shm", "-o", "out.shm"),
            "layout": ("layout", "a.shm", "-o", "out.svg"),
            "preview": ("preview", "a.shm", "-o", "out.png", "--size", "32x32"),
            "many": ("info", "a.shm", "both.shm", "a.vtk"),
            "manual": ("manual",),
            "wrong": ("info", "nothing"),
        }.items():
            self.check(name, *words)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    SCARCE, SHM = os.path.abspath(sys.argv.pop()), os.path.abspath(sys.argv.pop())
    unittest.main()
