#!/usr/bin/env python3
"""Tests that if shm is killed at any instant, either the old file or a complete new file exists, and that
temporary files do not accumulate.

Usage: kill_test.py PATH_OF_SHM
"""
import os
import random
import shutil
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest, forced
from sample_meshes import exodus_text

SHM = "shm"
KILLS = 200
SECONDS = 40  # time limit of the kill loop; on a busy machine, it does fewer than KILLS runs


class KillTest(FolderTest):
    NEEDS = ("ncgen",)

    def shm(self, *words):
        subprocess.run([SHM, *forced(words), "--quiet"], check=True, cwd=self.directory.name, timeout=120,
                       stderr=subprocess.DEVNULL)

    def exodus(self, name, steps):
        self.ncgen(name, exodus_text(steps, 10), "netCDF-4")

    def others(self):
        """Returns the names of the temporary files in the folder, which begin with a dot."""
        return [name for name in os.listdir(self.directory.name) if name.startswith(".")]

    def test_kills(self):
        self.exodus("first.e", range(8))
        self.exodus("all.e", range(12))
        for name in ("first", "all"):
            self.shm("compress", name + ".e", "-o", name + ".shm")
        self.shm("append", "first.shm", "all.e", "-o", "appended.shm")
        self.shm("convert", "all.e", "all.vtk")
        self.shm("decompress", "all.shm", "-o", "whole.e")
        self.shm("decompress", "all.shm", "-o", "whole.msh")
        # For each case: a command, its output, the file that exists under that name before the command (or
        # None), and the file that a complete run writes.
        cases = [
            (["append", "out.shm", "all.e"], "out.shm", "first.shm", "appended.shm"),
            (["append", "first.shm", "all.e", "-o", "out.shm"], "out.shm", None, "appended.shm"),
            (["compress", "all.e", "-o", "out.shm"], "out.shm", None, "all.shm"),
            (["compress", "all.e", "-o", "out.shm"], "out.shm", "first.shm", "all.shm"),
            (["decompress", "all.shm", "-o", "out.e"], "out.e", None, "whole.e"),
            (["decompress", "all.shm", "-o", "out.e"], "out.e", "first.e", "whole.e"),
            (["decompress", "all.shm", "-o", "out.msh"], "out.msh", None, "whole.msh"),
            (["convert", "all.e", "out.vtk"], "out.vtk", "all.vtk", "all.vtk"),
        ]
        times = []
        for words, output, before, _ in cases:
            times.append(min(self.time_of(words, output, before) for _ in range(2)))
        chance = random.Random(46)
        end = time.monotonic() + SECONDS
        killed = finished = left = 0
        for number in range(KILLS):
            if time.monotonic() > end:
                break
            words, output, before, after = cases[number % len(cases)]
            self.prepare(output, before)
            process = subprocess.Popen([SHM, *forced(words), "--quiet"], cwd=self.directory.name,
                                       stderr=subprocess.DEVNULL)
            time.sleep(times[number % len(cases)] * chance.random() * 1.1)
            process.kill()
            finished += process.wait() == 0
            killed += process.returncode != 0
            self.check(words, output, before, after)
            left = max(left, len(self.others()))
        print(f"{killed} runs killed, {finished} finished before; at most {left} temporary files left")
        self.assertGreater(killed, (killed + finished) // 4)
        # If the output is an Exodus file, the temporary file of HDF5 may remain after the last killed run.
        # The temporary files of other outputs exist only for an instant.
        self.assertLessEqual(left, 2)
        for words, output, before, _ in cases:
            self.prepare(output, before)
            self.shm(*words)
        self.assertEqual([name for name in self.others() if ".e.tmp" in name], [])

    def time_of(self, words, output, before):
        self.prepare(output, before)
        begin = time.monotonic()
        self.shm(*words)
        return time.monotonic() - begin

    def prepare(self, output, before):
        if os.path.exists(self.path(output)):
            os.remove(self.path(output))
        if before:
            shutil.copy(self.path(before), self.path(output))

    def check(self, words, output, before, after):
        if not os.path.exists(self.path(output)):
            self.assertIsNone(before, f"{words} removed the old file")
            return
        found = self.bytes(output)
        if before and found == self.bytes(before):
            return
        if output.endswith(".e"):  # netCDF-4 files contain the time of their creation
            self.shm("diff", after, output)
        else:
            self.assertTrue(found == self.bytes(after), f"{words} wrote an incomplete file")
        if output.endswith(".shm"):
            self.shm("verify", output)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop())
    unittest.main()
