#!/usr/bin/env python3
"""Tests --max-cells and --max-output: data that exceeds a limit is refused quickly, with exit code 5, and no
files remain.

Usage: limits_test.py PATH_OF_SHM
"""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest, tell
from sample_meshes import write_vtk

IMAGE = ("# vtk DataFile Version 3.0\nimage\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS {0} {0} {0}\n"
         "ORIGIN 0 0 0\nSPACING 1 1 1\n")
OVER = 5


class LimitsTest(FolderTest):
    timeout = 20

    def setUp(self):
        super().setUp()
        write_vtk(self.path("run.vtk"), 6)
        self.shm("compress", "run.vtk", "-q")
        data = bytearray(self.bytes("run.vtk.shm"))
        data[len(data) // 2] ^= 1
        with open(self.path("hurt.shm"), "wb") as hurt:
            hurt.write(data)
        self.before = sorted(os.listdir(self.directory.name))

    def refused(self, *words):
        text = self.shm(*words, code=OVER)
        self.assertRegex(text, b"the limit (of|is) ")
        self.assertEqual(sorted(os.listdir(self.directory.name)), self.before)
        tell("limit", refused=1)

    def test_all_that_decode(self):
        for words in (["verify", "run.vtk.shm"], ["decompress", "run.vtk.shm", "-o", "out.vtk"],
                      ["convert", "run.vtk.shm", "out.vtu"], ["convert", "run.vtk", "out.vtu"],
                      ["extract", "run.vtk.shm", "piece.shm", "--cells", "0:200"], ["diff", "run.vtk", "run.vtk.shm"],
                      ["repair", "hurt.shm", "-o", "whole.shm"], ["compress", "run.vtk", "-o", "out.shm"],
                      ["append", "run.vtk.shm", "run.vtk", "-o", "out.shm"], ["layout", "run.vtk.shm", "-o", "out.svg"],
                      ["join", "run.vtk", "-o", "out.shm"]):
            with self.subTest(words=words):
                self.refused(*words, "--max-cells", "100")

    def test_what_is_within_is_read(self):
        self.shm("verify", "run.vtk.shm", "--max-cells", "343", "--max-output", "1M")
        self.shm("extract", "run.vtk.shm", "piece.shm", "--cells", "0:10", "--max-cells", "100")
        self.shm("info", "run.vtk.shm", "--max-cells", "1")

    def test_bytes_of_numbers(self):
        write_vtk(self.path("large.vtk"), 30)
        self.shm("compress", "large.vtk", "-q")
        self.before = sorted(os.listdir(self.directory.name))
        for words in (["verify", "large.vtk.shm"], ["compress", "large.vtk", "-o", "out.shm"],
                      ["decompress", "large.vtk.shm", "-o", "out.vtk"], ["extract", "large.vtk.shm", "piece.shm", "--cells", "0:20000"]):
            with self.subTest(words=words):
                self.refused(*words, "--max-output", "1M")

    # These sources declare very many cells and points in a few bytes.
    def test_what_a_source_states(self):
        self.write("image.vtk", IMAGE.format(1000))
        self.before = sorted(os.listdir(self.directory.name))
        self.refused("compress", "image.vtk", "--max-cells", "1000000")
        self.write("points.vtu", '<VTKFile type="UnstructuredGrid"><UnstructuredGrid>'
                                 '<Piece NumberOfPoints="50000000" NumberOfCells="0"><Points/></Piece>'
                                 "</UnstructuredGrid></VTKFile>")
        self.before = sorted(os.listdir(self.directory.name))
        self.refused("compress", "points.vtu", "--max-cells", "1000000")


if __name__ == "__main__":
    LimitsTest.tool = os.path.abspath(sys.argv[1])
    unittest.main(argv=sys.argv[:1])
