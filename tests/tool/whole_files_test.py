#!/usr/bin/env python3
"""Tests files that bench/whole generates: round trips of a small file of each family, and the sizes of two
.shm files.

Usage: whole_files_test.py PATH_OF_SHM     (exit code 77, skipped, if NumPy or netCDF4 is missing)
"""
import os
import subprocess
import sys
import unittest
from pathlib import Path

TESTS = Path(__file__).resolve().parent.parent
sys.path += [str(TESTS / "support"), str(TESTS.parent / "bench")]
try:
    import netCDF4
    import numpy as np
    import whole_files
except ImportError as error:
    print(error)
    sys.exit(77)
from folder_test import FolderTest

SHM = "shm"

# Maximum sizes in bytes of two .shm files. They equal the current sizes; bench/whole prints the target sizes.
SIZES = {"hex1_arrays0.vtk": 390, "hex27_sets3_arrays3.e": 1660}
FEW_CELLS = 100


class WholeFilesTest(FolderTest):
    def there_and_back(self, path):
        """Checks a round trip of a file. Returns the size of the .shm file in bytes."""
        out = f"{path}.shm"
        subprocess.run([SHM, "compress", "-q", path, "-o", out], check=True)
        subprocess.run([SHM, "verify", "-q", out, "--against", path], check=True)
        return os.path.getsize(out)

    def written(self, some):
        return whole_files.write(some, Path(self.directory.name))

    def test_small_ones_of_each_family(self):
        some = [source for source in whole_files.sources()
                if source.cells <= FEW_CELLS and source.steps <= 1
                and (source.family != "tiny" or source.cells == 27)]
        self.assertEqual({source.family for source in some}, {"discontinuous", "tiny", "polyhedra"})
        for path in self.written(some):
            with self.subTest(path.name):
                self.there_and_back(path)

    def test_solutions_repeat(self):
        for family, kind, make in whole_files.REPEATING:
            with self.subTest(f"{family}, {kind}"):
                path = self.path(f"{family}_{kind}.e")
                whole_files.write_repeating(path, make, 2, (8, 3, 3), (3, 2))
                mesh = make((8, 3, 3))
                with netCDF4.Dataset(path) as file:
                    self.assertTrue(np.array_equal(file["connect1"][:] - 1, mesh.corners))
                    for name, like, sign in (("vals_nod_var1", mesh.node_like, mesh.node_sign),
                                             ("vals_nod_var3", mesh.node_like, 1),
                                             ("vals_elem_var2eb1", mesh.cell_like, 1)):
                        values = file[name][1]
                        alike = sign * values[like]
                        self.assertLess(len(np.unique(like)), len(like))
                        if mesh.rounded is None or "elem" in name:
                            self.assertTrue(np.array_equal(values, alike))
                        else:
                            self.assertFalse(np.array_equal(values, alike))
                            self.assertTrue(np.allclose(values, alike, rtol=1e-15, atol=0))
                self.there_and_back(path)

    def test_the_same_each_time(self):
        source = next(one for one in whole_files.sources() if one.name == "hex27_sets10_arrays3.e")
        first, = self.written([source])
        before = first.read_bytes()
        self.written([source])
        self.assertEqual(first.read_bytes(), before)

    def test_sizes(self):
        for path in self.written([one for one in whole_files.sources() if one.name in SIZES]):
            self.assertLessEqual(self.there_and_back(path), SIZES[path.name], path.name)


if __name__ == "__main__":
    SHM = sys.argv.pop(1)
    unittest.main()
