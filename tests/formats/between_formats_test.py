#!/usr/bin/env python3
"""Tests conversions between formats and compares the results with other programs: VTK, Gmsh, and netCDF's
ncdump.

Usage: between_formats_test.py PATH_OF_SHM     (exit code 77, skipped, if one of these programs is missing)
"""
import concurrent.futures
import itertools
import os
import re
import shutil
import subprocess
import sys
import unittest

try:
    import gmsh
    import vtk
except ImportError:
    print("no gmsh or no vtk for Python")
    sys.exit(77)
if not shutil.which("ncdump"):
    print("no ncdump")
    sys.exit(77)
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import TWO_BLOCKS

SHM = "shm"


def apart(function, *words):
    with concurrent.futures.ProcessPoolExecutor(1) as pool:
        return pool.submit(function, *words).result()


# Node order of each element type according to the Exodus manual: the number of corners, which come first, then one
# string for each further node. The string contains the numbers of the corners whose mean is the position of the node.
EDGES_HEX = ["12", "23", "34", "41", "15", "26", "37", "48", "56", "67", "78", "85"]
EDGES_WEDGE = ["12", "23", "31", "14", "25", "36", "45", "56", "64"]
EDGES_PYRAMID = ["12", "23", "34", "41", "15", "25", "35", "45"]
MANUAL = {
    "HEX20": (8, EDGES_HEX),
    "HEX27": (8, EDGES_HEX + ["12345678", "1234", "5678", "1584", "2376", "1265", "3487"]),
    "TETRA10": (4, ["12", "23", "13", "14", "24", "34"]),
    "WEDGE15": (6, EDGES_WEDGE),
    "WEDGE18": (6, EDGES_WEDGE + ["1254", "2365", "1463"]),
    "PYRAMID13": (5, EDGES_PYRAMID),
    "PYRAMID14": (5, EDGES_PYRAMID + ["1234"]),
    "QUAD8": (4, ["12", "23", "34", "41"]),
    "QUAD9": (4, ["12", "23", "34", "41", "1234"]),
    "TRI6": (3, ["12", "23", "31"]),
    "TRI7": (3, ["12", "23", "31", "123"]),
}
# For each Exodus element name: the class of the VTK cell and the number of the Gmsh type, or None if the
# program does not have this element.
SHAPES = {
    "HEX20": ("vtkQuadraticHexahedron", 17), "HEX27": ("vtkTriQuadraticHexahedron", 12),
    "TETRA10": ("vtkQuadraticTetra", 11), "WEDGE15": ("vtkQuadraticWedge", 18),
    "WEDGE18": ("vtkBiQuadraticQuadraticWedge", 13), "PYRAMID13": ("vtkQuadraticPyramid", 19),
    "PYRAMID14": (None, 14), "QUAD8": ("vtkQuadraticQuad", 16),
    "QUAD9": ("vtkBiQuadraticQuad", 10), "TRI6": ("vtkQuadraticTriangle", 9),
    "TRI7": ("vtkBiQuadraticTriangle", None),
}


def reference(shape, kind):
    """Returns the coordinates of the nodes of a VTK or Gmsh element, in the reference coordinates of that
    program."""
    cell, gmsh_type = SHAPES[shape]
    if kind == "vtk":
        element = getattr(vtk, cell)()
        flat = element.GetParametricCoords()
        local = [flat[3 * i:3 * i + 3] for i in range(element.GetNumberOfPoints())]
        if not shape.startswith("PYRAMID"):
            return local
        # VTK's reference coordinates of a pyramid are coordinates in a cube, in which some edges of the
        # pyramid are curved. EvaluateLocation() converts them to coordinates in a pyramid with straight
        # edges.
        pyramid, places = vtk.vtkPyramid(), []
        for i, corner in enumerate(((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (.5, .5, 1))):
            pyramid.GetPoints().SetPoint(i, corner)
        for point in local:
            place = [0.0] * 3
            pyramid.EvaluateLocation(vtk.reference(0), point, place, [0.0] * 5)
            places.append(place)
        return places
    gmsh.initialize(["gmsh"], False)
    _, dimension, _, count, flat, _ = gmsh.model.mesh.getElementProperties(gmsh_type)
    gmsh.finalize()
    width = len(flat) // count
    return [list(flat[width * i:width * (i + 1)]) + [0] * (3 - width) for i in range(count)]


def placed(point):
    """Applies an affine map to the coordinates, so that no coordinate occurs twice."""
    x, y, z = point
    return [2 * x + .25 * y + .125 * z, 3 * y + .5 * z + .0625 * x, 5 * z + .75 * x + 1]


def write_cell(shape, path):
    """Writes one element with VTK or, if VTK does not have this element, with Gmsh. The element lists its
    nodes in the order of that program. The node numbers are descending, so that the order of the numbers
    differs from the order in the file."""
    cell, gmsh_type = SHAPES[shape]
    points = [placed(p) for p in reference(shape, "vtk" if cell else "gmsh")]
    if cell:
        grid, all_points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
        all_points.SetDataTypeToDouble()
        for point in reversed(points):
            all_points.InsertNextPoint(point)
        grid.SetPoints(all_points)
        nodes = list(range(len(points) - 1, -1, -1))
        grid.InsertNextCell(getattr(vtk, cell)().GetCellType(), len(nodes), nodes)
        writer = vtk.vtkUnstructuredGridWriter()
        writer.SetFileName(path)
        writer.SetInputData(grid)
        writer.Write()
        return
    gmsh.initialize(["gmsh"], False)
    gmsh.model.addDiscreteEntity(3, 1)
    tags = list(range(len(points), 0, -1))
    gmsh.model.mesh.addNodes(3, 1, tags, list(itertools.chain(*points)))
    gmsh.model.mesh.addElements(3, 1, [gmsh_type], [[1]], [tags])
    gmsh.option.setNumber("Mesh.SaveAll", 1)
    gmsh.write(path)
    gmsh.finalize()


def cells_of_grid(grid):
    cells = []
    for c in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(c)
        cells.append((cell.GetClassName(), [grid.GetPoint(cell.GetPointId(i))
                                            for i in range(cell.GetNumberOfPoints())]))
    return cells


def seen_by_vtk(path):
    reader = vtk.vtkUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    return cells_of_grid(reader.GetOutput())


def exodus_seen_by_vtk(path):
    reader = vtk.vtkExodusIIReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    reader.SetAllArrayStatus(vtk.vtkExodusIIReader.ELEM_BLOCK, 1)
    reader.Update()
    blocks = reader.GetOutput().GetBlock(0)
    return [cell for b in range(blocks.GetNumberOfBlocks()) if blocks.GetBlock(b)
            for cell in cells_of_grid(blocks.GetBlock(b))]


def seen_by_gmsh(path):
    gmsh.initialize(["gmsh"], False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(path)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    place = {int(t): tuple(xyz[3 * i:3 * i + 3]) for i, t in enumerate(tags)}
    cells = []
    for kind, elements, nodes in zip(*gmsh.model.mesh.getElements()):
        width = len(nodes) // len(elements)
        for i in range(len(elements)):
            cells.append((int(kind), [place[int(n)] for n in nodes[width * i:width * (i + 1)]]))
    gmsh.finalize()
    return cells


def seen_by_ncdump(path):
    """Returns the type and the node coordinates of the only element in an Exodus file."""
    text = subprocess.run(["ncdump", "-p", "9,17", "-v", "coordx,coordy,coordz,connect1", path],
                          capture_output=True, text=True, check=True).stdout
    values = {name: [float(v) for v in re.search(rf"\n {name} =([^;]*);", text)[1].split(",")]
              for name in ("coordx", "coordy", "coordz", "connect1")}
    places = list(zip(values["coordx"], values["coordy"], values["coordz"]))
    kind = re.search(r'connect1:elem_type = "(\w+)"', text)[1]
    return kind, [places[int(n) - 1] for n in values["connect1"]]


def groups_seen_by_gmsh(path):
    """Returns the physical groups: name -> (dimension, elements as sorted lists of coordinates)."""
    gmsh.initialize(["gmsh"], False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(path)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    place = {int(t): tuple(xyz[3 * i:3 * i + 3]) for i, t in enumerate(tags)}
    found = {}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        cells = []
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
            for _, elements, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity)):
                width = len(nodes) // len(elements)
                cells += [[place[int(n)] for n in nodes[width * i:width * (i + 1)]]
                          for i in range(len(elements))]
        found[gmsh.model.getPhysicalName(dimension, tag)] = (dimension, tag, cells)
    views = {}
    for number, view in enumerate(gmsh.view.getTags()):
        steps = int(gmsh.option.getNumber(f"View[{number}].NbTimeStep"))
        views[gmsh.option.getString(f"View[{number}].Name")] = [
            gmsh.view.getModelData(view, step)[2:] for step in range(steps)]
    gmsh.finalize()
    return found, views


def normal(points):
    """Returns a normal of a face, computed from its first three corners."""
    a, b = ([q - p for p, q in zip(points[0], other)] for other in points[1:3])
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def grouped_boxes(path):
    """Creates two boxes of tetrahedra. One of the surfaces belongs to two groups, and one group contains both
    volumes."""
    gmsh.initialize(["gmsh"], False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.addBox(3, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.setSize(gmsh.model.getEntities(0), 1)
    for dimension, tags, tag, name in ((3, [1, 2], 1, "all"), (2, [1], 2, "wall"),
                                       (2, [1, 7], 3, "both")):
        gmsh.model.addPhysicalGroup(dimension, tags, tag)
        gmsh.model.setPhysicalName(dimension, tag, name)
    gmsh.model.mesh.generate(3)
    gmsh.write(path)
    gmsh.finalize()


def ncdump(path, *variables):
    text = subprocess.run(["ncdump", "-v", ",".join(variables), path], capture_output=True,
                          text=True, check=True).stdout
    return [re.search(rf"\n {name} =([^;]*);", text)[1].split() for name in variables]


def middle(points):
    return [sum(p[k] for p in points) / len(points) for k in range(3)]


class BetweenFormatsTest(FolderTest):
    def convert(self, source, target, *options):
        done = subprocess.run([SHM, "convert", "-fq", self.path(source), self.path(target),
                               *options], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stderr

    def assert_same_places(self, found, expected):
        self.assertEqual(len(found), len(expected))
        for one, other in zip(found, expected):
            for a, b in zip(one, other):
                self.assertAlmostEqual(a, b, delta=1e-9)

    def check_vtk(self, shape, cells):
        """Checks that the nodes have the positions of the nodes of VTK's own cell."""
        (kind, points), = cells
        self.assertEqual(kind, SHAPES[shape][0])
        self.assert_same_places(points, [placed(p) for p in reference(shape, "vtk")])

    def check_gmsh(self, shape, path):
        """Checks that each node is at the mean of the same corners as in Gmsh's own element. The affine map has
        moved the corners."""
        (kind, points), = apart(seen_by_gmsh, path)
        self.assertEqual(kind, SHAPES[shape][1])
        local = apart(reference, shape, "gmsh")
        corners = MANUAL[shape][0]
        for node, point in zip(local, points):
            between = self.corners_between(local[:corners], node)
            self.assert_same_places([point], [middle([points[c] for c in between])])

    def corners_between(self, corners, node):
        for count in range(1, len(corners) + 1):
            for some in itertools.combinations(range(len(corners)), count):
                if all(abs(a - b) < 1e-9 for a, b in zip(middle([corners[c] for c in some]), node)):
                    return some
        self.fail(f"{node} is not between corners")

    def check_exodus(self, shape, path):
        kind, points = seen_by_ncdump(path)
        self.assertEqual(kind, shape)
        corners, others = MANUAL[shape]
        self.assertEqual(len(points), corners + len(others))
        for point, between in zip(points[corners:], others):
            self.assert_same_places([point], [middle([points[int(c) - 1] for c in between])])
        # VTK's Exodus reader converts an Exodus element to a VTK cell.
        cells = apart(exodus_seen_by_vtk, path)
        if SHAPES[shape][0] is not None and cells and cells[0][0] == SHAPES[shape][0]:
            self.check_vtk(shape, cells)
            return True
        return False

    def two_blocks(self):
        self.ncgen("two.e", TWO_BLOCKS)

    def test_exodus_sets_in_gmsh(self):
        self.two_blocks()
        self.convert("two.e", "two.msh")
        groups, views = apart(groups_seen_by_gmsh, self.path("two.msh"))
        self.assertEqual({name: group[:2] for name, group in groups.items()},
                         {"steel": (3, 10), "air": (3, 20), "inlet": (2, 3), "fixed": (0, 7)})
        self.assertEqual(groups["fixed"][2], [[(0, 0, 0)], [(0, 1, 0)], [(0, 1, 2)]])
        low, top = groups["inlet"][2]
        self.assertEqual(sorted(low), [(0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1)])
        self.assertEqual(sorted(top), [(0, 0, 2), (0, 1, 2), (1, 0, 2), (1, 1, 2)])
        self.assertEqual((normal(low), normal(top)), ([-1, 0, 0], [0, 0, 1]))  # outward
        self.assertEqual([step[1] for step in views["v"]], [0, 0.5, 2])
        self.assertEqual(list(views["v"][2][0][11]), [42, 62, 82])
        self.assertEqual([list(step[0][0]) for step in views["heat"]], [[0.25], [0.5], [0.75]])

    def test_exodus_in_vtk(self):
        self.two_blocks()
        self.convert("two.e", "two.vtk")
        reader = vtk.vtkUnstructuredGridReader()
        reader.SetFileName(self.path("two.vtk"))
        reader.ReadAllFieldsOn()
        reader.Update()
        grid = reader.GetOutput()
        self.assertEqual(reader.GetHeader(), "two blocks")

        def tuples(array):
            return [array.GetTuple(i) for i in range(array.GetNumberOfTuples())]
        self.assertEqual(tuples(grid.GetPointData().GetArray("v"))[11], (42, 62, 82))
        self.assertEqual(tuples(grid.GetPointData().GetArray("fixed")),
                         [(float(i in (0, 3, 11)),) for i in range(12)])
        self.assertEqual(tuples(grid.GetCellData().GetArray("inlet")), [(8,), (32,)])
        self.assertEqual(tuples(grid.GetCellData().GetArray("BlockId")), [(10,), (20,)])
        self.assertEqual(tuples(grid.GetCellData().GetArray("elem_map")), [(2,), (1,)])
        self.assertEqual(tuples(grid.GetFieldData().GetArray("TIME")), [(2,)])
        names = grid.GetFieldData().GetAbstractArray("BlockNames")
        self.assertEqual([names.GetValue(i) for i in range(2)], ["10 steel", "20 air"])

    def test_exodus_back_from_others(self):
        self.two_blocks()
        for between in ("between.vtk", "between.msh"):
            with self.subTest(between):
                self.convert("two.e", between, *(["--step=2"] if between.endswith("vtk") else []))
                self.convert(between, "back.e")
                names, blocks, times = ncdump(self.path("back.e"), "eb_names", "eb_prop1",
                                              "time_whole")
                self.assertEqual([n.strip('",') for n in names[:2]], ["steel", "air"])
                self.assertEqual([n.strip(",") for n in blocks[:2]], ["10", "20"])
                self.assertEqual(times[-1], "2")
                variables, = ncdump(self.path("back.e"), "name_nod_var")
                for name in ("v_x", "v_y", "v_z"):
                    self.assertIn(name, "".join(variables))

    def test_gmsh_groups_in_exodus(self):
        apart(grouped_boxes, self.path("boxes.msh"))
        losses = self.convert("boxes.msh", "boxes.e")
        self.assertNotIn("group", losses)
        blocks, sets, ids = ncdump(self.path("boxes.e"), "eb_names", "els_names", "els_prop1")
        self.assertEqual(sorted(b.strip('",') for b in blocks), ["", "all", "all", "both"])
        self.assertEqual([s.strip('",') for s in sets], ["wall", "both"])
        self.assertEqual([i.strip(",") for i in ids], ["2", "3"])
        groups, _ = apart(groups_seen_by_gmsh, self.path("boxes.msh"))
        (first,), (second,) = (ncdump(self.path("boxes.e"), f"elem_els{i}") for i in (1, 2))
        self.assertEqual((len(first), len(second)), (len(groups["wall"][2]), len(groups["both"][2])))
        self.convert("boxes.msh", "boxes.vtk")
        reader = vtk.vtkUnstructuredGridReader()
        reader.SetFileName(self.path("boxes.vtk"))
        reader.ReadAllScalarsOn()
        reader.ReadAllFieldsOn()
        reader.Update()
        both = reader.GetOutput().GetCellData().GetArray("both")
        self.assertEqual(sum(both.GetTuple1(i) == 1 for i in range(both.GetNumberOfTuples())),
                         len(groups["both"][2]))

    def test_nodes_stand_where_each_format_has_them(self):
        read_by_vtk = []
        for shape, (cell, gmsh_type) in SHAPES.items():
            with self.subTest(shape=shape):
                first = "first.vtk" if cell else "first.msh"
                apart(write_cell, shape, self.path(first))
                targets = ["e"] + ["vtk"] * (cell is not None) + ["msh"] * (gmsh_type is not None)
                # Converts a file written by VTK or Gmsh to every format, and then converts each result to
                # every format.
                routes = [(first, "one." + t) for t in targets]
                routes += [("one." + s, f"from_{s}.{t}") for s in targets for t in targets]
                for source, target in routes:
                    self.convert(source, target, "--strict")
                    path = self.path(target)
                    if target.endswith(".vtk"):
                        self.check_vtk(shape, apart(seen_by_vtk, path))
                    elif target.endswith(".msh"):
                        self.check_gmsh(shape, path)
                    elif self.check_exodus(shape, path):
                        read_by_vtk.append(shape)
        self.assertGreaterEqual(set(read_by_vtk), {"HEX20", "HEX27", "TETRA10", "WEDGE15", "QUAD8",
                                                   "QUAD9", "TRI6"})


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
