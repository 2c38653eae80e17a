#!/usr/bin/env python3
"""Tests error messages. An invalid command line or a faulty file must result in an error message of one line
that names the error.

Usage: words_test.py PATH_OF_SHM
"""
import os
import re
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import exodus_text, write_vtk

SHM = "shm"

# Pairs of a wrong command line and a part of the expected message.
WRONG_CALLS = [
    ("extract mesh.shm out.vtk --step -1", "must be N, first, last or A:B"),
    ("extract mesh.shm out.vtk --step 1.5", "must be N, first, last or A:B"),
    ("convert mesh.vtk out.msh --step -1", "must be N, first, last or A:B"),
    ("decompress mesh.shm -o out.msh --step 99999999999999999999", "must be N, first, last or A:B"),
    ("compress mesh.vtk --delay -1", "--delay: '-1' is not a whole number"),
    ("append mesh.shm mesh.vtk --step -1", "must be N, first, last or A:B"),
    ("append mesh.shm mesh.vtk --time soon", "--time = soon is not a number"),
    ("compress mesh.vtk --segment-cells 0", "'0' is not a whole number of at least 1"),
    ("compress mesh.vtk --key-steps 0", "'0' is not a whole number of at least 1"),
    ("compress mesh.vtk --bits 99", "'99' is not a whole number from 1 to 52"),
    ("compress mesh.vtk --delay=-1", "'-1' is not a whole number from 0 to 1048576"),
    ("compress mesh.vtk --threads 0", "'0' is not a whole number from 1 to 1024"),
    ("compress mesh.vtk --restart-budget 101", "'101' is not a number from 0 to 100"),
    ("compress mesh.vtk --order fast", "'fast' is not keep, stream or free"),
    ("compress mesh.vtk --level 10x", "'10x' is not fast, default or best"),
    ("compress mesh.vtk --memory much", "'much' is not a size such as 512M"),
    ("compress mesh.vtk --memory -1M", "'-1M' is not a size such as 512M"),
    ("compress mesh.vtk --memory 10", "10 bytes are too few; the minimum is 1M"),
    ("diff mesh.vtk mesh.vtk --limit -1", "'-1' is not a whole number of at least 0"),
]

# For files that no command can read: name, contents, and a part of the expected message.
UNREAD_FILES = [
    ("beam.cgns", b"@(#)ADF Database Version B02012>", "is a CGNS file, which cannot be read; supported formats: Exodus, "),
    ("beam.h5", b"\x89HDF\r\n\x1a\n" + bytes(700) + b"HDF5 MotherNode" + bytes(99), "is a CGNS file"),
    ("words.txt", b"some words\n", "is not a mesh in a supported format: Exodus, VTK legacy, "),
]


class WordsTest(FolderTest):
    def setUp(self):
        super().setUp()
        write_vtk(self.path("mesh.vtk"), 4)
        self.run_tool("compress", "mesh.vtk", "-o", "mesh.shm", "-q")

    def run_tool(self, *words, code=0):
        done = subprocess.run([SHM, *words], cwd=self.directory.name, capture_output=True, text=True,
                              timeout=120)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stderr}")
        return done.stdout if code == 0 else done.stderr

    def expect_line(self, words, code, line):
        text = self.run_tool(*words, code=code)
        self.assertIn(line, text)
        self.assertEqual(len(text.splitlines()), 1, text)

    def test_wrong_calls(self):
        for call, line in WRONG_CALLS:
            with self.subTest(call=call):
                self.expect_line(call.split(), 2, line)

    def test_files_that_are_not_read(self):
        for name, content, line in UNREAD_FILES:
            with self.subTest(name=name), open(self.path(name), "wb") as file:
                file.write(content)
                file.flush()
                self.expect_line(["info", name], 3, line)
        self.expect_line(["verify", "mesh.vtk"], 3, "is not a .shm file; use shm compress to create one")
        self.expect_line(["split", "mesh.shm"], 3, "is not an archive of several files made by shm join")

    def test_netcdf_that_is_not_exodus(self):
        self.need("ncgen")
        text = self.write("a.cdl", "netcdf a { dimensions: d = 3 ; variables: int x(d) ; }")
        for kind, name in (("classic", "a netCDF"), ("nc4", "an HDF5")):
            subprocess.run(["ncgen", "-k", kind, "-o", self.path("a.nc"), text], check=True)
            self.expect_line(["info", "a.nc"], 3,
                             f"a.nc: is {name} file, but not an Exodus file: it lacks dimension")

    def test_no_more_is_read_than_there_is(self):
        """Bytes that are read twice count once."""
        text = self.run_tool("extract", "mesh.shm", "out.vtk")
        read, size = map(int, re.search(r"read (\d+) of (\d+) bytes", text).groups())
        self.assertEqual(size, os.path.getsize(self.path("mesh.shm")))
        self.assertTrue(size // 2 < read <= size, text)

    def test_damage_is_told_in_ranges(self):
        self.need("ncgen")
        text = self.write("a.cdl", exodus_text(range(40), 4))
        subprocess.run(["ncgen", "-k", "64-bit-offset", "-o", self.path("a.e"), text], check=True)
        self.run_tool("compress", "a.e", "-o", "a.shm", "--segment-cells", "20")
        with open(self.path("a.shm"), "rb") as file:
            whole = bytearray(file.read())
        for at in range(len(whole) // 3, len(whole) * 3 // 4):
            whole[at] ^= 0x5a
        with open(self.path("hurt.shm"), "wb") as file:
            file.write(whole)
        text = self.run_tool("verify", "hurt.shm", code=3)
        self.assertRegex(text, r"damaged in \d\d\d places\n")
        self.assertLess(len(text.splitlines()), 10, text)
        self.assertRegex(text, r"step values of point/p at steps \d+ to \d+, bytes \d+-\d+: \d+ chunks")
        done = subprocess.run([SHM, "repair", self.path("hurt.shm"), "-o", self.path("rest.shm")],
                              capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 7)
        self.assertLess(len(done.stdout.splitlines()), 10, done.stdout)
        self.assertRegex(done.stdout, r"values of point/p at steps \d+ to 39 of (\d+ to )?\d+ vertices")


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
