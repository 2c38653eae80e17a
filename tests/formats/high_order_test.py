#!/usr/bin/env python3
"""Tests Lagrange cells of VTK, Gmsh and Exodus: each node must be where the target format defines it.

All cells are straight, so each node lies at the position that follows from its parametric coordinates and the
corners. VTK's and Gmsh's libraries state these coordinates for each node of a cell; for Exodus, this test contains
the edges and faces of elements as SEACAS lists them.

Usage: high_order_test.py PATH_OF_SHM     (exit code 77, skipped, if NumPy, netCDF4, gmsh or VTK is missing)
"""
import json
import os
import sys
import unittest

try:
    import gmsh
    import netCDF4
    import numpy as np
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridReader
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
    from vtkmodules.util.numpy_support import vtk_to_numpy
except ImportError as missing:
    print(missing)
    sys.exit(77)

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest, forced
from gmsh_meshes import write_box, write_prisms

# The faces of a HEX64: their corners, and the nodes inside, each next to one corner.
HEX64_FACES = [(0, 1, 5, 4, 36, 37, 49, 48), (1, 2, 6, 5, 38, 39, 51, 50), (2, 3, 7, 6, 40, 41, 53, 52),
               (0, 4, 7, 3, 43, 55, 54, 42), (0, 3, 2, 1, 32, 35, 34, 33), (4, 5, 6, 7, 60, 61, 62, 63)]
# Elements that Exodus and one other format have: corners, and how SEACAS lists the nodes on edges (the ends of the
# edge first) and in the middle of faces (after their corners).
EDGES = {
    "TRI9": [(0, 1, 3, 4), (1, 2, 5, 6), (2, 0, 7, 8)],
    "QUAD12": [(0, 1, 4, 5), (1, 2, 6, 7), (2, 3, 8, 9), (3, 0, 10, 11)],
    "TETRA16": [(0, 1, 4, 5), (1, 2, 6, 7), (2, 0, 8, 9), (0, 3, 10, 13), (1, 3, 11, 14), (2, 3, 12, 15)],
    "WEDGE24": [(0, 1, 6, 7), (1, 2, 8, 9), (2, 0, 10, 11), (3, 4, 18, 19), (4, 5, 20, 21), (5, 3, 22, 23),
                (0, 3, 12, 15), (1, 4, 13, 16), (2, 5, 14, 17)],
    "HEX32": [(0, 1, 8, 9), (1, 5, 17, 21), (5, 4, 25, 24), (4, 0, 20, 16), (3, 2, 13, 12), (2, 6, 18, 22),
              (6, 7, 28, 29), (7, 3, 23, 19), (0, 3, 15, 14), (1, 2, 10, 11), (5, 6, 26, 27), (4, 7, 31, 30)],
    "TETRA15": [(0, 1, 4), (1, 2, 5), (2, 0, 6), (0, 3, 7), (1, 3, 8), (2, 3, 9)],
    "WEDGE21": [(0, 1, 6), (1, 2, 7), (2, 0, 8), (3, 4, 12), (4, 5, 13), (5, 3, 14), (0, 3, 9), (1, 4, 10), (2, 5, 11)],
    "PYRAMID19": [(0, 1, 5), (1, 2, 6), (2, 3, 7), (3, 0, 8), (0, 4, 9), (1, 4, 10), (2, 4, 11), (3, 4, 12)],
}
FACES = {
    "TETRA15": [(0, 1, 3, 13), (1, 2, 3, 11), (0, 3, 2, 12), (0, 2, 1, 10), (0, 1, 2, 3, 14)],
    "WEDGE21": [(0, 1, 4, 3, 20), (1, 2, 5, 4, 18), (0, 3, 5, 2, 19), (0, 2, 1, 15), (3, 4, 5, 16),
                (0, 1, 2, 3, 4, 5, 17)],
    "PYRAMID19": [(0, 1, 4, 14), (1, 2, 4, 15), (2, 3, 4, 16), (3, 0, 4, 17), (0, 3, 2, 1, 13), (0, 1, 2, 3, 4, 18)],
}
UNIT_CORNERS = {"TRI": [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "QUAD": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
                "TETRA": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
                "PYRAMID": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)],
                "WEDGE": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
                "HEX": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]}
CORNERS = np.array(UNIT_CORNERS["HEX"])
HEX27_CENTRES = {20: range(8), 21: (0, 1, 2, 3), 22: (4, 5, 6, 7), 23: (0, 3, 7, 4), 24: (1, 2, 6, 5),
                 25: (0, 1, 5, 4), 26: (2, 3, 7, 6)}


def interpolated(corners, parameters):
    """The points of a straight cell at parametric coordinates, of shape (n, axes of the cell). The weights of the
    corners follow from the number of axes and corners: products of r or 1 - r, or barycentric coordinates, or both in
    wedges."""
    axes = parameters.shape[1]
    if len(corners) == 6:
        around = np.column_stack([1 - parameters[:, :2].sum(axis=1), parameters[:, :2]])
        weights = np.hstack([around * (1 - parameters[:, 2:]), around * parameters[:, 2:]])
    elif len(corners) == 2**axes:
        at = CORNERS[:len(corners), :axes]
        weights = np.prod(np.where(at[None] == 1, parameters[:, None], 1 - parameters[:, None]), axis=2)
    else:
        weights = np.column_stack([1 - parameters.sum(axis=1), parameters])
    return weights @ corners


def write_element(path, kind, like=None):
    """Writes an Exodus file with one element, whose nodes have the order of SEACAS. `like`: a type of EDGES with more
    nodes, the first of which are those of this element."""
    family = kind.rstrip("0123456789")
    nodes, made = (int(name[len(family):]) for name in (kind, like or kind))
    at = np.full((made, 3), np.nan)
    corners = np.array(UNIT_CORNERS[family], float) * (2, 3, 5)
    at[:len(corners)] = corners
    for a, b, *between in EDGES[like or kind]:
        for i, node in enumerate(between, 1):
            at[node] = at[a] + (at[b] - at[a]) * i / (len(between) + 1)
    for *around, node in FACES.get(like or kind, []):
        at[node] = at[around].mean(axis=0)
    at = at[:nodes]
    assert not np.isnan(at).any()
    with netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_OFFSET") as file:
        file.setncatts({"api_version": np.float32(5), "version": np.float32(5), "floating_point_word_size": np.int32(8)})
        for name, size in {"len_string": 33, "len_line": 81, "num_dim": 3, "num_nodes": nodes, "num_elem": 1,
                           "num_el_blk": 1, "num_el_in_blk1": 1, "num_nod_per_el1": nodes}.items():
            file.createDimension(name, size)
        for i, axis in enumerate("xyz"):
            file.createVariable("coord" + axis, "f8", ("num_nodes",))[:] = at[:, i]
        file.createVariable("eb_prop1", "i4", ("num_el_blk",))[:] = 1
        connect = file.createVariable("connect1", "i4", ("num_el_in_blk1", "num_nod_per_el1"))
        connect.elem_type = kind
        connect[:] = np.arange(1, nodes + 1)


def element_of(path):
    """The type and the coordinates of the nodes of the only element of an Exodus file."""
    with netCDF4.Dataset(path) as file:
        points = np.stack([np.asarray(file["coord" + axis][:]) for axis in "xyz"], axis=1)
        return file["connect1"].elem_type, points[np.asarray(file["connect1"][0]) - 1]


def element_points(path):
    """For each element type of a Gmsh file: the coordinates of the nodes of each element."""
    gmsh.initialize(["gmsh", "-v", "0"])
    try:
        gmsh.open(path)
        tags, points, _ = gmsh.model.mesh.getNodes()
        place = {tag: i for i, tag in enumerate(tags)}
        points = points.reshape(-1, 3)
        found = {}
        for kind, elements, nodes in zip(*gmsh.model.mesh.getElements()):
            rows = np.array([place[tag] for tag in nodes]).reshape(len(elements), -1)
            found[kind] = points[rows]
        return found
    finally:
        gmsh.finalize()


def sorted_by_centre(elements):
    return elements[np.lexsort(np.round(elements.mean(axis=1), 6).T)]


class HighOrderTest(FolderTest):
    def shm(self, *words, **how):
        return super().shm(*forced(words), **how)

    def check_points(self, points, nodes, parameters, corners, what):
        expected = interpolated(points[nodes[:corners]], parameters)
        np.testing.assert_allclose(points[nodes], expected, atol=1e-9, err_msg=what)

    def check_vtk(self, path, cells):
        reader = vtkXMLUnstructuredGridReader() if path.endswith(".vtu") else vtkUnstructuredGridReader()
        reader.SetFileName(path)
        reader.Update()
        grid = reader.GetOutput()
        points = vtk_to_numpy(grid.GetPoints().GetData())
        found = 0
        for c in range(grid.GetNumberOfCells()):
            cell = grid.GetCell(c)
            axes, count = cell.GetCellDimension(), cell.GetNumberOfPoints()
            if axes == 0:
                self.assertEqual(count, 1, path)
                continue
            found += 1
            coordinates = cell.GetParametricCoords()
            coordinates = np.array([coordinates[i] for i in range(3 * count)]).reshape(-1, 3)[:, :axes]
            if cell.GetClassName() == "vtkCubicLine":  # the only class whose coordinates range from -1 to 1
                coordinates = (coordinates + 1) / 2
            corners = 2 if axes == 1 else cell.GetNumberOfEdges() if axes == 2 else {4: 4, 5: 6, 6: 8}[cell.GetNumberOfFaces()]
            nodes = np.array([cell.GetPointId(i) for i in range(count)])
            self.check_points(points, nodes, coordinates, corners, f"{path} {cell.GetClassName()}")
        self.assertEqual(found, cells, path)

    def check_gmsh(self, path, cells):
        gmsh.initialize(["gmsh", "-v", "0"])
        try:
            gmsh.open(path)
            tags, points, _ = gmsh.model.mesh.getNodes()
            points = points.reshape(-1, 3)
            place = {tag: i for i, tag in enumerate(tags)}
            found = 0
            for axes in (1, 2, 3):
                for kind, of_kind, nodes in zip(*gmsh.model.mesh.getElements(axes)):
                    name, _, _, count, coordinates, corners = gmsh.model.mesh.getElementProperties(kind)
                    parameters = coordinates.reshape(-1, axes)
                    if corners == 2**axes:
                        parameters = (parameters + 1) / 2
                    found += len(of_kind)
                    for row in nodes.reshape(-1, count):
                        self.check_points(points, np.array([place[tag] for tag in row]), parameters, corners,
                                          f"{path} {name}")
            self.assertEqual(found, cells, path)
        finally:
            gmsh.finalize()

    def check_exodus(self, path, cells):
        with netCDF4.Dataset(path) as file:
            points = np.stack([np.asarray(file["coord" + axis][:]) for axis in "xyz"], axis=1)
            blocks = [file[name] for name in file.variables if name.startswith("connect")]
            blocks = [(block.elem_type, np.asarray(block[:]) - 1) for block in blocks]
        self.assertEqual(sum(len(nodes) for kind, nodes in blocks if kind != "SPHERE"), cells, path)
        for kind, nodes in blocks:
            for a, b, *between in EDGES.get(kind, []):
                for i, node in enumerate(between, 1):
                    ends = points[nodes[:, a]], points[nodes[:, b]]
                    np.testing.assert_allclose(points[nodes[:, node]],
                                               ends[0] + (ends[1] - ends[0]) * i / (len(between) + 1), atol=1e-9)
            if kind == "QUAD16":
                for row in nodes:
                    self.check_cubic(points[row], EDGES["QUAD12"], [(0, 1, 2, 3, 12, 13, 14, 15)])
            if "HEX" not in kind:
                continue
            self.assertEqual(kind, f"HEX{nodes.shape[1]}")
            for row in nodes:
                at = points[row]
                if len(row) == 27:
                    for node, around in HEX27_CENTRES.items():
                        np.testing.assert_allclose(at[node], at[list(around)].mean(axis=0), atol=1e-9)
                if len(row) == 64:
                    self.check_hex64(at)

    def check_cubic(self, at, edges, faces):
        for a, b, first, second in edges:
            np.testing.assert_allclose(at[[first, second]], [(2 * at[a] + at[b]) / 3, (at[a] + 2 * at[b]) / 3],
                                       atol=1e-9)
        for face in faces:
            for i in range(4):
                near, beside, opposite, other = (at[face[(i + k) % 4]] for k in range(4))
                expected = (4 * near + 2 * beside + opposite + 2 * other) / 9
                np.testing.assert_allclose(at[face[4 + i]], expected, atol=1e-9)

    def check_hex64(self, at):
        self.check_cubic(at, EDGES["HEX32"], HEX64_FACES)
        inside = np.array([(1, 1, 1), (2, 1, 1), (2, 2, 1), (1, 2, 1), (1, 1, 2), (2, 1, 2), (2, 2, 2), (1, 2, 2)])
        np.testing.assert_allclose(at[[44, 45, 46, 47, 56, 57, 58, 59]], interpolated(at[:8], inside / 3), atol=1e-9)

    def check(self, path, cells):
        (self.check_exodus if path.endswith(".e") else self.check_gmsh if path.endswith(".msh") else
         self.check_vtk)(path, cells)

    def test_cells_of_each_order(self):
        for simplices in (False, True):
            for order in range(1, 8):
                self.check_order(order, simplices)

    def check_order(self, order, simplices):
        source, packed, back = (self.path(name) for name in ("box.msh", "box.shm", "back.msh"))
        cells = write_box(source, order, simplices)
        self.check(source, cells)
        self.shm("compress", source, "-o", packed)
        shapes = {block["shape"] for block in json.loads(self.shm("info", packed, "--json"))["blocks"]}
        solid = {"triangle", "tetrahedron"} if simplices else {"quad", "hexahedron"}
        self.assertEqual(shapes, {"vertex", "line"} | solid)
        self.shm("decompress", packed, "-o", back)
        self.shm("diff", source, back)
        # Exodus has tetrahedra and triangles up to order 2, the other cells up to order 3.
        targets = ["box.vtu", "box.vtk"] + (["box.e"] if order <= (2 if simplices else 3) else [])
        for target in targets:
            self.shm("convert", source, self.path(target))
            self.check(self.path(target), cells)
        for first in targets:  # from each of them to each other, and back to Gmsh
            for second in targets + ["again.msh"]:
                if first != second:
                    self.shm("convert", self.path(first), self.path("from_" + second))
                    self.check(self.path("from_" + second), cells)

    def test_prisms_of_each_order(self):
        for order in range(1, 8):
            source, again = self.path("prisms.msh"), self.path("again.msh")
            cells = write_prisms(source, order)
            for target in ("prisms.vtu", "prisms.vtk"):
                self.shm("convert", source, self.path(target))
                self.check_vtk(self.path(target), cells)
                self.shm("convert", self.path(target), again)
                before, after = element_points(source), element_points(again)
                self.assertEqual(sorted(before), sorted(after))
                for kind in before:
                    np.testing.assert_allclose(sorted_by_centre(before[kind]), sorted_by_centre(after[kind]), atol=1e-12,
                                               err_msg=f"{target} {kind}")

    def test_incomplete_cells(self):
        """VTK has no serendipity cells of order 3 and higher, Exodus has those of order 3; Gmsh calls them
        incomplete."""
        source, packed, back = (self.path(name) for name in ("prisms.msh", "prisms.shm", "back.msh"))
        for order in (3, 4, 7):
            cells = write_prisms(source, order, incomplete=True)
            self.shm("compress", source, "-o", packed)
            blocks = json.loads(self.shm("info", packed, "--json"))["blocks"]
            self.assertEqual({(block["shape"], block["order"], block["node_scheme"]) for block in blocks},
                             {("vertex", None, "lagrange"), ("line", order, "lagrange"), ("triangle", order, "serendipity"),
                              ("quad", order, "serendipity"), ("wedge", order, "serendipity")})
            self.shm("decompress", packed, "-o", back)
            self.shm("diff", source, back)
            if order == 3:
                self.shm("convert", source, self.path("prisms.e"))
                self.check_exodus(self.path("prisms.e"), cells)
            for target in ["prisms.vtu", "prisms.vtk"] + ["prisms.e"] * (order > 3):
                message = self.shm("convert", source, self.path(target), "--strict", code=6)
                self.assertIn(f"serendipity wedge with {9 * order - 3} nodes".encode(), message)

    def test_elements_of_exodus(self):
        for kind in EDGES:
            with self.subTest(kind):
                source, packed, other, again = (self.path(name) for name in ("one.e", "one.shm", "one", "again.e"))
                write_element(source, kind)
                self.shm("compress", source, "-o", packed)
                self.shm("decompress", packed, "-o", again)
                self.assertEqual(element_of(again)[0], kind)
                np.testing.assert_array_equal(element_of(again)[1], element_of(source)[1])
                other += ".vtu" if kind in FACES else ".msh"
                self.shm("convert", source, other, "--strict")
                # VTK states the coordinates of a hexahedron with equal corners for PYRAMID19, Gmsh none for WEDGE24.
                if kind not in ("PYRAMID19", "WEDGE24"):
                    self.check(other, 1)
                self.shm("convert", other, again, "--strict")
                self.assertEqual(element_of(again)[0], kind)
                np.testing.assert_array_equal(element_of(again)[1], element_of(source)[1])

    def test_elements_that_only_exodus_has(self):
        """Their corners are known, so they are counted and drawn; the other nodes keep their order."""
        for kind, like, shape in (("TETRA14", "TETRA15", "tetrahedron"), ("WEDGE20", "WEDGE21", "wedge"),
                                  ("PYRAMID18", "PYRAMID19", "pyramid")):
            source, packed, again = (self.path(name) for name in ("one.e", "one.shm", "again.e"))
            with self.subTest(kind):
                write_element(source, kind, like)
                self.shm("compress", source, "-o", packed)
                self.assertEqual([block["shape"] for block in json.loads(self.shm("info", packed, "--json"))["blocks"]],
                                 [shape])
                self.shm("decompress", packed, "-o", again)
                self.assertEqual(element_of(again)[0], kind)
                np.testing.assert_array_equal(element_of(again)[1], element_of(source)[1])
                message = self.shm("convert", source, self.path("one.vtu"), "--strict", code=6)
                self.assertIn(f"{kind[-2:]} nodes".encode(), message)

    def test_orders_that_exodus_lacks(self):
        source, target = self.path("four.msh"), self.path("four.e")
        write_box(source, 4)
        message = self.shm("convert", source, target, "--strict", code=6)
        self.assertIn(b"hexahedron with 125 nodes", message)
        self.shm("convert", source, target)
        with netCDF4.Dataset(target) as file:
            kinds = {file[name].elem_type for name in file.variables if name.startswith("connect")}
        self.assertIn("OTHER125", kinds)

    def test_old_numbering_of_vtk(self):
        for order in (2, 3, 4):
            source, vtu = self.path("box.msh"), self.path("new.vtu")
            write_box(source, order)
            self.shm("convert", source, vtu)
            reader = vtkXMLUnstructuredGridReader()
            reader.SetFileName(vtu)
            reader.Update()
            grid = reader.GetOutput()
            points = vtk_to_numpy(grid.GetPoints().GetData())
            cells = []
            for c in range(grid.GetNumberOfCells()):
                cell = grid.GetCell(c)
                if cell.GetNumberOfPoints() == (order + 1)**3:
                    cells.append([cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())])
            between = order - 1
            a = 8 + 10 * between
            for row in cells:
                row[a:a + between], row[a + between:a + 2 * between] = (row[a + between:a + 2 * between],
                                                                        row[a:a + between])
            old = self.path("old.vtu")
            with open(old, "w", encoding="ascii") as out:
                out.write('<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">\n<UnstructuredGrid>\n'
                          f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">\n<Points>\n'
                          '<DataArray type="Float64" NumberOfComponents="3" format="ascii">\n')
                np.savetxt(out, points, "%.17g")
                out.write('</DataArray>\n</Points>\n<Cells>\n'
                          '<DataArray type="Int64" Name="connectivity" format="ascii">\n')
                np.savetxt(out, cells, "%d")
                out.write('</DataArray>\n<DataArray type="Int64" Name="offsets" format="ascii">\n')
                np.savetxt(out, (np.arange(len(cells)) + 1) * (order + 1)**3, "%d")
                out.write('</DataArray>\n<DataArray type="UInt8" Name="types" format="ascii">\n')
                np.savetxt(out, np.full(len(cells), 72), "%d")
                out.write('</DataArray>\n</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n')
            self.check(old, 6)  # VTK knows the old numbering
            packed = self.path("old.shm")
            self.shm("compress", old, "-o", packed)
            self.shm("decompress", packed, "-o", self.path("old_again.vtu"))
            self.shm("diff", old, self.path("old_again.vtu"))
            self.check(self.path("old_again.vtu"), 6)
            for target in ("old.vtk", "old.msh") + (("old.e",) if order < 4 else ()):
                self.shm("convert", packed, self.path(target))
                self.check(self.path(target), 6)

    def test_bezier_and_anisotropic_cells(self):
        """Other formats cannot name cells whose nodes are control points, or whose order differs by axis."""
        for kind, nodes in ((79, 64), (79, 27), (72, 12), (72, 32), (72, 20), (72, 24), (70, 8), (73, 15), (79, 20)):
            source = self.path(f"cell{kind}_{nodes}.vtk")
            with open(source, "w", encoding="ascii") as out:
                out.write(f"# vtk DataFile Version 3.0\none cell\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {nodes} double\n")
                for i in range(nodes):
                    out.write(f"{i % 4} {i // 4 % 4} {i // 16}\n")
                out.write(f"CELLS 1 {nodes + 1}\n{nodes} {' '.join(map(str, range(nodes)))}\nCELL_TYPES 1\n{kind}\n")
            self.shm("convert", source, self.path("one.e"), "--strict", code=6)
            self.shm("convert", source, self.path("one.e"))
            with netCDF4.Dataset(self.path("one.e")) as file:
                self.assertEqual(file["connect1"].elem_type, f"OTHER{nodes}")
            self.shm("compress", source, "-o", self.path("one.shm"))
            block = json.loads(self.shm("info", self.path("one.shm"), "--json"))["blocks"][0]
            order = {64: 3, 27: 2}.get(nodes)  # the same along all axes
            self.assertEqual((block["order"], block["node_scheme"]), (order, "bezier" if order else "lagrange"))
            self.shm("decompress", self.path("one.shm"), "-o", self.path("one.vtk"))
            self.shm("diff", source, self.path("one.vtk"))
            self.shm("convert", source, self.path("one.msh"), code=3)

    def test_orders_that_differ_by_axis(self):
        """A quad of 16 nodes has order 3, or orders 7 and 1. An array of VTK tells which."""
        for orders, kind in (((3, 3, 3), "QUAD16"), ((7, 1, 0), "OTHER16")):
            source = self.path("quad.vtk")
            with open(source, "w", encoding="ascii") as out:
                out.write("# vtk DataFile Version 3.0\none cell\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 16 double\n")
                for i in range(16):
                    out.write(f"{i % 4} {i // 4} 0\n")
                out.write(f"CELLS 1 17\n16 {' '.join(map(str, range(16)))}\nCELL_TYPES 1\n70\nCELL_DATA 1\n"
                          "FIELD FieldData 1\nHigherOrderDegrees 3 1 double\n" + " ".join(map(str, orders)) + "\n")
            self.shm("convert", source, self.path("quad.e"))
            with netCDF4.Dataset(self.path("quad.e")) as file:
                self.assertEqual(file["connect1"].elem_type, kind)

    def test_linear_and_quadratic_cells(self):
        """Lagrange cells of order 1 and 2 are the cells that other type numbers have, and keep their type."""
        shapes = {68: ("line", 2), 69: ("triangle", 3), 70: ("quad", 4), 71: ("tetrahedron", 4), 73: ("wedge", 6),
                  76: ("triangle", 3), 77: ("quad", 4), 78: ("tetrahedron", 4), 80: ("wedge", 6)}
        quadratic = {68: 3, 69: 6, 70: 9, 71: 10, 72: 27, 73: 18}
        for kind, (shape, nodes) in list(shapes.items()) + [
                (kind, (shapes.get(kind, ("hexahedron", 8))[0], nodes)) for kind, nodes in quadratic.items()]:
            source, packed = self.path("cell.vtk"), self.path("cell.shm")
            with open(source, "w", encoding="ascii") as out:
                out.write(f"# vtk DataFile Version 3.0\none cell\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {nodes} double\n")
                for i in range(nodes):
                    out.write(f"{i % 3} {i // 3 % 3} {i // 9}\n")
                out.write(f"CELLS 1 {nodes + 1}\n{nodes} {' '.join(map(str, range(nodes)))}\nCELL_TYPES 1\n{kind}\n")
            self.shm("compress", source, "-o", packed)
            block = json.loads(self.shm("info", packed, "--json"))["blocks"][0]
            self.assertEqual((block["id"], block["shape"]), (kind, shape))
            self.shm("decompress", packed, "-o", self.path("again.vtk"))
            with open(self.path("again.vtk"), encoding="ascii") as again, open(source, encoding="ascii") as before:
                self.assertEqual(again.read().split(), before.read().split())


if __name__ == "__main__":
    FolderTest.tool = os.path.abspath(sys.argv.pop(1))
    unittest.main()
