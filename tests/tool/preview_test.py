#!/usr/bin/env python3
"""Tests the pictures that shm preview draws, and its error messages. The test contains a separate PNG
decoder, with which it checks contents and colours.

Usage: preview_test.py PATH_OF_SHM     (exit code 77, skipped, if the tool was built without libpng)

If SHM_CORPUS names a folder of meshes, the test also draws the small meshes in it.
"""
import collections
import json
import os
import re
import struct
import subprocess
import sys
import unittest
import zlib
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, FolderTest, lacks
from sample_meshes import exodus_text, hexahedra, write_vtk

SHM = "shm"
WHITE = (255, 255, 255)
GREY = (150, 150, 150)
GOLDEN = Path(__file__).resolve().parents[1] / "golden"
MANY = 40  # number of colours; a palette has fewer


def decoded(png):
    """Decodes a PNG file that has 8 bits for each of red, green and blue, or a palette. Returns its rows of
    pixels."""
    if png[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("not a PNG")
    at, packed, palette = 8, b"", []
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        body = png[at + 8:at + 8 + size]
        if zlib.crc32(kind + body) != struct.unpack(">I", png[at + 8 + size:at + 12 + size])[0]:
            raise ValueError("the checksum of " + kind.decode() + " is wrong")
        if kind == b"IHDR":
            width, height, *how = struct.unpack(">2I5B", body)
            if how not in ([8, 2, 0, 0, 0], [8, 3, 0, 0, 0]):
                raise ValueError(f"another kind of PNG: {how}")
        if kind == b"PLTE":
            palette = [tuple(body[i:i + 3]) for i in range(0, size, 3)]
        packed += body if kind == b"IDAT" else b""
        at += 12 + size
    if bool(palette) != (how[1] == 3):
        raise ValueError("a palette is missing or not needed")
    step = 1 if palette else 3  # bytes per pixel
    lines, stride, before = zlib.decompress(packed), step * width, bytearray(step * width)
    rows = []
    for y in range(height):
        kind, *_ = line = lines[y * (stride + 1):(y + 1) * (stride + 1)]
        now = bytearray(line[1:])
        for i in range(stride if kind else 0):
            left, corner = (now[i - step], before[i - step]) if i >= step else (0, 0)
            above = before[i]
            guess = left + above - corner
            paeth = min((left, above, corner), key=lambda value: abs(guess - value))
            now[i] = now[i] + (0, left, above, (left + above) // 2, paeth)[kind] & 255
        rows.append([palette[i] for i in now] if palette else
                    [tuple(now[i:i + 3]) for i in range(0, stride, 3)])
        before = now
    return rows


class Picture:
    def __init__(self, png):
        self.rows = decoded(png)
        self.size = (len(self.rows[0]), len(self.rows))
        self.colours = collections.Counter(pixel for row in self.rows for pixel in row)

    def pixel(self, x, y):
        """Returns the pixel at the given fractions of the width and of the height of the picture."""
        return self.rows[int(y * self.size[1])][int(x * self.size[0])]


def is_like(pixel, colour):
    """Returns true if two colours have the same hue, whatever their brightness."""
    light = sum(pixel) / sum(colour)
    return all(abs(a - light * b) < 3 for a, b in zip(pixel, colour))


class PreviewTest(FolderTest):
    def setUp(self):
        super().setUp()
        write_vtk(self.path("mesh.vtk"), 4)

    def drawn(self, name, *words, code=0):
        """Draws a small picture. Returns the picture and the JSON report of the tool."""
        if "--size" not in words:
            words += ("--size", "200x160")
        report = self.shm("preview", name, "-f", "-o", "out.png", "--json", *words, code=code)
        return Picture(self.bytes("out.png")), json.loads(report)

    def refused(self, *words, code=2, reason=""):
        before = sorted(os.listdir(self.directory.name))
        text = self.shm("preview", *words, code=code).decode()
        self.assertRegex(text, "^shm: .*" + reason)
        self.assertEqual(sorted(os.listdir(self.directory.name)), before)

    def grid(self, name, cells, points, data="", kind=12):
        self.write(name, "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n"
                   f"POINTS {len(points)} double\n" + "\n".join(" ".join(map(str, p)) for p in points) +
                   f"\nCELLS {len(cells)} {sum(len(c) + 1 for c in cells)}\n" +
                   "\n".join(" ".join(map(str, [len(c), *c])) for c in cells) +
                   f"\nCELL_TYPES {len(cells)}\n" + f"{kind}\n" * len(cells) + data)

    def test_a_cube(self):
        picture, report = self.drawn("mesh.vtk", "--size", "200x160")
        self.assertEqual(picture.size, (200, 160))
        self.assertEqual((report["width"], report["height"], report["faces"]), (200, 160, 96))
        self.assertEqual((report["input"], report["output"]), ("mesh.vtk", "out.png"))
        self.assertEqual(report["output_bytes"], len(self.bytes("out.png")))
        self.assertEqual((report["faces_skipped"], report["cells_left_out"], report["array"]), (0, 0, None))
        covered = 200 * 160 - picture.colours[WHITE]
        self.assertEqual(report["covered_pixels"], covered)
        self.assertTrue(.4 < covered / (200 * 160) < .6, covered)
        # Three sides of the box are visible. They have the same hue, but each has a different brightness.
        # Their edges are drawn.
        three = [picture.pixel(x, y) for x, y in [(.47, .2), (.43, .6), (.63, .6)]]
        self.assertEqual(len(set(three)), 3)
        for pixel in three:
            self.assertTrue(is_like(pixel, (86, 180, 233)), pixel)
        self.assertGreater(len(picture.colours), 7)
        self.assertEqual(sorted(os.listdir(self.directory.name)), ["mesh.vtk", "out.png"])

    def test_same_bytes_of_whatever_the_mesh_is_in(self):
        self.shm("preview", "mesh.vtk", "-q")
        pictures = {self.bytes("mesh.vtk.png")}
        self.shm("compress", "mesh.vtk", "-q")
        self.shm("convert", "mesh.vtk", "mesh.vtu", "-q")
        self.shm("join", "-o", "all.shm", "mesh.vtk", "-q")
        for name in ("mesh.vtk", "mesh.vtk.shm", "mesh.vtu", "all.shm"):
            for threads in ("1", "2"):
                self.shm("preview", name, "-qfo", "out.png", "-T", threads)
                pictures.add(self.bytes("out.png"))
        for name in ("mesh.vtk", "mesh.vtk.shm"):
            with open(self.path(name), "rb") as source:
                pictures.add(self.shm("preview", "-", "-o", "-", stdin=source))
        self.assertEqual(len(pictures), 1)

    def test_where_one_looks_from(self):
        picture, _ = self.drawn("mesh.vtk", "--view=0,-1,0", "--size", "120x120")
        self.assertEqual(sum(pixel != WHITE for pixel in picture.rows[60]), 110)
        above, _ = self.drawn("mesh.vtk", "--view=0,0,1e300", "--size", "120x120")
        self.assertEqual(above.colours[WHITE], picture.colours[WHITE])
        self.assertNotEqual(self.drawn("mesh.vtk", "--view=-1,2,1")[0].rows, self.drawn("mesh.vtk")[0].rows)

    def test_which_axis_goes_up(self):
        # The mesh consists of two blocks; the second block is above the first.
        self.ncgen("two.e", exodus_text([0, 1], 4))
        orange = (230, 159, 0)
        for up, at in (("z", (.5, .2)), ("y", (.2, .5))):
            picture, _ = self.drawn("two.e", "--up", up, "--view=1,0,0", "--size", "120x120")
            self.assertTrue(is_like(picture.pixel(*at), orange), (up, picture.pixel(*at)))
        self.drawn("mesh.vtk")
        plain = self.bytes("out.png")
        self.drawn("mesh.vtk", "--up", "z")
        self.assertEqual(self.bytes("out.png"), plain)
        for up in ("w", "", "0,1,0", "-z"):
            self.refused("mesh.vtk", f"--up={up}", reason="--up")

    def test_edges(self):
        write_vtk(self.path("fine.vtk"), 24)
        plain, _ = self.drawn("fine.vtk", "--size", "100x100", "--view=0,-1,0")
        edged, _ = self.drawn("fine.vtk", "--size", "100x100", "--view=0,-1,0", "--edges")
        self.assertEqual(len(plain.colours), 2)
        self.assertGreater(len(edged.colours), 3)

    def test_blocks(self):
        self.ncgen("two.e", exodus_text([0, 1], 4))
        picture, _ = self.drawn("two.e", "--view=0,-1,0", "--size", "120x120")
        self.assertTrue(is_like(picture.pixel(.3, .7), (86, 180, 233)), picture.pixel(.3, .7))
        self.assertTrue(is_like(picture.pixel(.3, .2), (230, 159, 0)), picture.pixel(.3, .2))

    def test_values(self):
        cells, points = hexahedra(2), [(x, y, z) for z in range(3) for y in range(3) for x in range(3)]
        data = ("\nCELL_DATA 8\nSCALARS both double 1\nLOOKUP_TABLE default\n" + "1 2 3 4 5 6 nan 8\n" +
                "SCALARS power double 1\nLOOKUP_TABLE default\n" + "1 2 3 4 nan nan 7 8\n" +
                "POINT_DATA 27\nSCALARS both double 1\nLOOKUP_TABLE default\n" +
                " ".join(str(x * 10 - 5) for x, _, _ in points) + "\nVECTORS v double\n" +
                "\n".join(f"{3 * x} 0 {4 * x}" for x, _, _ in points) +
                "\nSCALARS none double 1\nLOOKUP_TABLE default\n" + "nan " * 27 + "\n")
        self.grid("v.vtk", cells, points, data)
        self.shm("compress", "v.vtk", "-q")
        for name in ("v.vtk", "v.vtk.shm"):
            front = ("--view=0,-1,0", "--size", "200x200")
            picture, report = self.drawn(name, "--array", "point/both", *front)
            self.assertEqual(report["array"], {"name": "both", "location": "point", "step": None,
                                               "least": -5, "greatest": 15})
            self.assertGreater(len(picture.colours), MANY)
            self.assertLess(picture.pixel(.2, .4)[1], picture.pixel(.8, .4)[1])  # green increases
            self.assertGreater(picture.colours[(38, 38, 38)], 100)  # the legend

            picture, report = self.drawn(name, "--array", "power", *front)
            self.assertEqual((report["array"]["location"], report["array"]["greatest"]), ("cell", 8))
            self.assertTrue(is_like(picture.pixel(.3, .2), GREY), picture.pixel(.3, .2))
            self.assertFalse(is_like(picture.pixel(.3, .6), GREY))

            _, report = self.drawn(name, "--array", "v")  # the length of the vector
            self.assertEqual((report["array"]["least"], report["array"]["greatest"]), (0, 10))
            picture, report = self.drawn(name, "--array", "none")
            self.assertEqual((report["array"]["least"], report["array"]["greatest"]), (None, None))
            text = self.shm("preview", name, "-fo", "out.png", "--array", "none").decode()
            self.assertIn("none has no finite values", text)

            os.remove(self.path("out.png"))
            self.refused(name, "-o", "x.png", "--array", "both",
                         reason="there are point/both and cell/both; use one of these names")
            self.refused(name, "-o", "x.png", "--array", "nothing",
                         reason="there is no array nothing; there are .*cell/power")
            self.refused(name, "-o", "x.png", "--array", "power@0", reason="power has no time steps")

    def test_steps(self):
        self.ncgen("steps.e", exodus_text([0, 1, 2], 4))
        self.shm("compress", "steps.e", "-q")
        arrays = json.loads(self.shm("info", "steps.e.shm", "--json"))["arrays"]
        names = {a["location"]: a["name"] for a in arrays if a["per_step"] and a["location"] != "global"}
        self.assertEqual(sorted(names), ["cell", "point"])
        for location, array in names.items():
            reports = {}
            for name in ("steps.e", "steps.e.shm"):
                for step in ("", "@0", "@1", "@first", "@last"):
                    _, report = self.drawn(name, "--array", f"{location}/{array}{step}", "--size", "100x100")
                    reports.setdefault(step, []).append((report["array"], self.bytes("out.png")))
            for step, (one, other) in reports.items():
                self.assertEqual(one, other, step)
            self.assertEqual(reports[""], reports["@last"])
            self.assertEqual(reports["@0"], reports["@first"])
            self.assertNotEqual(reports["@0"][0][0]["greatest"], reports["@1"][0][0]["greatest"])
            self.assertEqual([reports[step][0][0]["step"] for step in ("@0", "@1", "")], [0, 1, 2])
        name = names["point"]
        for step, reason in [("@3", "there is no step 3: the mesh has 3"), ("@0:2", "must be N, from 0, first or last"),
                             ("@x", "must be N"), ("@-1", "must be N"), ("@", "must be N")]:
            self.refused("steps.e", "-fo", "x.png", "--array", name + step, reason=reason)

    def test_clip(self):
        whole, report = self.drawn("mesh.vtk", "--view=0,-1,0")
        self.assertEqual(report["faces"], 96)
        self.shm("compress", "mesh.vtk", "-q")
        sides = json.loads(self.shm("info", "mesh.vtk", "--json"))["box"]
        middle = (sides[0] + sides[3]) / 2
        for name in ("mesh.vtk", "mesh.vtk.shm"):
            cut, report = self.drawn(name, "--view=0,-1,0", f"--clip=1,0,0:{middle}")
            self.assertEqual(report["faces"], 2 * (16 + 8 + 8))
            self.assertLess(whole.colours[WHITE], cut.colours[WHITE])
            _, report = self.drawn(name, f"--clip=-1,0,0:{-sides[3] - 1}")
            self.assertEqual((report["faces"], report["covered_pixels"]), (0, 0))
        # Values stay with their cells.
        name = next(a["name"] for a in json.loads(self.shm("info", "mesh.vtk", "--json"))["arrays"]
                    if a["location"] == "cell")
        both = [self.drawn(one, "--array", "cell/" + name, f"--clip=1,0,0:{middle}")
                for one in ("mesh.vtk", "mesh.vtk.shm")]
        self.assertEqual(both[0][0].rows, both[1][0].rows)
        self.assertEqual(both[0][1]["array"], both[1][1]["array"])

    def test_what_is_no_volume(self):
        points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        for kind, cells in [(9, [[0, 1, 2, 3]]), (3, [[0, 1], [1, 2]]), (1, [[0], [2]])]:
            self.grid("flat.vtk", cells, points, kind=kind)
            picture, report = self.drawn("flat.vtk", "--size", "100x100")
            self.assertEqual(report["faces"], len(cells))
            self.assertGreaterEqual(report["covered_pixels"], 4)
            self.assertEqual(100 * 100 - picture.colours[WHITE], report["covered_pixels"])
        # A square that is viewed from above fills the picture except for the margin.
        self.grid("flat.vtk", [[0, 1, 2, 3]], points, kind=9)
        self.assertEqual(self.drawn("flat.vtk", "--size", "100x100")[1]["covered_pixels"], 92 * 92)
        # Only vertices.
        self.grid("none.vtk", [], points)
        self.shm("compress", "none.vtk", "-q")
        for name in ("none.vtk", "none.vtk.shm"):
            _, report = self.drawn(name)
            self.assertEqual((report["vertices"], report["faces"]), (4, 0))
            self.assertGreaterEqual(report["covered_pixels"], 8)

    def test_numbers_that_are_none(self):
        points = [(x, y, z) for z in range(3) for y in range(3) for x in range(3)]
        for bad in ("nan", "inf", "-inf"):
            self.grid("bad.vtk", hexahedra(2), [(bad, 0, 0), *points[1:]])
            _, report = self.drawn("bad.vtk")
            self.assertEqual((report["faces"], report["faces_skipped"]), (24, 3))
        self.grid("far.vtk", hexahedra(2), [(1e300, -1e300, 1.7e308), *points[1:]])
        self.assertGreater(self.drawn("far.vtk")[1]["covered_pixels"], 0)

    def test_places(self):
        self.shm("preview", "mesh.vtk")
        self.assertEqual(struct.unpack(">2I", self.bytes("mesh.vtk.png")[16:24]), (1024, 768))
        before = self.bytes("mesh.vtk.png")
        self.refused("mesh.vtk", code=4, reason="exists already; --force replaces it")
        self.shm("preview", "mesh.vtk", "--force", "--size", "64x64")
        self.assertNotEqual(self.bytes("mesh.vtk.png"), before)
        # A thumbnailer may pass the name of an existing file without a usual extension.
        self.write("thumbnail.X3k2f", "")
        self.shm("preview", "mesh.vtk", "-o", "thumbnail.X3k2f", "--size", "128x128", "--force")
        self.assertEqual(Picture(self.bytes("thumbnail.X3k2f")).size, (128, 128))
        write_vtk(self.path("other.vtk"), 2)
        os.mkdir(self.path("pictures"))
        lines = self.shm("preview", "mesh.vtk", "other.vtk", "-o", "pictures", "--json").decode().splitlines()
        self.assertEqual(sorted(os.listdir(self.path("pictures"))), ["mesh.vtk.png", "other.vtk.png"])
        self.assertEqual(json.loads(lines[-1])["done"], 2)

    def test_wrong_use(self):
        for size in ("8x8", "100", "x", "100x", "4097x100", "100x15", "-5x100", "1e3x100", "99999999999x100"):
            self.refused("mesh.vtk", f"--size={size}", reason="must be WxH, each 16 to 4096 pixels")
        for view in ("0,0,0", "1,2", "1,2,3,4", "a,b,c", "nan,0,1", "inf,0,0", "1,,2"):
            self.refused("mesh.vtk", f"--view={view}", reason="must be three numbers")
        for clip in ("1,0,0", "1,0:1", "1,0,0:nan", "1,0,0:", ":1", "1,0,0:1:2"):
            self.refused("mesh.vtk", f"--clip={clip}", reason="must be X,Y,Z:D")
        self.refused("mesh.vtk", "-o", "x.svg", reason="the name of a picture must end in .png")
        self.refused("mesh.vtk", "-o", "-", "--json", reason="cannot both go to standard output")
        self.refused("mesh.vtk", "--part", "a", reason="--part needs an archive")
        self.refused("missing.vtk", code=3)
        self.refused("mesh.vtk", "-o", "nowhere/x.png", code=4, reason="no folder nowhere")

    def test_damage_is_an_error(self):
        self.shm("compress", "mesh.vtk", "-q")
        whole = self.bytes("mesh.vtk.shm")
        for cut in range(40, len(whole) - 1, max(1, len(whole) // 12)):
            with open(self.path("cut.shm"), "wb") as out:
                out.write(whole[:cut])
            self.refused("cut.shm", code=3)
        with open(self.path("cut.shm"), "wb") as out:
            out.write(whole[:len(whole) // 2] + bytes([whole[len(whole) // 2] ^ 1]) + whole[len(whole) // 2 + 1:])
        self.refused("cut.shm", code=3)

    def attempt(self, path, *words, out="out.png"):
        """Draws a file and returns the exit code. The result must be either a complete picture, or only a message."""
        done = subprocess.run([SHM, "preview", str(path), "-o", out, "--size", "32x32", "-q", *words],
                              cwd=self.directory.name, capture_output=True, timeout=60)
        text, left = done.stderr.decode(), os.listdir(self.directory.name)
        if done.returncode == 0:
            self.assertEqual(left, [] if out == "-" else [out])
            self.assertEqual(Picture(done.stdout or self.bytes(out)).size, (32, 32))
            for name in left:
                os.remove(self.path(name))
        else:
            self.assertEqual((done.stdout, left), (b"", []))
            self.assertRegex(text, f"^shm: {path}[: ].*\n$")
            self.assertEqual(text.count("\n"), 1)
        return done.returncode

    def test_golden_files(self):
        os.remove(self.path("mesh.vtk"))
        files = [path for path in sorted(GOLDEN.glob("*/*.shm")) if path.parent.name != "faulty"]
        self.assertGreater(len(files), 100)
        for path in files[::3 if SANITIZED else 1]:
            with self.subTest(file=path):
                if path.stem == "archive":
                    self.assertEqual(self.attempt(path), 2)
                    self.assertEqual(self.attempt(path, "--part", "one_hexahedron.e"), 0)
                else:
                    self.assertEqual(self.attempt(path, out="-"), 0)

    def test_faulty_files(self):
        os.remove(self.path("mesh.vtk"))
        # A picture in which each block has a colour does not need the data that contains these faults, so
        # preview does not read this data.
        unseen = re.compile("Index: |Step values: |Parts of step values: |A group after step values"
                            "|The sequence of the second chunk|Last group of .*: stream array"
                            "|Extras: a blob|Step times: of 2.24 |Old index: another first element of step values"
                            "|Group and index: a box|Bundle: |Columns of a bundle: |Scaled copy: |Special values"
                            "|Weighted values: |Step values of sets: |Base: |Digest: |Values by terms: .* in a column of cells"
                            "|Last group of .*: stream (geometry|corner order)"  # only the box of the group differs
                            "|A private chunk|A later schema|A packed blob: |Step times: |Extras?: |Commit: ")
        lines = [line.split(" ", 2) for line in (GOLDEN / "faulty" / "list.txt").read_text().splitlines()]
        self.assertGreater(len(lines), 150)
        codes, tried = collections.Counter(), 0
        for number, _, sentence in lines[::3 if SANITIZED else 1]:
            path = GOLDEN / "faulty" / (number + ".shm")
            with self.subTest(file=number, sentence=sentence):
                # The picture is written to standard output, because this is faster than writing a file, which
                # must be flushed to the disk.
                code = self.attempt(path, out="-")
                codes[code] += 1
                if code != 0:
                    self.assertEqual(self.attempt(path), code)
                self.assertIn(code, (0, 3) if unseen.match(sentence) else (3, 5))
                if code != 0 or ": stream array" not in sentence or int(number) % 8 != 0:
                    continue
                # A fault in the values of an array is found when the array is drawn.
                tried += 1
                arrays = json.loads(self.shm("info", str(path), "--json"))["arrays"]
                names = [f"{array['location']}/{array['name']}" for array in arrays]
                self.assertIn(3, {self.attempt(path, "--array", name, out="-") for name in names})
        self.assertGreater(codes[0], 20)
        # A picture needs few parts of a file. Faults in other parts are not found.
        self.assertGreaterEqual(codes[3], 65 if SANITIZED else 215)
        self.assertGreater(tried, 1)

    def test_small_meshes_of_the_corpus(self):
        corpus = os.environ.get("SHM_CORPUS")
        if not corpus:
            self.skipTest("SHM_CORPUS is not set")
        most = (20 if SANITIZED else 100) << 10
        meshes = sorted(path for path in Path(corpus).rglob("*")
                        if path.is_file() and path.suffix not in (".md", ".tsv") and path.stat().st_size <= most)
        self.assertGreater(len(meshes), 10)
        for mesh in meshes:
            with self.subTest(mesh=mesh.name):
                self.shm("compress", str(mesh), "-qfo", "packed.shm")
                pictures = []
                for name in (str(mesh), "packed.shm"):
                    report = json.loads(self.shm("preview", name, "-fo", "out.png", "--json", "--size", "96x72"))
                    pictures.append(self.bytes("out.png"))
                picture = Picture(pictures[0])
                self.assertGreater(report["covered_pixels"], 20)
                self.assertEqual(96 * 72 - picture.colours[WHITE], report["covered_pixels"])
                self.assertGreaterEqual(len(picture.colours), 2)
                self.assertEqual(*pictures)


if __name__ == "__main__":
    SHM = FolderTest.tool = os.path.abspath(sys.argv.pop(1))
    if lacks(SHM, "preview"):
        print("this shm was built without libpng")
        sys.exit(77)
    unittest.main()
