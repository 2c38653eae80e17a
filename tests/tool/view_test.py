#!/usr/bin/env python3
"""Tests shm view. The page must contain exactly the given file, and no part of the file name may be
interpreted as markup.

Usage: view_test.py PATH_OF_SHM
"""
import base64
import html
import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import write_vtk

SHM = "shm"
PLACE = '<script type="application/octet-stream" id="file" data-name=""></script>'
FULL = re.compile(r'<p>before</p><script type="application/octet-stream" id="file" data-name="([^"<>]*)">([^<]*)'
                  r'</script><p>after</p>')


class ViewTest(FolderTest):
    def setUp(self):
        super().setUp()
        write_vtk(self.path("mesh.vtk"), 4)
        Path(self.path("page.html")).write_text(f"<p>before</p>{PLACE}<p>after</p>", encoding="ascii")
        self.shm("compress", "mesh.vtk", "-qo", "mesh.shm")

    def shm(self, *words, code=0, program=None, stdin=b""):
        done = subprocess.run([program or SHM, *words], cwd=self.directory.name, capture_output=True, timeout=60,
                              input=stdin)
        self.assertEqual(done.returncode, code, f"shm {words}\n{done.stdout}{done.stderr}")
        return done.stdout, done.stderr.decode()

    def inside(self, page):
        """Returns the name and the bytes of the file that a page contains."""
        found = FULL.fullmatch(page.decode())
        self.assertIsNotNone(found, page)
        return html.unescape(found[1]), base64.b64decode(found[2], validate=True)

    def viewed(self, *words, **more):
        self.shm("view", *words, "-fqo", "out.html", "--page", "page.html", **more)
        return self.inside(self.bytes("out.html"))

    def test_files_go_in_as_they_stand(self):
        self.assertEqual(self.viewed("mesh.shm"), ("mesh.shm", self.bytes("mesh.shm")))
        self.shm("view", "mesh.shm", "-q", "--page", "page.html")
        self.assertEqual(self.bytes("mesh.shm.html"), self.bytes("out.html"))
        self.assertIn("exists already", self.shm("view", "mesh.shm", "--page", "page.html", code=4)[1])

    def test_others_are_compressed(self):
        self.assertEqual(self.viewed("mesh.vtk"), ("mesh.vtk", self.bytes("mesh.shm")))
        name, fast = self.viewed("mesh.vtk", "--level", "fast")
        self.shm("compress", "mesh.vtk", "-qo", "fast.shm", "--level", "fast")
        self.assertEqual((name, fast), ("mesh.vtk", self.bytes("fast.shm")))

    def test_every_length_has_its_digits(self):
        lengths = set()
        for cells in range(1, 8):
            write_vtk(self.path("one.vtk"), cells)
            self.shm("compress", "one.vtk", "-fqo", "one.shm")
            self.assertEqual(self.viewed("one.shm")[1], self.bytes("one.shm"))
            lengths.add(len(self.bytes("one.shm")) % 3)
        self.assertEqual(lengths, {0, 1, 2})

    def test_pipes(self):
        page, _ = self.shm("view", "-", "-q", "--page", "page.html", stdin=self.bytes("mesh.vtk"))
        self.assertEqual(self.inside(page), ("mesh", self.bytes("mesh.shm")))
        page, _ = self.shm("view", "-", "-q", "--page", "page.html", stdin=self.bytes("mesh.shm"))
        Path(self.path("again.shm")).write_bytes(self.inside(page)[1])
        self.shm("verify", "again.shm", "--against", "mesh.vtk")

    def test_archives(self):
        write_vtk(self.path("other.vtk"), 3)
        self.shm("join", "-qo", "both.shm", "mesh.vtk", "other.vtk")
        self.assertEqual(self.viewed("both.shm"), ("both.shm", self.bytes("both.shm")))
        name, part = self.viewed("both.shm", "--part", "other.vtk")
        self.assertEqual(name, "other.vtk")
        Path(self.path("part.shm")).write_bytes(part)
        self.shm("verify", "part.shm", "--against", "other.vtk")
        self.assertIn("--part needs an archive",
                      self.shm("view", "mesh.shm", "--part", "x", "--page", "page.html", code=2)[1])

    def test_names_are_no_markup(self):
        name = "a\"><script>alert('&')<\\script>\n.shm"
        shutil.copy(self.path("mesh.shm"), self.path(name))
        told, content = self.viewed(name)
        self.assertEqual(told, name.replace("\n", "\\x0a"))
        self.assertEqual(content, self.bytes("mesh.shm"))

    def test_damaged_files_are_refused_and_leave_nothing(self):
        Path(self.path("cut.shm")).write_bytes(self.bytes("mesh.shm")[:-50])
        self.shm("view", "cut.shm", "-o", "cut.html", "--page", "page.html", code=3)
        self.assertFalse(os.path.exists(self.path("cut.html")))

    def test_pages_that_are_none(self):
        for content in ("", "<p>no place</p>", PLACE + PLACE):
            Path(self.path("wrong.html")).write_text(content, encoding="ascii")
            self.assertIn("no place for a file",
                          self.shm("view", "mesh.shm", "-o", "x.html", "--page", "wrong.html", code=3)[1])
        self.assertIn("cannot be read",
                      self.shm("view", "mesh.shm", "-o", "x.html", "--page", "missing.html", code=2)[1])
        self.assertIn("a page is a .html file",
                      self.shm("view", "mesh.vtk", "-o", "x.shm", "--page", "page.html", code=2)[1])

    def test_the_page_is_found_beside_the_program(self):
        program = self.path("usr/bin/shm")
        os.makedirs(os.path.dirname(program))
        shutil.copy(SHM, program)
        self.assertIn("--page names one", self.shm("view", "mesh.shm", "-o", "x.html", code=2, program=program)[1])
        os.makedirs(self.path("usr/share/shmformat"))
        shutil.copy(self.path("page.html"), self.path("usr/share/shmformat/shm.html"))
        self.shm("view", "mesh.shm", "-qo", "x.html", program=program)
        self.assertEqual(self.inside(self.bytes("x.html")), ("mesh.shm", self.bytes("mesh.shm")))


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
