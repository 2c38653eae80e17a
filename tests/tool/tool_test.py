#!/usr/bin/env python3
"""Tests the command line of shm: exit codes, JSON output, and that no temporary files remain.

Usage: tool_test.py PATH_OF_SHM
"""
import json
import os
import random
import re
import signal
import struct
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, FolderTest, forced
from sample_meshes import TWO_BLOCKS, write_vtk

import xml.etree.ElementTree

SHM = "shm"


class ToolTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.mesh = self.path("mesh.vtk")
        write_vtk(self.mesh, 5)

    def shm(self, *words, code=0):
        """Runs the tool and checks its exit code. Returns (stdout, stderr)."""
        done = subprocess.run([SHM, *forced(words)], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stdout}{done.stderr}")
        if code in (0, 1):
            self.assertEqual(done.stderr, "")
        else:
            self.assertEqual(done.stdout, "")
            self.assertTrue(done.stderr.startswith("shm: "), done.stderr)
            # An error is a single line. Before this line, verify lists all damage.
            *listed, error = done.stderr.splitlines()
            self.assertTrue(error.startswith("shm: ") and done.stderr.endswith("\n"), done.stderr)
            if listed:
                self.assertEqual(words[0], "verify", done.stderr)
                self.assertRegex(listed[0], f": damaged in {len(listed) - 1} places?$")
                self.assertTrue(all(line.startswith("shm:   ") for line in listed[1:]), done.stderr)
        return done.stdout, done.stderr

    def assert_only(self, *names):
        self.assertEqual(sorted(os.listdir(self.directory.name)), sorted(names))

    def test_help_and_version(self):
        self.assertIn("compress", self.shm("--help")[0])
        self.assertRegex(self.shm("--version")[0], r"^shm \d+\.\d+\.\d+\n$")
        for command in ("compress", "decompress", "append", "convert", "extract", "verify", "diff", "info",
                        "layout", "preview", "surface", "view"):
            self.assertIn("Examples:\n  shm " + command, self.shm(command, "--help")[0])

    def test_help_by_other_words(self):
        for words in (["help"], ["-h"]):
            self.assertEqual(self.shm(*words), self.shm("--help"))
        for words in (["compress", "-h"], ["help", "compress"]):
            self.assertEqual(self.shm(*words), self.shm("compress", "--help"))
        for words in (["version"], ["-V"]):
            self.assertEqual(self.shm(*words), self.shm("--version"))
        alone = subprocess.run([SHM], capture_output=True, text=True, timeout=120)
        self.assertEqual((alone.returncode, alone.stdout, alone.stderr), (2, "", self.shm("--help")[0]))

    def test_slips_of_the_hand(self):
        for words, expected in [
                (["compres", "mesh.vtk"], "there is no command compres; did you mean compress? (see shm --help)"),
                (["inof", "mesh.vtk"], "there is no command inof; did you mean info? (see shm --help)"),
                (["squash"], "there is no command squash (see shm --help)"),
                ([""], "there is no command  (see shm --help)"),
                (["help", "verfy"], "there is no command verfy; did you mean verify? (see shm --help)"),
                (["compress", "mesh.vtk", "--ordr", "free"],
                 "there is no option --ordr; did you mean --order? (see shm compress --help)"),
                (["compress", "--theads=2"],
                 "there is no option --theads; did you mean --threads? (see shm compress --help)"),
                (["verify", "mesh.shm", "--qqqqqqqq"], "there is no option --qqqqqqqq (see shm verify --help)")]:
            with self.subTest(words=words):
                self.assertEqual(self.shm(*words, code=2), ("", f"shm: {expected}\n"))

    def test_wrong_use(self):
        self.shm("squash", self.mesh, code=2)
        self.shm("compress", code=2)
        self.shm("compress", self.mesh, "--order", "any", code=2)
        self.shm("compress", self.mesh, "--order", "free", "--delay", "5", code=2)
        self.shm("compress", self.mesh, "--bits", "53", code=2)
        self.shm("compress", self.mesh, "--bits", "0", code=2)
        self.shm("compress", self.mesh, "--delay", "-1", code=2)
        for words in (["--delay", "5"], ["--order", "stream", "--delay", "5"]):
            self.shm("compress", self.mesh, "--codec", "shifts", *words, code=2)
        self.shm("compress", self.mesh, "--segment-cells", "0", code=2)
        self.assertIn("the minimum is 1M", self.shm("compress", self.mesh, "--memory", "10", code=2)[1])
        self.shm("compress", self.mesh, "--threads", "0", code=2)
        self.shm("compress", self.mesh, "--key-steps", "0", code=2)
        self.shm("compress", self.mesh, "--restart-budget", "-1", code=2)
        self.shm("compress", self.mesh, "--restart-budget", "nan", code=2)
        self.shm("compress", self.mesh, "--temp", self.path("nowhere"), code=2)
        self.shm("compress", self.mesh, "-o", "-", "--json", code=2)
        self.shm("convert", self.mesh, self.path("out.xyz"), code=2)
        self.shm("convert", self.mesh, self.path("out.vtk"), "--format", "stl", code=2)
        self.shm("decompress", code=2)
        self.assert_only("mesh.vtk")

    def test_bad_input(self):
        garbage = self.path("garbage.bin")
        with open(garbage, "wb") as out:
            out.write(bytes(range(256)) * 8)
        for words in (["compress", self.path("missing.e")], ["compress", garbage],
                      ["convert", self.directory.name, self.path("x.vtk")], ["verify", garbage],
                      ["verify", self.mesh], ["info", garbage], ["info", self.path("missing.shm")],
                      ["layout", garbage, "-o", self.path("x.svg")],
                      ["preview", garbage, "-o", self.path("x.png")],
                      ["decompress", self.mesh, "-o", self.path("x.vtk")],
                      ["convert", garbage, self.path("x.vtk")]):
            _, error = self.shm(*words, code=3)
            self.assertIn(words[1], error)
        self.assert_only("mesh.vtk", "garbage.bin")

    def test_diff(self):
        moved, shuffled = self.path("moved.vtk"), self.path("shuffled.vtk")
        packed, exodus = self.path("mesh.shm"), self.path("mesh.e")
        write_vtk(moved, 5, bend=0.01)
        write_vtk(shuffled, 5, shuffled=True)
        self.shm("compress", self.mesh, "-o", packed, "-q")
        self.shm("convert", self.mesh, exodus, "-q")
        for other in (self.mesh, packed, exodus):
            self.assertIn("are equal", self.shm("diff", self.mesh, other)[0])
        text, _ = self.shm("diff", self.mesh, moved, "--limit", "1", code=1)
        self.assertIn("coordinates: 180 of 648 values differ", text)
        self.assertRegex(text, r"vertex \d+ at \(\S+ \S+ 0\.5\), component 0: .* in B\n    and 179 more")
        self.assertEqual(self.shm("diff", self.mesh, moved, "-q", code=1)[0], "")
        for how in (["--abs", "0.051"], ["--rel", "0.102"], ["--ignore", "coordinates"],
                    ["--array", "coordinates:abs=0.051"]):
            self.shm("diff", self.mesh, moved, *how)
        self.shm("diff", self.mesh, moved, "--abs", "0.049", code=1)

        report = json.loads(self.shm("diff", self.mesh, moved, "--json", code=1)[0])
        self.assertEqual(list(report), [
            "equal", "tolerance", "match", "a", "b", "matched_vertices", "matched_cells",
            "values_compared", "values_different", "differences", "notes"])
        self.assertFalse(report["equal"])
        self.assertEqual(report["b"]["vertices"], 216)
        (finding,) = report["differences"]
        self.assertEqual((finding["kind"], finding["what"]), ("coordinates", "coordinates"))
        self.assertEqual(finding["different"], 180)
        self.assertAlmostEqual(finding["largest_difference"], 0.05)
        self.assertAlmostEqual(finding["largest_relative"], 0.1)
        place = finding["places"][0]
        self.assertEqual((place["element"], place["a"] // 36, place["component"]), ("vertex", 5, 0))

        self.shm("diff", self.mesh, shuffled, code=1)
        self.shm("diff", self.mesh, shuffled, "--match", "--ignore", "heat", "--ignore", "zone")
        report = json.loads(self.shm("diff", self.mesh, shuffled, "--match", "--json", code=1)[0])
        self.assertEqual((report["matched_vertices"], report["matched_cells"]), (216, 125))
        self.assertEqual([each["what"] for each in report["differences"]],
                         ["array 'point/heat'", "array 'cell/zone'"])

        self.shm("diff", self.mesh, code=2)
        self.shm("diff", self.mesh, moved, "--abs", "1", "--rel", "1", code=2)
        self.shm("diff", self.mesh, moved, "--abs", "-1", code=2)
        self.shm("diff", self.mesh, moved, "--only", "nothing", code=2)
        self.shm("diff", self.mesh, moved, "--array", "heat:bits=4", code=2)
        for words in ([self.path("no.e"), self.mesh], [self.mesh, self.path("no.e")]):
            self.assertIn("no.e", self.shm("diff", *words, code=3)[1])
        self.assert_only("mesh.vtk", "moved.vtk", "shuffled.vtk", "mesh.shm", "mesh.e")

    def test_damaged_files(self):
        packed = self.path("mesh.vtk.shm")
        self.shm("compress", self.mesh)
        with open(packed, "rb") as source:
            good = source.read()
        cut = self.path("cut.shm")
        for size in (0, 5, 40, len(good) // 2, len(good) - 1):
            with open(cut, "wb") as out:
                out.write(good[:size])
            for words in (["verify", cut], ["info", cut],
                          ["decompress", cut, "-o", self.path("x.vtk")]):
                self.assertIn(cut, self.shm(*words, code=3)[1])
            expected = ("is empty" if size == 0 else "the file" if size <= 16
                        else "has been cut, and has no index")
            self.assertIn(expected, self.shm("info", cut, code=3)[1])
            if size == 0:
                self.assertIn(expected, self.shm("verify", cut, code=3)[1])
        with open(cut, "wb") as out:
            out.write(good + b"an append that was torn")
        self.assertEqual(self.shm("info", cut)[0].splitlines()[1:],
                         self.shm("info", packed)[0].splitlines()[1:])
        self.assertRegex(self.shm("verify", cut, code=1)[0],
                         "sound, .*, but 23 bytes after the end of the mesh do not belong to it\n$")
        self.assertEqual(json.loads(self.shm("verify", cut, "--json", code=1)[0])["stray_bytes"], 23)
        against = self.shm("verify", cut, "--against", self.mesh, code=1)[0]
        self.assertRegex(against, "(?s)equal to .*\n  23 bytes after the end of the mesh do not belong to it\n$")
        archive = self.path("torn_archive.shm")
        self.shm("join", "-o", archive, packed, cut)
        self.assertRegex(self.shm("verify", archive, code=1)[0],
                         "(?s)sound, [^\n]*[a-z]\n.*sound, .*, but 23 bytes after the end of the mesh do not belong to it\n$")
        os.remove(archive)
        damaged = bytearray(good)
        damaged[len(good) // 2] ^= 0x10
        with open(cut, "wb") as out:
            out.write(damaged)
        self.assertIn("shm repair -o OUT.shm", self.shm("verify", cut, code=3)[1])
        self.assertIn("shm repair -o OUT.shm",
                      self.shm("decompress", cut, "-o", self.path("x.vtk"), code=3)[1])
        # Damages values at the end of the second chunk, which is a group. `info` does not read these values.
        third = [mark.start() for mark in re.finditer(b"SHMc", good)][2]
        damaged = bytearray(good)
        damaged[third - 1] ^= 0x10
        with open(cut, "wb") as out:
            out.write(damaged)
        self.shm("verify", cut, code=3)
        self.shm("info", cut)
        damaged = bytearray(good)
        damaged[-20] ^= 0x10  # the last bytes of the index
        with open(cut, "wb") as out:
            out.write(damaged)
        self.assertIn("index", self.shm("info", cut, code=3)[1])
        self.assert_only("mesh.vtk", "mesh.vtk.shm", "cut.shm")

    def test_an_index_that_lies_is_damage(self):
        """These golden faulty files have correct checksums, but a wrong field in the index or a wrong box."""
        folder = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "golden", "faulty")
        with open(os.path.join(folder, "list.txt"), encoding="utf-8") as lines:
            lies = [line.split(" ", 2) for line in lines if re.search(" [Ii]ndex: another | a box that is not ", line)]
        self.assertGreater(len(lies), 12)
        for number, _, sentence in lies:
            with self.subTest(sentence):
                lying, healed = os.path.join(folder, number + ".shm"), self.path(number + ".shm")
                error = self.shm("verify", lying, code=3)[1]
                if "box" in sentence and "Group" in sentence:
                    self.assertIn("the bounding box of the group does not match its vertices", error)
                    continue
                self.assertRegex(error, "index, at byte [0-9]+: entry [0-9]+, of the .* at byte [0-9]+, has a different ")
                self.shm("repair", lying, "-o", healed)
                self.shm("verify", healed)

    def test_output_that_cannot_be_written(self):
        packed = self.path("mesh.shm")
        self.shm("compress", self.mesh, "-o", packed)
        nowhere = self.path("nowhere/out")
        self.shm("compress", self.mesh, "-o", nowhere + ".shm", code=4)
        self.shm("decompress", packed, "-o", nowhere + ".vtk", code=4)
        self.shm("decompress", packed, "-o", nowhere + ".e", code=4)
        self.shm("layout", self.mesh, "-o", nowhere + ".svg", code=4)
        os.mkdir(self.path("folder.vtk"))
        self.shm("convert", packed, self.path("folder.vtk"), code=4)
        self.assert_only("mesh.vtk", "mesh.shm", "folder.vtk")

    def test_compress_json(self):
        out, _ = self.shm("compress", self.mesh, "--json")
        report = json.loads(out)
        packed = self.path("mesh.vtk.shm")
        self.assertEqual(report["input_bytes"], os.path.getsize(self.mesh))
        self.assertEqual(report["output_bytes"], os.path.getsize(packed))
        self.assertEqual(sum(report["streams"].values()), report["output_bytes"])
        self.assertEqual((report["vertices"], report["cells"], report["hexahedra"]), (216, 125, 125))
        streams = report["streams"]
        connectivity = sum(streams.get(k, 0) for k in
                           ("connectivity", "corner order", "vertex numbers", "cell numbers",
                            "imports"))
        self.assertEqual((report["segments"], report["imported_vertices"]), (1, 0))
        self.assertAlmostEqual(report["connectivity_bits_per_hex"], 8 * connectivity / 125)
        self.assertAlmostEqual(report["geometry_bits_per_vertex"], 8 * streams["geometry"] / 216)
        self.assertGreaterEqual(report["max_active_vertices"], 8)
        self.assertGreater(report["peak_rss_bytes"], 1 << 20)
        self.assertGreaterEqual(report["seconds"], 0)
        self.assertEqual(sorted(report["arrays"]), ["cell/zone", "point/heat"])
        self.assertAlmostEqual(report["arrays"]["point/heat"]["bits_per_value"],
                               8 * streams["array:point/heat"] / 216)

    def test_info(self):
        packed = self.path("mesh.vtk.shm")
        self.shm("compress", self.mesh)
        text, _ = self.shm("info", "-v", packed)
        for word in ("216 vertices", "125 hexahedra", "'heat'", "connectivity", "geometry"):
            self.assertIn(word, text)
        report = json.loads(self.shm("info", packed, "--json")[0])
        self.assertEqual(report["total_bytes"], os.path.getsize(packed))
        self.assertEqual(sum(s["bytes"] for s in report["streams"].values()), report["total_bytes"])
        self.assertEqual(report["blocks"][0]["shape"], "hexahedron")
        plain = json.loads(self.shm("info", self.mesh, "--json")[0])
        self.assertEqual(plain["arrays"], report["arrays"])
        self.assertNotIn("segment_codecs", plain)

    def test_info_tells_the_codec(self):
        packed = self.path("mesh.shm")
        for codec in ("paper", "rows", "replay", "mixed", "shifts", "patterns"):
            self.shm("compress", self.mesh, "-o", packed, "--codec", codec)
            report = json.loads(self.shm("info", "-v", packed, "--json")[0])
            self.assertEqual(report["segment_codecs"], [codec])
            self.assertIn(f"\ncodec        {codec}\n", self.shm("info", "-v", packed)[0])
            self.shm("compress", self.mesh, "-o", packed, "--codec", codec, "--segment-cells", "50")
            report = json.loads(self.shm("info", "-v", packed, "--json")[0])
            self.assertEqual(report["segment_codecs"], [codec] * 3)
            self.assertIn(f"\ncodec        {codec}\n", self.shm("info", "-v", packed)[0])

    def test_segments(self):
        packed = self.path("mesh.shm")
        for order in ("keep", "stream"):
            for delay in ("0", "9"):
                out, _ = self.shm("compress", self.mesh, "-o", packed, "--order", order, "--delay",
                                  delay, "--segment-cells", "50", "--json")
                self.assertEqual(json.loads(out)["segments"], 3)
                report = json.loads(self.shm("info", packed, "--json")[0])
                self.assertEqual(report["segment_starts"], [0, 50, 100])
                self.assertEqual(report["imported_vertices"], json.loads(out)["imported_vertices"])
                self.assertIn("segments     3, ", self.shm("info", "-v", packed)[0])
                self.shm("verify", packed, "--against", self.mesh)
                back = self.path("back.vtk")
                self.shm("decompress", packed, "-o", back)
                self.shm("verify", packed, "--against", back)

    def test_delay_is_tried(self):
        plain, local = self.path("plain.vtk"), self.path("local.vtk")
        write_vtk(plain, 29)
        write_vtk(local, 29, window=60)
        packed = self.path("mesh.shm")

        def delay_of(mesh, *options):
            self.shm("compress", mesh, "-o", packed, *options)
            if mesh == self.mesh or not SANITIZED:  # the other meshes are large
                self.shm("verify", packed, "--against", mesh)
            return json.loads(self.shm("info", packed, "--json")[0])["delay"]
        self.assertEqual(delay_of(self.mesh, "--order", "stream"), 0)
        self.assertEqual(delay_of(self.mesh, "--order", "stream", "--delay", "16"), 16)
        if not SANITIZED:
            self.assertEqual(delay_of(plain, "--order", "stream"), 0)
            self.assertEqual(delay_of(local, "--order", "keep"), 0)
            self.assertEqual(delay_of(plain, "--order", "stream", "--delay", "16"), 16)
        self.assertEqual(delay_of(local, "--order", "stream", "--delay", "0"), 0)
        without = os.path.getsize(packed)
        self.assertIn(delay_of(local, "--order", "stream"), (256, 1024))
        self.assertLess(os.path.getsize(packed), 0.99 * without)
        if SANITIZED:
            return
        # If the source is a .shm file, the tool can read the mesh only once. It therefore copies the mesh to
        # temporary storage before it encodes the mesh.
        again = self.path("again.shm")
        self.shm("compress", local, "-o", again)
        self.assertIn(delay_of(again, "--order", "stream"), (256, 1024))

    def test_threads(self):
        files = []
        for threads in ("1", "2", "3"):
            packed, back = self.path("mesh.shm"), self.path("back.vtk")
            self.shm("compress", self.mesh, "-o", packed, "--segment-cells", "30", "--threads",
                     threads)
            self.shm("verify", packed, "--against", self.mesh, "--threads", threads)
            self.shm("decompress", packed, "-o", back, "--threads", threads)
            with open(packed, "rb") as a, open(back, "rb") as b:
                files.append((a.read(), b.read()))
        self.assertEqual(files[0], files[1])
        self.assertEqual(files[0], files[2])

    def test_key_steps(self):
        """The values change slowly, so a step needs few bytes unless it is coded without reference to other
        steps. A step has more than 64 KiB, because smaller steps are coded as bundles."""
        mesh, packed = self.path("steps.msh"), self.path("steps.shm")
        layers = 2100
        nodes = [(x, y, z) for z in range(layers) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        with open(mesh, "w") as out:
            out.write(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(nodes)}\n")
            for node, (x, y, z) in enumerate(nodes, 1):
                out.write(f"{node} {x} {y} {z}\n")
            out.write(f"$EndNodes\n$Elements\n{layers - 1}\n")
            for cell in range(1, layers):
                out.write(f"{cell} 5 2 1 1 {' '.join(str(4 * cell - 3 + i) for i in range(8))}\n")
            out.write("$EndElements\n")
            for step in range(9):
                out.write(f'$NodeData\n1\n"heat"\n1\n{step / 2}\n3\n{step}\n1\n{len(nodes)}\n')
                for node in range(1, len(nodes) + 1):
                    out.write(f"{node} {0.1 * node ** 3.3 + step * (node * 7919 % 101)!r}\n")
                out.write("$EndNodeData\n")
        sizes = {}
        for key_steps in ("1", "3", "8", "9"):
            out = self.shm("compress", mesh, "-o", packed, "--key-steps", key_steps, "--json")[0]
            sizes[key_steps] = json.loads(out)["streams"]["array:point/heat"]
            self.shm("verify", packed, "--against", mesh)
        self.assertGreater(sizes["1"], 2 * sizes["3"])
        self.assertGreater(sizes["3"], sizes["8"])
        self.assertGreater(sizes["8"], sizes["9"])
        self.shm("compress", mesh, "-o", packed)
        self.assertEqual(json.loads(self.shm("info", packed, "--json")[0])["streams"]
                         ["array:point/heat"]["bytes"], sizes["8"])

    def test_restart_budget(self):
        mesh, packed = self.path("slim.vtk"), self.path("slim.shm")
        write_vtk(mesh, 8)  # too small to be divided by default
        for budget in ("0", "2", "100"):
            out, _ = self.shm("compress", mesh, "-o", packed, "--restart-budget", budget, "--json")
            self.assertEqual(json.loads(out)["segments"], 1)

    def test_verify(self):
        other = self.path("other.vtk")
        write_vtk(other, 5, bend=1e-9)
        ways = ([], ["--order", "stream"], ["--order", "stream", "--delay", "20"],
                ["--delay", "7"], ["--bits", "12"], ["--codec", "paper"],
                ["--abs", "1e-12"], ["--rel", "1e-12", "--order", "free"],
                ["--order", "free"], ["--codec", "replay"],
                ["--codec", "mixed"], ["--codec", "mixed", "--order", "free"],
                ["--codec", "paper", "--order", "stream", "--delay", "9"],
                ["--codec", "replay", "--order", "free"],
                ["--codec", "rows", "--order", "stream"],
                ["--level", "fast"], ["--level", "best", "--order", "stream"])
        for options in ways[::4 if SANITIZED else 1]:
            packed = self.path("mesh.shm")
            self.shm("compress", self.mesh, "-o", packed, *options)
            self.shm("verify", packed)
            self.shm("verify", packed, "--against", self.mesh)
            if "--bits" not in options:
                out, _ = self.shm("verify", packed, "--against", other, code=1)
                self.assertIn("coordinates, vertex", out)
            back = self.path("back.vtk")
            self.shm("decompress", packed, "-o", back)
            self.shm("verify", packed, "--against", back)

    def test_verify_json(self):
        packed, other = self.path("mesh.shm"), self.path("other.vtk")
        write_vtk(other, 5, bend=1e-9)
        self.shm("compress", self.mesh, "-o", packed)

        def verified(*words, code=0):
            return json.loads(self.shm("verify", packed, *words, "--json", code=code)[0])
        counts = {"vertices": 216, "cells": 125, "hexahedra": 125, "arrays": 2, "steps": 0}
        self.assertEqual(verified(), {"file": packed, "sound": True, **counts})
        self.assertEqual(verified("--against", self.mesh),
                         {"file": packed, "sound": True, "against": self.mesh, "equal": True,
                          "differences": 0, "first_differences": [], "quantized": [], **counts})
        bent = verified("--against", other, code=1)
        self.assertFalse(bent["equal"])
        self.assertGreater(bent["differences"], len(bent["first_differences"]))
        self.assertIn("coordinates, vertex", bent["first_differences"][0])
        self.shm("compress", self.mesh, "-o", packed, "--bits", "12")
        [error] = verified("--against", self.mesh)["quantized"]
        self.assertEqual(error["what"], "coordinates")
        self.assertLessEqual(error["largest_error"], error["promised_error"])

    def listed_bounds(self, packed):
        """Returns two error bounds that `info` reports: of the coordinates, and of the array heat."""
        report = json.loads(self.shm("info", packed, "--json")[0])
        bounds = {a["name"]: a["max_error"] for a in report["arrays"]}
        self.assertIsNone(bounds["zone"])  # integers
        return report["coordinate_max_error"], bounds["heat"]

    def test_bounds(self):
        write_vtk(self.mesh, 5, noise=.01)  # noise, so that rounding makes the file smaller
        packed, back = self.path("mesh.shm"), self.path("back.vtk")
        abs3, rel2 = ["--abs", "1e-3"], ["--rel", "0.01"]
        heat, points = "array 'heat'", "coordinates"
        # The grid is .5 wide. The values of the array heat range from 0 to 1.
        for options, bounds in (
                ([], (None, None)), (abs3, (1e-3, 1e-3)), (rel2, (.005, .01)),
                (["--array", "heat:abs=.25"], (None, .25)),
                (["--array", "point/heat:rel=.25"], (None, .25)),
                (["--array", "coordinates:abs=1e-5"], (1e-5, None)),
                ([*abs3, "--array", "coordinates:lossless"], (None, 1e-3)),
                ([*rel2, "--array", "heat:lossless"], (.005, None)),
                ([*abs3, "--array", "heat:abs=0.1", "--array", "coordinates:rel=1e-3"], (.0005, .1)),
                (["--abs", "1e-30"], (None, None))):
            self.shm("compress", *options, self.mesh, "-o", packed)
            for listed, bound in zip(self.listed_bounds(packed), bounds):
                self.assertEqual(listed is None, bound is None, options)
                if bound is not None:
                    self.assertAlmostEqual(listed, bound, delta=1e-12)
            names = [name for name, bound in zip((points, heat), bounds) if bound]
            out = self.shm("verify", packed, "--against", self.mesh)[0]
            self.assertEqual([line.split(":")[0].strip() for line in out.splitlines()[1:]], names)
            report = json.loads(self.shm("verify", packed, "--against", self.mesh, "--json")[0])
            self.assertEqual([error["what"] for error in report["quantized"]], names)
            for error in report["quantized"]:
                self.assertLessEqual(error["largest_error"], error["promised_error"])
                self.assertGreater(error["promised_error"], 0)
            self.assertEqual("error at most" in self.shm("info", packed)[0], bool(names))
        # For coordinates, --bits takes precedence over --abs, and --array takes precedence over both.
        self.shm("compress", self.mesh, "-o", packed, "--bits", "4", *abs3)
        report = json.loads(self.shm("info", packed, "--json")[0])
        self.assertEqual((report["coordinate_bits"], report["arrays"][0]["max_error"]), (4, 1e-3))
        self.shm("compress", self.mesh, "-o", packed, "--bits", "4", "--array", "coordinates:abs=1",
                 "--array", "heat:bits=7")
        report = json.loads(self.shm("info", packed, "--json")[0])
        self.assertEqual((report["coordinate_bits"], report["coordinate_max_error"]), (0, 1))
        self.assertEqual(report["arrays"][0]["bits"], 7)
        # verify finds the decompressed text file and the original source equal to the .shm file, although
        # values were rounded.
        self.shm("compress", self.mesh, "-o", packed, *abs3)
        self.shm("decompress", packed, "-o", back)
        self.shm("verify", packed, "--against", back)
        self.shm("verify", packed, "--against", self.mesh)

    def test_bounds_in_steps(self):
        """Exodus files store fields in steps."""
        write_vtk(self.mesh, 5, noise=.01)  # noise, so that rounding makes the file smaller
        exodus, packed = self.path("mesh.e"), self.path("mesh.shm")
        self.shm("convert", self.mesh, exodus)
        report = json.loads(self.shm("info", exodus, "--json")[0])
        stepped = [a["name"] for a in report["arrays"] if a["per_step"]]
        self.assertIn("heat", stepped)
        for order in ("keep", "stream", "free"):
            self.shm("compress", exodus, "-o", packed, "--rel", "1e-3", "--order", order)
            out = self.shm("verify", packed, "--against", exodus)[0]
            self.assertIn("array 'heat': largest error ", out)
            self.assertIn("coordinates: largest error ", out)

    def test_broken_bounds(self):
        write_vtk(self.mesh, 5, noise=.01)  # noise, so that rounding makes the file smaller
        packed, other = self.path("mesh.shm"), self.path("other.vtk")
        with open(self.mesh) as source:
            lines = source.read().split("\n")
        at = lines.index("FIELD data 1") + 2  # position of heat

        def write_other(number, value):
            changed = list(lines)
            changed[at + number] = value
            with open(other, "w") as out:
                out.write("\n".join(changed))
        self.shm("compress", self.mesh, "-o", packed, "--array", "heat:abs=0.01")
        write_other(17, "0.0101")  # 0 in the mesh
        self.shm("verify", packed, "--against", self.mesh)
        out = self.shm("verify", packed, "--against", other, code=1)[0]
        self.assertIn("array 'heat', vertex 17: 0.0101 in the source, 0 in the restored mesh; "
                      "error 0.0101, allowed 0.01", out)
        report = json.loads(self.shm("verify", packed, "--against", other, "--json", code=1)[0])
        self.assertFalse(report["equal"])
        self.assertEqual(report["differences"], 1)
        self.assertGreater(report["quantized"][0]["largest_error"], .01)
        write_other(17, "nan")
        out = self.shm("verify", packed, "--against", other, code=1)[0]
        self.assertIn("vertex 17: nan", out)
        write_other(17, "0.0099")  # at the limit of the bound
        self.shm("verify", packed, "--against", other)
        # Values that are not finite stay exact.
        for odd in ("nan", "inf", "-inf"):
            write_other(5, odd)
            self.shm("compress", other, "-o", packed, "--rel", "0.01")
            self.assertIsNotNone(self.listed_bounds(packed)[1])
            self.shm("verify", packed, "--against", other)
            self.shm("verify", packed, "--against", self.mesh, code=1)

    def test_wrong_bounds(self):
        for options, what in (
                (["--abs", "0"], "'0' is not a number above 0"),
                (["--abs", "x"], "'x' is not a number"),
                (["--abs", "nan"], "'nan' is not a number"),
                (["--abs", "inf"], "'inf' is not a number"),
                (["--abs=-1"], "'-1' is not a number"), (["--rel", "1"], "below 1"),
                (["--rel", "0"], "'0' is not a number"), (["--abs", "1", "--rel", ".1"], "exclude"),
                (["--array", "heat"], "'heat' is not NAME:abs=E"),
                (["--array", "heat:abs"], "not a number"), (["--array", "heat:exact"], "is none of"),
                (["--array", "heat:bits=53"], "1 to 52"), (["--array", "heat:rel=2"], "below 1"),
                (["--array", "cold:abs=1"], "the mesh has no array 'cold'"),
                (["--array", "cell/heat:abs=1"], "no array 'cell/heat'"),
                (["--array", "zone:abs=1"], "'zone' holds int32, and integers are never rounded"),
                (["--array", "heat:abs=1", "--array", "heat:abs=2"], "comes twice")):
            _, error = self.shm("compress", self.mesh, *options, code=2)
            self.assertIn(what, error)
        self.assert_only("mesh.vtk")

    def test_order_free(self):
        mesh, packed = self.path("shuffled.vtk"), self.path("shuffled.shm")
        write_vtk(mesh, 16, shuffled=True)
        sizes = {}
        for order in ("stream", "free"):
            report = json.loads(self.shm("compress", mesh, "-o", packed, "--order", order,
                                       "--json")[0])
            sizes[order] = report["streams"]["connectivity"] + report["streams"]["geometry"]
            self.shm("verify", packed, "--against", mesh)
        self.assertLess(5 * sizes["free"], sizes["stream"])
        self.assertIn("order        free", self.shm("info", "-v", packed)[0])
        self.assertEqual(json.loads(self.shm("info", packed, "--json")[0])["order"], "free")
        self.shm("verify", packed, "--against", self.mesh, code=1)
        back = self.path("back.vtk")
        self.shm("decompress", packed, "-o", back)
        self.shm("verify", packed, "--against", back)

    def test_cell_order(self):
        order, packed, back = self.path("order.txt"), self.path("mesh.shm"), self.path("back.vtk")

        def write(text):
            with open(order, "w") as out:
                out.write(text)

        def lines(numbers):
            return "".join(f"{n}\n" for n in numbers)
        free = ("--order", "free", "--cell-order", order)
        shuffled = random.Random(3).sample(range(125), 125)
        for numbers in (range(125), reversed(range(125)), shuffled):
            write(lines(numbers))
            self.shm("compress", self.mesh, "-o", packed, *free)
            self.shm("verify", packed, "--against", self.mesh, "--cell-order", order)
        write(lines(shuffled)[:-1])  # the file has no newline after the last number
        self.shm("compress", self.mesh, "-o", packed, *free, "--bits", "12", "--segment-cells", "30")
        self.shm("verify", packed, "--against", self.mesh, "--cell-order", order)
        self.shm("verify", packed, "--against", self.mesh, code=1)  # no known order
        self.shm("compress", self.mesh, "-o", packed, *free)
        self.shm("decompress", packed, "-o", back)
        self.shm("verify", packed, "--against", back)
        # Each value of the array "zone" is the number of the cell in the source, divided by seven and rounded
        # down.
        with open(back) as text:
            words = text.read().split()
        at = words.index("CELL_DATA")
        zones = [int(w) for w in words[at:][words[at:].index("zone") + 4:][:125]]
        self.assertEqual(zones, [n // 7 for n in shuffled])

        os.remove(packed)
        identity = list(range(125))
        for text, line, what in (
                (lines(identity[:99]) + "99x\n" + lines(identity[100:]), 100, "'99x' is not a number"),
                (lines(identity[:99]) + "-99\n" + lines(identity[100:]), 100, "'-99' is not a number"),
                (lines(identity[:60]) + "\n" + lines(identity[60:]), 61, "is not a number"),
                (lines(identity[:124]) + "125\n", 125, "cell 125 is beyond the last"),
                (lines(identity[:124]) + "7\n", 125, "cell 7 occurs twice"),
                (lines(identity + [0]), 126, "occurs twice"),
                (lines(identity[:124]), 125, "ends after 124 of 125 cells"),
                ("", None, "is too short for the numbers of 125 cells")):
            write(text)
            for command in (("compress", self.mesh, "-o", packed, *free),):
                _, error = self.shm(*command, code=3)
                self.assertIn(order, error)
                self.assertIn(what, error)
                if line is not None:
                    self.assertIn(f"line {line}", error)
        self.shm("compress", self.mesh, "-o", packed, "--order", "free", "--cell-order",
                 self.path("missing"), code=3)
        self.shm("compress", self.mesh, "-o", packed, "--cell-order", order, code=2)
        self.shm("compress", self.mesh, "-o", packed, "--order", "stream", "--cell-order", order,
                 code=2)
        self.shm("verify", self.mesh, "--cell-order", order, code=2)
        self.assert_only("mesh.vtk", "order.txt", "back.vtk")

    def test_spatial_sort(self):
        program = os.path.join(os.path.dirname(os.path.abspath(SHM)), "shm_spatial_sort")
        if not os.path.exists(program):
            self.skipTest("shm_spatial_sort was not built (SHM_BUILD_CGAL)")
        mesh, order = self.path("shuffled.vtk"), self.path("order.txt")
        packed = self.path("mesh.shm")
        write_vtk(mesh, 16, shuffled=True)
        for options in ([], ["--multiscale"]):
            subprocess.run([program, mesh, "-o", order, *options], check=True)
            printed = subprocess.run([program, mesh, *options], check=True, capture_output=True,
                                     text=True).stdout
            with open(order) as text:
                numbers = text.read()
            self.assertEqual(numbers, printed)
            self.assertEqual(sorted(map(int, numbers.split())), list(range(16 ** 3)))
            self.shm("compress", mesh, "-o", packed, "--order", "free", "--cell-order", order)
            self.shm("verify", packed, "--against", mesh, "--cell-order", order)
        for words, code in (([], 2), ([mesh, "--what"], 2), ([mesh, mesh], 2),
                            ([self.path("missing")], 3), ([mesh, "-o", self.path("no/where")], 4)):
            done = subprocess.run([program, *words], capture_output=True, text=True)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertEqual(done.stdout, "")

    def test_hint_at_order_free(self):
        mesh, packed = self.path("shuffled.vtk"), self.path("shuffled.shm")
        write_vtk(mesh, 25, shuffled=True)

        def hint(path, *options):
            return subprocess.run([SHM, "compress", "-f", path, "-o", packed, *options], check=True,
                                  capture_output=True, text=True).stderr
        self.assertRegex(hint(mesh), r"^.*shuffled.vtk: .* --order free .* \d+ % of these bytes\n$")
        if SANITIZED:
            return
        self.assertEqual(hint(mesh, "--quiet"), "")
        self.assertEqual(hint(mesh, "--json"), "")
        self.assertEqual(hint(mesh, "--order", "stream"), "")
        write_vtk(mesh, 25)
        self.assertEqual(hint(mesh), "")

    def test_keep_gives_back_the_source(self):
        packed, again = self.path("mesh.shm"), self.path("again.shm")
        back = self.path("back.vtk")
        self.shm("compress", self.mesh, "-o", packed)
        self.shm("decompress", packed, "-o", back)
        self.shm("compress", back, "-o", again)
        with open(packed, "rb") as a, open(again, "rb") as b:
            self.assertEqual(a.read(), b.read())

    def test_formats_and_names(self):
        for name in ("out.e", "out.e.4.0", "out.e-s002", "out.exo", "out.msh", "out.vtk", "out.shm"):
            out = self.path(name)
            self.shm("convert", self.mesh, out)
            report = json.loads(self.shm("info", out, "--json")[0])
            self.assertEqual((report["vertices"], report["hexahedra"]), (216, 125), name)
        odd = self.path("odd.name")
        self.shm("convert", self.mesh, odd, "--format", "exodus")
        self.assertEqual(json.loads(self.shm("info", odd, "--json")[0])["source_format"], "exodus")

    def test_join_and_split(self):
        names = ("piece.e.2.0", "piece.e.2.1", "old.vtk.shm")
        pieces = self.path("pieces")
        os.mkdir(pieces)
        for count, name in enumerate(names[:2]):
            write_vtk(self.mesh, 3 + count)
            self.shm("convert", self.mesh, os.path.join(pieces, name))
        self.shm("compress", self.mesh, "-o", os.path.join(pieces, names[2]))
        archive, back = self.path("all.shm"), self.path("back")
        inputs = [os.path.join(pieces, name) for name in names]
        report = json.loads(self.shm("join", *inputs, "-o", archive, "--json")[0])
        self.assertEqual(report["output_bytes"], os.path.getsize(archive))
        self.assertEqual([member["name"] for member in report["members"]], list(names))
        self.assertEqual(report["members"][0]["input_bytes"], os.path.getsize(inputs[0]))

        info = json.loads(self.shm("info", archive, "--json")[0])
        self.assertEqual([(m["file"], m["hexahedra"]) for m in info["members"]],
                         [(names[0], 27), (names[1], 64), (names[2], 64)])
        self.assertIn("archive of 3 files", self.shm("info", archive)[0])
        self.assertEqual(self.shm("verify", archive)[0].count(": sound, "), 3)
        self.assertEqual(self.shm("verify", archive, "--against", pieces)[0].count("equal"), 3)

        os.mkdir(back)
        self.shm("split", archive, "-d", back)
        self.assertEqual(sorted(os.listdir(back)), sorted(names))
        for name in names:
            one, other = os.path.join(pieces, name), os.path.join(back, name)
            self.shm("verify", archive, "--against", back)
            if name.endswith(".shm"):
                with open(one, "rb") as a, open(other, "rb") as b:
                    self.assertEqual(a.read(), b.read())
        self.shm("split", archive, names[1], "-d", back, "--packed")
        self.shm("verify", os.path.join(back, names[1] + ".shm"), "--against", inputs[1])

        os.replace(inputs[0], inputs[1])
        os.replace(os.path.join(back, names[0]), inputs[0])
        self.assertIn("differ", self.shm("verify", archive, "--against", pieces, code=1)[0])

    def test_join_and_split_say_what_is_wrong(self):
        archive, other = self.path("all.shm"), self.path("mesh.shm")
        self.shm("compress", self.mesh, "-o", other)
        self.shm("join", self.mesh, other, "-o", archive)
        self.assertIn("shm split", self.shm("decompress", archive, "-o", self.path("a.vtk"), code=2)[1])
        self.shm("split", archive, "nobody", code=2)
        self.shm("split", other, code=3)
        self.shm("verify", archive, "--against", self.mesh, code=2)
        self.shm("join", archive, "-o", self.path("nested.shm"), code=2)
        self.shm("join", self.mesh, self.mesh, "-o", self.path("twins.shm"), code=2)
        os.rename(other, self.mesh + ".shm")
        self.shm("join", self.mesh, self.mesh + ".shm", "-o", other)
        self.assertIn("two members", self.shm("split", other, "--packed", code=2)[1])
        os.remove(self.mesh + ".shm")
        self.shm("join", self.mesh, self.path("missing.e"), "-o", self.path("less.shm"), code=3)
        with open(archive, "r+b") as file:
            file.truncate(os.path.getsize(archive) - 1)
        self.assertIn("end record", self.shm("split", archive, code=3)[1])
        self.assert_only("all.shm", "mesh.shm", "mesh.vtk")

    def losses(self, *words, code=0):
        """Runs a conversion. Returns the items that it reports as missing from its output."""
        done = subprocess.run([SHM, *forced(words), "-q"], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        out = next(word for word in words[2:] if not word.startswith("-"))
        lines = done.stderr.splitlines()
        for line in lines:
            self.assertTrue(line.startswith(f"shm: not in {out}: "), line)
        return [line.split(": ", 2)[2] for line in lines]

    def exodus(self):
        return self.ncgen("two.e", TWO_BLOCKS)

    def arrays(self, path):
        report = json.loads(self.shm("info", path, "--json")[0])
        return {a["name"]: a for a in report["arrays"]}, report

    def test_losses_are_named(self):
        exodus, packed = self.exodus(), self.path("two.shm")
        vtk, msh = self.path("two.vtk"), self.path("two.msh")
        factors = "distribution factors of side set 3 'inlet'"
        of_vtk = ["time steps 0 to 1 of 3 (a file of format vtk holds one step: --step N selects it, a name "
                  "such as out_%04d writes one file per step)",
                  "blocks that array 'heat' covers (NaN on all other blocks)", factors, "QA records"]
        self.assertEqual(self.losses("convert", exodus, vtk), of_vtk)
        self.assertEqual(self.losses("convert", exodus, msh), [factors, "QA records"])
        # The tool reports the same losses if the source is the .shm file instead of the Exodus file.
        # Conversions to Exodus and .shm files lose nothing.
        self.shm("compress", exodus, "-o", packed)
        self.assertEqual(self.losses("decompress", packed, "-o", vtk), of_vtk)
        self.assertEqual(self.losses("decompress", packed, "-o", self.path("back.e"), "--strict"), [])
        self.assertEqual(self.losses("convert", exodus, self.path("again.shm"), "--strict"), [])

    def test_strict_writes_nothing(self):
        exodus, packed = self.exodus(), self.path("two.shm")
        self.shm("compress", exodus, "-o", packed)
        for words in (["convert", exodus, self.path("two.vtk")],
                      ["decompress", packed, "-o", self.path("two.msh")]):
            self.assertIn("QA records", self.losses(*words, "--strict", code=6))
        self.assert_only("mesh.vtk", "two.e", "two.shm")
        # Nothing is missing: nothing is reported.
        self.assertEqual(self.losses("convert", self.mesh, self.path("mesh.msh"), "--strict"), [])

    def test_one_step(self):
        exodus, vtk = self.exodus(), self.path("two.vtk")
        for step, last in ((0, 1), (2, 31)):
            self.assertNotIn("time", " ".join(self.losses("convert", exodus, vtk, f"--step={step}")))
            report = json.loads(self.shm("info", vtk, "--json")[0])
            self.assertEqual(len(report["step_times"]), 0)
            self.losses("convert", vtk, self.path("back.e"))
            arrays, report = self.arrays(self.path("back.e"))
            self.assertEqual(len(report["step_times"]), 1)
            self.assertIn("v_x", arrays)
        self.assertIn("there is no step 3", self.shm("convert", exodus, vtk, "--step", "3", code=2)[1])

    def test_what_survives(self):
        exodus = self.exodus()
        vtk, msh = self.path("two.vtk"), self.path("two.msh")
        self.losses("convert", exodus, vtk)
        arrays, report = self.arrays(vtk)
        self.assertEqual(arrays["v"]["components"], 3)
        for name in ("heat", "fixed", "inlet", "elem_map"):
            self.assertIn(name, arrays)
        self.losses("convert", vtk, self.path("vtk.e"))
        arrays, report = self.arrays(self.path("vtk.e"))
        self.assertEqual([(b["id"], b["name"]) for b in report["blocks"]], [(10, "steel"), (20, "air")])
        self.losses("convert", exodus, msh)
        arrays, report = self.arrays(msh)
        self.assertEqual(len(report["step_times"]), 3)
        self.assertTrue(arrays["v"]["per_step"])
        self.assertEqual([(b["id"], b["name"], b["cells"]) for b in report["blocks"]],
                         [(10, "steel", 1), (20, "air", 1), (7, "fixed", 3), (3, "inlet", 2)])
        self.losses("convert", msh, self.path("msh.e"))
        arrays, report = self.arrays(self.path("msh.e"))
        self.assertEqual(len(report["step_times"]), 3)
        self.assertEqual([b["name"] for b in report["blocks"]], ["steel", "air", "fixed", "inlet"])
        self.assertIn("v_z", arrays)

    def test_layout(self):
        svg = self.path("mesh.svg")
        self.assertIn("width", self.shm("layout", self.mesh, "-o", svg)[0])
        root = xml.etree.ElementTree.parse(svg).getroot()
        self.assertTrue(root.tag.endswith("svg"))

        for name in ("x.gif", "x"):
            self.assertIn("the name of a picture must end in .svg or .png",
                          self.shm("layout", self.mesh, "-o", self.path(name), code=2)[1])
        if SANITIZED:  # LeakSanitizer would report memory that fontconfig does not free
            return
        png = self.path("mesh.png")
        self.assertIn("stored close together", self.shm("layout", self.mesh, "-o", png)[0])
        with open(png, "rb") as picture:
            head = picture.read(24)
        self.assertEqual((head[:8], head[16:24]), (b"\x89PNG\r\n\x1a\n", struct.pack(">2I", 1240, 664)))

    def test_full_disk(self):
        packed = self.path("mesh.vtk.shm")
        self.shm("compress", self.mesh)
        for words in (["info", packed], ["compress", self.mesh, "-o", "-"]):
            with open("/dev/full", "wb") as full:
                done = subprocess.run([SHM, *forced(words)], stdout=full, stderr=subprocess.PIPE)
            self.assertEqual(done.returncode, 4, done.stderr)

    def test_quiet(self):
        self.assertEqual(self.shm("compress", "--quiet", self.mesh)[0], "")
        self.assertEqual(self.shm("verify", "-q", self.path("mesh.vtk.shm"))[0], "")

    def test_standard_streams(self):
        packed = subprocess.run([SHM, "compress", "-q", self.mesh, "-o", "-"], capture_output=True,
                                check=True).stdout
        back = self.path("back.vtk")
        subprocess.run([SHM, "decompress", "-", "-o", back, "-q"], input=packed, check=True)
        self.shm("compress", self.mesh, "-o", self.path("mesh.shm"))
        with open(self.path("mesh.shm"), "rb") as source:
            self.assertEqual(source.read(), packed)
        self.shm("verify", self.path("mesh.shm"), "--against", back)

    def test_interrupted_run_leaves_nothing(self):
        big = self.path("big.vtk")
        write_vtk(big, 40)
        for number in (signal.SIGINT, signal.SIGTERM):
            process = subprocess.Popen([SHM, "compress", big], stdout=subprocess.DEVNULL)
            time.sleep(0.05)
            process.send_signal(number)
            if process.wait() == -number:
                self.assert_only("mesh.vtk", "big.vtk")
            else:  # the tool finished before the signal
                os.remove(big + ".shm")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop())
    unittest.main()
