#!/usr/bin/env python3
"""Tests commands that read a mesh from an archive: one member of the archive, which --part selects, or all
members.

Usage: parts_test.py PATH_OF_SHM
"""
import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest, lacks
from sample_meshes import write_vtk

SHM = "shm"


class PartsTest(FolderTest):
    def setUp(self):
        super().setUp()
        write_vtk(self.path("a.vtk"), 3)
        write_vtk(self.path("b.vtk"), 4)
        os.mkdir(self.path("out"))
        self.write("page.html", '<script type="application/octet-stream" id="file" data-name=""></script>')
        self.shm("join", "-o", "both.shm", "a.vtk", "b.vtk")

    def shm(self, *words, code=0):
        done = subprocess.run([SHM, *words], cwd=self.directory.name, capture_output=True, text=True,
                              timeout=60, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stdout}{done.stderr}")
        return done.stdout + done.stderr

    def drawing(self):
        """Returns the drawing commands that this build of the tool supports, with the extensions of the files
        that they write."""
        return [(command, extension) for command, extension in (("preview", ".png"), ("surface", ".ply"))
                if not lacks(SHM, command)]

    def test_one_of_them(self):
        self.shm("decompress", "both.shm", "--part", "b.vtk", "-o", "out")
        self.shm("diff", "out/b.vtk", "b.vtk")
        self.shm("convert", "both.shm", "a.vtu", "--part", "a.vtk")
        self.shm("diff", "a.vtu", "a.vtk")
        self.shm("diff", "both.shm", "a.vtk", "--part", "a.vtk")
        self.shm("diff", "both.shm", "b.vtk", "--part", "a.vtk", code=1)
        self.shm("layout", "both.shm", "--part", "a.vtk")
        self.assertTrue(os.path.exists(self.path("both.shm.svg")))
        for command, extension in self.drawing():
            self.shm(command, "both.shm", "--part", "a.vtk")
            self.shm(command, "a.vtk")
            self.assertEqual(self.bytes("both.shm" + extension), self.bytes("a.vtk" + extension))
            self.assertGreater(len(self.bytes("a.vtk" + extension)), 100)
        self.shm("view", "both.shm", "--part", "a.vtk", "--page", "page.html", "-o", "part.html")
        self.shm("view", "both.shm", "--page", "page.html", "-o", "both.html")
        self.assertLess(len(self.bytes("part.html")), len(self.bytes("both.html")))
        self.shm("join", "-o", "one.shm", "b.vtk")
        self.shm("diff", "one.shm", "b.vtk")

    def test_all_of_them(self):
        self.assertIn("out/b.vtk", self.shm("decompress", "both.shm", "-o", "out"))
        for name in ("a.vtk", "b.vtk"):
            self.shm("diff", "out/" + name, name)
        self.assertIn("exists already", self.shm("decompress", "both.shm", code=4))
        os.rename(self.path("both.shm"), self.path("out/both.shm"))
        self.shm("decompress", "out/both.shm", "-f")
        self.shm("compress", "a.vtk")
        os.remove(self.path("a.vtk"))
        self.assertIn("2 files: 2 done", self.shm("decompress", "a.vtk.shm", "out/both.shm", "-f"))

    def test_which_of_them(self):
        for words in (["convert", "both.shm", "x.vtu"], ["diff", "both.shm", "a.vtk"],
                      ["layout", "both.shm"], *([command, "both.shm"] for command, _ in self.drawing()), ["decompress", "both.shm", "-o", "x.vtk"],
                      ["extract", "both.shm", "x.vtk"]):
            with self.subTest(words=words):
                self.assertIn("is an archive of a.vtk, b.vtk: --part names one of them",
                              self.shm(*words, code=2))
        self.assertIn("there is no part c.vtk in both.shm; there are a.vtk, b.vtk",
                      self.shm("convert", "both.shm", "x.vtu", "--part", "c.vtk", code=2))
        self.assertIn("--part needs an archive", self.shm("convert", "a.vtk", "x.vtu", "--part", "a", code=2))
        self.assertIn("--part needs an archive", self.shm("diff", "a.vtk", "b.vtk", "--part", "a", code=2))
        self.assertIn("--rm does not remove archives",
                      self.shm("decompress", "both.shm", "-o", "out", "--rm", code=2))
        self.assertTrue(os.path.exists(self.path("both.shm")))


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
