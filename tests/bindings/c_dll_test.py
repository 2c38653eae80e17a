#!/usr/bin/env python3
"""Tests the Windows build of the C library with C programs that are compiled for Windows.

  c_dll_test.py SHMFORMAT_C.DLL IMPORT_LIBRARY RUNNER

RUNNER is a command that runs Windows programs on this machine. The library exports exactly the functions that
the header declares, and depends only on system libraries. A C compiler for Windows compiles the examples. One
example writes a file, and by default refuses to replace an existing file; the other example reads that file.
"""
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[2]
HEADER = ROOT / "bindings" / "c" / "include" / "shmformat.h"
EXAMPLES = ROOT / "bindings" / "c" / "examples"
TOOLS = "x86_64-w64-mingw32-"
SYSTEM = {"advapi32.dll", "kernel32.dll", "msvcrt.dll"}


def run(*command, **more):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **more)


class Dll(unittest.TestCase):
    def setUp(self):
        folder = TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)
        shutil.copy(LIBRARY, self.path)

    def test_exports_what_the_header_declares_and_nothing_else(self):
        listed = run(TOOLS + "objdump", "-p", LIBRARY).stdout
        table = listed[listed.index("[Ordinal/Name Pointer] Table"):]
        exported = set(re.findall(r"^\s*\[\s*\d+\] (\w+)$", table, re.MULTILINE))
        declared = set(re.findall(r"^SHMF_API .*?(shmf_\w+)\(", HEADER.read_text(encoding="utf-8"), re.MULTILINE))
        self.assertGreater(len(declared), 40)
        self.assertEqual(exported, declared)
        needed = {name.lower() for name in re.findall(r"DLL Name: (\S+)", listed)}
        self.assertLessEqual(needed, SYSTEM)

    def example(self, name, *arguments):
        program = self.path / f"{name}.exe"
        done = run(TOOLS + "gcc-posix", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror",
                   "-Wno-missing-field-initializers", "-I", HEADER.parent,
                   EXAMPLES / f"{name}.c", IMPORT_LIBRARY, "-o", program)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        done = run(RUNNER, program, *arguments, cwd=self.path)
        return done.returncode, done.stdout, done.stderr

    def test_the_examples_write_and_read(self):
        self.assertEqual(self.example("write_steps", "bar.shm"), (0, "", ""))
        code, _, why = self.example("write_steps", "bar.shm")
        self.assertEqual(code, 7)  # SHMF_OUTPUT
        self.assertIn("exists already", why)
        self.assertEqual(self.example("first_array", "bar.shm"),
                         (0, "404 vertices, 100 cells\ntemperature: 300 to 310\n", ""))


if __name__ == "__main__":
    LIBRARY, IMPORT_LIBRARY, RUNNER = (Path(word).resolve() for word in sys.argv[1:4])
    del sys.argv[1:4]
    unittest.main()
