"""Tests the ParaView plugin: its reader must return the same data as ParaView's own reader of Exodus files.

    pvpython paraview_check.py FOLDER [--loaded]

FOLDER contains pairs of an Exodus file and its .shm file, such as `x.e` and `x.shm`. `two` and `run` are the meshes of
tests/support/sample_meshes.py. With --loaded, ParaView has already loaded the plugin. Without --loaded, this
script loads it by calling the plugin's function load(). scripts/test-paraview creates the files and runs this
script in both ways.
"""
import sys
import unittest
from pathlib import Path

import numpy as np
from paraview import simple
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader

FOLDER = Path(sys.argv[1]).resolve()
OUT = FOLDER / "out"
OUT.mkdir(exist_ok=True)

if "--loaded" not in sys.argv:
    import shmformat_paraview
    shmformat_paraview.load()
import shmformat  # noqa: E402  which the plugin finds


def output(proxy, time=None):
    proxy.UpdatePipeline(*([] if time is None else [time]))
    return proxy.GetClientSideObject().GetOutputDataObject(0)


def parts_of(collection):
    """Returns the grids of a partitioned data set collection as a dictionary. The key of a grid is (name
    of its group in the data assembly, name of the grid)."""
    assembly, parts = collection.GetDataAssembly(), {}
    for group in assembly.GetChildNodes(0, False):
        for node in assembly.GetChildNodes(group, False):
            for index in assembly.GetDataSetIndices(node):
                name = collection.GetMetaData(index).Get(collection.NAME())
                parts[assembly.GetNodeName(group), name] = collection.GetPartition(index, 0)
    return parts


def of_exodus(name):
    """Converts the names that ParaView's own reader gives to unnamed blocks and sets to the names that the
    plugin uses. The results are in lower case."""
    for theirs, own in (("block_", "block "), ("nodelist_", "node set "), ("surface_", "side set ")):
        if name.startswith(theirs) and name[len(theirs):].isdigit():
            return own + name[len(theirs):]
    return name.lower()


def arrays_of(data):
    arrays = [data.GetArray(i) for i in range(data.GetNumberOfArrays())]
    return {array.GetName(): vtk_to_numpy(array) for array in arrays if array is not None}


def shape_of(grid):
    """Returns (corners, points of cells, types of cells, corner offsets) of a grid. `points of cells`
    contains coordinates instead of point numbers, because readers number points differently."""
    if grid.GetNumberOfCells() == 0:
        return np.zeros(0, int), np.zeros((0, 3)), np.zeros(0), np.zeros(0)
    corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    return (corners, vtk_to_numpy(grid.GetPoints().GetData())[corners], vtk_to_numpy(grid.GetCellTypesArray()),
            vtk_to_numpy(grid.GetCells().GetOffsetsArray()))


def times_of(reader):
    """Returns the times of a reader as a list, even if ParaView returns a single time as a plain number."""
    return np.atleast_1d(reader.TimestepValues).tolist()


class Plugin(unittest.TestCase):
    def setUp(self):
        self.addCleanup(self.clean)

    @staticmethod
    def clean():
        for proxy in [*simple.GetRenderViews(), *simple.GetSources().values()]:
            simple.Delete(proxy)

    def opened(self, name):
        reader = simple.OpenDataFile(str(FOLDER / name))
        self.assertIsNotNone(reader, name)
        reader.UpdatePipelineInformation()
        return reader

    def all_sets(self, reader):
        for kind in ("NodeSets", "SideSets", "ElementSets"):
            names = reader.GetPropertyValue(f"{kind}Info") or []
            setattr(reader, kind, list(names[::2]))

    def same(self, own, theirs, what):
        """Checks that two grids have equal cells and equal values in all arrays that both have. Returns the
        number of compared arrays."""
        (corners, *shape), (their_corners, *their_shape) = shape_of(own), shape_of(theirs)
        for one, other in zip(shape, their_shape, strict=True):
            self.assertTrue(np.array_equal(one, other), what)
        self.assertEqual(own.GetNumberOfPoints(), theirs.GetNumberOfPoints())
        every_cell = np.arange(own.GetNumberOfCells())
        return (self.same_values(own.GetPointData(), theirs.GetPointData(), corners, their_corners, what) +
                self.same_values(own.GetCellData(), theirs.GetCellData(), every_cell, every_cell, what))

    def test_files_are_opened_by_their_name(self):
        reader = self.opened("two.shm")
        self.assertEqual(reader.SMProxy.GetXMLName(), "ShmReader")
        self.assertEqual(times_of(reader), [0, .5, 2])
        self.assertEqual([list(reader.PointArrays), list(reader.Blocks)], [["v_x", "v_y", "v_z"], ["steel", "air"]])

    def test_what_is_switched_off_is_not_there(self):
        reader = self.opened("two.shm")
        self.assertEqual(list(parts_of(output(reader))), [("element_blocks", "steel"), ("element_blocks", "air")])
        reader.PointArrays, reader.CellArrays, reader.Blocks = ["v_y"], [], ["air"]
        (air,) = parts_of(output(reader)).values()
        self.assertEqual(set(arrays_of(air.GetPointData())), {"v_y", "shm_vertex_number"})
        self.assertEqual(set(arrays_of(air.GetCellData())), {"block"})
        reader.PointArrays, reader.SideSets, reader.NodeSets, reader.Blocks = ["v_x"], ["inlet"], ["fixed"], []
        parts = parts_of(output(reader))
        self.assertEqual(list(parts), [("node_sets", "fixed"), ("side_sets", "inlet")])
        self.assertEqual([part.GetNumberOfCells() for part in parts.values()], [3, 2])
        self.assertIn("v_x", arrays_of(parts["side_sets", "inlet"].GetPointData()))
        reader.OneGrid = 1
        grid = output(reader)
        self.assertTrue(grid.IsA("vtkUnstructuredGrid"))
        self.assertEqual((grid.GetNumberOfCells(), grid.GetNumberOfPoints()), (2, 12))
        reader.OneGrid = 0
        self.assertEqual(len(parts_of(output(reader))), 2)

    def test_it_reads_what_paraview_reads_of_the_source(self):
        sources = sorted(FOLDER.glob("*.e"))
        self.assertGreaterEqual(len(sources), 2)
        compared = {"element_blocks": 0, "node_sets": 0, "side_sets": 0, "values": 0}
        for source in sources:
            with self.subTest(source=source.name):
                own, theirs = self.opened(source.stem + ".shm"), self.opened(source.name)
                theirs.ApplyDisplacements = 0
                self.assertEqual(times_of(own), times_of(theirs))
                self.all_sets(own)
                for kind in ("NodeSet", "SideSet"):
                    names = theirs.GetPropertyValue(f"{kind}Info") or []
                    setattr(theirs, f"{kind}s", list(names[::2]))
                for time in times_of(own)[:3] or [None]:
                    expected, found = (parts_of(output(reader, time)) for reader in (theirs, own))
                    expected = {(group, of_exodus(name)): part for (group, name), part in expected.items()}
                    found = {(group, name.lower()): part for (group, name), part in found.items()}
                    self.assertEqual(set(found), set(expected))
                    for key, part in found.items():
                        compared[key[0]] += 1
                        compared["values"] += self.same(part, expected[key], key)
        for what, count in compared.items():
            self.assertGreaterEqual(count, 3, what)

    def same_values(self, own, theirs, at, at_theirs, what):
        """Compares all variables of the source. .shm files store the components of vectors as separate arrays."""
        found, compared = arrays_of(own), 0
        for name, values in arrays_of(theirs).items():
            if name in ("ids", "object_id", "element_side", "shm_vertex_number"):
                continue  # created by the readers
            columns = {name: values}
            if values.ndim > 1:
                columns = {f"{name}_{axis}": values[:, i] for i, axis in enumerate("xyz"[:values.shape[1]])}
            for column, expected in columns.items():
                self.assertIn(column, found, what)
                self.assertTrue(np.array_equal(found[column][at], expected[at_theirs], equal_nan=True), (what, column))
                compared += 1
        return compared

    def test_the_picture_is_not_of_one_colour(self):
        reader = self.opened("run.shm")
        view = simple.CreateView("RenderView")
        view.ViewSize = [300, 300]
        shown = simple.Show(reader, view)
        simple.ColorBy(shown, ("POINTS", "u"))
        shown.RescaleTransferFunctionToDataRange()
        simple.ResetCamera(view)
        simple.Render(view)
        simple.SaveScreenshot(str(OUT / "picture.png"), view)
        png = vtkPNGReader()
        png.SetFileName(str(OUT / "picture.png"))
        png.Update()
        pixels = vtk_to_numpy(png.GetOutput().GetPointData().GetScalars())
        colours, counts = np.unique(pixels, axis=0, return_counts=True)
        self.assertGreater(len(colours), 50)  # a colour scale
        self.assertLess(counts.max(), .95 * len(pixels))  # not only the background

    def test_what_is_saved_comes_back(self):
        for name in ("two", "run"):
            for one in (0, 1):
                reader = self.opened(f"{name}.shm")
                reader.OneGrid = one
                self.all_sets(reader)
                time = reader.TimestepValues[1]
                output(reader, time)
                simple.GetAnimationScene().AnimationTime = time
                simple.SaveData(str(OUT / "saved.shm"), proxy=reader)
                with shmformat.open(FOLDER / f"{name}.shm") as mesh, shmformat.open(OUT / "saved.shm") as saved:
                    self.assertTrue(np.array_equal(saved.points, mesh.points))
                    self.assertTrue(np.array_equal(saved.cells.connectivity, mesh.cells.connectivity))
                    self.assertTrue(np.array_equal(saved.cells.types, mesh.cells.types))
                    self.assertTrue(np.array_equal(saved.cells.blocks, mesh.cells.blocks))
                    if not one:
                        self.assertEqual(*([(block.name or block.id, block.cells) for block in of.blocks] for of in (saved, mesh)))
                    for own, source in ((saved.point_data, mesh.point_data), (saved.cell_data, mesh.cell_data)):
                        self.assertEqual(set(own), set(source))
                        for array in source:
                            values = source[array] if isinstance(source[array], np.ndarray) else source[array][1]
                            self.assertTrue(np.array_equal(own[array], values, equal_nan=True), array)
                reader.OneGrid = 1
                back = simple.OpenDataFile(str(OUT / "saved.shm"))
                back.OneGrid = 1
                self.same(output(back), output(reader, time), name)
                simple.Delete(back)
                simple.Delete(reader)

    def test_a_filter_of_it_is_saved(self):
        reader = self.opened("run.shm")
        output(reader, 1.)
        cut = simple.Threshold(Input=reader, Scalars=["CELLS", "heat"], ThresholdMethod="Between", LowerThreshold=5.,
                               UpperThreshold=20.)
        cells = sum(part.GetNumberOfCells() for part in parts_of(output(cut, 1.)).values())
        self.assertTrue(0 < cells < 216)
        simple.SaveData(str(OUT / "cut.shm"), proxy=cut)
        with shmformat.open(OUT / "cut.shm") as mesh:
            self.assertEqual(mesh.cell_count, cells)

    def test_what_is_no_mesh_is_not_saved(self):
        name = OUT / "sphere.shm"
        with self.assertRaises((RuntimeError, AttributeError)):  # in ParaView 5.12 and 5.11
            simple.SaveData(str(name), proxy=simple.Sphere())
        self.assertFalse(name.exists())

    def test_a_file_that_has_grown_is_reloaded(self):
        name = OUT / "grows.shm"
        x = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
        shmformat.write(name, x, np.arange(8)[None], point_data={"t": {0: np.zeros(8)}}, step_times=[0], replace=True)
        reader = self.opened(name)
        self.assertEqual(times_of(reader), [0])
        output(reader)
        shmformat.append(name, point_data={"t": {1: np.full(8, 3.)}}, step_times=[0, 4])
        simple.ReloadFiles(reader)
        reader.UpdatePipelineInformation()
        self.assertEqual(times_of(reader), [0, 4])
        (block,) = parts_of(output(reader, 4.)).values()
        self.assertEqual(arrays_of(block.GetPointData())["t"].tolist(), [3.] * 8)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
