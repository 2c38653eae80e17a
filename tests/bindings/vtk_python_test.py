#!/usr/bin/env python3
"""The reader and the writer of VTK's pipelines.

    vtk_python_test.py LIBSHMFORMAT_C.SO SHM        SHM: path of the tool

Arrays are VTK's own and outlive the reader; arrays that are switched off are not read; steps, pieces and
blocks are those of the file. Unstructured grids of the corpus (SHM_CORPUS) are what VTK reads itself.
"""
import gc
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkFiltersGeneral import vtkWarpVector

ROOT = Path(__file__).resolve().parents[2]
LIBRARY, SHM = (str(Path(path).resolve()) for path in sys.argv[1:3])
del sys.argv[1:3]
os.environ["SHMFORMAT_LIBRARY"] = LIBRARY
sys.path.insert(0, str(ROOT / "bindings" / "python"))
import shmformat  # noqa: E402
import shmformat.vtk  # noqa: E402
from vtk_corpus import corpus, unstructured_grids  # noqa: E402


class Vtk(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def bar(self, **more):
        """A bar of 50 hexahedra with an array of points, one of cells, and one at steps."""
        x = np.repeat(np.arange(51), 4) * .1
        corner = np.tile(np.arange(4), 51)
        self.points = np.column_stack([x, (corner == 1) | (corner == 2), corner >= 2]).astype(np.float64)
        self.cells = np.arange(50)[:, None] * 4 + np.arange(8)
        shmformat.write(self.path("bar.shm"), self.points, self.cells, point_data={"v": self.points, "same": x},
                        cell_data={"n": np.arange(50), "same": np.arange(50.),
                                   "t": {0: np.zeros(50), 2: np.full(50, 2.)}}, step_times=[0, .5, 1], **more)
        return self.path("bar.shm")

    def read(self, name, **more):
        reader = shmformat.vtk.Reader(**more)
        reader.SetFileName(name)
        reader.Update()
        return reader

    def test_arrays_are_vtks_and_outlive_the_reader(self):
        reader = self.read(self.bar())
        grid = reader.GetOutput()
        del reader
        gc.collect()
        junk = [np.full(2000, 7.) for _ in range(2000)]  # memory that was NumPy's would be overwritten
        self.assertTrue(np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), self.points))
        self.assertTrue(np.array_equal(vtk_to_numpy(grid.GetCells().GetConnectivityArray()), self.cells.reshape(-1)))
        self.assertTrue(np.array_equal(vtk_to_numpy(grid.GetCellData().GetArray("n")), np.arange(50)))
        self.assertTrue(np.array_equal(vtk_to_numpy(grid.GetPointData().GetArray("same")), self.points[:, 0]))
        self.assertTrue(np.array_equal(vtk_to_numpy(grid.GetCellData().GetArray("same")), np.arange(50)))
        self.assertFalse(vtk_to_numpy(grid.GetCellData().GetArray("block")).any())
        self.assertEqual(grid.GetBounds(), (0, 5, 0, 1, 0, 1))
        self.assertEqual(len(junk), 2000)

    def test_it_is_a_part_of_a_pipeline(self):
        reader = shmformat.vtk.Reader()
        reader.SetFileName(self.bar())
        warp = vtkWarpVector()
        warp.SetInputConnection(reader.GetOutputPort())
        warp.SetInputArrayToProcess(0, 0, 0, 0, "v")
        warp.Update()
        self.assertEqual(warp.GetOutput().GetBounds(), (0, 10, 0, 2, 0, 2))

    def test_steps_are_chosen_by_time(self):
        reader = shmformat.vtk.Reader()
        reader.SetFileName(self.bar())
        reader.UpdateInformation()
        information = reader.GetOutputInformation(0)
        times = [information.Get(Pipeline.TIME_STEPS(), i) for i in range(information.Length(Pipeline.TIME_STEPS()))]
        self.assertEqual(times, [0, .5, 1])
        for time, expected in ((0, 0), (1, 2), (7, 2), (.7, None), (-1, 0)):
            reader.UpdateTimeStep(time)
            grid = reader.GetOutput()
            array = grid.GetCellData().GetArray("t")
            self.assertEqual(array is None, expected is None, time)  # there are no values at step 1
            if array is not None:
                self.assertEqual(array.GetValue(0), expected)
            self.assertEqual(grid.GetInformation().Get(grid.DATA_TIME_STEP()), max(t for t in times if t <= max(time, 0)))

    def test_arrays_that_are_switched_off_are_not_read(self):
        reader = shmformat.vtk.Reader()
        reader.SetFileName(self.bar())
        reader.UpdateInformation()
        points, cells = reader.GetPointDataArraySelection(), reader.GetCellDataArraySelection()
        self.assertEqual([cells.GetArrayName(i) for i in range(cells.GetNumberOfArrays())], ["n", "same", "t"])
        points.DisableAllArrays()
        cells.DisableArray("same")
        reader.Update()
        self.assertEqual(reader.GetOutput().GetPointData().GetNumberOfArrays(), 0)
        self.assertIsNone(reader.GetOutput().GetCellData().GetArray("same"))
        points.EnableArray("v")  # and the pipeline notices
        reader.Update()
        self.assertEqual(reader.GetOutput().GetPointData().GetNumberOfArrays(), 1)

    def test_pieces_are_segments_and_make_the_whole(self):
        source = self.path("many.vtk")
        grid = self.read(self.bar()).GetOutput()
        writer = shmformat.vtk.Writer()
        writer.SetFileName(source.replace(".vtk", ".shm"))
        writer.SetInputData(grid)
        writer.Write()
        done = subprocess.run([SHM, "compress", "-f", "--segment-cells", "12", source.replace(".vtk", ".shm"), "-o",
                               self.path("segments.shm")], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(len(shmformat.open(self.path("segments.shm")).segments), 3)
        for pieces in (1, 2, 3, 9):
            numbers = []
            for piece in range(pieces):
                reader = shmformat.vtk.Reader()
                reader.SetFileName(self.path("segments.shm"))
                reader.UpdatePiece(piece, pieces, 0)
                array = reader.GetOutput().GetCellData().GetArray("n")
                numbers += vtk_to_numpy(array).tolist() if reader.GetOutput().GetNumberOfCells() else []
            self.assertEqual(numbers, list(range(50)), pieces)

    def test_blocks_and_sets_are_parts(self):
        sets = [shmformat.Set("node", 3, "left", np.array([0, 1, 2, 3])),
                shmformat.Set("element", 4, "", np.array([5, 7]))]
        out = self.read(self.bar(sets=sets), blocks=True).GetOutput()
        names = [out.GetMetaData(i).Get(out.NAME()) for i in range(out.GetNumberOfPartitionedDataSets())]
        self.assertEqual(names, ["block 1", "left", "element set 4"])
        parts = [out.GetPartition(i, 0) for i in range(3)]
        self.assertEqual([part.GetNumberOfCells() for part in parts], [50, 4, 2])
        self.assertEqual(parts[1].GetBounds(), (0, 0, 0, 1, 0, 1))
        self.assertEqual(vtk_to_numpy(parts[2].GetCellData().GetArray("n")).tolist(), [5, 7])

    def test_polyhedra_have_their_faces(self):
        grid = self.read(str(ROOT / "tests" / "golden" / "0.10" / "polyhedra.shm")).GetOutput()
        kinds = [grid.GetCellType(i) for i in range(grid.GetNumberOfCells())]
        self.assertIn(42, kinds)
        cell = grid.GetCell(kinds.index(42))
        self.assertGreaterEqual(cell.GetNumberOfFaces(), 4)
        self.assertGreater(min(cell.GetFace(i).GetNumberOfPoints() for i in range(cell.GetNumberOfFaces())), 2)

    def test_what_is_written_comes_back(self):
        first = self.read(str(ROOT / "tests" / "golden" / "0.10" / "mixed_cells.shm")).GetOutput()
        writer = shmformat.vtk.Writer()
        writer.SetFileName(self.path("a.shm"))
        writer.SetInputData(first)
        self.assertGreater(writer.Write(), 100)
        self.same(first, self.read(self.path("a.shm")).GetOutput())
        writer.Write()  # replaces, as VTK's writers do
        polyhedra = self.read(str(ROOT / "tests" / "golden" / "0.10" / "polyhedra.shm")).GetOutput()
        writer.SetInputData(polyhedra)
        with self.assertRaises(ValueError):
            writer.Write()

    def same(self, a, b):
        """Points, cells, and all arrays of the first."""
        self.assertEqual(vtk_to_numpy(a.GetPoints().GetData()).tobytes(), vtk_to_numpy(b.GetPoints().GetData()).tobytes())
        types = vtk_to_numpy(a.GetCellTypesArray())
        # Some writers say the linear type of cells of second order: .shm files say what they are.
        differs = types != vtk_to_numpy(b.GetCellTypesArray())
        sizes = np.diff(vtk_to_numpy(a.GetCells().GetOffsetsArray()))
        linear = np.zeros(256, int)
        linear[[3, 5, 9, 10, 12, 13, 14]] = 2, 3, 4, 4, 8, 6, 5
        self.assertFalse((differs & ((linear[types] == 0) | (sizes == linear[types]))).any())
        for get in ("GetOffsetsArray", "GetConnectivityArray"):
            self.assertTrue(np.array_equal(*(vtk_to_numpy(getattr(grid.GetCells(), get)()) for grid in (a, b))), get)
        fields = 0
        for one, other in ((a.GetPointData(), b.GetPointData()), (a.GetCellData(), b.GetCellData())):
            for i in range(one.GetNumberOfArrays()):
                array = one.GetArray(i)
                if array is None or not array.GetName() or one.GetArray(array.GetName()) is not array:
                    continue  # strings; of several of a name the first
                back = other.GetArray(array.GetName())
                self.assertIsNotNone(back, array.GetName())
                if back.GetDataTypeSize() == array.GetDataTypeSize():
                    self.assertEqual(vtk_to_numpy(array).tobytes(), vtk_to_numpy(back).tobytes(), array.GetName())
                    fields += 1
        return fields

    def test_corpus_files_are_what_vtk_reads(self):
        if not corpus():
            self.skipTest("SHM_CORPUS names no folder")
        compared = fields = 0
        for source, grid in unstructured_grids(SHM, self.path("a.shm")):
            if set(np.unique(vtk_to_numpy(grid.GetCellTypesArray())).tolist()) & {8, 11}:
                continue  # pixels and voxels: .shm files have quads and hexahedra
            with self.subTest(source=source.name):
                fields += self.same(grid, self.read(self.path("a.shm")).GetOutput())
                compared += 1
        self.assertGreater(compared, 20)
        self.assertGreater(fields, 30)


if __name__ == "__main__":
    unittest.main()
