#!/usr/bin/env python3
"""Tests shm surface. Checks closed surfaces, colours, decimation and error messages. The test contains its own
readers of PLY, STL and OBJ files.

Usage: surface_test.py PATH_OF_SHM     (exit code 77, skipped, if the tool was built without OpenMesh)

If SHM_CORPUS names a folder of meshes, the small meshes in this folder are tested, too. If SHM_ALL_SURFACES is
also set, all meshes in the folder are tested.
"""
import json
import math
import os
import struct
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, FolderTest, lacks
from sample_meshes import exodus_text, hexahedra, write_vtk

SHM = "shm"
TYPES = {"float": "f", "double": "d", "int": "i", "uint": "I", "uchar": "B", "char": "b", "short": "h", "ushort": "H"}
# RGB colours of the smallest value, of the largest value, and of a missing value.
FIRST, LAST, GREY = (68, 1, 84), (253, 231, 37), (150, 150, 150)


class Ply:
    """The contents of a binary PLY file: for each kind of element, a list of dictionaries."""

    def __init__(self, data):
        end = data.index(b"end_header\n") + len(b"end_header\n")
        lines = data[:end].decode("ascii").splitlines()
        if lines[:2] != ["ply", "format binary_little_endian 1.0"]:
            raise ValueError(f"another kind of PLY: {lines[:2]}")
        self.elements = {}
        layout, at = [], end
        for line in lines[2:]:
            word, *rest = line.split()
            if word == "element":
                layout.append((rest[0], int(rest[1]), []))
            elif word == "property":
                layout[-1][2].append(rest)
        self.properties = {name: [rest[-1] for rest in properties] for name, _, properties in layout}
        self.types = {name: [rest[0] for rest in properties] for name, _, properties in layout}
        for name, count, properties in layout:
            self.elements[name] = rows = []
            for _ in range(count):
                row = {}
                for rest in properties:
                    length = 1
                    if rest[0] == "list":
                        length, = struct.unpack_from("<" + TYPES[rest[1]], data, at)
                        at += struct.calcsize(TYPES[rest[1]])
                    form = f"<{length}{TYPES[rest[-2]]}"
                    values = struct.unpack_from(form, data, at)
                    at += struct.calcsize(form)
                    row[rest[-1]] = list(values) if rest[0] == "list" else values[0]
                rows.append(row)
        if at != len(data):
            raise ValueError(f"{len(data) - at} bytes after the end")
        self.points = [(row["x"], row["y"], row["z"]) for row in self.elements["vertex"]]
        self.faces = [row["vertex_indices"] for row in self.elements["face"]]
        self.blocks = [row["block"] for row in self.elements["face"]]

    def colours(self, element):
        return [(row["red"], row["green"], row["blue"]) for row in self.elements[element]]


def ways(faces):
    """Counts how often each directed edge occurs."""
    count = {}
    for face in faces:
        for a, b in zip(face, face[1:] + face[:1]):
            count[a, b] = count.get((a, b), 0) + 1
    return count


def is_closed(faces):
    """Returns true if each edge belongs to exactly two faces, which use the edge in opposite directions."""
    count = ways(faces)
    return all(n == 1 and count.get((b, a)) == 1 for (a, b), n in count.items())


def euler(points, faces):
    """Returns the Euler characteristic: number of vertices - number of edges + number of faces."""
    return len(points) - len({frozenset(way) for way in ways(faces)}) + len(faces)


def volume(points, faces):
    """Returns the volume of a closed surface. It is positive if the faces are counter-clockwise when seen
    from outside."""
    total = 0
    for face in faces:
        for b, c in zip(face[1:], face[2:]):
            (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points[face[0]], points[b], points[c]
            total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6


def triangles_of(stl):
    """Returns normal and corners of each triangle."""
    count, = struct.unpack_from("<I", stl, 80)
    if len(stl) != 84 + 50 * count:
        raise ValueError("the number of triangles does not match the number of bytes")
    rows = [struct.unpack_from("<12fH", stl, 84 + 50 * i) for i in range(count)]
    return [(row[:3], [row[3:6], row[6:9], row[9:12]]) for row in rows]


def wavefront(text):
    points, faces = [], []
    for line in text.splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            points.append(tuple(map(float, rest)))
        elif word == "f":
            faces.append([int(part.split("/")[0]) - 1 for part in rest])
    return points, faces


class SurfaceTest(FolderTest):
    timeout = 600  # decimating surfaces of the corpus takes long

    def setUp(self):
        super().setUp()
        write_vtk(self.path("mesh.vtk"), 4)

    def written(self, name, *words, out="out.ply"):
        """Runs shm surface. Returns the bytes of the file that it writes, and its report."""
        report = json.loads(self.shm("surface", name, "-f", "-o", out, "--json", *words))
        self.assertEqual(report["output_bytes"], len(self.bytes(out)))
        return self.bytes(out), report

    def ply(self, name, *words):
        data, report = self.written(name, *words)
        ply = Ply(data)
        self.assertEqual((report["vertices"], report["faces"]), (len(ply.points), len(ply.faces)))
        return ply, report

    def refused(self, *words, code=2, reason=""):
        before = sorted(os.listdir(self.directory.name))
        text = self.shm("surface", *words, code=code).decode()
        self.assertRegex(text, "^shm: .*" + reason)
        self.assertEqual(sorted(os.listdir(self.directory.name)), before)

    def grid(self, name, cells, points, data="", kinds=12):
        kinds = [kinds] * len(cells) if isinstance(kinds, int) else kinds
        self.write(name, "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n"
                   f"POINTS {len(points)} double\n" + "\n".join(" ".join(map(str, p)) for p in points) +
                   f"\nCELLS {len(cells)} {sum(len(c) + 1 for c in cells)}\n" +
                   "\n".join(" ".join(map(str, [len(c), *c])) for c in cells) +
                   f"\nCELL_TYPES {len(cells)}\n" + "".join(f"{kind}\n" for kind in kinds) + data)

    def test_a_cube(self):
        ply, report = self.ply("mesh.vtk")
        self.assertEqual((len(ply.points), len(ply.faces)), (98, 96))
        self.assertEqual({len(face) for face in ply.faces}, {4})
        self.assertTrue(is_closed(ply.faces))
        self.assertEqual(euler(ply.points, ply.faces), 2)
        self.assertGreater(volume(ply.points, ply.faces), 0)
        self.assertEqual(ply.properties, {"vertex": ["x", "y", "z"], "face": ["vertex_indices", "block"]})
        self.assertEqual(ply.types, {"vertex": ["float"] * 3, "face": ["list", "int"]})
        self.assertEqual(set(ply.blocks), {0})
        self.assertEqual((report["input"], report["output"], report["array"]), ("mesh.vtk", "out.ply", None))
        for key in ("vertices_copied", "lines_and_points", "faces_collapsed", "faces_not_finite", "cells_left_out"):
            self.assertEqual(report[key], 0, key)
        self.assertIsNone(report["triangles_before"])
        self.assertEqual(sorted(os.listdir(self.directory.name)), ["mesh.vtk", "out.ply"])

    def test_other_formats_have_the_same_surface(self):
        ply, _ = self.ply("mesh.vtk")
        data, report = self.written("mesh.vtk", out="out.stl")
        triangles = triangles_of(data)
        self.assertEqual((len(triangles), report["faces"]), (2 * 96, 2 * 96))
        self.assertEqual({corner for _, three in triangles for corner in three}, set(ply.points))
        flat = [corner for _, three in triangles for corner in three]
        threes = [[3 * i, 3 * i + 1, 3 * i + 2] for i in range(len(triangles))]
        self.assertAlmostEqual(volume(flat, threes), volume(ply.points, ply.faces), 5)
        for normal, (a, b, c) in triangles:
            u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
            cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
            size = math.sqrt(sum(x * x for x in cross))
            for got, wanted in zip(normal, cross):
                self.assertAlmostEqual(got, wanted / size, 5)
        data, _ = self.written("mesh.vtk", out="out.obj")
        points, faces = wavefront(data.decode())
        self.assertEqual(faces, ply.faces)
        self.assertEqual([struct.unpack("<3f", struct.pack("<3f", *point)) for point in points], ply.points)

    def test_the_format_is_named_or_that_of_the_name(self):
        self.shm("surface", "mesh.vtk", "--format", "stl")
        self.assertEqual(len(triangles_of(self.bytes("mesh.vtk.stl"))), 192)
        self.shm("surface", "mesh.vtk", "--format", "obj", "-o", "any.name")
        self.assertTrue(self.bytes("any.name").startswith(b"#"))
        with open(self.path("mesh.vtk"), "rb") as source:
            Ply(self.shm("surface", "-", "-o", "-", stdin=source))
        self.refused("mesh.vtk", "-o", "x.vtk", reason="must end in .ply, .stl or .obj, unless --format is given")
        self.refused("mesh.vtk", "--format", "off", reason="--format")

    def test_same_bytes_of_whatever_the_mesh_is_in(self):
        self.shm("compress", "mesh.vtk", "-q")
        self.shm("convert", "mesh.vtk", "mesh.vtu", "-q")
        self.shm("join", "-o", "all.shm", "mesh.vtk", "-q")
        for out, words in (("out.ply", []), ("out.stl", []), ("out.obj", []), ("out.ply", ["--decimate", "60"])):
            surfaces = set()
            for name in ("mesh.vtk", "mesh.vtk.shm", "mesh.vtu", "all.shm"):
                for threads in ("1", "2"):
                    self.shm("surface", name, "-qfo", out, "-T", threads, *words)
                    surfaces.add(self.bytes(out))
            self.assertEqual(len(surfaces), 1)

    def test_blocks(self):
        self.ncgen("two.e", exodus_text([0, 1], 4))
        ply, _ = self.ply("two.e")
        self.assertEqual(set(ply.blocks), {0, 1})
        heights = {block: [ply.points[v][2] for face, of in zip(ply.faces, ply.blocks) if of == block for v in face]
                   for block in (0, 1)}
        self.assertLess(sum(heights[0]) / len(heights[0]), sum(heights[1]) / len(heights[1]))
        decimated, _ = self.ply("two.e", "--decimate", "40")
        self.assertEqual(set(decimated.blocks), {0, 1})

    def test_colours(self):
        cells, points = hexahedra(2), [(x, y, z) for z in range(3) for y in range(3) for x in range(3)]
        data = ("\nCELL_DATA 8\nSCALARS c double 1\nLOOKUP_TABLE default\n1 2 3 4 5 6 nan 8\n"
                "POINT_DATA 27\nSCALARS p double 1\nLOOKUP_TABLE default\n" +
                " ".join(str(x * 10 - 5) for x, _, _ in points) + "\nVECTORS v double\n" +
                "\n".join(f"{3 * x} 0 {4 * x}" for x, _, _ in points) + "\n")
        self.grid("v.vtk", cells, points, data)
        self.shm("compress", "v.vtk", "-q")
        for name in ("v.vtk", "v.vtk.shm"):
            ply, report = self.ply(name, "--array", "p")
            self.assertEqual(report["array"], {"name": "p", "location": "point", "step": None,
                                               "least": -5, "greatest": 15})
            self.assertEqual(ply.properties["vertex"], ["x", "y", "z", "red", "green", "blue"])
            self.assertEqual(ply.properties["face"], ["vertex_indices", "block"])
            by_x = {}
            for (x, _, _), colour in zip(ply.points, ply.colours("vertex")):
                by_x.setdefault(x, set()).add(colour)
            self.assertEqual((by_x[0], by_x[2]), ({FIRST}, {LAST}))
            self.assertEqual(len(by_x[1]), 1)
            lengths, report = self.ply(name, "--array", "v")
            self.assertEqual((report["array"]["least"], report["array"]["greatest"]), (0, 10))
            self.assertEqual(lengths.colours("vertex"), ply.colours("vertex"))
            ply, report = self.ply(name, "--array", "cell/c")
            self.assertEqual((report["array"]["least"], report["array"]["greatest"]), (1, 8))
            self.assertEqual(ply.properties["vertex"], ["x", "y", "z"])
            self.assertEqual(ply.properties["face"], ["vertex_indices", "red", "green", "blue", "block"])
            colours = ply.colours("face")
            self.assertEqual([colours.count(colour) for colour in (FIRST, LAST, GREY)], [3, 3, 3])
            self.assertEqual(len(set(colours)), 8)
            kept, _ = self.ply(name, "--array", "p", "--decimate", "14")
            before = dict(zip(lengths.points, lengths.colours("vertex")))
            self.assertEqual({before[point] == colour for point, colour in zip(kept.points, kept.colours("vertex"))},
                             {True})
            kept, _ = self.ply(name, "--array", "c", "--decimate", "14")
            self.assertLessEqual(set(kept.colours("face")), set(colours))
        self.refused("v.vtk", "-o", "x.stl", "--array", "p", reason="--array needs a .ply file")
        self.refused("v.vtk", "-o", "x.ply", "--array", "q", reason="there is no array q")

    def test_steps(self):
        self.ncgen("steps.e", exodus_text([0, 1, 2], 2))
        self.shm("compress", "steps.e", "-q")
        arrays = json.loads(self.shm("info", "steps.e", "--json"))["arrays"]
        names = {array["location"]: array["name"] for array in arrays
                 if array.get("per_step") and array["location"] != "global"}
        self.assertEqual(sorted(names), ["cell", "point"])
        for name in ("steps.e", "steps.e.shm"):
            colours, surfaces = {}, {}
            for step, number in (("@first", 0), ("@0", 0), ("@1", 1), ("@last", 2), ("", 2)):
                ply, report = self.ply(name, "--array", "point/" + names["point"] + step)
                self.assertEqual(report["array"]["step"], number)
                colours.setdefault(number, set()).add(tuple(ply.colours("vertex")))
                surfaces.setdefault(number, set()).add((tuple(ply.points), str(ply.faces)))
            # Several words can select the same step, such as "@first" and "@0". The colours must be the same
            # for all of these words and must differ from step to step. The mesh must be the same at all steps.
            self.assertEqual([len(one) for one in colours.values()], [1, 1, 1])
            self.assertEqual(len(set.union(*colours.values())), 3)
            self.assertEqual(len(set.union(*surfaces.values())), 1)
            # At each step, the vertex with the smallest value must be violet, and the vertex with the largest
            # value yellow. The test computes the number of each vertex from its coordinates, and its value
            # from the number, as exodus_text() does.
            for step in range(3):
                ply, report = self.ply(name, "--array", f"{names['point']}@{step}")
                vertex = [round(x / .25) + 3 * round(y / .25) + 9 * round(z / .25) for x, y, z in ply.points]
                self.assertEqual(sorted(vertex), [v for v in range(27) if v != 13])
                value = [v % 97 * .01 + step * (.5 + v % 5) if names["point"] == "u" else
                         v % 97 * .02 + step * (.5 + v % 5) for v in vertex]
                self.assertAlmostEqual(report["array"]["least"], min(value), 5)
                self.assertAlmostEqual(report["array"]["greatest"], max(value), 5)
                shown = ply.colours("vertex")
                self.assertEqual(shown[value.index(min(value))], FIRST)
                self.assertEqual(shown[value.index(max(value))], LAST)
            # From step to step, the values of all cells grow by the same amount. The colours of all steps are
            # therefore equal, and only the reported range distinguishes the steps.
            least = [self.ply(name, "--array", f"cell/{names['cell']}@{step}")[1]["array"]["least"]
                     for step in range(3)]
            self.assertEqual([number - least[0] for number in least], [0, .125, .25])
        self.refused("steps.e", "-o", "x.ply", "--array", names["point"] + "@3", reason="there is no step 3")

    def test_edges_of_four_faces_are_taken_apart(self):
        # In the first mesh, two hexahedra touch along an edge. In the second mesh, they touch at a vertex.
        points = [(x, y, z) for z in range(3) for y in range(3) for x in range(3)]
        for pair, copies in (((0, 3), 2), ((0, 7), 1)):
            cells = [hexahedra(2)[i] for i in pair]
            self.grid("touch.vtk", cells, points)
            ply, report = self.ply("touch.vtk")
            self.assertEqual((report["vertices_copied"], len(ply.faces)), (copies, 12))
            self.assertTrue(is_closed(ply.faces))
            self.assertEqual(euler(ply.points, ply.faces), 4)
            self.assertEqual(len(triangles_of(self.written("touch.vtk", out="out.stl")[0])), 24)
        text = self.shm("surface", "touch.vtk", "-o", "other.ply").decode()
        self.assertIn("1 vertex copied to separate faces", text)

    def test_faces_that_do_not_go_around_alike(self):
        points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0), (1, 0, 1), (1, 1, 1)]
        alike, turned, third = [1, 4, 5, 2], [2, 5, 4, 1], [1, 6, 7, 2]
        for cells, copies in (([[0, 1, 2, 3], alike], 0), ([[0, 1, 2, 3], turned], 2),
                              ([[0, 1, 2, 3], alike, third], 4)):
            self.grid("sheet.vtk", cells, points, kinds=9)
            for words in ([], ["--decimate", "3"]):
                ply, report = self.ply("sheet.vtk", *words)
                self.assertEqual(report["vertices_copied"], copies)
                self.assertEqual(max(ways(ply.faces).values()), 1)
                if not words:
                    self.assertEqual(ply.faces and len(ply.points), len({v for c in cells for v in c}) + copies)

    def test_lines_and_points_are_left_out(self):
        points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (5, 5, 5)]
        self.grid("mixed.vtk", [[0, 1, 2], [0, 4], [4], [0, 2, 2]], points, kinds=[5, 3, 1, 5])
        done = subprocess.run([SHM, "surface", "mixed.vtk", "-o", "m.ply", "--json"], cwd=self.directory.name,
                              capture_output=True, check=True)
        report = json.loads(done.stdout)
        self.assertEqual((report["faces"], report["lines_and_points"], report["faces_collapsed"]), (1, 2, 1))
        self.assertIn(b"not in m.ply: 2 lines and points", done.stderr)
        self.assertIn(b"not in m.ply: 1 face with fewer than three different vertices", done.stderr)
        ply = Ply(self.bytes("m.ply"))
        self.assertEqual(len(ply.points), 3)
        # Only lines: a file without faces.
        self.grid("lines.vtk", [[0, 1], [1, 2]], points, kinds=3)
        for out in ("out.ply", "out.stl", "out.obj"):
            _, report = self.written("lines.vtk", out=out)
            self.assertEqual((report["vertices"], report["faces"], report["lines_and_points"]), (0, 0, 2))
            self.written("lines.vtk", "--decimate", "5", out=out)

    def test_polygons_of_many_corners(self):
        ring = [(math.cos(i * math.tau / 300), math.sin(i * math.tau / 300), 0) for i in range(300)]
        for count, faces, triangles in ((255, 1, 253), (256, 254, 254), (300, 298, 298)):
            self.grid("ring.vtk", [list(range(count))], ring, kinds=7)
            ply, _ = self.ply("ring.vtk")
            self.assertEqual(len(ply.faces), faces)
            self.assertEqual(len(triangles_of(self.written("ring.vtk", out="out.stl")[0])), triangles)

    def test_coordinates(self):
        points = [(x + 1e6 + 1 / 3, y, z) for z in range(3) for y in range(3) for x in range(3)]
        self.grid("far.vtk", hexahedra(2), points)
        self.assertEqual(self.ply("far.vtk")[1]["vertices_rounded"], 26)
        self.assertIn(b"coordinates of 26 vertices rounded to float32", self.shm("surface", "far.vtk", "-o", "far.ply"))
        single = {struct.unpack("<3f", struct.pack("<3f", *point)) for point in points}
        self.assertLessEqual(set(Ply(self.bytes("far.ply")).points), single)
        points = [(x, y, z) for z in range(3) for y in range(3) for x in range(3)]
        for bad in ("nan", "inf", "-inf", "1e39", "-1e300"):
            self.grid("bad.vtk", hexahedra(2), [(bad, 0, 0), *points[1:]])
            for out, words in (("out.ply", []), ("out.stl", []), ("out.ply", ["--decimate", "9"])):
                _, report = self.written("bad.vtk", *words, out=out)
                self.assertEqual(report["faces_not_finite"], 3)
                self.assertEqual(report["vertices_rounded"], 0)

    def test_decimation(self):
        write_vtk(self.path("fine.vtk"), 10)
        whole, _ = self.ply("fine.vtk")
        self.assertEqual(len(whole.faces), 600)
        size = volume(whole.points, whole.faces)
        for left in (1200, 600, 100, 12):
            ply, report = self.ply("fine.vtk", "--decimate", str(left))
            self.assertEqual(report["triangles_before"], 1200)
            self.assertEqual({len(face) for face in ply.faces}, {3})
            self.assertTrue(left - 1 <= len(ply.faces) <= left, len(ply.faces))
            self.assertTrue(is_closed(ply.faces))
            self.assertEqual(euler(ply.points, ply.faces), 2)
            self.assertLessEqual(set(ply.points), set(whole.points))
            self.assertAlmostEqual(volume(ply.points, ply.faces) / size, 1, 2 if left >= 100 else 1)
        # A closed surface needs at least four faces. Although only one face is requested, decimation must keep
        # at least four, and the tool must report this.
        done = subprocess.run([SHM, "surface", "fine.vtk", "-fo", "few.ply", "--decimate", "1", "--json"],
                              cwd=self.directory.name, capture_output=True, check=True)
        few = json.loads(done.stdout)["faces"]
        self.assertGreaterEqual(few, 4)
        self.assertIn(f"in few.ply: {few} faces are left; no more can be removed".encode(), done.stderr)

    def test_a_sheet_keeps_its_outline(self):
        points = [(x, y, 0) for y in range(11) for x in range(11)]
        quads = [[y * 11 + x, y * 11 + x + 1, y * 11 + x + 12, y * 11 + x + 11] for y in range(10) for x in range(10)]
        self.grid("sheet.vtk", quads, points, kinds=9)
        ply, _ = self.ply("sheet.vtk", "--decimate", "2")
        self.assertEqual(len(ply.faces), 2)
        self.assertEqual(set(ply.points), {(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)})

    def test_no_vertex_of_a_plane_takes_in_all_others(self):
        m = 41
        points = [(x, y, 0) for y in range(m) for x in range(m)]
        quads = [[y * m + x, y * m + x + 1, y * m + x + m + 1, y * m + x + m] for y in range(m - 1) for x in range(m - 1)]
        self.grid("sheet.vtk", quads, points, kinds=9)
        ply, _ = self.ply("sheet.vtk", "--decimate", "200")
        uses = [0] * len(ply.points)
        for face in ply.faces:
            for vertex in face:
                uses[vertex] += 1
        self.assertLessEqual(max(uses), 20)

    def test_places(self):
        self.shm("surface", "mesh.vtk")
        before = self.bytes("mesh.vtk.ply")
        self.refused("mesh.vtk", code=4, reason="exists already; --force replaces it")
        self.shm("surface", "mesh.vtk", "--force", "--decimate", "20")
        self.assertNotEqual(self.bytes("mesh.vtk.ply"), before)
        write_vtk(self.path("other.vtk"), 2)
        os.mkdir(self.path("surfaces"))
        lines = self.shm("surface", "mesh.vtk", "other.vtk", "-o", "surfaces", "--json").decode().splitlines()
        self.assertEqual(sorted(os.listdir(self.path("surfaces"))), ["mesh.vtk.ply", "other.vtk.ply"])
        self.assertEqual(json.loads(lines[-1])["done"], 2)

    def test_wrong_use(self):
        for left in ("0", "-1", "x", "1.5", ""):
            self.refused("mesh.vtk", f"--decimate={left}", reason="--decimate")
        self.refused("mesh.vtk", "-o", "-", "--json", reason="cannot both go to standard output")
        self.refused("mesh.vtk", "--part", "a", reason="--part needs an archive")
        self.refused("missing.vtk", code=3)
        self.refused("mesh.vtk", "-o", "nowhere/x.ply", code=4, reason="no folder nowhere")

    def test_nothing_is_said_but_the_report(self):
        for out in ("a.ply", "a.stl", "a.obj"):
            done = subprocess.run([SHM, "surface", "mesh.vtk", "-o", out, "-q"], cwd=self.directory.name,
                                  capture_output=True, check=True)
            self.assertEqual((done.stdout, done.stderr), (b"", b""))

    def test_damage_is_an_error(self):
        self.shm("compress", "mesh.vtk", "-q")
        whole = self.bytes("mesh.vtk.shm")
        for cut in range(40, len(whole) - 1, max(1, len(whole) // 6)):
            with open(self.path("cut.shm"), "wb") as out:
                out.write(whole[:cut])
            self.refused("cut.shm", code=3)

    def corpus(self, most):
        corpus = os.environ.get("SHM_CORPUS")
        if not corpus:
            self.skipTest("SHM_CORPUS is not set")
        meshes = sorted(path for path in Path(corpus).rglob("*")
                        if path.is_file() and path.suffix not in (".md", ".tsv") and path.stat().st_size <= most)
        self.assertGreater(len(meshes), 10)
        return meshes

    def test_meshes_of_the_corpus(self):
        # Some meshes also have lines and points, which are not part of the written surface. Some meshes have
        # only lines and points.
        everything = "SHM_ALL_SURFACES" in os.environ
        for mesh in self.corpus(1 << 40 if everything else (20 if SANITIZED else 100) << 10):
            with self.subTest(mesh=mesh.name):
                ply, report = self.ply(str(mesh))
                self.assertEqual(max(ways(ply.faces).values(), default=1), 1)
                self.assertEqual(self.bytes("out.ply"), self.written(str(mesh))[0])
                self.assertEqual({vertex for face in ply.faces for vertex in face}, set(range(len(ply.points))))
                stl = triangles_of(self.written(str(mesh), out="out.stl")[0])
                self.assertEqual(len(stl), sum(len(face) - 2 for face in ply.faces))
                closed = is_closed(ply.faces)
                half = max(4, len(stl) // 4)
                less, report = self.ply(str(mesh), "--decimate", str(half))
                self.assertEqual(max(ways(less.faces).values(), default=1), 1)
                self.assertLessEqual(len(less.faces), len(stl))
                if closed and not report["vertices_copied"]:
                    self.assertTrue(is_closed(less.faces))
                    self.assertEqual(euler(less.points, less.faces), euler(ply.points, ply.faces))

    def test_closed_meshes_of_the_corpus(self):
        known = ("HybridOctree_Hex__deformed_armadillo.vtk",)
        found = [mesh for mesh in self.corpus(1 << 40) if mesh.name in known]
        if SANITIZED or not found:
            self.skipTest("takes long, or is not there")
        for mesh in found:
            with self.subTest(mesh=mesh.name):
                ply, report = self.ply(str(mesh))
                self.assertTrue(is_closed(ply.faces))
                self.assertEqual(euler(ply.points, ply.faces), 2)
                stl = triangles_of(self.written(str(mesh), out="out.stl")[0])
                self.assertEqual(len(stl), 2 * len(ply.faces))
                less, report = self.ply(str(mesh), "--decimate", "2000")
                self.assertTrue(1990 < len(less.faces) <= 2000, len(less.faces))
                self.assertTrue(is_closed(less.faces))
                self.assertEqual(euler(less.points, less.faces), 2)


if __name__ == "__main__":
    SHM = FolderTest.tool = os.path.abspath(sys.argv.pop(1))
    if lacks(SHM, "surface"):
        print("this shm was built without OpenMesh")
        sys.exit(77)
    unittest.main()
