#!/usr/bin/env python3
"""Tests the Python package: data is returned as NumPy arrays, and meshes that are written and read again are
unchanged.

  python_test.py LIBSHMFORMAT_C.SO SHM        SHM: path of the tool

Other tests check the data itself: the golden tests compare it with the output of shm_text, and
corpus_readers_test.py compares it with the data of other readers. This test checks the shape, type and
owner of arrays, the number of bytes read from a source, and errors.
"""
import gc
import io
import os
import re
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "golden" / "0.10"
LIBRARY, SHM = (str(Path(path).resolve()) for path in sys.argv[1:3])
del sys.argv[1:3]
os.environ["SHMFORMAT_LIBRARY"] = LIBRARY
sys.path.insert(0, str(ROOT / "bindings" / "python"))
import shmformat  # noqa: E402


def bar(cells):
    """Returns the points and hexahedra of a bar."""
    x = np.repeat(np.arange(cells + 1), 4) * .1
    corner = np.tile(np.arange(4), cells + 1)
    points = np.column_stack([x, (corner == 1) | (corner == 2), corner >= 2]).astype(np.float64)
    return points, (np.arange(cells)[:, None] * 4 + np.arange(8)).astype(np.int32)


class Counted(io.BytesIO):
    """A file that counts the bytes read from it."""
    given = 0

    def read(self, *arguments):
        some = super().read(*arguments)
        self.given += len(some)
        return some


class FolderTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return Path(self.folder.name) / name


class Reading(FolderTest):
    def test_arrays_belong_to_numpy_and_outlive_the_file(self):
        with shmformat.open(GOLDEN / "steps_and_extras.shm") as mesh:
            points, cells, values = mesh.points, mesh.cells, mesh.cell_data["p"][1]
            for array in (points, cells.offsets, cells.connectivity, cells.types, cells.blocks, values):
                self.assertTrue(array.flags.owndata and array.flags.c_contiguous and array.flags.writeable)
            self.assertIs(mesh.points, points)
            self.assertIsNot(mesh.cell_data["p"][1], values)
        gc.collect()
        self.assertEqual(points.shape, (36, 3))
        self.assertEqual(len(cells), 12)
        self.assertEqual(cells.offsets[-1], len(cells.connectivity))
        self.assertTrue((cells.types == 12).all())
        with self.assertRaises(ValueError):
            mesh.verify()

    def test_out_is_filled_itself(self):
        with shmformat.open(GOLDEN / "steps_and_extras.shm") as mesh:
            into = np.zeros((36, 3), np.float32)
            numbers = np.zeros(96, np.uint64)
            field = np.zeros(12, np.float32)
            result = mesh.read(cell_data=["p", "n"], step=3, out={"points": into, "connectivity": numbers, "p": field})
            self.assertIs(result.points, into)
            self.assertIs(result.cells.connectivity, numbers)
            self.assertIs(result.cell_data["p"], field)
            self.assertTrue(np.array_equal(into, mesh.points.astype(np.float32)))
            self.assertTrue(np.array_equal(numbers, mesh.cells.connectivity))
            self.assertTrue(np.array_equal(field, mesh.cell_data["p"][3]))
            with self.assertRaises(ValueError):
                mesh.read(out={"points": np.zeros((35, 3))})
            with self.assertRaises(ValueError):
                mesh.read(out={"points": np.zeros((36, 6))[:, ::2]})
            with self.assertRaises(ValueError):
                mesh.read(out={"none": into})
            with self.assertRaises(ValueError):
                mesh.read(cell_data=["p"])  # the step is missing
            with self.assertRaises(shmformat.Error) as caught:
                mesh.read(out={"points": np.zeros((36, 3), np.int64)})
            self.assertEqual(caught.exception.code, "misuse")

    def test_memory_of_the_caller_is_filled_where_it_is(self):
        """The package writes directly into arrays that the caller supplies, even if they are parts of larger
        arrays; the rest of the larger arrays is unchanged. All other arrays own their memory, and
        share it with no other array."""
        data = (GOLDEN / "steps_and_extras.shm").read_bytes()
        with shmformat.open(data) as mesh:
            room, values = np.full((72, 3), 7.), np.full((4, 12), 7, np.float32)
            result = mesh.read(cell_data=["p"], step=1, out={"points": room[18:54], "p": values[2]})
            self.assertTrue(np.shares_memory(result.points, room) and np.shares_memory(result.cell_data["p"], values))
            self.assertTrue(np.array_equal(room[18:54], mesh.points) and np.array_equal(values[2], mesh.cell_data["p"][1]))
            self.assertTrue((room[:18] == 7).all() and (room[54:] == 7).all() and (values[[0, 1, 3]] == 7).all())
            part, cells = mesh.select(cells=(2, 9)), mesh.cells
            own = [mesh.points, cells.offsets, cells.connectivity, cells.types, cells.blocks, mesh.cell_data["p"][1],
                   mesh.cell_data["p"][1], part.points, part.cells.connectivity, part.cell_numbers, part.vertex_numbers,
                   mesh.step_times, *(one.numbers for one in mesh.sets), *(extra.values for extra in mesh.extras)]
        for i, array in enumerate(own):
            base = array if array.base is None else array.base  # the memory of a reshaped array belongs to its base
            self.assertTrue(base.flags.owndata and array.flags.writeable, i)
            self.assertFalse(np.shares_memory(array, np.frombuffer(data, np.uint8)), i)
            for other in own[:i]:
                self.assertFalse(np.shares_memory(array, other), i)

    def hundred_arrays(self, steps):
        """Writes a file with a hundred cell arrays, each with 4000 incompressible bytes per step. Returns the
        path of the file and the values of one array."""
        points, cells = bar(500)  # with fewer cells, a chunk would contain several steps
        values = np.random.default_rng(2).random((100, steps, 500))
        shmformat.write(self.path("a.shm"), points, cells, step_times=np.arange(float(steps)), level="fast",
                        cell_data={f"a{i}": dict(enumerate(own)) for i, own in enumerate(values)})
        return self.path("a.shm"), values[50]

    def test_one_step_of_one_array_takes_its_own_bytes(self):
        """The index and the schema are read only once, when the file is opened."""
        made, values = self.hundred_arrays(4)
        subprocess.run([SHM, "compress", "-q", "--level", "fast", "--key-steps", "1", made, "-o", self.path("b.shm")],
                       check=True)
        source = Counted(self.path("b.shm").read_bytes())
        mesh = shmformat.open(source)
        opened = source.given
        self.assertLess(opened, 4096)
        self.assertTrue(np.array_equal(mesh.cell_data["a50"][2], values[2]))
        self.assertLess(source.given, opened + 4000 + 256)  # plus chunk headers of the mesh
        for step in (3, 1):
            before = source.given
            self.assertTrue(np.array_equal(mesh.cell_data["a50"][step], values[step]))
            self.assertLess(source.given - before, 4000)
        self.assertLess(source.given, len(source.getvalue()) / 50)

    def test_steps_that_refer_to_others_take_those_of_their_array(self):
        made, values = self.hundred_arrays(10)
        source = Counted(made.read_bytes())
        mesh = shmformat.open(source)
        for step in (7, 9):  # one step in eight is coded without reference to other steps
            before = source.given
            self.assertTrue(np.array_equal(mesh.cell_data["a50"][step], values[step]))
            self.assertLess(source.given - before, 8 * 4000)

    def test_a_chunk_of_several_steps_is_read_once(self):
        points, cells = bar(50)
        values = np.random.default_rng(4).random((40, 50))
        shmformat.write(self.path("a.shm"), points, cells, cell_data={"u": dict(enumerate(values))}, level="fast")
        source = Counted(self.path("a.shm").read_bytes())
        mesh = shmformat.open(source)
        for step in range(40):
            self.assertTrue(np.array_equal(mesh.cell_data["u"][step], values[step]))
        self.assertLess(source.given, 1.5 * len(source.getvalue()))

    def test_steps_are_those_that_have_values(self):
        with shmformat.open(GOLDEN / "steps_and_extras.shm") as mesh:
            steps = mesh.cell_data["p"]
            self.assertEqual(list(steps), [0, 1, 3])
            self.assertEqual(len(steps), 3)
            self.assertEqual(mesh.step_times.tolist(), [0, .5, 1, 2])
            with self.assertRaises(KeyError):
                steps[2]
            with self.assertRaises(KeyError):
                mesh.point_data["none"]

    def test_pieces_and_the_whole_take_turns(self):
        points, cells = bar(50)
        numbers = np.arange(50)
        self.assertGreater(shmformat.write(self.path("bar.shm"), points, cells, cell_data={"n": numbers}), 100)
        with shmformat.open(self.path("bar.shm")) as mesh:
            some = mesh.select(cells=(10, 20))
            near = mesh.select(box=(0, 0, 0, .55, 1, 1))
            for _ in range(2):
                self.assertEqual((mesh.cell_count, some.cell_count, near.cell_count), (50, 10, 6))
                self.assertEqual(some.cell_data["n"].tolist(), list(range(10, 20)))
                self.assertEqual(near.cell_data["n"].tolist(), list(range(6)))
                self.assertEqual(mesh.cell_data["n"].tolist(), list(range(50)))
            self.assertEqual(some.cell_numbers.tolist(), list(range(10, 20)))
            self.assertTrue(np.array_equal(mesh.points[some.vertex_numbers], some.points))
            self.assertTrue(np.array_equal(some.vertex_numbers[some.cells.connectivity],
                                           mesh.cells.connectivity[80:160]))
            self.assertEqual(mesh.select(cells=(0, 0)).cell_count, 0)
            self.assertEqual(mesh.select(blocks=[0]).cell_count, 50)
            self.assertEqual(mesh.select(numbers=[7, 3, 7]).cell_data["n"].tolist(), [3, 7])
            self.assertEqual(mesh.select(numbers=[]).cell_count, 0)

    def test_paths_bytes_and_file_objects_are_the_same(self):
        data = (GOLDEN / "keep.shm").read_bytes()
        points = shmformat.open(str(GOLDEN / "keep.shm")).points
        for source in (data, bytearray(data), memoryview(data), io.BytesIO(data)):
            self.assertTrue(np.array_equal(shmformat.open(source).points, points))

    def test_archives_are_mappings(self):
        with shmformat.open(GOLDEN / "archive.shm") as archive:
            self.assertIsInstance(archive, shmformat.Archive)
            meshes = {name: archive[name] for name in archive}
        self.assertGreater(len(meshes), 1)
        for mesh in meshes.values():  # a mesh remains usable after its archive is closed
            self.assertEqual(len(mesh.points), mesh.vertex_count)

    def test_cells_and_vertices_may_be_limited(self):
        cells = shmformat.open(GOLDEN / "keep.shm").cell_count
        shmformat.open(GOLDEN / "keep.shm", max_cells=cells, max_vertices=1000)
        for limit in ({"max_cells": cells - 1}, {"max_vertices": 1}):
            with self.assertRaises(shmformat.Error) as caught:
                shmformat.open(GOLDEN / "keep.shm", **limit)
            self.assertEqual(caught.exception.code, "over limit")
        with shmformat.open(GOLDEN / "archive.shm", max_vertices=1) as archive, self.assertRaises(shmformat.Error):
            archive[next(iter(archive))]
        with self.assertRaises(ValueError):
            shmformat.open(GOLDEN / "keep.shm", max_cells=0)

    def test_errors_say_what_and_where(self):
        with self.assertRaises(shmformat.Error) as caught:
            shmformat.open(self.path("none.shm"))
        self.assertEqual(caught.exception.code, "io")
        self.assertIn("none.shm", str(caught.exception))
        data = bytearray((GOLDEN / "keep.shm").read_bytes())
        data[150] ^= 1
        with self.assertRaises(shmformat.Error) as caught:
            shmformat.open(data).verify()
        self.assertEqual(caught.exception.code, "corrupt")
        self.assertTrue(caught.exception.section)
        self.assertIsInstance(caught.exception.offset, int)

    def test_what_a_source_raises_is_the_cause(self):
        class Broken(io.BytesIO):
            broken = False

            def read(self, *arguments):
                if self.broken:
                    raise OSError("the line is dead")
                return super().read(*arguments)

        source = Broken((GOLDEN / "keep.shm").read_bytes())
        mesh = shmformat.open(source)
        source.broken = True
        with self.assertRaises(shmformat.Error) as caught:
            mesh.read()
        self.assertIsInstance(caught.exception.__cause__, OSError)
        self.assertIn("the line is dead", str(caught.exception))
        with self.assertRaises(shmformat.Error) as caught:
            shmformat.open(source)
        self.assertIsInstance(caught.exception.__cause__, OSError)

    def test_progress_may_end_a_run(self):
        mesh = shmformat.open(GOLDEN / "keep.shm")
        told = []
        mesh.verify(told.append)
        self.assertEqual(told[-1], 1)
        self.assertEqual(told, sorted(told))

        def enough(done):
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            mesh.read(progress=enough)
        self.assertEqual(len(mesh.points), 36)

    def test_what_ends_the_program_is_no_error(self):
        class Broken(io.BytesIO):
            def read(self, *arguments):
                raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            shmformat.open(Broken((GOLDEN / "keep.shm").read_bytes()))

    def test_a_mesh_that_is_read_is_left_alone(self):
        mesh = shmformat.open(GOLDEN / "keep.shm")
        part = mesh.select(cells=(0, 2))
        with self.assertRaises(shmformat.Error) as caught:
            mesh.read(progress=lambda done: part.cell_count)
        self.assertIn("busy", str(caught.exception))
        with self.assertRaises(ValueError):
            mesh.read(progress=lambda done: mesh.close())
        self.assertEqual(len(mesh.points), 36)

    def test_a_selection_that_fails_leaves_the_others(self):
        mesh = shmformat.open(GOLDEN / "keep.shm")
        points = mesh.points
        with self.assertRaises(shmformat.Error):
            mesh.select(cells=(0, 10**9)).points
        self.assertEqual(len(mesh.cells), 12)
        self.assertTrue(np.array_equal(mesh.read(cells=False).points, points))

    def test_a_closed_mesh_knows_its_arrays(self):
        with shmformat.open(GOLDEN / "steps_and_extras.shm") as mesh:
            pass
        self.assertEqual(list(mesh.cell_data), ["p", "n"])
        self.assertEqual(mesh.cell_data.role("p"), "")
        self.assertEqual(mesh.source_format, "")

    def test_looking_for_a_name_decodes_nothing(self):
        class Counting(io.BytesIO):
            reads = 0

            def read(self, *arguments):
                Counting.reads += 1
                return super().read(*arguments)

        mesh = shmformat.open(Counting((GOLDEN / "steps_and_extras.shm").read_bytes()))
        steps = mesh.cell_data["p"]
        before = Counting.reads
        self.assertTrue("p" in mesh.cell_data and "q" not in mesh.cell_data and 3 in steps and 2 not in steps)
        self.assertEqual(Counting.reads, before)

    def test_other_threads_run_meanwhile(self):
        points, cells = bar(20000)
        values = np.sin(np.arange(len(points)))
        shmformat.write(self.path("bar.shm"), points, cells, point_data={"v": values})
        mesh, turns, done = shmformat.open(self.path("bar.shm")), [], threading.Event()

        def count():
            while not done.is_set():
                turns.append(1)
                done.wait(.0005)

        other = threading.Thread(target=count)
        other.start()
        before = len(turns)
        for _ in range(5):
            mesh.read(point_data=["v"])
        during = len(turns) - before
        done.set()
        other.join()
        self.assertGreater(during, 5)


class Boundary(FolderTest):
    def faces(self, found):
        return [tuple(found.vertex_numbers[found.connectivity[first:end]]) for first, end in zip(found.offsets, found.offsets[1:])]

    def test_it_has_the_faces_of_a_bar(self):
        points, hexahedra = bar(5)
        shmformat.write(self.path("bar.shm"), points, hexahedra, point_data={"u": points * 2, "i": np.arange(24, dtype=np.int16)},
                        cell_data={"p": np.arange(5.) * .5})
        with shmformat.open(self.path("bar.shm")) as mesh:
            found = mesh.boundary(point_data=["i", "u"], cell_data=["p"])
            alone = mesh.boundary()
        for array in (found.points, found.offsets, found.connectivity, found.vertex_numbers, found.cell_numbers, found.blocks,
                      found.sides, *found.point_data.values(), *found.cell_data.values()):
            self.assertTrue(array.flags.owndata and array.flags.c_contiguous and array.flags.writeable)
        self.assertEqual(len(found), 22)
        self.assertEqual(found.left_out, 0)
        self.assertEqual(sorted(found.vertex_numbers), list(range(24)))
        np.testing.assert_array_equal(found.points, points[found.vertex_numbers])
        np.testing.assert_array_equal(found.point_data["u"], points[found.vertex_numbers] * 2)
        np.testing.assert_array_equal(found.point_data["i"], found.vertex_numbers)
        np.testing.assert_array_equal(found.cell_data["p"], found.cell_numbers * .5)
        self.assertEqual([sum(found.cell_numbers == c) for c in range(5)], [5, 4, 4, 4, 5])
        side = ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7))
        for face, cell, number in zip(self.faces(found), found.cell_numbers, found.sides):
            self.assertEqual(set(face), set(hexahedra[cell][list(side[number - 1])]))
        self.assertEqual(self.faces(alone), self.faces(found))
        self.assertEqual((alone.point_data, alone.cell_data), ({}, {}))

    def test_pieces_have_their_own(self):
        points, hexahedra = bar(9)
        shmformat.write(self.path("bar.shm"), points, hexahedra)
        with shmformat.open(self.path("bar.shm")) as mesh:
            piece = mesh.select(cells=(3, 5))
            found = piece.boundary()
            self.assertEqual(len(found), 10)
            self.assertEqual(sorted(set(found.cell_numbers)), [3, 4])
            self.assertEqual(sorted(found.vertex_numbers), list(range(12, 24)))
            self.assertEqual(len(mesh.boundary(threads=2)), 38)  # `mesh` is not restricted by the selection of `piece`
            self.assertEqual(len(piece.boundary()), 10)

    def test_values_at_steps(self):
        with shmformat.open(GOLDEN / "steps_and_extras.shm") as mesh:
            found = mesh.boundary(cell_data=["p", "n"], step=3)
            np.testing.assert_array_equal(found.cell_data["p"], mesh.cell_data["p"][3][found.cell_numbers])
            np.testing.assert_array_equal(found.cell_data["n"], mesh.cell_data["n"][3][found.cell_numbers])
            with self.assertRaises(ValueError):
                mesh.boundary(cell_data=["p"])
            with self.assertRaises(KeyError):
                mesh.boundary(point_data=["none"])
            with self.assertRaises(shmformat.Error) as raised:
                mesh.boundary(cell_data=["p"], step=77)
            self.assertEqual(raised.exception.code, "misuse")
            with self.assertRaises(shmformat.Error) as raised:
                mesh.boundary(max_bytes=100)
            self.assertEqual(raised.exception.code, "over limit")

    def test_progress_may_end_it(self):
        with shmformat.open(GOLDEN / "steps_and_extras.shm") as mesh:
            told = []
            mesh.boundary(progress=told.append)
            self.assertEqual(told[-1], 1)
            with self.assertRaises(ZeroDivisionError):
                mesh.boundary(progress=lambda done: 1 / 0)


class Readme(FolderTest):
    def test_its_example_runs(self):
        text = (ROOT / "README.md").read_text(encoding="utf-8")
        code = re.search(r"```python\n(.*?)```", text, re.S)[1]
        self.assertLessEqual(code.count("\n"), 5)
        points, cells = bar(50)
        shmformat.write(self.path("run.shm"), points, cells, point_data={"u": points})
        done = subprocess.run([sys.executable, "-c", code], cwd=self.folder.name, capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": str(ROOT / "bindings" / "python")}, check=False)
        self.assertEqual((done.stdout, done.stderr), ("(204, 3) 50 ['u']\n", ""))
        self.assertEqual(shmformat.open(self.path("part.shm")).cell_count, 11)


class Writing(FolderTest):
    def test_what_is_written_comes_back(self):
        points, cells = bar(40)
        values = np.random.default_rng(1).random((164, 3))
        steps = {s: np.full(40, s, np.float32) for s in (0, 2)}
        sets = [shmformat.Set("node", 4, "left", np.array([0, 1, 2, 3])),
                shmformat.Set("side", 5, "", np.array([7, 9]), sides=np.array([5, 6])),
                shmformat.Set("element", 6, "all", np.array([], int), blocks=np.array([0]))]
        extras = [shmformat.Extra("demo/corners", np.array([[3, 1], [2, 0]]), "vertices")]
        for order in ("keep", "stream"):
            target = io.BytesIO()
            size = shmformat.write(target, points, cells, point_data={"v": values, "t": values[:, 0]},
                                   cell_data={"p": steps}, step_times=[0, 1, 2], sets=sets, extras=extras,
                                   order=order, level="best", source_format="demo")
            self.assertEqual(size, len(target.getvalue()))
            mesh = shmformat.open(target)
            if order == "keep":
                self.assertTrue(np.array_equal(mesh.points, points))
                self.assertTrue(np.array_equal(mesh.cells.connectivity.reshape(-1, 8), cells))
                self.assertTrue(np.array_equal(mesh.extras[-1].values, extras[0].values))
            # Whatever the order, each corner of a cell has the same coordinates and the same value as in the
            # input.
            self.assertTrue(np.array_equal(mesh.points[mesh.cells.connectivity], points[cells.reshape(-1)]))
            self.assertTrue(np.array_equal(mesh.point_data["v"][mesh.cells.connectivity], values[cells.reshape(-1)]))
            self.assertEqual(mesh.point_data["t"].shape, (164,))
            self.assertEqual({s: mesh.cell_data["p"][s].tolist() for s in mesh.cell_data["p"]},
                             {s: v.tolist() for s, v in steps.items()})
            self.assertEqual(mesh.source_format, "demo")
            self.assertRegex(mesh.digest, "^[0-9a-f]{16}$")
            again = io.BytesIO()
            shmformat.write(again, mesh.points, mesh.cells.connectivity.reshape(-1, 8),
                            point_data={name: mesh.point_data[name] for name in ("v", "t")},
                            cell_data={"p": dict(mesh.cell_data["p"])}, step_times=[0, 1, 2], level="fast")
            self.assertEqual(shmformat.open(again).digest, mesh.digest)  # although order and level differ
            back = mesh.sets
            self.assertEqual([(s.kind, s.id, s.name) for s in back], [(s.kind, s.id, s.name) for s in sets])
            self.assertEqual(back[1].sides.tolist(), [5, 6])
            self.assertEqual(back[2].blocks.tolist(), [0])
            self.assertTrue(np.array_equal(mesh.points[back[0].numbers], points[[0, 1, 2, 3]]))

    def test_data_of_the_mesh_and_of_sets(self):
        points, cells = bar(40)
        sets = [shmformat.Set("node", 1, "", np.arange(4)), shmformat.Set("node", 2, "", np.arange(9)),
                shmformat.Set("side", 5, "", np.array([7, 9]), sides=np.array([5, 6])),
                shmformat.Set("element", 6, "", np.array([3]))]
        steps = (0, 1, 3)
        data = {"global_data": {"energy": {s: np.array([s * 1.5]) for s in steps},
                                "count": {s: np.array([s, 7], np.int32) for s in steps}},
                "node_set_data": {"force": {s: np.arange(39.).reshape(13, 3) * s for s in steps}},
                "side_set_data": {"flux": {s: np.array([s, .5]) for s in steps}},
                "element_set_data": {"damage": {s: np.array([s], np.float32) for s in steps}}}

        def same(mesh, steps):
            for kind, arrays in data.items():
                found = getattr(mesh, kind)
                self.assertEqual(list(found), list(arrays))
                for name, values in arrays.items():
                    self.assertEqual(list(found[name]), list(steps))
                    self.assertIsNone(found.on_sets(name))
                    for step in steps:
                        self.assertEqual(found[name][step].tolist(), values[step].tolist(), (name, step))

        def part(of):
            return {kind: {name: {s: values[s] for s in of} for name, values in arrays.items()}
                    for kind, arrays in data.items()}

        for order in ("keep", "stream"):
            path = self.path(order + ".shm")
            shmformat.write(path, points, cells, sets=sets, step_times=[0, 1], order=order, **part((0, 1)))
            same(shmformat.open(path), (0, 1))
            shmformat.append(path, step_times=[0, 1, 2, 3], **part((3,)))
            mesh = shmformat.open(path)
            same(mesh, steps)
            same(mesh.select(cells=(3, 5)), steps)  # a selection has all of them
            self.assertEqual(list(mesh.point_data) + list(mesh.cell_data), [])
        with shmformat.open(GOLDEN / "steps_beside_mesh.shm") as mesh:
            self.assertEqual(mesh.node_set_data.on_sets("pressure"), [0, 7])
            self.assertEqual(mesh.side_set_data["flux"][2].shape, (25, 2))
            self.assertEqual(mesh.side_set_data["flux"][2][0, 1], -1)
            self.assertEqual(list(mesh.element_set_data["damaged"]), [0, 1, 3, 4])

    def test_cells_of_several_blocks_go_in_as_they_came_out(self):
        with shmformat.open(GOLDEN / "every_shape.shm") as mesh:
            shmformat.write(self.path("again.shm"), mesh.points, mesh.cells, blocks=mesh.blocks)
            again = shmformat.open(self.path("again.shm"))
            for name in ("offsets", "connectivity", "types", "blocks"):
                self.assertTrue(np.array_equal(getattr(again.cells, name), getattr(mesh.cells, name)), name)
            self.assertEqual(again.blocks, mesh.blocks)

    def test_bounds_are_kept_and_told(self):
        points, cells = bar(100)
        values = np.sin(np.arange(404.) / 9)
        shmformat.write(self.path("a.shm"), points, cells, point_data={"v": values}, errors={"v": 1e-3},
                        coordinate_error=1e-4)
        mesh = shmformat.open(self.path("a.shm"))
        self.assertLessEqual(np.abs(mesh.point_data["v"] - values).max(), 1e-3)
        self.assertLessEqual(np.abs(mesh.points - points).max(), 1e-4)
        self.assertEqual(mesh.point_data.error("v"), 1e-3)
        self.assertEqual(mesh.coordinate_error, 1e-4)
        shmformat.write(self.path("b.shm"), points, cells, point_data={"v": values}, relative_errors={"v": .01})
        mesh = shmformat.open(self.path("b.shm"))
        self.assertLessEqual((np.abs(mesh.point_data["v"] - values) - .01 * np.abs(values)).max(), 0)
        self.assertFalse(np.array_equal(mesh.point_data["v"], values))
        self.assertEqual((mesh.point_data.error("v"), mesh.point_data.relative_error("v")), (0, .01))
        holes = np.where(np.arange(404) % 7 == 0, 9.97e36, values)
        shmformat.write(self.path("d.shm"), points, cells, point_data={"v": holes}, errors={"v": 1e-3},
                        fills={"v": [9.97e36, -9999]})
        mesh = shmformat.open(self.path("d.shm"))
        self.assertEqual(mesh.point_data.fills("v"), (9.97e36, -9999))
        self.assertTrue(np.array_equal(mesh.point_data["v"] == 9.97e36, holes == 9.97e36))
        self.assertLessEqual(np.abs(mesh.point_data["v"] - holes).max(), 1e-3)
        for wrong in ({"relative_errors": {"v": .75}}, {"relative_errors": {"v": .1}, "errors": {"v": .1}},
                      {"fills": {"v": [np.nan]}}, {"fills": {"v": [1] * 17}}):
            with self.assertRaises(shmformat.Error):
                shmformat.write(self.path("c.shm"), points, cells, point_data={"v": values}, **wrong)

    def test_steps_are_appended(self):
        points, cells = bar(20)
        path = self.path("bar.shm")
        steps = {s: np.full(20, float(s)) for s in range(4)}
        shmformat.write(path, points, cells, cell_data={"p": {0: steps[0]}}, step_times=[0])
        shmformat.append(path, cell_data={"p": {s: steps[s] for s in (1, 3)}}, step_times=[0, 1, 2, 3])
        mesh = shmformat.open(path)
        self.assertEqual({s: mesh.cell_data["p"][s].tolist() for s in mesh.cell_data["p"]},
                         {s: steps[s].tolist() for s in (0, 1, 3)})
        self.assertEqual(mesh.step_times.tolist(), [0, 1, 2, 3])
        before = path.read_bytes()
        with self.assertRaises(shmformat.Error):
            shmformat.append(path, cell_data={"p": {2: steps[2]}})  # not after the last step
        with self.assertRaises(shmformat.Error):
            shmformat.append(path, cell_data={"p": {4: steps[2][:5]}})
        with self.assertRaises(KeyError):
            shmformat.append(path, cell_data={"q": {4: steps[2]}})
        self.assertEqual(path.read_bytes(), before)
        self.assertEqual(os.listdir(self.folder.name), ["bar.shm"])

    def test_nothing_is_replaced_unasked_and_nothing_half_done_stays(self):
        points, cells = bar(3)
        path = self.path("bar.shm")
        with self.assertRaises(shmformat.Error) as caught:
            shmformat.write(path, points, cells + 100)  # corners without a vertex
        self.assertEqual(caught.exception.code, "misuse")
        self.assertEqual(os.listdir(self.folder.name), [])
        shmformat.write(path, points, cells)
        with self.assertRaises(shmformat.Error) as caught:
            shmformat.write(path, points, cells)
        self.assertEqual(caught.exception.code, "output")
        shmformat.write(path, points[::-1].copy(), cells, replace=True)
        self.assertTrue(np.array_equal(shmformat.open(path).points, points[::-1]))

        class Full(io.BytesIO):
            def write(self, data):
                raise OSError("no room")

        with self.assertRaises(shmformat.Error) as caught:
            shmformat.write(Full(), points, cells)
        self.assertIsInstance(caught.exception.__cause__, OSError)

    def test_what_cannot_be_written_is_told(self):
        points, cells = bar(3)
        for wrong in (lambda: shmformat.write(io.BytesIO(), points[:, :2], cells),
                      lambda: shmformat.write(io.BytesIO(), points, cells[:, :7]),
                      lambda: shmformat.write(io.BytesIO(), points, cells, point_data={"v": np.zeros((16, 2, 2))})):
            self.assertRaises(ValueError, wrong)
        for wrong in (lambda: shmformat.write(io.BytesIO(), points, cells * 1.0),
                      lambda: shmformat.write(io.BytesIO(), points, cells, point_data={"v": np.zeros(16, complex)})):
            self.assertRaises(TypeError, wrong)
        with self.assertRaises(shmformat.Error):
            shmformat.write(io.BytesIO(), points, cells, point_data={"v": np.zeros(15)})
        with self.assertRaises(TypeError):  # fractions are not integers
            shmformat.write(io.BytesIO(), points, cells, cell_data={"v": {0: np.zeros(3, int), 1: np.full(3, .5)}})
        with self.assertRaises(ValueError):
            shmformat.write("a\0b", points, cells)

    def test_sinks_may_take_less_than_they_are_given(self):
        class Slow(io.RawIOBase):
            def __init__(self):
                self.data = bytearray()

            def write(self, data):
                self.data += bytes(data[:7])
                return min(len(data), 7)

        points, cells = bar(3)
        slow = Slow()
        self.assertEqual(shmformat.write(slow, points, cells), len(slow.data))
        shmformat.open(bytes(slow.data)).verify()


if __name__ == "__main__":
    unittest.main()
