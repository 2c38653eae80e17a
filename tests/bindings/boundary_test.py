#!/usr/bin/env python3
"""Checks that the boundary surface found by the library equals the result of VTK's vtkGeometryFilter, for
generated meshes and for the corpus.

  boundary_test.py LIBSHMFORMAT_C.SO SHM [--all]      SHM: path of the tool; SHM_CORPUS: folder of the corpus

Only the small files of the corpus are read; with --all, every file is read. Faces are compared as sets of
vertices, without the second-order nodes of cells. VTK's filter differs from the library in two ways: it hides
a face if another cell of any dimension contains all vertices of the face, and it counts a cell that contains
a vertex twice as two cells. The test accepts that VTK does not return a face only if one of these
differences explains it, and if exactly one cell has this face.
"""
import os
import subprocess
import sys
import tempfile
import unittest
from collections import defaultdict
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
LIBRARY, SHM = (str(Path(path).resolve()) for path in sys.argv[1:3])
del sys.argv[1:3]
ALL = "--all" in sys.argv
if ALL:
    sys.argv.remove("--all")
os.environ["SHMFORMAT_LIBRARY"] = LIBRARY
sys.path[:0] = [str(Path(__file__).resolve().parent), str(ROOT / "bindings" / "python")]
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy  # noqa: E402
from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints  # noqa: E402
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid  # noqa: E402
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter  # noqa: E402

import shmformat  # noqa: E402
from vtk_corpus import corpus  # noqa: E402

MOST_BYTES = 1 << 17
# For each shape: the type number of VTK's linear cell and the number of its corners.
LINEAR = {"vertex": (1, 1), "line": (3, 2), "triangle": (5, 3), "quad": (9, 4), "tetrahedron": (10, 4), "hexahedron": (12, 8),
          "wedge": (13, 6), "pyramid": (14, 5)}
SIDES = {"tetrahedron": ((0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)),
         "pyramid": ((0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (0, 3, 2, 1)),
         "wedge": ((0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)),
         "hexahedron": ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7))}
POLYGON, POLYHEDRON = 7, 42


def faces_of(nodes):
    """Returns the faces of a polyhedron. `nodes` lists the faces one after the other, each with its first
    vertex repeated at its end. Returns an empty list if `nodes` does not have this form."""
    faces, at = [], 0
    while at < len(nodes):
        if nodes[at] not in nodes[at + 1:]:
            return []
        end = nodes.index(nodes[at], at + 1)
        faces.append(nodes[at:end])
        at = end + 1
    return faces


class Grid:
    """The cells of a mesh, as a VTK grid and as lists of corners. Cells without a geometry are omitted."""

    def __init__(self, mesh):
        cells = mesh.cells
        shapes = [block.shape for block in mesh.blocks]
        self.cells = []  # shape and corners; for polyhedra all nodes
        self.grid = vtkUnstructuredGrid()
        points = vtkPoints()
        points.SetData(numpy_to_vtk(mesh.points, deep=True))
        self.grid.SetPoints(points)
        numbers = numpy_to_vtk(np.arange(len(mesh.points)), deep=True)
        numbers.SetName("number")
        self.grid.GetPointData().AddArray(numbers)
        for first, end, block in zip(cells.offsets.tolist(), cells.offsets[1:].tolist(), cells.blocks.tolist()):
            self._add(shapes[block], cells.connectivity[first:end].tolist())

    def _add(self, shape, nodes):
        if shape == "faces":
            faces = faces_of(nodes)
            if not faces:
                return
            stream = vtkIdList()
            for number in [len(faces), *(word for face in faces for word in (len(face), *face))]:
                stream.InsertNextId(number)
            self.grid.InsertNextCell(POLYHEDRON, stream)
        elif shape == "polygon" and len(nodes) >= 3:
            self.grid.InsertNextCell(POLYGON, len(nodes), nodes)
        elif shape in LINEAR and len(nodes) >= LINEAR[shape][1]:
            kind, count = LINEAR[shape]
            nodes = nodes[:count]
            self.grid.InsertNextCell(kind, count, nodes)
        else:
            return
        self.cells.append((shape, nodes))

    def boundary(self):
        """Returns the faces that VTK's filter finds, as sets of vertices."""
        if not self.cells:
            return set()
        chosen = vtkGeometryFilter()
        chosen.SetInputData(self.grid)
        chosen.MergingOff()
        chosen.Update()
        found = chosen.GetOutput()
        if not found.GetNumberOfCells():
            return set()
        numbers = vtk_to_numpy(found.GetPointData().GetArray("number"))
        faces = set()
        for kind in (found.GetVerts(), found.GetLines(), found.GetPolys(), found.GetStrips()):
            offsets, corners = (vtk_to_numpy(array) for array in (kind.GetOffsetsArray(), kind.GetConnectivityArray()))
            faces.update(frozenset(numbers[corners[first:end]].tolist()) for first, end in zip(offsets, offsets[1:]))
        return faces

    def sides(self, cell):
        """Returns the sides of a cell as sets of vertices. Omits pairs of sides that have the same
        vertices."""
        shape, nodes = self.cells[cell]
        cycles = faces_of(nodes) if shape == "faces" else [[nodes[at] for at in side] for side in SIDES.get(shape, ())]
        odd = set()
        for cycle in cycles:
            odd ^= {frozenset(cycle)}
        return odd

    def reasons(self, faces):
        """`faces` are faces that VTK does not return. For each of them, yields two truth values: whether the
        face belongs to exactly one volume cell, and whether VTK's filter hides such a face."""
        at = defaultdict(list)
        wanted = {vertex for face in faces for vertex in face}
        for cell, (_, nodes) in enumerate(self.cells):
            for vertex in wanted.intersection(nodes):
                at[vertex].append(cell)
        for face in faces:
            around = [cell for cell in at[min(face)] if face <= set(self.cells[cell][1])]
            twice = any(len(set(nodes)) < len(nodes) for vertex in face for cell in at[vertex]
                        for shape, nodes in [self.cells[cell]] if shape != "faces")
            yield sum(face in self.sides(cell) for cell in around) == 1, len(around) > 1 or twice


def faces_in(found):
    corners = found.vertex_numbers[found.connectivity].tolist()
    offsets = found.offsets.tolist()
    return [corners[first:end] for first, end in zip(offsets, offsets[1:])]


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.packed = Path(folder.name) / "run.shm"

    def compare(self, path):
        """Compares the boundary of a file with VTK's result. Returns the number of faces."""
        with shmformat.open(path) as mesh:
            found = mesh.boundary()
            grid = Grid(mesh)
            np.testing.assert_array_equal(found.points, mesh.points[found.vertex_numbers])
        faces = faces_in(found)
        self.assertEqual(found.left_out, mesh._info.cells - len(grid.cells))
        ours, theirs = {frozenset(face) for face in faces}, grid.boundary()
        self.assertEqual(theirs - ours, set())
        for alone, is_hidden in grid.reasons(ours - theirs):
            self.assertTrue(alone and is_hidden)
        return len(faces)


class Made(Case):
    def made(self, points, blocks):
        """Writes a mesh with these blocks. Each block is a pair (shape, cells)."""
        cells = [np.array(rows) for _, rows in blocks]
        offsets = np.concatenate([[0], np.cumsum(np.concatenate([np.full(len(rows), rows.shape[1]) for rows in cells]))])
        types = np.concatenate([np.full(len(rows), LINEAR[shape][0], np.uint8) for (shape, _), rows in zip(blocks, cells)])
        of_cells = np.concatenate([np.full(len(rows), at, np.uint32) for at, rows in enumerate(cells)])
        listed = [shmformat.Block(at + 1, "", shape, rows.shape[1], len(rows))
                  for at, ((shape, _), rows) in enumerate(zip(blocks, cells))]
        shmformat.write(self.packed, points, shmformat.Cells(offsets, np.concatenate([rows.reshape(-1) for rows in cells]),
                                                             types, of_cells), blocks=listed, replace=True)
        return self.packed

    def test_shapes_beside_each_other(self):
        x, y, z = np.meshgrid(np.arange(4.), np.arange(3.), np.arange(3.), indexing="ij")
        points = np.column_stack([x.reshape(-1), y.reshape(-1), z.reshape(-1)])

        def corners(i, j, k):
            return [(i + a) * 9 + (j + b) * 3 + k + c for a, b, c in
                    ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))]

        cubes = [corners(i, j, k) for i in range(3) for j in range(2) for k in range(2)]
        part = {"hexahedron": [(0, 1, 2, 3, 4, 5, 6, 7)], "wedge": [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)],
                "pyramid": [(0, 1, 2, 3, 6), (0, 4, 5, 1, 6), (0, 3, 7, 4, 6)],
                "tetrahedron": [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)],
                "quad": [(0, 1, 2, 3)], "triangle": [(0, 1, 2)], "line": [(0, 1)], "vertex": [(5,)]}
        blocks = [(shape, [[cube[i] for i in at] for cube in cubes[n::len(part)] for at in cells])
                  for n, (shape, cells) in enumerate(part.items())]
        self.assertGreater(self.compare(self.made(points, blocks)), 50)

    def test_a_cell_that_stands_three_times(self):
        points = np.array([[i & 1 ^ (i >> 1 & 1), i >> 1 & 1, i >> 2] for i in range(8)], float)
        self.assertEqual(self.compare(self.made(points, [("hexahedron", [list(range(8))] * 3)])), 0)
        self.assertEqual(self.compare(self.made(points, [("hexahedron", [list(range(8))])])), 6)

    def test_sides_look_outward(self):
        """If all cells have a positive volume, the volume enclosed by the boundary must be the sum of their volumes."""
        subprocess.run([Path(SHM).with_name("shm_make_mesh"), "tets", "500", self.packed.with_suffix(".vtk"), "--fields",
                        "none"], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([SHM, "compress", "-q", self.packed.with_suffix(".vtk"), "-o", self.packed], check=True)
        with shmformat.open(self.packed) as mesh:
            found = mesh.boundary()
            cells = mesh.points[mesh.cells.connectivity.reshape(-1, 8)].astype(float)
        quads = found.points[found.connectivity.reshape(-1, 4)].astype(float)

        def within(q):  # 6 times the volume
            return sum(np.einsum("...i,...i", q[..., 0, :], np.cross(q[..., a, :], q[..., a + 1, :])).sum() for a in (1, 2))

        self.assertGreater(within(quads), 0)
        self.assertAlmostEqual(within(quads), within(cells[:, np.array(SIDES["hexahedron"])]), 6)


class Corpus(Case):
    def test_faces_are_those_of_vtk(self):
        if corpus() is None:
            self.skipTest("SHM_CORPUS names no folder")
        compared = faces = 0
        for source in sorted(corpus().glob("*/*")):
            if not source.is_file() or (source.stat().st_size > MOST_BYTES and not ALL):
                continue
            subprocess.run([SHM, "compress", "--level", "fast", "-f", str(source), "-o", str(self.packed)], check=True,
                           stdout=subprocess.DEVNULL)
            with self.subTest(file=source.name):
                faces += self.compare(self.packed)
            compared += 1
        self.assertGreater(compared, 100 if ALL else 15)
        self.assertGreater(faces, 1000)


if __name__ == "__main__":
    unittest.main()
