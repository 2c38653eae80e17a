#!/usr/bin/env python3
"""Tests shm join --merge with the parts of a decomposed Exodus mesh. The command must either write the same
file as for the whole mesh, or fail with an error that names a part and write no output file.

Usage: merge_test.py PATH_OF_SHM
"""
import json
import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from decomposed import Split, interleaved, whole_text
from folder_test import FolderTest
from mpi_ranks import CORPUS
from sample_meshes import write_vtk

SHM = "shm"


class MergeTest(FolderTest):
    NEEDS = ("ncgen", "ncdump")

    def shm(self, *words, code=0):
        done = subprocess.run([SHM, *words], cwd=self.directory.name, capture_output=True, text=True,
                              timeout=120, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stdout}{done.stderr}")
        return done.stdout if code == 0 else done.stderr

    def split(self, count, n=4, **how):
        """Creates whole.e and its parts, mesh.e.COUNT.0, mesh.e.COUNT.1 and so on."""
        split = Split(self.ncgen("whole.e", whole_text(n, **how)), interleaved, count)
        for part in range(count):
            self.ncgen(f"mesh.e.{count}.{part:0{len(str(count))}}", split.text(part))
        return split

    def test_the_bytes_of_the_whole(self):
        self.split(4)
        for options in ([], ["--order", "stream"], ["--order", "free"], ["--level", "best"]):
            with self.subTest(options=options):
                self.shm("join", "--merge", "-f", "-o", "merged.shm", "mesh.e.4", *options)
                self.shm("compress", "-f", "whole.e", *options)
                self.assertEqual(self.bytes(self.path("merged.shm")),
                                 self.bytes(self.path("whole.e.shm")))

    def test_parts_by_name(self):
        """Parts may be given in any order, because the numbers in their names determine their order."""
        self.split(11, n=3)
        parts = [f"mesh.e.11.{part:02}" for part in range(11)]
        self.shm("join", "--merge", "-o", "named.shm", *parts)
        self.shm("join", "--merge", "-o", "counted.shm", "mesh.e.11")
        self.assertEqual(self.bytes(self.path("named.shm")), self.bytes(self.path("counted.shm")))
        self.shm("decompress", "named.shm", "-o", "back.e")
        self.shm("diff", "back.e", "whole.e")
        self.shm("join", "--merge", "-o", "turned.shm", *reversed(parts))
        self.shm("diff", "turned.shm", "whole.e")

    def test_parts_of_an_archive(self):
        self.split(3)
        parts = [f"mesh.e.3.{part}" for part in range(3)]
        self.shm("join", "-o", "parts.shm", *parts)
        os.mkdir(self.path("out"))
        self.shm("decompress", "parts.shm", "-o", "out")
        self.shm("join", "--merge", "-o", "merged.shm", "out/mesh.e.3")
        self.shm("diff", "merged.shm", "whole.e")

    def test_what_it_reports(self):
        self.split(2)
        text = self.shm("join", "--merge", "-o", "merged.shm", "mesh.e.2")
        self.assertIn("merged.shm", text)
        self.assertIn("times smaller", text)
        report = json.loads(self.shm("join", "--merge", "-f", "--json", "-o", "merged.shm", "mesh.e.2"))
        parts = sum(os.path.getsize(self.path(f"mesh.e.2.{part}")) for part in range(2))
        self.assertEqual(report["input_bytes"], parts)
        self.assertEqual(report["output_bytes"], os.path.getsize(self.path("merged.shm")))

    def test_real_parts(self):
        parts = os.path.join(CORPUS, "exodus/moose__out.e.4")
        if not os.path.exists(parts + ".0"):
            self.skipTest("SHM_CORPUS has no parts")
        self.shm("join", "--merge", "-o", "merged.shm", parts)
        self.shm("decompress", "merged.shm", "-o", "back.e")
        self.shm("diff", "merged.shm", "back.e")
        cells = sum(json.loads(self.shm("info", "--json", f"{parts}.{part}"))["hexahedra"]
                    for part in range(4))
        self.assertEqual(json.loads(self.shm("info", "--json", "merged.shm"))["hexahedra"], cells)

    def test_what_goes_wrong(self):
        split = self.split(3)
        with open(self.path("mesh.e.3.1"), "rb") as file:
            good = file.read()

        def refused(words, *inputs, code=3, out="out.shm"):
            error = self.shm("join", "--merge", "-o", out, *(inputs or ["mesh.e.3"]), code=code)
            for word in words:
                self.assertIn(word, error)
            self.assertFalse([name for name in os.listdir(self.directory.name) if "out" in name])

        def doubled(name, values):
            return [values[0]] * len(values) if name == "elem_num_map" else values

        self.ncgen("mesh.e.3.1", split.text(1, doubled))
        refused(["mesh.e.3.1", "'elem_num_map'", "twice"])
        self.ncgen("mesh.e.3.1", split.text(
            1, lambda name, values: None if name == "node_num_map" else values))
        refused(["mesh.e.3.1", "'node_num_map'", "missing"])
        with open(self.path("mesh.e.3.1"), "wb") as file:
            file.write(good)
        refused(["mesh.e.3"], "mesh.e.3.0", "mesh.e.3.1")  # the third part is missing
        write_vtk(self.path("a.vtk"), 2)
        refused(["a.vtk", "is not an Exodus file"], "mesh.e.3.0", "a.vtk")
        refused(["mesh.e.4"], "mesh.e.4")
        refused(["join writes .shm files"], code=2, out="out.e")
        os.truncate(self.path("mesh.e.3.1"), 1000)
        refused(["mesh.e.3.1"])


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
