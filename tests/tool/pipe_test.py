#!/usr/bin/env python3
"""Tests that shm reads the same data from pipes as from files, and writes the same data to pipes as to files.

Usage: pipe_test.py PATH_OF_SHM
"""
import os
import shutil
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, FolderTest, forced
from sample_meshes import exodus_text, write_vtk

SHM = "shm"


class PipeTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.temp = self.path("temp")
        os.mkdir(self.temp)
        self.mesh = self.path("mesh.vtk")
        write_vtk(self.mesh, 6)

    def shm(self, *words, given=b"", code=0, pieces=0, cwd=None):
        """Runs the tool and passes it bytes on standard input, in pieces of `pieces` bytes. Returns its
        output."""
        environment = dict(os.environ, TMPDIR=self.temp)
        process = subprocess.Popen([SHM, *forced(words)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, env=environment, cwd=cwd)
        if pieces:
            try:
                for at in range(0, len(given), pieces):
                    process.stdin.write(given[at:at + pieces])
                    process.stdin.flush()
                    if at // pieces % 100 == 0:
                        time.sleep(0.001)
            except BrokenPipeError:
                pass
            given = None
        out, self.errors = process.communicate(given, timeout=120)
        self.assertEqual(process.returncode, code, (words, self.errors))
        self.assertEqual(os.listdir(self.temp), [])
        return out

    def formats(self):
        """Returns a dictionary from the name of each format to the contents of a file in this format."""
        found = {"vtk": self.mesh}
        for name in ("vtu", "gmsh", "ucd", "exodus"):
            found[name] = self.path("mesh." + name)
            self.shm("convert", self.mesh, found[name], "--format", name)
        if shutil.which("ncgen"):
            for kind in ("64-bit-offset", "netCDF-4"):
                found[kind] = self.ncgen(kind, exodus_text(range(3), 4), kind)
        return found

    def test_there_and_back(self):
        for name, path in self.formats().items():
            with self.subTest(name):
                format_name = "exodus" if name in ("64-bit-offset", "netCDF-4") else name
                source, packed = self.bytes(path), self.path("packed.shm")
                self.shm("compress", path, "-o", packed)
                for words in (["-"], ["-", "-o", "-"]):
                    self.assertEqual(self.shm("compress", *words, given=source),
                                     self.bytes(packed))
                back = self.shm("decompress", "-", "-o", "-", "--format", format_name,
                                given=self.bytes(packed), pieces=997)
                with open(self.path("back"), "wb") as out:
                    out.write(back)
                self.shm("diff", path, self.path("back"))
                self.shm("decompress", packed, "-o", self.path("file"), "--format", format_name)
                if name != "netCDF-4":  # netCDF-4 files contain the time of their creation
                    self.assertEqual(back, self.bytes(self.path("file")))
                again = self.shm("convert", "-", "-", "--format", "shm", given=source)
                self.assertEqual(again, self.bytes(packed))
                info = self.shm("info", "-", given=source).replace(b"-:", path.encode() + b":")
                self.assertEqual(info.splitlines()[1:],
                                 self.shm("info", path).splitlines()[1:])

    def test_packed_input(self):
        packed = self.path("mesh.shm")
        self.shm("compress", self.mesh, "-o", packed)
        given = self.bytes(packed)
        for pieces in (1, 7, 1000, 1 << 20):
            self.assertIn(b"-: sound", self.shm("verify", "-", given=given, pieces=pieces))
        self.shm("verify", "-", "--against", self.mesh, given=given)
        self.assertEqual(self.shm("info", "-", "--json", given=given).count(b'"streams"'), 1)
        self.assertEqual(self.shm("compress", "-", given=given), given)
        for command in ("info", "verify"):
            self.shm(command, "-", given=given[:-100], code=3)
        self.assertTrue(self.errors.startswith(b"shm: -"), self.errors)
        damaged = bytearray(given)
        damaged[len(given) // 2] ^= 1
        self.shm("decompress", "-", "-o", "-", "--format", "vtk", given=bytes(damaged), code=3)
        self.shm("verify", "-", given=b"", code=3)
        self.shm("verify", "-", given=self.bytes(self.mesh), code=3)
        self.assertIn(b"not a .shm file", self.errors)
        self.shm("compress", "-", given=b"what is this?", code=3)
        self.assertTrue(self.errors.startswith(b"shm: -: "), self.errors)
        self.shm("decompress", "-", "-o", "-", given=given, code=2)  # the format is unknown

    def test_archives(self):
        both = self.path("both.shm")
        self.shm("compress", self.mesh, "-o", self.path("a.shm"))
        self.shm("join", "-o", both, self.path("a.shm"), self.mesh)
        self.assertEqual(self.shm("verify", "-", given=self.bytes(both)).count(b"sound"), 2)
        self.assertIn(b"mesh.vtk", self.shm("info", "-", given=self.bytes(both)))
        self.shm("decompress", "-", "-o", "-", "--format", "vtk", given=self.bytes(both), code=2)
        self.assertIn(b"archive", self.errors)

    def test_append(self):
        for kind in ("64-bit-offset", "netCDF-4"):
            for name, steps in (("first", range(2)), ("all", range(5))):
                self.ncgen(name, exodus_text(steps, 4), kind)
            first, packed, out = (self.path(name) for name in ("first.shm", "all.shm", "out.shm"))
            self.shm("compress", self.path("first"), "-o", first)
            self.shm("compress", self.path("all"), "-o", packed)
            self.shm("append", first, self.path("all"), "-o", out)
            for source in (self.path("all"), packed):
                piped = self.shm("append", first, "-", "-o", "-", given=self.bytes(source))
                self.shm("append", first, source, "-o", out)
                self.assertEqual(piped, self.bytes(out))
            self.shm("append", first, "-", given=self.bytes(self.path("all")))
            self.assertEqual(self.shm("append", first, "-", given=self.bytes(self.path("all")))
                             .count(b"nothing to do"), 1)
            before = self.bytes(first)
            self.shm("append", first, "-", given=b"what is this?", code=3)
            self.assertTrue(self.errors.startswith(b"shm: -: "), self.errors)
            self.shm("append", first, "-", "--time", "9", given=self.bytes(self.mesh), code=1)
            self.shm("append", "-", self.path("all"), given=before, code=3)
            self.assertEqual(self.bytes(first), before)

    def test_interrupted_while_input_comes(self):
        files = self.formats()
        for name in ("netCDF-4", "64-bit-offset"):
            if name not in files:
                self.skipTest("ncgen is not installed")
            given = self.bytes(files[name])
            for number in (signal.SIGINT, signal.SIGTERM):
                process = subprocess.Popen([SHM, "compress", "-", "-o", self.path("never.shm"),
                                            "--temp", self.temp], stdin=subprocess.PIPE)
                process.stdin.write(given[:len(given) // 2])
                process.stdin.flush()
                # HDF5 can only open a file by its name, so the test waits until the tool has created a
                # temporary file. For the other formats, temporary files have no names.
                end = time.monotonic() + 20
                while name == "netCDF-4" and not os.listdir(self.temp):
                    self.assertLess(time.monotonic(), end)
                    time.sleep(0.005)
                time.sleep(0.05)
                process.send_signal(number)
                self.assertEqual(process.wait(timeout=20), -number)
                process.stdin.close()
                self.assertEqual(os.listdir(self.temp), [])
                self.assertFalse(os.path.exists(self.path("never.shm")))

    def test_readers_that_go_away(self):
        big = self.path("big.vtk")
        write_vtk(big, 14 if SANITIZED else 24)
        self.shm("compress", big, "-o", self.path("big.shm"))
        for words in (["compress", big, "-o", "-"],
                      ["decompress", self.path("big.shm"), "-o", "-", "--format", "vtk"],
                      ["convert", big, "-", "--format", "exodus"], ["info", big]):
            with self.subTest(words):
                process = subprocess.Popen([SHM, *forced(words)], stdout=subprocess.PIPE,
                                           stderr=subprocess.PIPE)
                process.stdout.close()
                errors = process.stderr.read()
                process.stderr.close()
                self.assertEqual(process.wait(), 4)
                self.assertEqual(errors, b"")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop())
    unittest.main()
