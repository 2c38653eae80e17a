#!/usr/bin/env python3
"""Tests that meshes written to .shm files with meshio are read back unchanged. (corpus_readers_test.py tests
the meshes of the corpus.)

    meshio_test.py LIBSHMFORMAT_C.SO
"""
import os
import sys
import tempfile
import unittest
from pathlib import Path

import meshio
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = str(Path(sys.argv.pop(1)).resolve())
os.environ["SHMFORMAT_LIBRARY"] = LIBRARY
sys.path.insert(0, str(ROOT / "bindings" / "python"))
import shmformat  # noqa: E402
import shmformat.meshio  # noqa: E402


def sample():
    """Returns hexahedra, wedges and quads that use the same points."""
    points = np.random.default_rng(3).random((20, 3))
    cells = [("hexahedron", np.array([[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]])),
             ("wedge", np.array([[8, 9, 10, 12, 13, 14]])), ("quad", np.array([[12, 13, 14, 15]]))]
    return meshio.Mesh(points, cells, point_data={"v": points * 2, "t": points[:, 0]},
                       cell_data={"n": [np.array([1, 2]), np.array([3]), np.array([4])]},
                       point_sets={"some": np.array([3, 1])},
                       cell_sets={"few": [np.array([1]), np.array([0]), np.array([], int)]})


class Meshio(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def same(self, a, b):
        self.assertEqual(np.asarray(a.points, float).tobytes(), np.asarray(b.points, float).tobytes())
        self.assertEqual([c.type for c in a.cells], [c.type for c in b.cells])
        for one, other in zip(a.cells, b.cells):
            self.assertTrue(np.array_equal(one.data, other.data), one.type)

    def test_meshes_go_in_and_come_out(self):
        mesh = sample()
        meshio.write(self.path("a.shm"), mesh)
        back = meshio.read(self.path("a.shm"))
        self.same(mesh, back)
        for name, values in mesh.point_data.items():
            self.assertTrue(np.array_equal(values, back.point_data[name]))
        for one, other in zip(mesh.cell_data["n"], back.cell_data["n"]):
            self.assertTrue(np.array_equal(one, other))
        self.assertEqual(back.point_sets["some"].tolist(), [3, 1])
        self.assertEqual([group.tolist() for group in back.cell_sets["few"]], [[1], [0], []])
        meshio.write(self.path("a.shm"), back)  # replaces the file, as meshio's writers do

    def test_lagrange_cells_keep_their_order(self):
        points = np.random.default_rng(5).random((125 + 20, 3))
        cells = [("VTK_LAGRANGE_HEXAHEDRON", np.arange(125)[None, ::-1]), ("VTK_LAGRANGE_TETRAHEDRON", np.arange(125, 145)[None, :])]
        meshio.write(self.path("a.shm"), meshio.Mesh(points, cells))
        back = meshio.read(self.path("a.shm"))
        self.same(meshio.Mesh(points, cells), back)

    def test_a_step_can_be_chosen(self):
        points = np.zeros((8, 3))
        steps = {1: np.full(8, 1.), 4: np.full(8, 4.)}
        shmformat.write(self.path("a.shm"), points, np.arange(8)[None, :], point_data={"t": steps})
        self.assertEqual(meshio.read(self.path("a.shm")).point_data["t"][0], 1)
        self.assertEqual(shmformat.meshio.read(self.path("a.shm"), step=4).point_data["t"][0], 4)
        self.assertEqual(shmformat.meshio.read(self.path("a.shm"), step=2).point_data, {})

    def test_what_meshio_or_the_format_has_not_is_told(self):
        with self.assertRaises(meshio.ReadError):
            shmformat.meshio.read(ROOT / "tests" / "golden" / "0.10" / "polyhedra.shm")
        with self.assertRaises(meshio.ReadError):
            shmformat.meshio.read(ROOT / "tests" / "golden" / "0.10" / "archive.shm")
        bezier = [shmformat.Block(1, "", "hexahedron", 27, 1, "bezier")]  # meshio has names for these cells, but no dimension
        one = shmformat.Cells(np.array([0, 27]), np.arange(27), np.array([79], np.uint8), np.zeros(1, np.uint32))
        shmformat.write(self.path("bezier.shm"), np.random.default_rng(4).random((27, 3)), one, blocks=bezier)
        with self.assertRaisesRegex(meshio.ReadError, "VTK_BEZIER_HEXAHEDRON"):
            shmformat.meshio.read(self.path("bezier.shm"))
        os.remove(self.path("bezier.shm"))
        wedge = [shmformat.Block(1, "", "wedge", 15, 1)]
        one = shmformat.Cells(np.array([0, 15]), np.arange(15), np.array([26], np.uint8), np.zeros(1, np.uint32))
        shmformat.write(self.path("wedge.shm"), np.random.default_rng(4).random((15, 3)), one, blocks=wedge)
        try:  # newer versions of meshio support such cells
            self.assertEqual(shmformat.meshio.read(self.path("wedge.shm")).cells[0].type, "wedge15")
        except meshio.ReadError as why:
            self.assertIn("wedge15", str(why))
        os.unlink(self.path("wedge.shm"))
        mesh = meshio.Mesh(np.zeros((64, 3)), [("hexahedron64", np.arange(64)[None, :])])
        with self.assertRaises(meshio.WriteError):
            meshio.write(self.path("a.shm"), mesh)
        self.assertEqual(os.listdir(self.folder.name), [])


if __name__ == "__main__":
    unittest.main()
