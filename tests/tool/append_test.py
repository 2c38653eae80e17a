#!/usr/bin/env python3
"""Tests shm append. The result must equal a single file with all steps, or the file must be unchanged.

Usage: append_test.py PATH_OF_SHM
"""
import json
import os
import re
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, FolderTest, forced
from sample_meshes import exodus_text

SHM = "shm"


class AppendTest(FolderTest):
    NEEDS = ("ncgen",)

    def shm(self, *words, code=0, stderr=""):
        done = subprocess.run([SHM, *forced(words)], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stdout}{done.stderr}")
        if code == 0:
            self.assertRegex(done.stderr, stderr + "$")
        else:
            self.assertEqual(done.stdout, "")
            self.assertRegex(done.stderr, stderr)
        return done.stdout

    def exodus(self, name, steps, n=4, kind="64-bit-offset", with_globals=True, **how):
        text = exodus_text(steps, n, **how)
        if not with_globals:
            for words in ("num_glo_var = 2 ;", "char name_glo_var.*?;", "double vals_glo_var.*?;",
                          'name_glo_var = "energy", "mass" ;', "vals_glo_var = .*?;"):
                text, count = re.subn(words, "", text, count=1)
                self.assertEqual(count, 1, words)
        return self.ncgen(name, text, kind)

    def packed(self, source, *words):
        name = source + ".shm"
        self.shm("compress", source, "-o", name, *words)
        return name

    def assert_steps(self, file, source, same_numbers=True):
        """Checks that `file` contains all data of the source and decompresses to the same Exodus file."""
        self.shm("verify", file)
        self.shm("verify", file, "--against", source)
        self.shm("decompress", file, "-o", self.path("back.e"))
        words = [] if same_numbers else ["--match"]
        self.assertIn("equal", self.shm("diff", source, self.path("back.e"), *words))
        os.remove(self.path("back.e"))

    def test_restarts_of_as_many_steps(self):
        # The parts differ only in their step values. The first two parts even have the same number of steps.
        for first, second, third in (((0, 1, 2), (3, 4, 5), (6,)), ((0,), (1,), (2,))):
            parts = [self.exodus(f"part{i}.e", steps, with_globals=False)
                     for i, steps in enumerate((first, second, third))]
            file = self.packed(parts[0])
            for part in parts[1:]:
                self.shm("append", file, part)
            whole = self.exodus("whole.e", (*first, *second, *third), with_globals=False)
            self.assert_steps(file, whole)

    def test_outputs(self):
        file = self.packed(self.exodus("a.e", (0, 1)))
        # If the source contains no new steps, the output equals the input file.
        self.shm("append", file, self.path("a.e"), "-o", self.path("same.shm"))
        self.assertEqual(self.bytes(self.path("same.shm")), self.bytes(file))
        self.shm("append", file, self.path("a.e"), "-o", "-", "--json", code=2, stderr="both")
        # If FILE is a symbolic link, append writes to the target of the link.
        os.symlink(file, self.path("link.shm"))
        self.shm("append", self.path("link.shm"), self.exodus("b.e", (2,)))
        self.assertTrue(os.path.islink(self.path("link.shm")))
        self.assert_steps(file, self.exodus("whole.e", (0, 1, 2)))

    def test_a_file_that_was_written_on(self):
        first, all_steps = self.exodus("first.e", range(4)), self.exodus("all.e", range(11))
        for how in ([], ["--order", "stream"], ["--order", "stream", "--delay", "20"],
                    ["--order", "free"], ["--segment-cells", "20"], ["--key-steps", "1"]):
            with self.subTest(how):
                file = self.packed(first, *how)
                output = self.shm("append", file, all_steps)
                self.assertIn("7 time steps added, 11 in all", output)
                self.assert_steps(file, all_steps, "--order" not in how)
                before = self.bytes(file)
                self.assertIn("nothing to do", self.shm("append", file, all_steps))
                self.assertEqual(self.bytes(file), before)
        self.assertEqual(sorted(os.listdir(self.directory.name)),
                         ["all.e", "first.e", "first.e.shm"])

    def test_a_file_with_parity(self):
        """After an append, parity protects the same share of the file as before."""
        whole = self.exodus("whole.e", range(6))
        file = self.packed(self.exodus("a.e", range(3)), "--parity", "30%")
        self.assertIn("parity", self.shm("verify", file))
        self.shm("append", file, whole)
        output = self.shm("verify", file)
        self.assertIn("6 time steps, parity", output)
        self.assert_steps(file, whole)
        before = self.bytes(file)
        with open(file, "r+b") as damaged:
            damaged.write(bytes(4096))
        # append refuses the damaged file. Otherwise it would compute new parity from damaged data, and the
        # damage would become permanent.
        self.shm("append", file, self.exodus("more.e", range(7)), code=3, stderr=".")
        self.shm("repair", file)
        self.assertEqual(self.bytes(file), before)
        bare = self.packed(self.exodus("bare.e", range(3)))
        self.shm("append", bare, whole)
        # The parity begins at offset `end`. The test damages single bytes. Some of them are in parts of the
        # file that append copies without decoding them.
        end = len(self.bytes(bare)) - 16
        for at in range(100, end, 211 if SANITIZED else 41):
            with open(file, "wb") as damaged:
                damaged.write(before[:at] + bytes([before[at] ^ 1]) + before[at + 1:])
            self.shm("append", file, self.path("more.e"), code=3, stderr=".")
        self.shm("repair", file)
        self.shm("append", file, self.path("more.e"))
        self.assert_steps(file, self.path("more.e"))

    def test_a_file_of_a_single_step(self):
        """In a file with a single step, the step refers to no other step. Appended steps do not refer to
        other steps either, unless the file was written with --key-steps."""
        # A step has more than 64 KiB, because smaller steps may be coded as bundles.
        first, all_steps = self.exodus("first.e", (0,), n=21), self.exodus("all.e", range(7), n=21)
        grown = {}
        for how in ((), ("--key-steps", "1"), ("--key-steps", "8")):
            file = self.packed(first, *how)
            self.shm("append", file, all_steps)
            self.assert_steps(file, all_steps)
            grown[how] = self.bytes(file)
        self.assertEqual(grown[()], grown["--key-steps", "1"])
        self.assertLess(len(grown["--key-steps", "8"]), len(grown[()]))

    def test_a_run_that_was_restarted(self):
        all_steps = self.exodus("all.e", range(9))
        for kind in ("64-bit-offset", "netCDF-4"):
            for how in ([], ["--order", "stream", "--delay", "20"]):
                with self.subTest(kind + str(how)):
                    all_steps = self.exodus("all.e", range(9), kind=kind)
                    file = self.packed(self.exodus("run.e", range(3), kind=kind), *how)
                    for begin, end in ((3, 5), (4, 8), (8, 9)):  # the second part begins earlier
                        part = self.exodus("run.e-s002", range(begin, end), kind=kind)
                        self.shm("append", file, part)
                    self.assert_steps(file, all_steps, not how)

    def test_packed_sources(self):
        all_steps = self.exodus("all.e", range(9))
        file = self.packed(self.exodus("first.e", range(3)))
        self.shm("append", file, self.packed(all_steps))
        self.assert_steps(file, all_steps)
        streamed = self.packed(self.exodus("first.e", range(3)), "--order", "stream")
        self.shm("append", streamed, self.packed(all_steps))
        self.assert_steps(streamed, all_steps, same_numbers=False)

    def test_chosen_steps(self):
        file = self.packed(self.exodus("first.e", range(3)))
        all_steps = self.exodus("all.e", range(9))
        out = self.path("out.shm")
        report = json.loads(self.shm("append", file, all_steps, "-o", out, "--step", "4", "--step",
                                   "6", "--json"))
        self.assertEqual(report["appended_steps"], [4, 6])
        self.assertEqual(report["step_times"], [0, .5, 1, 2, 3])
        self.assertEqual(report["bytes"], os.path.getsize(out))
        self.assert_steps(out, self.exodus("some.e", [0, 1, 2, 4, 6]))
        # The appended file has as many steps as the new file, but other times.
        self.shm("append", file, self.exodus("middle.e", range(4, 9)), "-o", out, "--step", "3", "--step", "4")
        self.assert_steps(out, self.exodus("some.e", [0, 1, 2, 7, 8]))
        self.shm("append", file, all_steps, "--step", "9", code=2, stderr="no step 9")
        self.shm("append", file, all_steps, "--step", "1", "--all", code=2,
                 stderr="excludes")
        self.shm("append", file, self.path("first.e"), "--all", "-o", out)
        times = json.loads(self.shm("info", out, "--json"))["step_times"]
        self.assertEqual(times, [0, .5, 1, 0, .5, 1])

    def test_what_does_not_fit(self):
        file = self.packed(self.exodus("first.e", range(3)))
        before = self.bytes(file)
        self.shm("append", file, self.exodus("other.e", range(6), first_node_moved=True), code=1,
                 stderr="coordinates, vertex 0")
        self.shm("append", file, self.exodus("small.e", range(6), n=3), code=1,
                 stderr="number of vertices: 64 in the source, 125")
        later = self.exodus("later.e", range(3, 6), title="another")
        self.shm("append", file, later, "--strict", code=6,
                 stderr="shm: not in .*: a different title")
        self.shm("append", later, file, code=3, stderr="is not a .shm file")
        self.shm("append", file, self.path("none.e"), code=3, stderr="none.e")
        self.shm("append", file, code=2, stderr="required")
        self.shm("join", "-o", self.path("two.shm"), file, self.path("first.e"))
        self.shm("append", self.path("two.shm"), later, code=3, stderr="archive")
        with open(self.path("cut.shm"), "wb") as out:
            out.write(before[:-20])
        self.shm("append", self.path("cut.shm"), later, code=3, stderr="the file has been cut")
        self.shm("convert", later, self.path("mesh.vtk"), stderr="(?s)not in.*")
        flat = self.packed(self.path("mesh.vtk"))
        self.shm("append", flat, self.path("mesh.vtk"), code=3, stderr="neither time steps")
        self.assertEqual(self.bytes(file), before)
        self.assertEqual([name for name in os.listdir(self.directory.name) if name[0] == "."], [])
        self.shm("append", file, later, stderr="not in .*: a different title, or different structure.*\n")
        self.assert_steps(file, self.exodus("all.e", range(6)))

    def test_bounds(self):
        file = self.packed(self.exodus("first.e", range(3)), "--rel", "1e-3")
        all_steps = self.exodus("all.e", range(9))
        self.shm("append", file, all_steps)
        self.shm("verify", file, "--against", all_steps)

    def test_other_formats(self):
        """Appends single steps from files of formats that store one step per file and no global variables."""
        source = self.exodus("all.e", range(6))
        self.shm("convert", source, self.path("all.msh"), stderr="(?s)not in.*")
        self.shm("convert", self.path("all.msh"), self.path("plain.e"), stderr="(?s)(not in.*)?")
        self.shm("compress", self.path("plain.e"), "-o", self.path("plain.shm"))
        self.shm("convert", self.exodus("first.e", range(3)), self.path("first.msh"),
                 stderr="(?s)not in.*")
        self.shm("convert", self.path("first.msh"), self.path("first.e"), stderr="(?s)(not in.*)?")
        file = self.packed(self.path("first.e"))
        for step, name in ((3, "a.vtk"), (4, "b.vtu"), (5, "c.vtk")):
            one = self.path(name)
            self.shm("convert", self.path("plain.e"), one, "--step", str(step),
                     stderr="(?s)(not in.*)?")
            self.shm("append", file, one, *(["--time", "2"] if step == 4 else []))
        self.assertIn("equal", self.shm("diff", self.path("plain.shm"), file))
        self.shm("decompress", file, "-o", self.path("back.e"))
        self.assertIn("equal", self.shm("diff", self.path("plain.e"), self.path("back.e")))
        self.shm("convert", source, self.path("d.vtk"), stderr="(?s)not in.*")
        with_globals = self.packed(source)
        self.shm("append", with_globals, self.path("d.vtk"), "--all", code=1,
                 stderr="(?s)array 'energy': SOURCE has no array of this name and type")
        self.shm("append", file, self.path("c.vtk"), stderr="")  # has no later step

    def test_gmsh(self):
        all_steps, first = self.path("all.msh"), self.path("first.msh")
        self.shm("convert", self.exodus("all.e", range(6)), all_steps, stderr="(?s)not in.*")
        self.shm("convert", self.exodus("first.e", range(3)), first, stderr="(?s)not in.*")
        file = self.packed(first)
        self.shm("append", file, all_steps)
        self.shm("verify", file, "--against", all_steps)
        self.shm("decompress", file, "-o", self.path("back.msh"))
        self.assertIn("equal", self.shm("diff", all_steps, self.path("back.msh")))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop())
    unittest.main()
