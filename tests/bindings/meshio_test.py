#!/usr/bin/env python3
"""meshio with .shm files: meshes go in and come out, and are those that meshio's own readers give.

    meshio_test.py LIBSHMFORMAT_C.SO SHM        SHM: path of the tool
"""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import meshio
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
LIBRARY, SHM = (str(Path(path).resolve()) for path in sys.argv[1:3])
del sys.argv[1:3]
os.environ["SHMFORMAT_LIBRARY"] = LIBRARY
sys.path.insert(0, str(ROOT / "bindings" / "python"))
import shmformat  # noqa: E402
import shmformat.meshio  # noqa: E402

MOST_BYTES_OF_SOURCES = 1 << 20  # meshio takes long over larger ones


def sample():
    """Hexahedra, wedges and quads over the same points."""
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
        meshio.write(self.path("a.shm"), back)  # as meshio's writers do, it replaces

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
        wedge = [shmformat.Block(1, "", "wedge", 15, 1)]
        one = shmformat.Cells(np.array([0, 15]), np.arange(15), np.array([26], np.uint8), np.zeros(1, np.uint32))
        shmformat.write(self.path("wedge.shm"), np.random.default_rng(4).random((15, 3)), one, blocks=wedge)
        try:  # newer ones have such cells
            self.assertEqual(shmformat.meshio.read(self.path("wedge.shm")).cells[0].type, "wedge15")
        except meshio.ReadError as why:
            self.assertIn("wedge15", str(why))
        os.unlink(self.path("wedge.shm"))
        mesh = meshio.Mesh(np.zeros((64, 3)), [("hexahedron64", np.arange(64)[None, :])])
        with self.assertRaises(meshio.WriteError):
            meshio.write(self.path("a.shm"), mesh)
        self.assertEqual(os.listdir(self.folder.name), [])

    def test_corpus_files_are_what_meshio_reads(self):
        corpus = os.environ.get("SHM_CORPUS", "")
        if not os.path.isdir(corpus):
            self.skipTest("SHM_CORPUS names no folder")
        compared = 0
        for source in sorted(Path(corpus).rglob("*")):
            if source.suffix not in (".vtk", ".vtu") or source.stat().st_size > MOST_BYTES_OF_SOURCES:
                continue
            try:
                expected = meshio.read(source)
            except (Exception, SystemExit):  # what meshio cannot read nobody compares
                continue
            packed = self.path("packed.shm")
            done = subprocess.run([SHM, "compress", "--level", "fast", "-f", str(source), "-o", packed],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            with self.subTest(source=source.name):
                self.compare(expected, packed)
                compared += 1
        self.assertGreater(compared, 15)

    def compare(self, expected, packed):
        """Cells one by one: meshio makes blocks of types, and we of blocks and types."""
        back = meshio.read(packed)
        points = np.asarray(expected.points)
        self.assertEqual(back.points.astype(points.dtype).tobytes(), points.tobytes())

        def flat(mesh):
            return [(block.type, tuple(cell)) for block in mesh.cells for cell in block.data.tolist()]

        self.assertEqual(flat(back), flat(expected))


if __name__ == "__main__":
    unittest.main()
