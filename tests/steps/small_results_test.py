#!/usr/bin/env python3
"""Checks that small result files need at most as many bytes as `xz -6` makes of them.

small_results_test.py SHM

The folder results contains these files, compressed by `xz -6`: one hexahedron with 200 arrays, once with values and
once with zeros; a symmetric tensor that is stored as nine components; equal arrays at many time steps.
"""
import lzma
import os
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))

from folder_test import FolderTest


class SmallResultsTest(FolderTest):
    def test_sizes(self):
        packed = sorted((HERE / "results").glob("*.xz"))
        self.assertEqual(len(packed), 4)
        for source in packed:
            mesh, out = self.path(source.stem), self.path("out.shm")
            data = lzma.decompress(source.read_bytes())
            with open(mesh, "wb") as file:
                file.write(data)
            sizes = {}
            for level in ("fast", "default", "best"):
                with self.subTest(source.name, level=level):
                    self.shm("compress", mesh, "-o", out, "-f", "--level", level)
                    self.shm("verify", out, "--against", mesh)
                    sizes[level] = os.path.getsize(out)
                    self.assertLessEqual(sizes[level], len(data))
                    if level != "fast":
                        self.assertLessEqual(sizes[level], source.stat().st_size)
            self.assertLessEqual(sizes["best"], sizes["default"])


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    SmallResultsTest.tool = os.path.abspath(sys.argv.pop())
    unittest.main()
