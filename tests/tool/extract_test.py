#!/usr/bin/env python3
"""Tests shm extract. A piece must equal the part of the whole mesh that this script selects itself. VTK and
ncdump read the files.

Usage: extract_test.py PATH_OF_SHM     (exit code 77, skipped, if VTK, NumPy or netCDF is missing)
"""
import json
import os
import re
import shutil
import subprocess
import sys
import unittest

try:
    import numpy as np
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError:
    print("no vtk or no numpy for Python")
    sys.exit(77)
if not shutil.which("ncdump") or not shutil.which("ncgen"):
    print("no ncdump or no ncgen")
    sys.exit(77)

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, FolderTest, forced
from sample_meshes import hexahedra, wedges

SHM = "shm"
N = 8  # cells per side


class Grid:
    """A mesh of hexahedra in two blocks, with wedges in the last layer. It has number maps, three steps, and
    sets."""

    def __init__(self):
        m = N + 1
        z, y, x = np.meshgrid(range(m), range(m), range(m), indexing="ij")
        self.points = np.stack([x.ravel() * .125 + y.ravel() * .01, y.ravel() * .125,
                                z.ravel() * .125], axis=1)
        cells = hexahedra(N)
        layer = N * N
        self.steel, self.air = cells[:3 * layer], cells[3 * layer:(N - 1) * layer]
        self.wedges = []
        for c in cells[(N - 1) * layer:]:
            self.wedges += wedges(c)
        self.cells = self.steel + self.air + self.wedges
        self.blocks = np.repeat([10, 20, 30], [len(self.steel), len(self.air), len(self.wedges)])
        self.node_map = np.arange(len(self.points)) * 3 + 100
        self.elem_map = np.arange(len(self.cells))[::-1] + 5000
        steps = np.arange(3)[:, None]
        self.heat = np.sin(self.points[:, 0] * 5 + self.points[:, 2])[None, :] * (1 + steps)
        self.flux = np.arange(len(self.air))[None, :] * .5 + steps
        # The side set contains those sides of the hexahedra that are at x = 0. They have side number 4 in
        # Exodus.
        self.inlet = [c for c in range(len(self.steel) + len(self.air)) if c % N == 0]
        self.fixed = [v for v in range(len(self.points)) if self.points[v, 2] == 0]

    def write(self, path):
        def numbers(values):
            return ", ".join(repr(v) if isinstance(v, float) else str(v)
                             for v in np.asarray(values).ravel().tolist())

        p, s, a, w = len(self.points), len(self.steel), len(self.air), len(self.wedges)
        text = f"""netcdf grid {{
dimensions: len_string = 33 ; len_line = 81 ; four = 4 ; len_name = 33 ; time_step = UNLIMITED ;
  num_dim = 3 ; num_nodes = {p} ; num_elem = {s + a + w} ; num_el_blk = 3 ;
  num_el_in_blk1 = {s} ; num_nod_per_el1 = 8 ; num_el_in_blk2 = {a} ; num_nod_per_el2 = 8 ;
  num_el_in_blk3 = {w} ; num_nod_per_el3 = 6 ; num_side_sets = 1 ;
  num_side_ss1 = {len(self.inlet)} ; num_node_sets = 1 ; num_nod_ns1 = {len(self.fixed)} ;
  num_nod_var = 1 ; num_elem_var = 1 ;
variables: double time_whole(time_step) ; int eb_status(num_el_blk) ; int eb_prop1(num_el_blk) ;
  eb_prop1:name = "ID" ; char eb_names(num_el_blk, len_name) ; int ss_status(num_side_sets) ;
  int ss_prop1(num_side_sets) ; ss_prop1:name = "ID" ; char ss_names(num_side_sets, len_name) ;
  int ns_status(num_node_sets) ; int ns_prop1(num_node_sets) ; ns_prop1:name = "ID" ;
  char ns_names(num_node_sets, len_name) ; int elem_ss1(num_side_ss1) ; int side_ss1(num_side_ss1) ;
  int node_ns1(num_nod_ns1) ; int connect1(num_el_in_blk1, num_nod_per_el1) ;
  connect1:elem_type = "HEX8" ; int connect2(num_el_in_blk2, num_nod_per_el2) ;
  connect2:elem_type = "HEX8" ; int connect3(num_el_in_blk3, num_nod_per_el3) ;
  connect3:elem_type = "WEDGE6" ; double coordx(num_nodes) ; double coordy(num_nodes) ;
  double coordz(num_nodes) ; int node_num_map(num_nodes) ; int elem_num_map(num_elem) ;
  char name_nod_var(num_nod_var, len_name) ; char name_elem_var(num_elem_var, len_name) ;
  double vals_nod_var1(time_step, num_nodes) ; int elem_var_tab(num_el_blk, num_elem_var) ;
  double vals_elem_var1eb2(time_step, num_el_in_blk2) ;
  :api_version = 5.14f ; :version = 5.14f ; :floating_point_word_size = 8 ; :file_size = 1 ;
  :title = "a grid" ;
data: time_whole = 0, 0.5, 2 ; eb_status = 1, 1, 1 ; eb_prop1 = 10, 20, 30 ;
  eb_names = "steel", "air", "lid" ; ss_status = 1 ; ss_prop1 = 3 ; ss_names = "inlet" ;
  ns_status = 1 ; ns_prop1 = 7 ; ns_names = "fixed" ;
  elem_ss1 = {numbers([c + 1 for c in self.inlet])} ; side_ss1 = {numbers([4] * len(self.inlet))} ;
  node_ns1 = {numbers([v + 1 for v in self.fixed])} ;
  connect1 = {numbers(np.array(self.steel) + 1)} ; connect2 = {numbers(np.array(self.air) + 1)} ;
  connect3 = {numbers(np.array(self.wedges) + 1)} ; coordx = {numbers(self.points[:, 0])} ;
  coordy = {numbers(self.points[:, 1])} ; coordz = {numbers(self.points[:, 2])} ;
  node_num_map = {numbers(self.node_map)} ; elem_num_map = {numbers(self.elem_map)} ;
  name_nod_var = "heat" ; name_elem_var = "flux" ; elem_var_tab = 0, 1, 0 ;
  vals_nod_var1 = {numbers(self.heat)} ; vals_elem_var1eb2 = {numbers(self.flux)} ;
}}
"""
        subprocess.run(["ncgen", "-k", "64-bit-offset", "-o", path, "-"], input=text, text=True,
                       check=True)


class Read:
    """The contents of a VTK or VTU file as VTK reads them."""

    def __init__(self, path):
        reader = (vtk.vtkXMLUnstructuredGridReader if path.endswith(".vtu")
                  else vtk.vtkUnstructuredGridReader)()
        reader.SetFileName(path)
        if path.endswith(".vtk"):
            reader.ReadAllScalarsOn()
            reader.ReadAllFieldsOn()
        reader.Update()
        grid = reader.GetOutput()
        self.points = vtk_to_numpy(grid.GetPoints().GetData())
        connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
        offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
        self.cells = [connectivity[a:b] for a, b in zip(offsets, offsets[1:])]
        self.types = vtk_to_numpy(grid.GetCellTypesArray())
        arrays = lambda data: {data.GetArrayName(a): vtk_to_numpy(data.GetArray(a))
                               for a in range(data.GetNumberOfArrays())
                               if data.GetArray(a) is not None}
        self.point, self.cell = arrays(grid.GetPointData()), arrays(grid.GetCellData())


def ncdump(path, variable):
    """Returns the values of a variable as a list of numbers or strings."""
    text = subprocess.run(["ncdump", "-p", "9,17", "-v", variable, path], capture_output=True,
                          text=True, check=True).stdout
    values = re.search(rf"\n {variable} =\s*(.*?) ;\n", text, re.S).group(1)
    if '"' in values:
        return re.findall(r'"(.*?)"', values)
    return np.array([float(v) for v in values.replace("\n", " ").split(",")])


class ExtractTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.grid = Grid()
        self.grid.write(self.path("grid.e"))

    def shm(self, *words, code=0):
        done = subprocess.run([SHM, *forced(words)], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stdout}{done.stderr}")
        return done.stdout, done.stderr

    def compressed(self, *how):
        self.shm("compress", self.path("grid.e"), "-o", self.path("grid.shm"), "--segment-cells",
                 "60", *how)
        return self.path("grid.shm")

    def extract(self, name, *words):
        """Extracts a piece of grid.shm. Returns the standard output of the tool and the path of the piece."""
        output, _ = self.shm("extract", self.path("grid.shm"), self.path(name), *words)
        return output, self.path(name)

    def expect_piece(self, whole, piece, chosen):
        """Compares a piece with the whole mesh. `chosen` contains the numbers that the cells of the piece
        have in the whole mesh."""
        cells, vertices = piece.cell["shm_cell_number"], piece.point["shm_vertex_number"]
        np.testing.assert_array_equal(cells, np.sort(np.asarray(chosen, dtype=np.int64)))
        used = sorted({v for c in chosen for v in whole.cells[c]})
        np.testing.assert_array_equal(vertices, used)
        np.testing.assert_array_equal(piece.points, whole.points[vertices])
        for at, cell in enumerate(cells):
            np.testing.assert_array_equal(vertices[piece.cells[at]], whole.cells[cell])
        np.testing.assert_array_equal(piece.types, whole.types[cells])
        for name, values in piece.point.items():
            if not name.startswith("shm_") and name in whole.point:
                np.testing.assert_array_equal(values, whole.point[name][vertices], name)
        for name, values in piece.cell.items():
            if not name.startswith("shm_") and name in whole.cell:
                np.testing.assert_array_equal(values, whole.cell[name][cells], name)

    def test_pieces_of_every_order(self):
        for how in ([], ["--order", "stream", "--delay", "0"], ["--order", "stream", "--delay", "50"],
                    ["--order", "free"]):
            source = self.compressed(*how)
            self.shm("decompress", source, "-o", self.path("whole.vtu"))
            whole = Read(self.path("whole.vtu"))
            count = len(whole.cells)
            inside = np.all((whole.points >= [.2, .1, .3]) & (whole.points <= [.6, .5, .55]), axis=1)
            in_box = [c for c in range(count) if inside[whole.cells[c]].any()]
            self.assertGreater(len(in_box), 5)
            box = ["--box", ".2,.1,.3,.6,.5,.55"]
            blocks = whole.cell["BlockId"]
            for words, chosen in (
                    (["--cells", "100:170"], range(100, 170)),
                    (["--cells", f"{count - 1}:{count}"], [count - 1]),
                    (box, in_box),
                    (["--block", "air"], np.flatnonzero(blocks == 20)),
                    (["--block", "10", "--block", "lid"], np.flatnonzero(blocks != 20)),
                    (box + ["--block", "20"], [c for c in in_box if blocks[c] == 20]),
                    (box + ["--cells", "0:300"], [c for c in in_box if c < 300]),
                    ([], range(count)))[::3 if SANITIZED else 1]:
                with self.subTest(how=how, words=words):
                    _, path = self.extract("piece.vtu", *words)
                    piece = Read(path)
                    self.expect_piece(whole, piece, list(chosen))
                    self.assertIn("heat", piece.point)
                    _, path = self.extract("piece.vtk", *words)
                    self.expect_piece(whole, Read(path), list(chosen))
            # In order `keep`, the points of the .shm file must also equal those of the original mesh.
            if not how:
                np.testing.assert_array_equal(whole.points, self.grid.points)

    def test_steps_and_arrays(self):
        for how in ([], ["--order", "stream", "--delay", "0"]):
            source = self.compressed(*how)
            for step in range(3):
                self.shm("decompress", source, "-o", self.path("whole.vtu"), "--step", str(step))
                whole = Read(self.path("whole.vtu"))
                _, path = self.extract("piece.vtu", "--cells", "150:260", "--step", str(step),
                                       "--array", "heat")
                piece = Read(path)
                self.expect_piece(whole, piece, list(range(150, 260)))
                self.assertIn("heat", piece.point)
                self.assertNotIn("flux", piece.cell)
        self.assertFalse((whole.point["heat"][:9] == self.grid.heat[0, :9]).all())

    def test_exodus_keeps_numbers_names_sets_and_steps(self):
        self.compressed()
        grid = self.grid
        _, path = self.extract("piece.e", "--cells", "100:300")
        vertices = sorted({v for c in grid.cells[100:300] for v in c})
        np.testing.assert_array_equal(ncdump(path, "node_num_map"), grid.node_map[vertices])
        np.testing.assert_array_equal(ncdump(path, "elem_num_map"), grid.elem_map[100:300])
        self.assertEqual(ncdump(path, "eb_names"), ["steel", "air"])
        np.testing.assert_array_equal(ncdump(path, "eb_prop1"), [10, 20])
        np.testing.assert_array_equal(ncdump(path, "time_whole"), [0, .5, 2])
        np.testing.assert_array_equal(ncdump(path, "vals_nod_var1"), grid.heat[:, vertices].ravel())
        np.testing.assert_array_equal(ncdump(path, "vals_elem_var1eb2"),
                                      grid.flux[:, :300 - len(grid.steel)].ravel())
        inlet = [c - 100 + 1 for c in grid.inlet if 100 <= c < 300]
        np.testing.assert_array_equal(ncdump(path, "elem_ss1"), inlet)
        np.testing.assert_array_equal(ncdump(path, "side_ss1"), [4] * len(inlet))
        self.assertEqual(ncdump(path, "ss_names"), ["inlet"])
        self.assertIn('title = "a grid"', subprocess.run(["ncdump", "-h", path], text=True,
                                                         capture_output=True, check=True).stdout)
        fixed = sorted(set(grid.fixed) & set(vertices))
        if fixed:
            np.testing.assert_array_equal(ncdump(path, "node_ns1"),
                                          [vertices.index(v) + 1 for v in fixed])
        # Extracts a second piece from the piece "piece.shm". Then decompresses "piece.shm" to Exodus.
        self.extract("piece.shm", "--cells", "100:300")
        self.shm("extract", self.path("piece.shm"), self.path("again.vtu"), "--cells", "50:60")
        again = Read(self.path("again.vtu"))
        np.testing.assert_array_equal(again.cell["shm_cell_number"], range(150, 160))
        np.testing.assert_array_equal(again.cell["elem_num_map"], grid.elem_map[150:160])
        self.shm("decompress", self.path("piece.shm"), "-o", self.path("back.e"))
        np.testing.assert_array_equal(ncdump(self.path("back.e"), "elem_ss1"), inlet)
        self.assertEqual(ncdump(self.path("back.e"), "ss_names"), ["inlet"])
        np.testing.assert_array_equal(ncdump(self.path("back.e"), "elem_num_map"),
                                      grid.elem_map[100:300])
        # The source "none.shm" has no number maps. The element number map of the extracted piece therefore
        # contains the positions of the elements in "none.shm", counted from 1.
        self.shm("extract", self.path("piece.shm"), self.path("none.vtk"), "--cells", "50:60")
        self.shm("compress", self.path("none.vtk"), "-o", self.path("none.shm"))
        self.shm("extract", self.path("none.shm"), self.path("none.e"), "--cells", "3:6")
        np.testing.assert_array_equal(ncdump(self.path("none.e"), "elem_num_map"), [4, 5, 6])

    def test_sets(self):
        for how in ([], ["--order", "stream", "--delay", "20"]):
            self.compressed(*how)
            for name in ("inlet", "3", "side_set_3"):
                _, path = self.extract("sides.vtu", "--set", name)
                sides = Read(path)
                self.assertTrue((sides.types == vtk.VTK_QUAD).all())
                self.assertEqual(len(sides.cells), len(self.grid.inlet))
                self.assertTrue((sides.cell["shm_side"] == 4).all())
                # The set covers the part of the face x = 0 that is below the wedges. The mesh is sheared
                # along y. Each point must occur once.
                self.assertEqual(len(sides.points), (N + 1) * N)
                np.testing.assert_allclose(sides.points[:, 0], sides.points[:, 1] * .08)
                middles = {tuple(np.round(sides.points[c].mean(axis=0), 9)) for c in sides.cells}
                self.assertEqual(len(middles), len(sides.cells))
                expected = {tuple(np.round(self.grid.points[[self.grid.cells[c][i]
                                                             for i in (0, 3, 4, 7)]].mean(axis=0), 9))
                            for c in self.grid.inlet}
                self.assertEqual(middles, expected)
                by_place = {tuple(p): h for p, h in zip(self.grid.points, self.grid.heat[2])}
                np.testing.assert_array_equal(sides.point["heat"],
                                              [by_place[tuple(p)] for p in sides.points])
            _, path = self.extract("nodes.vtu", "--set", "fixed")
            nodes = Read(path)
            self.assertTrue((nodes.types == vtk.VTK_VERTEX).all())
            self.assertEqual({tuple(p) for p in nodes.points},
                             {tuple(p) for p in self.grid.points[self.grid.fixed]})
            self.assertEqual(len(nodes.cells), len(self.grid.fixed))
            _, path = self.extract("nodes.vtu", "--set", "fixed", "--box", "0,0,0,.3,.3,.3")
            self.assertEqual(len(Read(path).points), 9)
            _, path = self.extract("part.vtu", "--set", "inlet", "--box", "-1,-1,-1,2,2,.1")
            self.assertEqual(len(Read(path).cells), N)

    def test_info_lists_the_sets_of_a_piece(self):
        def sets_of(path):
            return sorted(json.loads(self.shm("info", "--json", path)[0])["sets"],
                          key=lambda each: each["kind"])

        whole = self.compressed()
        grid = self.grid
        self.assertEqual(sets_of(whole), [
            {"kind": "node set", "id": "7", "name": "fixed", "members": len(grid.fixed)},
            {"kind": "side set", "id": "3", "name": "inlet", "members": len(grid.inlet)}])
        _, piece = self.extract("piece.shm", "--cells", "0:100")
        used = {v for c in grid.cells[:100] for v in c}
        self.assertEqual(sets_of(piece), [
            {"kind": "node set", "id": "7", "name": "fixed", "members": len(used & set(grid.fixed))},
            {"kind": "side set", "id": "3", "name": "inlet",
             "members": sum(c < 100 for c in grid.inlet)}])
        self.assertIn("side set 3 'inlet'", self.shm("info", piece)[0])
        # In the Gmsh file, groups keep their names as physical groups. The blocks become physical groups,
        # too.
        self.extract("piece.msh", "--cells", "150:210")
        self.assertEqual([each["name"] for each in sets_of(self.path("piece.msh"))],
                         ["inlet", "steel", "air"])

    def test_physical_groups(self):
        self.compressed()
        self.extract("piece.msh", "--cells", "150:210")
        self.shm("compress", self.path("piece.msh"), "-o", self.path("grid.shm"))
        _, path = self.extract("air.vtu", "--block", "air")
        self.assertEqual(len(Read(path).cells), 210 - len(self.grid.steel))

    def test_a_group_of_two_volumes(self):
        """The group "one" contains volume 1. The group "both" contains volumes 1 and 2."""
        points = [(x, y, z) for z in range(2) for y in range(2) for x in range(3)]
        with open(self.path("two.msh"), "w") as out:
            out.write("""$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
3 1 "one"
3 2 "both"
$EndPhysicalNames
$Entities
0 0 0 2
1 0 0 0 1 1 1 2 1 2 0
2 1 0 0 2 1 1 1 2 0
$EndEntities
$Nodes
1 12 1 12
3 1 0 12
""" + "\n".join(map(str, range(1, 13))) + "\n" + "\n".join("%g %g %g" % p for p in points) + """
$EndNodes
$Elements
2 2 1 2
3 1 5 1
1 1 2 5 4 7 8 11 10
3 2 5 1
2 2 3 6 5 8 9 12 11
$EndElements
""")
        self.shm("compress", self.path("two.msh"), "-o", self.path("grid.shm"))
        for words, chosen in ((["--set", "both"], [0, 1]), (["--set", "both", "--cells", "1:2"], [1])):
            _, path = self.extract("group.vtu", *words)
            np.testing.assert_array_equal(Read(path).cell["shm_cell_number"], chosen)
        _, errors = self.shm("extract", self.path("grid.shm"), self.path("x.vtu"), "--set", "three",
                           code=2)
        self.assertIn("'both'", errors)

    def test_bytes(self):
        self.compressed()
        size = os.path.getsize(self.path("grid.shm"))
        output, _ = self.extract("piece.vtu", "--cells", "60:120", "--step", "0", "--array", "heat")
        read, of = map(int, re.search(r"read (\d+) of (\d+) bytes", output).groups())
        self.assertEqual(of, size)
        self.assertLess(read, size * 2 // 3)
        everything, _ = self.extract("piece.e")
        self.assertGreater(int(re.search(r"read (\d+) of", everything).group(1)), read)

    def test_archives(self):
        self.compressed()
        self.shm("join", "-o", self.path("both.shm"), self.path("grid.shm"), self.path("grid.e"))
        _, errors = self.shm("extract", self.path("both.shm"), self.path("x.vtu"), code=2)
        self.assertIn("grid.shm, grid.e", errors)
        _, errors = self.shm("extract", self.path("both.shm"), self.path("x.vtu"), "--part", "no", code=2)
        self.assertIn("grid.shm, grid.e", errors)
        for part in ("grid.shm", "grid.e"):
            self.shm("extract", self.path("both.shm"), self.path("x.vtu"), "--part", part, "--cells",
                     "10:20")
            np.testing.assert_array_equal(Read(self.path("x.vtu")).cell["shm_cell_number"],
                                          range(10, 20))
        self.shm("extract", self.path("grid.shm"), self.path("y.vtu"), "--part", "grid.e", code=2)

    def test_what_is_not_there(self):
        self.compressed()
        for words, expected in ((["--cells", "5:4"], "0:576"), (["--cells", "5:5"], "0:576"),
                            (["--cells", "0:10000"], "0:576"), (["--cells", "7"], "A:B"),
                            (["--cells", "-1:7"], "A:B"),
                            (["--block", "40"], "10 'steel', 20 'air', 30 'lid'"),
                            (["--array", "cold"], "point/heat, cell/flux"),
                            (["--set", "outlet"], "node set 7 'fixed', side set 3 'inlet'"),
                            (["--step", "3"], "has 3, counted from 0"),
                            (["--box", "1,2,3"], "six numbers"),
                            (["--box", "0,0,0,1,1,nan"], "six numbers"),
                            (["--box", "0,0,1,1,1,0"], "z has a minimum above"),
                            (["--box", "7,7,7,8,8,8"], "the bounding box of the mesh is 0,0,0,1.08,1,1"),
                            (["--set", "fixed", "--block", "air"], "cannot be used"),
                            (["--block", "steel", "--cells", "400:410"], "nothing to extract")):
            with self.subTest(words=words):
                _, errors = self.shm("extract", self.path("grid.shm"), self.path("x.vtu"), *words,
                                   code=2)
                self.assertIn(expected, errors)
                self.assertEqual(errors.count("\n"), 1)
        self.shm("extract", self.path("grid.e"), self.path("x.vtu"), code=3)
        self.shm("extract", "-", self.path("x.vtu"), code=2)
        self.shm("extract", self.path("grid.shm"), self.path("x.unknown"), code=2)
        with open(self.path("grid.shm"), "rb") as whole, open(self.path("cut.shm"), "wb") as cut:
            cut.write(whole.read()[:-100])
        _, errors = self.shm("extract", self.path("cut.shm"), self.path("x.vtu"), code=3)
        self.assertIn("the file has been cut", errors)
        self.assertFalse(os.path.exists(self.path("x.vtu")))
        # UCD has no time steps, and VTK cannot store the truth table of Exodus. Both losses are reported. With
        # --strict, they are errors.
        _, errors = self.shm("extract", self.path("grid.shm"), self.path("x.vtu"), "--strict", code=6)
        self.assertIn("not in", errors)
        self.assertFalse(os.path.exists(self.path("x.vtu")))


if __name__ == "__main__":
    SHM = sys.argv.pop(1)
    unittest.main(verbosity=2)
