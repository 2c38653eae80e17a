#!/usr/bin/env python3
"""Tests which libraries the tool loads. At its start, the tool must load only a few libraries. It must load
the libraries of a format only when it processes a file of that format. Also tests the error message if a
library cannot be loaded.

Usage: start_test.py PATH_OF_SHM     (exit code 77, skipped, if the tool is linked to all libraries)
"""
import gzip
import os
import re
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, FolderTest
from sample_meshes import write_vtk

SHM = "shm"
MOST = 16 + 4 * SANITIZED  # libraries at the start, including the loader
NETCDF, EXODUS, ARCHIVE = "netcdf", "exo", "archive"


def needed():
    """Returns the names of the libraries that the dynamic linker loads before main()."""
    text = subprocess.run(["ldd", SHM], capture_output=True, text=True, check=True).stdout
    return [os.path.basename(line.split()[0]) for line in text.splitlines() if ".so" in line and "vdso" not in line]


class StartTest(FolderTest):
    def setUp(self):
        super().setUp()
        write_vtk(self.path("mesh.vtk"), 3)
        self.shm("convert", "mesh.vtk", "mesh.e")
        self.shm("compress", "mesh.vtk", "-o", "mesh.shm")
        with gzip.open(self.path("mesh.vtk.gz"), "wb") as out:
            out.write(self.bytes("mesh.vtk"))

    def shm(self, *words, code=0, **environment):
        done = subprocess.run([SHM, *words], cwd=self.directory.name, capture_output=True, timeout=60, text=True,
                              env=os.environ | environment)
        self.assertEqual(done.returncode, code, f"shm {words}\n{done.stdout}{done.stderr}")
        return done.stderr

    def loaded(self, *words):
        """Returns the names of all libraries that a command loads. For libraries loaded at run time, the name
        contains no folder."""
        self.shm(*words, LD_DEBUG="files", LD_DEBUG_OUTPUT=self.path("log"))
        logs = [name for name in os.listdir(self.directory.name) if name.startswith("log.")]
        text = "".join(self.bytes(name).decode("utf-8", "replace") for name in logs)
        for name in logs:
            os.remove(self.path(name))
        return {os.path.basename(name) for name in re.findall(r"calling init: (\S+)", text)}

    def one_of(self, names, word):
        found = [name for name in names if name.startswith("lib" + word)]
        self.assertEqual(len(found), 1, (word, names))
        return found[0]

    def none_of(self, names, *words):
        for word in words:
            self.assertFalse([name for name in names if name.startswith("lib" + word)], names)

    def test_few_libraries_at_the_start(self):
        names = needed()
        self.assertLessEqual(len(names), MOST, names)
        self.none_of(names, NETCDF, EXODUS, ARCHIVE)

    def test_libraries_come_with_files(self):
        for words in (["--version"], ["compress", "mesh.vtk", "-fo", "v.shm"], ["decompress", "mesh.shm", "-fo", "v.vtk"],
                      ["verify", "mesh.shm"], ["info", "mesh.shm"]):
            names = self.loaded(*words)
            self.assertIn("libc.so.6", names)
            self.none_of(names, NETCDF, EXODUS, ARCHIVE)
        names = self.loaded("compress", "mesh.e", "-fo", "e.shm")
        self.one_of(names, NETCDF)
        self.none_of(names, EXODUS, ARCHIVE)
        names = self.loaded("decompress", "mesh.shm", "-fo", "v.e")
        self.one_of(names, NETCDF)
        self.one_of(names, EXODUS)
        names = self.loaded("info", "mesh.vtk.gz")
        self.one_of(names, ARCHIVE)
        self.none_of(names, NETCDF, EXODUS)

    def broken(self, name, target=None):
        """Creates a folder for LD_LIBRARY_PATH. In this folder, the library `name` is an empty file or a link
        to the library `target`."""
        folder = self.path("libraries")
        os.makedirs(folder, exist_ok=True)
        for other in os.listdir(folder):
            os.remove(os.path.join(folder, other))
        if target:
            os.symlink(target, os.path.join(folder, name))
        else:
            open(os.path.join(folder, name), "wb").close()
        return folder

    def refused(self, library, folder, *words, code, file, why="file too short"):
        """Checks the error message: a single sentence with the file, the library, and the reason."""
        text = self.shm(*words, code=code, LD_LIBRARY_PATH=folder)
        self.assertEqual(len(text.splitlines()), 1, text)
        self.assertTrue(text.startswith(f"shm: {file}: needs {library}, which does not load: "), text)
        self.assertIn(why, text)

    def test_netcdf_does_not_load(self):
        name = self.one_of(self.loaded("info", "mesh.e"), NETCDF)
        folder = self.broken(name)
        for words in (["compress", "mesh.e", "-fo", "x.shm"], ["info", "mesh.e"], ["verify", "mesh.shm", "--against", "mesh.e"],
                      ["convert", "mesh.e", "x.vtk"]):
            self.refused(name, folder, *words, code=3, file="mesh.e")
        self.refused(name, folder, "decompress", "mesh.shm", "-o", "x.e", code=4, file="x.e")
        self.shm("compress", "mesh.e", "-fo", "e.shm")
        self.refused(name, folder, "decompress", "e.shm", "-o", "x.e", code=4, file="x.e")
        self.assertFalse(os.path.exists(self.path("x.e")))
        self.shm("compress", "mesh.vtk", "-fo", "x.shm", LD_LIBRARY_PATH=folder)
        self.assertEqual(self.bytes("x.shm"), self.bytes("mesh.shm"))

    def test_of_many_files_those_that_need_it_fail(self):
        name = self.one_of(self.loaded("info", "mesh.e"), NETCDF)
        os.symlink("mesh.e", self.path("again.e"))
        text = self.shm("compress", "-f", "mesh.e", "again.e", "mesh.vtk", code=3, LD_LIBRARY_PATH=self.broken(name))
        self.assertEqual(re.findall(r"^shm: (\S+): needs " + re.escape(name), text, re.MULTILINE), ["mesh.e", "again.e"])
        self.assertEqual(self.bytes("mesh.vtk.shm"), self.bytes("mesh.shm"))

    def test_exodus_does_not_load(self):
        name = self.one_of(self.loaded("decompress", "mesh.shm", "-fo", "v.e"), EXODUS)
        folder = self.broken(name)
        self.refused(name, folder, "decompress", "mesh.shm", "-o", "x.e", code=4, file="x.e")
        self.shm("compress", "mesh.e", "-fo", "x.shm", LD_LIBRARY_PATH=folder)

    def test_libarchive_does_not_load(self):
        name = self.one_of(self.loaded("info", "mesh.vtk.gz"), ARCHIVE)
        folder = self.broken(name)
        self.refused(name, folder, "compress", "mesh.vtk.gz", "-o", "x.shm", code=3, file="mesh.vtk.gz")

    def test_another_library_under_its_name(self):
        name = self.one_of(self.loaded("info", "mesh.e"), NETCDF)
        text = subprocess.run(["ldd", SHM], capture_output=True, text=True, check=True).stdout
        other = re.search(r"libz\.so\.1 => (\S+)", text)[1]
        self.refused(name, self.broken(name, other), "info", "mesh.e", code=3, file="mesh.e", why="undefined symbol: nc_")


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    if any(name.startswith("libnetcdf") for name in needed()):
        print("the tool is linked to netCDF")
        sys.exit(77)
    unittest.main()
