#!/usr/bin/env python3
"""Checks that no command of the tool uses more than 300 MB for any of the asking files: small files that try
to make a reader allocate much memory. Tests eight commands with default options.

Usage: asking_files_test.py PATH_OF_SHM PATH_OF_MAKE_ASKING
"""
import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, FolderTest, sample_of, tell

SHM, MAKE_ASKING = "shm", "make_asking"
MOST_MEMORY, MOST_FILE = 300 << 20, 200_000


class AskingFilesTest(FolderTest):
    def setUp(self):
        super().setUp()
        sheets = subprocess.run([MAKE_ASKING], check=True, capture_output=True, text=True).stdout.split()
        self.sheets = [] if SANITIZED else sample_of(sheets)  # each needs several seconds
        subprocess.run([MAKE_ASKING, self.directory.name, *self.sheets], check=True)
        self.write("more.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 3 3\n"
                               "ORIGIN 0 0 0\nSPACING 1 1 1\n")

    def peak(self, *words):
        """Runs a command. Returns its peak memory and its exit code."""
        process = subprocess.Popen([SHM, *words], cwd=self.directory.name, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        return usage.ru_maxrss * 1024, process.returncode

    def test_no_command_takes_much(self):
        names = sorted(name for name in os.listdir(self.directory.name) if name.endswith(".shm"))
        self.assertGreaterEqual(len(names), 16 + len(self.sheets))
        runs = most = 0
        for name in names:
            self.assertLess(os.path.getsize(self.path(name)), MOST_FILE, name)
            commands = [["info", name], ["verify", name], ["decompress", name, "-o", "out.vtu", "-f"],
                        ["extract", name, "piece.shm", "--cells", "0:1", "-f"],
                        ["repair", name, "-o", "whole.shm", "-f"], ["join", name, "-o", "joined.shm", "-f"],
                        ["append", name, "more.vtk", "-o", "longer.shm", "-f"], ["diff", name, "more.vtk"]]
            # These files take a long time to read. The test therefore runs only the first four commands; the
            # other commands would read the files in the same way.
            if name.startswith(("components", "stepped", "sheet", "larger")):
                commands = commands[:4]
            for words in commands:
                memory, code = self.peak(*words)
                runs, most = runs + 1, max(most, memory)
                with self.subTest(words=words):
                    self.assertIn(code, (0, 1, 3, 5, 6, 7))
                    if not SANITIZED:
                        self.assertLess(memory, MOST_MEMORY, f"{memory >> 20} MiB")
        tell("asking", files=len(names), runs=runs, most=most)


if __name__ == "__main__":
    SHM, MAKE_ASKING = map(os.path.abspath, sys.argv[1:3])
    unittest.main(argv=sys.argv[:1])
