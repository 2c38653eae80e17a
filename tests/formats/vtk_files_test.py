#!/usr/bin/env python3
"""Tests that the tool converts between legacy VTK and VTU in both directions. VTK's own readers check the
results.

Usage: vtk_files_test.py PATH_OF_SHM      (exit code 77, skipped, if VTK for Python is missing)
Also tests files of the corpus if SHM_CORPUS names its folder.
"""
import glob
import os
import random
import re
import shutil
import subprocess
import sys
import unittest

try:
    import numpy  # noqa: F401, the oracles need it
    import vtk
except ImportError:
    print("no vtk or no numpy for Python")
    sys.exit(77)
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import vtk_oracle
import vtu_oracle
from folder_test import SANITIZED, FolderTest, forced

SHM = "shm"
LARGEST_OF_CORPUS = 3 << 20
EVERY = 5 if SANITIZED else 1  # of very many similar files
VARIANTS = "field data 'variants' (variants)"
TABLE = "lookup table 'lookup_table'"
AXES = ["metadata of " + axis + "_COORDINATES" for axis in "XYZ"]
# Maps the names of some corpus files to the items of the file that VTU cannot store.
OF_CORPUS = {
    "vtk-data__can.vtk": ["title 'converted from pyvista/vtk-data:Data/can.vtu'"],
    "sofa__vox8_binary.vtk": [TABLE],
}
# Maps the names of some corpus files to the items that VTU stores under another name and that legacy files do not
# contain.
OTHERWISE = {"vtk-data__can.vtk": ["Title"]}

HEAD = "# vtk DataFile Version 4.2\n{title}\nASCII\nDATASET UNSTRUCTURED_GRID\n"
TETRAHEDRON = """POINTS 4 double
0 0 0 1 0 0 0 1 0 0 0 1
CELLS 1 5
4 0 1 2 3
CELL_TYPES 1
10
"""


def array_xml(name, values, kind="Int32", components=1, more=""):
    word = "Array" if kind == "String" else "DataArray"
    return (f'<{word} type="{kind}" Name="{name}" NumberOfComponents="{components}" {more} '
            f'format="ascii">{values}</{word}>')


def text_xml(name, strings, more=""):
    codes = " ".join(str(byte) for text in strings for byte in text.encode() + b"\0")
    return array_xml(name, codes, "String", 1, more)


def grid_xml(points, cells, kind, point_data="", cell_data="", field="", of_points="",
             version="1.0"):
    ends = [sum(map(len, cells[:i + 1])) for i in range(len(cells))]
    words = lambda lists: " ".join(str(value) for row in lists for value in row)
    return (f'<VTKFile type="UnstructuredGrid" version="{version}" byte_order="LittleEndian">'
            f'<UnstructuredGrid><FieldData>{field}</FieldData>'
            f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">'
            f'{point_data or "<PointData/>"}{cell_data or "<CellData/>"}<Points>'
            + array_xml("Points", words(points), "Float64", 3, of_points) + "</Points><Cells>"
            + array_xml("connectivity", words(cells), "Int64")
            + array_xml("offsets", " ".join(map(str, ends)), "Int64")
            + array_xml("types", " ".join([str(kind)] * len(cells)), "UInt8")
            + "</Cells></Piece></UnstructuredGrid></VTKFile>")


def shuffled_grid(size):
    """Returns points and hexahedra of a cube of `size` cells per side, in random order."""
    m = size + 1
    number = list(range(m ** 3))
    random.Random(3).shuffle(number)
    points = [None] * m ** 3
    for i, place in enumerate(number):
        points[place] = (i % m, i // m % m, i // m // m)
    at = lambda x, y, z: number[(z * m + y) * m + x]
    cells = [[at(x, y, z), at(x + 1, y, z), at(x + 1, y + 1, z), at(x, y + 1, z),
              at(x, y, z + 1), at(x + 1, y, z + 1), at(x + 1, y + 1, z + 1), at(x, y + 1, z + 1)]
             for x in range(size) for y in range(size) for z in range(size)]
    random.Random(4).shuffle(cells)
    return points, cells


class VtkFamilyTest(FolderTest):
    maxDiff = None

    def shm(self, *words, code=0):
        done = subprocess.run([SHM, *forced(words)], capture_output=True, encoding="utf-8")
        self.assertEqual(done.returncode, code, done.stderr + done.stdout)
        return done

    def losses(self, *words, code=0):
        """Runs the tool and returns the items that its messages report as missing from the output."""
        return [re.sub(r"^shm: not in [^:]*: ", "", line)
                for line in self.shm(*words, "-q", code=code).stderr.splitlines()]

    def assert_same(self, a, b, unlike=(), step=-1):
        self.assertEqual(vtu_oracle.compare_legacy(a, b, unlike, step), 0, f"{a} against {b}")

    def there_and_back(self, source, lost, lost_back=(), unlike=()):
        there, back = ("there.vtu", "back.vtk") if source.endswith(".vtk") else ("there.vtk",
                                                                               "back.vtu")
        there, back = self.path(there), self.path(back)
        self.assertEqual(sorted(self.losses("convert", source, there)), sorted(lost))
        self.assert_same(source, there, unlike)
        self.assertEqual(sorted(self.losses("convert", there, back)), sorted(lost_back))
        self.assert_same(there, back, unlike)

    # --- whole files

    def test_every_kind_of_cell_and_array(self):
        for version, encoding in (("42", "ASCII"), ("42", "BINARY"), ("51", "BINARY")):
            with self.subTest(version=version, encoding=encoding):
                vtk_oracle.write(vtk_oracle.sample(), version, encoding, self.path("all.vtk"))
                self.there_and_back(self.path("all.vtk"), [VARIANTS, TABLE])

    def test_structured_and_polygonal_data(self):
        os.mkdir(self.path("samples"))
        vtk_oracle.write_samples(self.path("samples"))
        files = sorted(glob.glob(self.path("samples/*.vtk")))
        self.assertEqual(len(files), 76)
        for path in files[::EVERY]:
            kind, _, rest = os.path.basename(path).partition("-")
            shape = rest.split("-")[0] if rest.count("-") == 2 else ""
            lost = [VARIANTS] + [TABLE] * (shape != "empty")
            if kind == "polydata":
                lost.append("kind of data set (POLYDATA)")
            else:
                size = vtk_oracle.SHAPES[shape]
                words = ("dimensions " + " ".join(map(str, size)) if shape != "extent"
                         else "extent 2 5 -3 -1 0 4")
                lost.append(f"{words} ({kind.upper()})")
            lost += AXES * (kind == "rectilinear_grid")
            with self.subTest(os.path.basename(path)):
                self.there_and_back(path, lost)

    def test_files_of_vtk_s_xml_writer(self):
        os.mkdir(self.path("samples"))
        vtu_oracle.write_samples(self.path("samples"))
        for name in ("raw_zlib_64_little", "base64_lz4_32_big", "binary_lzma_64_big",
                     "ascii_none_32_little"):
            with self.subTest(name):
                self.there_and_back(self.path(f"samples/{name}.vtu"), [])

    def test_corpus(self):
        corpus = os.environ.get("SHM_CORPUS", "")
        if not os.path.isdir(corpus):
            self.skipTest("SHM_CORPUS names no folder")
        files = [path for path in glob.glob(os.path.join(corpus, "*", "*.vt[ku]"))
                 if os.path.getsize(path) <= LARGEST_OF_CORPUS]
        self.assertGreater(len(files), 25)
        for path in sorted(files)[::EVERY]:
            name = os.path.basename(path)
            with self.subTest(name):
                self.there_and_back(path, OF_CORPUS.get(name, []), [],
                                    OTHERWISE.get(name, []))

    def test_through_archives(self):
        """A .shm file decompresses to the same contents in both formats, whatever the order of the .shm
        file."""
        vtk_oracle.write(vtk_oracle.sample(), "51", "BINARY", self.path("all.vtk"))
        os.mkdir(self.path("samples"))
        vtu_oracle.write_samples(self.path("samples"))
        sources = {self.path("all.vtk"): [VARIANTS, TABLE],
                   self.path("samples/raw_zlib_64_little.vtu"): []}
        for source, lost in sources.items():
            own, other = (".vtk", ".vtu") if source.endswith(".vtk") else (".vtu", ".vtk")
            for order in ("keep", "stream", "free"):
                with self.subTest(source=source, order=order):
                    packed, own_path, path = (self.path("packed.shm"), self.path("own" + own),
                                              self.path("other" + other))
                    self.shm("compress", source, "--order", order, "-o", packed)
                    self.losses("decompress", packed, "-o", own_path)
                    self.assertEqual(self.losses("decompress", packed, "-o", path), lost)
                    self.assert_same(own_path, path)

    # --- steps and time

    def test_each_step(self):
        path = self.path("steps.vtu")
        vtu_oracle.write_steps(path)
        other_time = "field data 'TimeValue' (replaced by the time of the step)"
        for step in range(3):
            there = self.path("step.vtk")
            self.assertEqual(self.losses("convert", path, there, f"--step={step}"), [other_time])
            self.assert_same(path, there, step=step)
        self.assertEqual(self.losses("convert", path, there),
                         ["time steps 0 to 1 of 3 (a file of format vtk holds one step: --step N selects "
                          "it, a name such as out_%04d writes one file per step)", other_time])
        self.assert_same(path, there)

    def test_arrays_and_strings_of_some_steps(self):
        points, cells = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [[0, 1, 2, 3]]
        data = "<PointData>" + "".join(
            array_xml("always", f"{step} 1 2 3", "Int32", 1, f'TimeStep="{step}"')
            + text_xml("same", ["a", "b", "c", "d"], f'TimeStep="{step}"')
            + text_xml("other", ["a", "b", "c", str(step)], f'TimeStep="{step}"')
            for step in range(2)) + array_xml("first", "4 5 6 7", "Int32", 1,
                                              'TimeStep="0"') + "</PointData>"
        text = grid_xml(points, cells, 10, data).replace(
            "<UnstructuredGrid>", '<UnstructuredGrid TimeValues="1.5 2.5">')
        path, there = self.write("some.vtu", text), self.path("some.vtk")
        for step, missing in ((0, 1), (1, 0)):
            lost = self.losses("convert", path, there, f"--step={step}")
            expected = [f"array 'other' at time step {missing}"]
            self.assertEqual(lost, expected + ["array 'first' at time step 0"] * step)
            grid, found = vtu_oracle.seen(there)
            data = grid.GetPointData()
            strings = [data.GetAbstractArray("other").GetValue(i) for i in range(4)]
            self.assertEqual(strings, ["a", "b", "c", str(step)])
            self.assertEqual(data.GetAbstractArray("same").GetValue(3), "d")
            self.assertEqual(data.GetArray("always").GetValue(0), step)
            self.assertEqual(data.GetArray("first") is not None, step == 0)
            self.assertEqual(found["FieldData", "TimeValue"][-1], (repr(step + 1.5),))

    def test_points_that_move(self):
        points, cells = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [[0, 1, 2, 3]]
        data = "<PointData>" + "".join(
            array_xml("t", f"{step} 1 2 3", "Int32", 1, f'TimeStep="{step}"')
            for step in range(3)) + "</PointData>"
        text = grid_xml(points, cells, 10, data).replace(
            "<UnstructuredGrid>", '<UnstructuredGrid TimeValues="0 1 2">')
        first = re.search("<Points>.*</Points>", text)[0]
        moved = "".join(array_xml("Points", f"0 0 0 1 0 0 0 1 0 0 0 {1 + step // 2}", "Float64", 3,
                                  f'TimeStep="{step}"') for step in range(3))
        path = self.write("moved.vtu", text.replace(first, f"<Points>{moved}</Points>"))
        for step in range(3):
            for target in ("moved.vtk", "moved.inp"):
                self.losses("convert", path, self.path(target), f"--step={step}")
            self.assert_same(path, self.path("moved.vtk"), step=step)
            with open(self.path("moved.inp")) as file:
                self.assertIn(f"4 0 0 {1 + step // 2}", re.sub(" +", " ", file.read()))
        self.shm("compress", path, "-o", self.path("moved.shm"))
        for words, height in ((["--step", "1"], 1), (["--step", "2"], 2), (["--array", "t"], 2)):
            for target in ("piece.vtu", "piece.vtk"):
                self.shm("extract", self.path("moved.shm"), self.path(target), *words)
                grid, _ = vtu_oracle.seen(self.path(target))
                self.assertEqual(grid.GetPoint(3)[2], height, (words, target))

    def test_pieces_keep_title_time_and_order_of_nodes(self):
        points = [(x, y, z) for z in range(3) for y in range(3) for x in range(3)]
        # The element is a second-order Lagrange hexahedron with nodes at its corners, edges, faces and
        # centre. Nodes 18 and 19, on two vertical edges, are exchanged between old and new versions of the
        # file format.
        hexahedron = [0, 2, 8, 6, 18, 20, 26, 24, 1, 5, 7, 3, 19, 23, 25, 21, 9, 11, 17, 15,
                      12, 14, 10, 16, 4, 22, 13]
        field = array_xml("TimeValue", "2.5", "Float64", 1, 'NumberOfTuples="1"')
        field += text_xml("Title", ["a title"], 'NumberOfTuples="1"')
        source = self.write("curved.vtu", grid_xml(points, [hexahedron], 72, field=field,
                                                   version="2.2"))
        self.shm("compress", source, "-o", self.path("curved.shm"))
        self.shm("extract", self.path("curved.shm"), self.path("part.shm"), "--cells", "0:1")
        whole, _ = vtu_oracle.seen(source)
        nodes = lambda grid: [grid.GetPoint(grid.GetCell(0).GetPointId(i)) for i in range(27)]
        for source in ("curved.shm", "part.shm"):
            for target in ("piece.vtu", "piece.vtk"):
                words = ["--cells", "0:1"] if source == "curved.shm" else []
                self.shm("extract", self.path(source), self.path(target), *words)
                with self.subTest(source=source, target=target):
                    grid, _ = vtu_oracle.seen(self.path(target))
                    self.assertEqual(nodes(grid), nodes(whole))
        grid, found = vtu_oracle.seen(self.path("piece.vtu"))
        self.shm("extract", self.path("curved.shm"), self.path("piece.vtk"), "--cells", "0:1")
        with open(self.path("piece.vtk"), "rb") as file:
            text = file.read(4096)
        self.assertEqual(text.split(b"\n")[1], b"a title")
        self.assertIn(b"TIME 1 1 double", text)

    def test_time_of_a_single_mesh_in_exodus(self):
        if not shutil.which("ncdump"):
            self.skipTest("no ncdump")
        points, cells = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [[0, 1, 2, 3]]
        data = "<PointData>" + array_xml("heat", "1 2 3 4", "Float64") + "</PointData>"
        for kind, value in (("Float64", "2.5"), ("Float32", "2.5"), ("Int32", "7")):
            time = array_xml("TimeValue", value, kind, 1, 'NumberOfTuples="1"')
            names = text_xml("BlockNames", ["10 steel"], 'NumberOfTuples="1"')
            ids = "<CellData>" + array_xml("BlockId", "10") + "</CellData>"
            source = self.write("one.vtu", grid_xml(points, cells, 10, data, ids, time + names))
            self.shm("convert", source, self.path("one.vtk"))
            for name in ("one.vtu", "one.vtk"):
                with self.subTest(name=name, kind=kind):
                    exodus = self.path("one.e")
                    self.assertEqual(self.losses("convert", self.path(name), exodus), [])
                    text = subprocess.run(["ncdump", "-v", "time_whole,vals_nod_var1,eb_names",
                                           exodus], capture_output=True, text=True,
                                          check=True).stdout
                    self.assertIn(f"time_whole = {float(value):g} ;", text)
                    self.assertRegex(text, r"vals_nod_var1 =\s+1, 2, 3, 4 ;")
                    self.assertIn('"steel', text)
                    self.losses("convert", exodus, self.path("back.vtu"))
                    _, found = vtu_oracle.seen(self.path("back.vtu"))
                    self.assertEqual(found["FieldData", "TimeValue"][-1], (repr(float(value)),))

    # --- strings

    def test_strings_follow_points_and_cells(self):
        points, cells = shuffled_grid(5)
        name_of = lambda place: "p" + "".join(map(str, place)) + "é"
        centre = lambda cell: tuple(sum(points[v][k] for v in cell) for k in range(3))
        data = ("<PointData>" + text_xml("names", map(name_of, points)) + "</PointData>",
                "<CellData>" + text_xml("cells", (name_of(centre(c)) for c in cells)) + "</CellData>")
        source = self.write("strings.vtu", grid_xml(points, cells, 12, *data))
        legacy = self.path("strings.vtk")
        self.assertEqual(self.losses("convert", source, legacy), [])
        for path in (source, legacy):
            for order in ("keep", "stream", "free"):
                packed = self.path("packed.shm")
                self.shm("compress", path, "--order", order, "-o", packed)
                self.shm("verify", packed, "--against", path)
                for target in ("back.vtu", "back.vtk"):
                    with self.subTest(source=path, order=order, target=target):
                        back = self.path(target)
                        self.assertEqual(self.losses("decompress", packed, "-o", back), [])
                        grid, _ = vtu_oracle.seen(back)
                        names = grid.GetPointData().GetAbstractArray("names")
                        places = [tuple(map(int, grid.GetPoint(i))) for i in range(len(points))]
                        if order != "keep":
                            self.assertNotEqual(places, points)
                        self.assertEqual([names.GetValue(i) for i in range(len(points))],
                                         list(map(name_of, places)))
                        names = grid.GetCellData().GetAbstractArray("cells")
                        for c in range(len(cells)):
                            ids = grid.GetCell(c).GetPointIds()
                            middle = tuple(sum(places[ids.GetId(i)][k] for i in range(8))
                                           for k in range(3))
                            self.assertEqual(names.GetValue(c), name_of(middle))
                        # In every vertex order, each vertex keeps its string, although the strings change their
                        # places in the array.
                        self.shm("diff", path, back, "--match")
        self.assertIn("names", self.shm("diff", source, back, code=1).stdout)

    def test_a_changed_string_is_found(self):
        points, cells = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [[0, 1, 2, 3]]
        write = lambda name, strings: self.write(name, grid_xml(
            points, cells, 10, "<PointData>" + text_xml("s", strings) + "</PointData>"))
        a, b = write("a.vtu", ["x", "y", "x", "z"]), write("b.vtu", ["x", "y", "q", "z"])
        self.shm("convert", b, self.path("b.vtk"))
        for other in (b, self.path("b.vtk")):
            text = self.shm("diff", a, other, code=1).stdout
            self.assertIn("array 'point/s': 1 of 4 values differs\n", text)
            self.assertIn("vertex 2 at (0 1 0): 'x' in A, 'q' in B", text)
            self.assertNotIn("vtk/strings", text)
        for strings in (["x", "y"], ["a", "b", "c", "d", "e"]):
            self.assertIn("strings", self.shm("info", write("bad.vtu", strings), code=3).stderr)

    def test_pieces(self):
        """The strings of all pieces are joined into one array. The tool reports an array that only some pieces
        contain."""
        first = grid_xml([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [[0, 1, 2, 3]], 10,
                         "<PointData>" + text_xml("s", "abcd") + "</PointData>")
        second = grid_xml([(5, 0, 0), (6, 0, 0), (5, 1, 0)], [[0, 1, 2]], 5,
                          "<PointData>" + text_xml("s", "xay") + array_xml("only", "1 2 3")
                          + "</PointData>")
        piece = re.search("<Piece.*</Piece>", second)[0]
        path = self.write("two.vtu", first.replace("</Piece>", "</Piece>" + piece))
        for order in ("keep", "stream"):
            self.shm("compress", path, "--order", order, "-o", self.path("two.shm"))
            self.assertEqual(self.losses("decompress", self.path("two.shm"), "-o",
                                         self.path("two.vtk")),
                             ["array 'only' of piece 1", "split into 2 pieces"])
            self.losses("decompress", self.path("two.shm"), "-o", self.path("back.vtu"))
            for name in ("two.vtk", "back.vtu"):
                grid, _ = vtu_oracle.seen(self.path(name))
                strings = grid.GetPointData().GetAbstractArray("s")
                found = {grid.GetPoint(i): strings.GetValue(i) for i in range(7)}
                self.assertEqual([found[p] for p in ((1, 0, 0), (0, 0, 1), (5, 0, 0), (6, 0, 0),
                                                     (5, 1, 0))], ["b", "d", "x", "a", "y"])

    # --- converted and reported items

    def test_attributes_bits_and_names(self):
        data = """POINT_DATA 4
SCALARS six float 6
LOOKUP_TABLE default
1 2 3 4 5 6 1 2 3 4 5 6 1 2 3 4 5 6 1 2 3 4 5 6
METADATA
COMPONENT_NAMES
xx

zz
xy
yz
xz

SCALARS second float 1
LOOKUP_TABLE default
1 2 3 4
TENSORS6 stress float
1 2 3 4 5 6 1 2 3 4 5 6 1 2 3 4 5 6 1 2 3 4 5 6
GLOBAL_IDS gid vtktypeint64
10000000000 2 3 4
EDGE_FLAGS edge int
0 1 0 1
FIELD more 3
bits 3 4 bit
0 1 1 0 1 1 1 1 0 0 0 1
words 2 4 string
a%20b



c%25
%C3%A9

x
odd 1 3 int
7 8 9
CELL_DATA 1
VECTORS v double
1 2 3
"""
        field = "FIELD FieldData 2\nTIME 1 1 double\n2.5\nflags 3 2 bit\n1 0 1 1 1 0\n"
        metadata = "METADATA\nCOMPONENT_NAMES\neast\nnorth\nup\n\n"
        text = HEAD.format(title="a title of 5 words") + field + TETRAHEDRON.replace(
            "0 0 1\n", "0 0 1\n" + metadata, 1) + data
        path = self.write("all.vtk", text)
        place = "place of array 'odd' (3 values for 4 points; field data there)"
        # The conversion stores the array 'odd' as field data. VTK nevertheless reads it as a point array.
        self.there_and_back(path, [place], unlike=["odd"])
        grid, found = vtu_oracle.seen(self.path("there.vtu"))
        self.assertEqual(found["FieldData", "Title"], "a title of 5 words")
        self.assertEqual(found["PointData", vtk.vtkDataSetAttributes.SCALARS], "six")
        self.assertEqual(found["PointData", vtk.vtkDataSetAttributes.TENSORS], "stress")
        self.assertEqual(found["PointData", "six"][2], ("xx", None, "zz", "xy", "yz", "xz"))
        self.assertEqual(found["CellData", vtk.vtkDataSetAttributes.VECTORS], "v")
        self.assertEqual(grid.GetFieldData().GetArray("odd").GetNumberOfTuples(), 3)
        for name in ("there.vtu", "back.vtk"):
            points = vtu_oracle.seen(self.path(name))[0].GetPoints().GetData()
            self.assertEqual([points.GetComponentName(c) for c in range(3)], ["east", "north", "up"])
        self.assertIsInstance(grid.GetPointData().GetArray("bits"), vtk.vtkBitArray)

    def test_integer_points_and_blanking(self):
        text = ("# vtk DataFile Version 2.0\nvtk output\nASCII\nDATASET STRUCTURED_GRID\n"
                "DIMENSIONS 2 2 1\nPOINTS 4 int\n0 0 0 1 0 0 0 1 0 1 1 0\nBLANKING 4 char\n1 0 1 1\n")
        self.assertEqual(self.losses("convert", self.write("old.vtk", text), self.path("old.vtu")),
                         ["dimensions 2 2 1 (STRUCTURED_GRID)"])
        grid, found = vtu_oracle.seen(self.path("old.vtu"))
        self.assertIsInstance(grid.GetPoints().GetData(), vtk.vtkIntArray)
        self.assertEqual(found["PointData", "BLANKING"][-1], ("1", "0", "1", "1"))
        self.shm("convert", self.path("old.vtu"), self.path("back.vtk"))
        grid, _ = vtu_oracle.seen(self.path("back.vtk"))
        self.assertIsInstance(grid.GetPoints().GetData(), vtk.vtkIntArray)

    def test_polyhedra(self):
        """Two polyhedra share a face. They list the corners of that face in opposite directions."""
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]
        faces = [[(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], [(1, 3, 2), (1, 2, 4), (2, 3, 4),
                                                                 (3, 1, 4)]]
        grid = vtk.vtkUnstructuredGrid()
        places = vtk.vtkPoints()
        for point in points:
            places.InsertNextPoint(point)
        grid.SetPoints(places)
        for cell in faces:
            stream = vtk.vtkIdList()
            for value in [len(cell)] + [v for face in cell for v in (len(face), *face)]:
                stream.InsertNextId(value)
            grid.InsertNextCell(vtk.VTK_POLYHEDRON, stream)
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetFileName(self.path("cells.vtu"))
        writer.SetInputData(grid)
        writer.Write()
        vtk_oracle.write(grid, "42", "BINARY", self.path("cells.vtk"))
        self.there_and_back(self.path("cells.vtu"), [])
        self.there_and_back(self.path("cells.vtk"), [])
        for order in ("stream", "free"):
            self.shm("compress", self.path("cells.vtk"), "--order", order, "-o", self.path("c.shm"))
            for target in ("c.vtu", "c.vtk"):
                self.shm("decompress", self.path("c.shm"), "-o", self.path(target))
            self.assert_same(self.path("c.vtu"), self.path("c.vtk"))
            found, _ = vtu_oracle.seen(self.path("c.vtu"))
            for c, cell in enumerate(faces):
                stream, of_cell = vtk.vtkIdList(), []
                found.GetFaceStream(c, stream)
                at = 1
                for _ in range(stream.GetId(0)):
                    size = stream.GetId(at)
                    of_cell.append([found.GetPoint(stream.GetId(at + 1 + i)) for i in range(size)])
                    at += size + 1
                self.assertEqual(of_cell, [[tuple(map(float, points[v])) for v in face]
                                           for face in cell])

    def test_only_xml_files_say_it(self):
        points, cells = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [[0, 1, 2, 3]]
        data = ('<PointData Scalars="t" Vectors="t" Tangents="n" GlobalIds="g">'
                + array_xml("t", "1 2 3 4") + array_xml("n", "1 0 0 " * 4, "Float32", 3)
                + array_xml("g", "4 5 6 7", "Int64", 1, 'IdType="1"') + "</PointData>")
        text = grid_xml(points, cells, 10, data).replace(
            "<UnstructuredGrid>", "<!-- by hand --><UnstructuredGrid><Mine>x</Mine>")
        path, there = self.write("odd.vtu", text), self.path("odd.vtk")
        lost = ["attribute Vectors of array 't'", "attribute Tangents of array 'n'", "comments",
                "element 'Mine'"]
        self.assertEqual(sorted(self.losses("convert", path, there)), sorted(lost))
        _, found = vtu_oracle.seen(there)
        self.assertEqual(found["PointData", vtk.vtkDataSetAttributes.SCALARS], "t")
        self.assertEqual(found["PointData", vtk.vtkDataSetAttributes.GLOBALIDS], "g")
        os.remove(there)
        self.losses("convert", path, there, "--strict", code=6)
        self.assertFalse(os.path.exists(there))

    def test_strict_between_them_when_nothing_is_lost(self):
        text = HEAD.format(title="a grid") + TETRAHEDRON + ("POINT_DATA 4\nSCALARS t int 1\n"
                                                            "LOOKUP_TABLE default\n1 2 3 4\n")
        path = self.write("plain.vtk", text)
        self.assertEqual(self.losses("convert", path, self.path("a.vtu"), "--strict"), [])
        self.assertEqual(self.losses("convert", self.path("a.vtu"), self.path("b.vtk"), "--strict"),
                         [])
        self.assert_same(path, self.path("b.vtk"))
        with open(self.path("b.vtk"), "rb") as file:
            self.assertEqual(file.readlines()[1], b"a grid\n")

    def test_other_formats_hear_of_it(self):
        text = (HEAD.format(title="a grid") + "FIELD FieldData 1\nmine 1 1 int\n4\n" + TETRAHEDRON
                + "POINT_DATA 4\nSCALARS t float 1\nLOOKUP_TABLE colours\n1 2 3 4\nMETADATA\n"
                "COMPONENT_NAMES\nkelvin\n\nFIELD f 2\nb 1 4 bit\n0 1 1 0\ns 1 4 string\na\nb\nc\nd\n"
                "LOOKUP_TABLE colours 1\n0 0 0 1\n")
        path = self.write("a.vtk", text)
        common = ["strings of array 's'", "field data 'mine'", "metadata of array 't'",
                  "type bit of array 'b' (written as numbers 0 and 1)"]
        of_legacy = common + ["attribute SCALARS of array 't'", "lookup table 'colours'"]
        of_xml = common + ["attribute Scalars of array 't'"]
        for target in ("a.e", "a.msh"):
            self.assertEqual(sorted(self.losses("convert", path, self.path(target))),
                             sorted(of_legacy))
        self.assertEqual(sorted(self.losses("convert", path, self.path("a.inp"))),
                         sorted(of_legacy + ["title 'a grid'"]))
        self.assertEqual(self.losses("convert", path, self.path("a.vtu")), ["lookup table 'colours'"])
        image = self.write("image.vtk", "# vtk DataFile Version 3.0\nvtk output\nASCII\nDATASET "
                           "STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nSPACING 1 1 1\nORIGIN 0 0 0\n"
                           "CELL_DATA 1\nFIELD f 1\nm 1 1 int\n3\n")
        self.assertEqual(self.losses("convert", image, self.path("image.e")),
                         ["dimensions 2 2 2 (STRUCTURED_POINTS)"])
        self.assertEqual(sorted(self.losses("convert", self.path("a.vtu"), self.path("b.e"))),
                         sorted(of_xml))

    def test_blocks_of_one_number_are_told(self):
        """In Gmsh, a group of volumes and a group of faces may have the same number."""
        text = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
2 5 "skin"
3 5 "body"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
$EndNodes
$Elements
2
1 2 2 5 1 1 2 3
2 4 2 5 1 1 2 3 4
$EndElements
"""
        path = self.write("a.msh", text)
        for target in ("a.vtk", "a.vtu"):
            lost = [line for line in self.losses("convert", path, self.path(target))
                    if line.startswith("number of block")]
            self.assertEqual(lost, ["number of block 1 'body', which another block has (2 there)"])
            grid, _ = vtu_oracle.seen(self.path(target))
            ids = grid.GetCellData().GetArray("BlockId")
            self.assertEqual([ids.GetValue(i) for i in range(2)], [1, 2])

    def test_rounded_values_have_no_ranges(self):
        points, cells = shuffled_grid(3)
        values = " ".join(str(i / 7) for i in range(3 * len(points)))
        key = ('<InformationKey name="L2_NORM_RANGE" location="vtkDataArray" length="2">'
               '<Value index="0">0</Value><Value index="1">9</Value></InformationKey>')
        data = array_xml("v", "VALUES", "Float64", 3).replace("VALUES", key + values)
        source = self.write("a.vtu", grid_xml(points, cells, 12, f"<PointData>{data}</PointData>"))
        for options, found in (([], True), (["--rel", "0.01"], False)):
            self.shm("compress", source, *options, "-o", self.path("a.shm"))
            self.shm("decompress", self.path("a.shm"), "-o", self.path("a.vtk"))
            with open(self.path("a.vtk"), "rb") as file:
                self.assertEqual(b"L2_NORM_RANGE" in file.read(), found)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
