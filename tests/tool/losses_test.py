#!/usr/bin/env python3
"""Tests that the tool reports data that an output cannot store. The name of an output file normally determines
its format. If --format names a different format that can store less, the tool must report an error before it
does any work.

Usage: losses_test.py PATH_OF_SHM
"""
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import exodus_text, write_vtk

SHM = "shm"


class LossesTest(FolderTest):
    NEEDS = ("ncgen",)

    def setUp(self):
        super().setUp()
        self.exodus("run.e", range(4))
        self.run_tool("compress", "run.e", "-o", "run.shm", "-q")

    def exodus(self, name, steps, **how):
        text = self.write("text.cdl", exodus_text(steps, 3, **how))
        subprocess.run(["ncgen", "-k", "64-bit-offset", "-o", self.path(name), text], check=True)

    def run_tool(self, *words, code=0):
        done = subprocess.run([SHM, *words], cwd=self.directory.name, capture_output=True, timeout=120)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stderr.decode()}")
        return done.stderr.decode()

    def expect_refusal(self, *words, lost):
        before = sorted(os.listdir(self.directory.name))
        text = self.run_tool(*words, code=2)
        self.assertRegex(text, "^shm: .*" + lost + "; leave --format out, or give OUT a name that")
        self.assertEqual(len(text.splitlines()), 1)
        self.assertEqual(sorted(os.listdir(self.directory.name)), before)

    def test_steps_that_the_name_promises(self):
        for format in ("vtk", "vtu", "ucd"):
            for words in (["convert", "run.e"], ["convert", "run.shm"], ["extract", "run.shm"]):
                for out in ("out.e", "out.exo", "out.e.4.0", "out.msh", "out.shm"):
                    with self.subTest(format=format, words=words, out=out):
                        self.expect_refusal(*words, out, "--format", format, lost="3 of 4 time steps")
            self.expect_refusal("decompress", "run.shm", "-o", "out.e", "--format", format,
                                lost="3 of 4 time steps")

    def test_numbers_that_are_too_large_for_exodus(self):
        """Gmsh's physical tags become set numbers in Exodus, which have 32 bits. If a tag is too large, the
        set gets another number, and the tool reports this."""
        corners = [(n & 1, n >> 1 & 1, n >> 2) for n in range(8)]
        for tag, fits in ((2**31 - 1, True), (2**31, False), (2**32, False)):
            self.write("far.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n"
                       f"1 0 0 0 1 1 1 1 {tag} 0\n$EndEntities\n$Nodes\n1 8 1 8\n3 1 0 8\n" +
                       "".join(f"{n + 1}\n" for n in range(8)) + "".join("%d %d %d\n" % xyz for xyz in corners) +
                       "$EndNodes\n$Elements\n1 1 1 1\n3 1 5 1\n1 1 2 4 3 5 6 8 7\n$EndElements\n")
            said = self.run_tool("convert", "far.msh", "far.e", "-f")
            self.assertEqual(said, "" if fits else "shm: not in far.e: number of element set "
                             f"{tag}, which is above {2**31 - 1}\n")
            if not fits:
                self.run_tool("convert", "far.msh", "strict.e", "--strict", code=6)

    def test_names_that_netcdf_does_not_take_are_bad_input(self):
        """The reader of classic netCDF headers accepts any names in the source, but netCDF refuses to write
        some of them."""
        plain = Path(self.path("run.e")).read_bytes()
        self.assertIn(b"num_nodes", plain)
        Path(self.path("odd.e")).write_bytes(plain.replace(b"time_step", b"time/step").replace(b"len_line", b"len/line"))
        self.run_tool("compress", "odd.e", "-o", "odd.shm", "-q")
        self.run_tool("decompress", "odd.shm", "-o", "back.e", code=3)

    def test_it_is_found_before_values_are_decoded(self):
        whole = Path(self.path("run.shm")).read_bytes()

        def hurt(at):
            Path(self.path("run.shm")).write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1:])
            return self.run_tool("verify", "run.shm", code=3)

        group = re.search(r"group of segment 0, bytes \d+-(\d+)", hurt(200))
        hurt(int(group[1]))
        self.run_tool("decompress", "run.shm", "-o", "out.e", code=3)
        self.expect_refusal("decompress", "run.shm", "-o", "out.e", "--format", "vtk",
                            lost="3 of 4 time steps")

    def test_what_else_the_format_of_the_mesh_would_hold(self):
        self.expect_refusal("convert", "run.e", "out.e", "--format", "vtk", "--step", "1",
                            lost="blocks that array 'heat' covers .*")
        self.expect_refusal("convert", "run.e", "out.shm", "--format", "gmsh", lost="array 'global/energy' and 1 more")

    def test_names_that_promise_nothing_more(self):
        """The tool lists the data that the output format cannot store, and writes the file without this
        data."""
        for out, words in (("out.vtk", []), ("out.vtk.4.0", []), ("out", ["--format", "vtk"]),
                           ("out.vtu", ["--format", "vtk"]), ("out.dat", ["--format", "ucd"])):
            text = self.run_tool("convert", "run.e", out, *words)
            self.assertIn(f"shm: not in {out}: time steps 0 to 2 of 4", text)
        # Nothing is lost.
        write_vtk(self.path("mesh.vtk"), 3)
        self.run_tool("convert", "mesh.vtk", "other.vtu", "--format", "vtk")

    def test_a_title_with_zero_bytes_and_other_controls(self):
        self.exodus("title.e", range(1), title=r"left\000right")
        text = self.run_tool("convert", "title.e", "out.ucd")
        self.assertIn("shm: not in out.ucd: title 'left'\n", text)
        self.exodus("escape.e", range(1), title=r"\033[2Jgone")
        text = self.run_tool("convert", "escape.e", "other.ucd")
        self.assertIn(r"shm: not in other.ucd: title '\x1b[2Jgone'", text)


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
