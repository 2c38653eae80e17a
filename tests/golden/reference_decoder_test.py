#!/usr/bin/env python3
"""Checks that the reference decoder in spec/, which was written from the text of the specification only,
agrees with the library.

reference_decoder_test.py SHM SHM_TEXT SHM_MAKE_MESH [--all [TIMES]] [--only NAME]

SHM: path of the tool; SHM_TEXT: path of the program that decodes a file with the library and prints the
contents (shm_text.cpp); SHM_MAKE_MESH: path of the mesh generator. For each golden file, the reference decoder
must print exactly the text that is stored next to the file. Small files of the corpus (the folder in
SHM_CORPUS) are compressed with several orders, levels and codecs; both decoders must print the same text for
the result. Damaged bytes must lead to an error. --all tests all files of the corpus, whatever their size, with
TIMES different settings (default 1). This takes about an hour per setting, so --all is only used by hand.
--only restricts the test to files with NAME in their path.
"""
import argparse
import contextlib
import math
import os
import random
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(os.path.dirname(os.path.dirname(HERE)), "spec"), os.path.join(os.path.dirname(HERE), "support")]
from folder_test import SHARE, sample_of  # noqa: E402
import reference_decoder  # noqa: E402
import reference_decoder.columns  # noqa: E402
import reference_decoder.file  # noqa: E402
import reference_decoder.group  # noqa: E402
from reference_decoder import ShmError, text_of  # noqa: E402

GOLDEN = HERE
FAULTY = os.path.join(GOLDEN, "faulty")
CORPUS = os.environ.get("SHM_CORPUS", "")
FOLDERS = ("exodus", "vtk", "gmsh", "other")
SETTINGS = [options.split() for options in (
    "--order keep --level default", "--order stream --level best", "--order free --level fast",
    "--order keep --codec rows --delay 7", "--order stream --codec paper --delay 5", "--order keep --level best",
    "--order keep --codec replay", "--order stream --codec mixed", "--order keep --level fast",
    "--order stream --codec shifts", "--order keep --codec shifts --level best", "--order stream --codec replay",
    "--order keep --codec paper --delay 3", "--order keep --codec mixed --segment-cells 17",
    "--order stream --level default --segment-cells 23", "--order keep --codec shifts --segment-cells 40",
    "--order stream --codec shifts --level best --segment-cells 31", "--order free --level best --key-steps 1",
    "--order keep --codec patterns", "--order stream --level fast --segment-cells 41 --key-steps 3",
    "--order stream --codec patterns --segment-cells 29",
    "--order keep --rel 1e-3", "--order stream --bits 12 --level best")]
# Time limit in seconds for the tests of all small files together.
SECONDS = 25 if SHARE == 1 else 12
# A file is small if it has at most this number of bytes.
LARGEST = 60000
ARGUMENTS = None


def golden_files():
    found = []
    for folder, _, names in os.walk(GOLDEN):
        if folder == FAULTY:
            continue
        found += [os.path.join(folder, name) for name in names if name.endswith(".shm")]
    return sample_of(sorted(found))


def content(path):
    with open(path, "rb") as file:
        return file.read()


def without_trailing(path):
    """Returns the bytes of a golden file without the trailing bytes that follow the mesh. The text that is
    stored next to the golden file states the number of trailing bytes."""
    trailing = int(content(path[:-4] + ".txt").rsplit(b"trailing bytes ", 1)[1])
    data = content(path)
    return data[: len(data) - trailing]


class Golden(unittest.TestCase):
    def test_every_file_decodes_to_its_twin(self):
        files = golden_files()
        self.assertGreater(len(files), 100 / (2 * SHARE))
        for path in files:
            with self.subTest(os.path.basename(path)):
                self.assertEqual(b"".join(text_of(content(path))), content(path[:-4] + ".txt"))

    def test_digests_tell_files_apart(self):
        digests = {b"".join(text_of(content(path), digest=True)) for path in golden_files()}
        texts = {content(path[:-4] + ".txt") for path in golden_files()}
        self.assertEqual(len(digests), len(texts))


class Faulty(unittest.TestCase):
    def test_every_faulty_file_is_refused(self):
        with open(os.path.join(FAULTY, "list.txt"), encoding="utf-8") as lines:
            faulty = [line.split(" ", 2) for line in lines]
        self.assertGreater(len(faulty), 150)
        for number, code, sentence in faulty:
            with self.subTest(number, fault=sentence.strip()), self.assertRaises(ShmError) as caught:
                list(text_of(content(os.path.join(FAULTY, number + ".shm"))))
            message = str(caught.exception)
            with self.subTest(number, fault=sentence.strip(), message=message):
                self.assertEqual("unsupported" in message, code == "unsupported")
                self.assertEqual("truncated" in message, code == "truncated")


class Changed(unittest.TestCase):
    def test_a_changed_byte_is_an_error(self):
        chance = random.Random(1)
        for path in golden_files():
            data = without_trailing(path)
            for at in {0, 9, 12, len(data) - 1, *(chance.randrange(len(data)) for _ in range(8))}:
                changed = bytearray(data)
                changed[at] ^= 1 << chance.randrange(8)
                with self.subTest(os.path.basename(path), at=at), self.assertRaises(ShmError):
                    list(text_of(bytes(changed)))

    def test_a_file_that_was_cut_is_an_error(self):
        for path in golden_files()[::5]:
            data = without_trailing(path)
            for at in range(0, len(data), max(1, len(data) // 23)):
                if data[:at].endswith(b"SHME"):
                    continue  # an earlier index of a live file
                with self.subTest(os.path.basename(path), at=at), self.assertRaises(ShmError):
                    list(text_of(data[:at]))

    def test_bytes_behind_the_end_are_counted_only(self):
        path = os.path.join(GOLDEN, "0.1", "keep.shm")
        twin = content(path[:-4] + ".txt").replace(b"trailing bytes 0", b"trailing bytes 3")
        self.assertEqual(b"".join(text_of(content(path) + b"abc")), twin)

    def test_bitstreams_that_say_anything_are_errors_or_meshes(self):
        """Decodes hostile streams with correct checksums. Decoding must not raise any exception except
        ShmError."""
        class Fits(int):
            __hash__ = int.__hash__

            def __eq__(self, other):
                return True

            def __ne__(self, other):
                return False

        chance, errors, tried = random.Random(2), 0, 0
        for path in golden_files():
            data = content(path)
            if reference_decoder.is_archive(data):
                continue
            places = stream_places(data)
            for _ in range(6 if len(data) < 3000 else 2):
                changed = bytearray(data)
                for at in chance.sample(places, min(len(places), 3)):
                    changed[at] = chance.randrange(256)
                tried += 1
                with self.subTest(os.path.basename(path)), mock.patch.object(
                        reference_decoder.file, "checksum", lambda data: Fits()), mock.patch.object(
                        reference_decoder.group, "checksum", lambda data: Fits()), contextlib.suppress(ShmError):
                    errors += 1
                    list(text_of(bytes(changed)))
                    errors -= 1
        self.assertGreater(errors, tried // 10)


def stream_places(data):
    """Returns the offsets of all bytes that are coded data and not headers: the bitstreams of each group, and
    the values in each chunk of step values."""
    places, at, sequence = [], 16, 0
    while True:
        chunk = reference_decoder.file.read_chunk(data, at, sequence)
        begin, end = chunk.base(), chunk.end()
        if chunk.kind == reference_decoder.file.GROUP:
            schema = reference_decoder.File(data).schema
            header = reference_decoder.group.GroupHeader(schema, chunk)
            places += range(begin + header.header_bytes, end)
        elif chunk.kind == reference_decoder.file.STEP_VALUES:
            places += range(end - sum(len(part.data) for part in reference_decoder.steps.read_parts(chunk)), end)
        elif chunk.kind == reference_decoder.file.INDEX:
            return places or [16 + 22]
        at, sequence = end, sequence + 1


class BothAgree(unittest.TestCase):
    def check(self, source, options, scratch):
        """Compresses the source, decodes the file with both decoders and compares the results. Returns false
        if the tool refuses these options."""
        packed = os.path.join(scratch, "packed.shm")
        done = subprocess.run([ARGUMENTS.shm, "compress", "-f", source, "-o", packed, *options],
                              capture_output=True, text=True, timeout=1200)
        if done.returncode != 0:
            self.assertIn(done.returncode, (2, 3, 5), done.stderr)
            return False
        expected = subprocess.run([ARGUMENTS.shm_text, packed], capture_output=True, timeout=1200)
        self.assertEqual(expected.returncode, 0, expected.stderr)
        with self.subTest(source, options=" ".join(options)):
            at, twin = 0, expected.stdout
            for piece in text_of(content(packed)):
                self.assertTrue(twin.startswith(piece, at), f"the text differs from byte {at} on")
                at += len(piece)
            self.assertEqual(at, len(twin))
        return True


class Generated(BothAgree):
    def test_mesh_of_two_tiles(self):
        """The mesh has more cells than a tile, the unit that a reader returns in one call. The mesh is so
        large that even rare states of the context mixer occur during decoding."""
        with tempfile.TemporaryDirectory() as scratch:
            mesh = os.path.join(scratch, "mesh.vtk")
            subprocess.run([ARGUMENTS.shm_make_mesh, "ogrid", "5000", mesh, "--fields", "basic"], check=True,
                           capture_output=True)
            self.assertTrue(self.check(mesh, ["--level", "best", "--codec", "mixed"], scratch))

    def test_many_cells_around_an_edge(self):
        """The mesh is a wheel of twelve sectors, coded sector by sector. Twelve cells share each edge on the
        axis, and the contexts of the codecs count at most seven."""
        spokes, layers = 12, 30
        size, turn = 2 * spokes + 1, math.pi / spokes
        ring = [(math.cos(turn * i), math.sin(turn * i)) for i in range(2 * spokes)]
        points = [(x, y, z) for z in range(layers + 1) for x, y in [(0, 0), *ring]]
        cells = []
        for i in range(spokes):
            quad = [0, 1 + 2 * i, 2 + 2 * i, 1 + (2 * i + 2) % (2 * spokes)]
            cells += [[size * (layer + up) + v for up in (0, 1) for v in quad] for layer in range(layers)]
        self.check_hexahedra(points, cells, ("rows", "mixed", "replay", "paper"))

    def test_grids_full_of_holes(self):
        """Tests irregular meshes. The decoder must discard its records of earlier hexahedra in the same order
        as the encoder; otherwise, it decodes such meshes incorrectly."""
        n, m = 8, 9
        points = [(x, y, z) for z in range(m) for y in range(m) for x in range(m)]
        for seed in range(6):
            chance = random.Random(seed)
            corners = [x + m * (y + m * z) for z in range(n) for y in range(n) for x in range(n)
                       if chance.random() < .5]
            cells = [[up + v for up in (c, c + m * m) for v in (0, 1, m + 1, m)] for c in corners]
            self.check_hexahedra(points, cells, ("rows", "mixed"))

    def test_polygons_of_several_sizes(self):
        points = [(x, y, 0) for y in range(3) for x in range(4)]
        cells = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 11, 6], [4, 5, 9, 8]]
        self.check_cells(points, cells, 7, ("rows", "mixed", "replay", "paper"))

    def test_hexahedra_with_joined_corners(self):
        """Some hexahedra are collapsed to wedges, pyramids or simpler cells. A face may contain a vertex
        twice."""
        n, m = 5, 6
        points = [(x, y, z) for z in range(m) for y in range(m) for x in range(m)]
        for seed in range(4):
            chance = random.Random(seed)
            joined = list(range(m**3))
            for v in range(m**3 - m * m - m - 1):
                if chance.random() < .1:
                    joined[v] = v + chance.choice((1, m, m * m))
            corners = [x + m * (y + m * z) for z in range(n) for y in range(n) for x in range(n)]
            cells = [[joined[up + v] for up in (c, c + m * m) for v in (0, 1, m + 1, m)] for c in corners]
            self.check_hexahedra(points, cells, ("rows", "mixed", "replay", "paper", "patterns"))

    def test_a_range_too_small_for_a_step(self):
        """The range of the values is so small that the quantization step is rounded to 0. Division by this
        step follows IEEE 754."""
        points = [(x, y, z) for z in range(3) for y in range(2) for x in range(2)]
        cells = [[4 * up + v for up in (z, z + 1) for v in (0, 1, 3, 2)] for z in range(2)]
        field = ("POINT_DATA 12\nSCALARS a double 1\nLOOKUP_TABLE default\n"
                 + "\n".join(str(5e-324 * (i % 5)) for i in range(12)))
        for level in ("default", "best"):
            self.check_hexahedra(points, cells, ("rows",), field, "--array", "a:bits=20", "--level", level)

    def check_hexahedra(self, points, cells, *how):
        self.check_cells(points, cells, 12, *how)

    def check_cells(self, points, cells, vtk_type, codecs, fields="", *options):
        with tempfile.TemporaryDirectory() as scratch:
            mesh = os.path.join(scratch, "mesh.vtk")
            with open(mesh, "w", encoding="ascii") as file:
                print("# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID", file=file)
                print("POINTS", len(points), "double", *(x for point in points for x in point), file=file)
                numbers = [v for cell in cells for v in (len(cell), *cell)]
                print("CELLS", len(cells), len(numbers), *numbers, file=file)
                print("CELL_TYPES", len(cells), *[vtk_type] * len(cells), file=file)
                print(fields, file=file)
            for codec in codecs:
                for order in ("keep", "stream"):
                    self.assertTrue(self.check(mesh, ["--codec", codec, "--order", order, *options], scratch))


class Corpus(BothAgree):
    def setUp(self):
        if not CORPUS:
            self.skipTest("SHM_CORPUS names no folder")

    def test_small_files_become_the_same_by_both(self):
        files = []
        for folder in FOLDERS:
            for where, _, names in os.walk(os.path.join(CORPUS, folder)):
                files += [os.path.join(where, name) for name in names]
        files.sort(key=lambda path: (os.path.getsize(path), path))
        if ARGUMENTS.only:
            files = [path for path in files if ARGUMENTS.only in path]
        tried, begin = 0, time.monotonic()
        with tempfile.TemporaryDirectory() as scratch:
            if ARGUMENTS.all:
                for number, source in enumerate(files):
                    times = 0
                    for turn in range(len(SETTINGS)):
                        options = SETTINGS[(number + turn) % len(SETTINGS)]
                        started = time.monotonic()
                        taken = self.check(source, options, scratch)
                        print(os.path.relpath(source, CORPUS), *options,
                              f"{time.monotonic() - started:.1f} s" if taken else "refused", flush=True)
                        times += taken
                        if times == ARGUMENTS.all:
                            break
                    tried += times
            else:
                # Tests each small file with several settings, until the time limit is reached.
                small = [path for path in sample_of(files) if os.path.getsize(path) <= LARGEST]
                for turn in range(len(SETTINGS)):
                    for number, source in enumerate(small):
                        if time.monotonic() - begin < SECONDS:
                            tried += self.check(source, SETTINGS[(number + turn) % len(SETTINGS)], scratch)
        self.assertGreater(tried, 0 if ARGUMENTS.all or ARGUMENTS.only else 10)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("shm")
    parser.add_argument("shm_text")
    parser.add_argument("shm_make_mesh")
    parser.add_argument("--all", type=int, nargs="?", const=1, default=0, metavar="TIMES")
    parser.add_argument("--only", default="")
    ARGUMENTS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])
