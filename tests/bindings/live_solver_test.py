#!/usr/bin/env python3
"""Tests the examples that write a live file: solvers that commit each time step.

  live_solver_test.py LIBSHMFORMAT_C.SO SHM        SHM: path of the tool

The solvers are killed at random moments. Each committed step must be in the file, bit for bit. The environment variable
SHM_KILL_TRIALS sets the number of kills of each solver. The test also checks in which order the library writes data,
flushes it to the disk and gives the file its name.
"""
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
LIBRARY, SHM = (Path(path).resolve() for path in sys.argv[1:3])
del sys.argv[1:3]
os.environ["SHMFORMAT_LIBRARY"] = str(LIBRARY)
os.environ["PYTHONPATH"] = str(ROOT / "bindings" / "python")
sys.path.insert(0, os.environ["PYTHONPATH"])
import shmformat  # noqa: E402

TRIALS = int(os.environ.get("SHM_KILL_TRIALS", "20"))
STEPS = 400
C, FORTRAN, PYTHON = (ROOT / "bindings" / language for language in ("c", "fortran", "python"))

# Prints each call that writes or flushes a file or changes a name, before the call is made.
OBSERVER = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <sys/types.h>
static void say(const char *text) { fputs(text, stderr); }
ssize_t write(int file, const void *bytes, size_t count) {
  static ssize_t (*call)(int, const void *, size_t);
  if (!call) *(void **)&call = dlsym(RTLD_NEXT, "write");
  if (file > 2) say("write\n");
  return call(file, bytes, count);
}
int fsync(int file) {
  static int (*call)(int);
  if (!call) *(void **)&call = dlsym(RTLD_NEXT, "fsync");
  say("fsync\n");
  return call(file);
}
int linkat(int a, const char *from, int b, const char *to, int flags) {
  static int (*call)(int, const char *, int, const char *, int);
  if (!call) *(void **)&call = dlsym(RTLD_NEXT, "linkat");
  say("link\n");
  return call(a, from, b, to, flags);
}
"""


class LiveSolver(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.build("gcc", "-std=c99", "-Wall", "-Wextra", "-Wno-missing-field-initializers", f"-I{C / 'include'}",
                  C / "examples" / "live_solver.c", LIBRARY, f"-Wl,-rpath,{LIBRARY.parent}", "-o", cls.folder / "c")
        cls.build("gfortran", "-std=f2003", "-Wall", "-Werror", f"-J{cls.folder}", FORTRAN / "shmformat.f90",
                  FORTRAN / "examples" / "live_solver.f90", LIBRARY, f"-Wl,-rpath,{LIBRARY.parent}", "-o",
                  cls.folder / "fortran")
        cls.file = cls.folder / "bar.shm"
        cls.reference = {}

    @classmethod
    def build(cls, *command):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    def expect_steps(self, steps):
        """The file has exactly the first steps of the solver."""
        with shmformat.open(self.file) as mesh:
            self.assertEqual(list(mesh.step_times), [0.5 * step for step in range(steps)])
            values = mesh.point_data["temperature"]
            self.assertEqual(len(values), steps)
            x = mesh.points[:, 0]
            for step in {0, steps // 2, steps - 1} if steps else ():
                np.testing.assert_array_equal(values[step], 300 + x * (0.5 * step))
            mesh.verify()

    def expect_kills_leave_commits(self, *command):
        chance, seen = random.Random(1), 0
        started = time.monotonic()
        subprocess.run([*command, str(self.file), "60"], check=True, capture_output=True)
        longest = time.monotonic() - started
        self.expect_steps(60)
        for _ in range(TRIALS):
            self.file.unlink(missing_ok=True)
            with subprocess.Popen([*command, str(self.file), str(STEPS)], stdout=subprocess.PIPE, text=True) as solver:
                time.sleep(chance.uniform(0, longest))
                solver.send_signal(signal.SIGKILL)
                committed = solver.stdout.read().count("is committed\n")
            if not self.file.exists():
                self.assertEqual(committed, 0)
                continue
            with shmformat.open(self.file) as mesh:
                steps = len(mesh.step_times)
            # The solver may have been killed after a commit and before it reported the commit.
            self.assertIn(steps - committed, (0, 1))
            self.expect_steps(steps)
            info = subprocess.run([SHM, "info", "--json", self.file], capture_output=True, check=True)
            self.assertEqual(len(json.loads(info.stdout)["step_times"]), steps)
            seen += committed > 0
        self.assertGreater(seen, TRIALS // 5)

    def test_kills_of_the_c_solver(self):
        self.expect_kills_leave_commits(str(self.folder / "c"))

    def test_kills_of_the_python_solver(self):
        self.expect_kills_leave_commits(sys.executable, str(PYTHON / "examples" / "live_solver.py"))

    def test_the_fortran_solver(self):
        done = subprocess.run([self.folder / "fortran", self.file], capture_output=True, text=True, check=False)
        self.assertEqual((done.stdout, done.stderr, done.returncode), ("20 steps are committed\n", "", 0))
        self.expect_steps(20)

    def test_a_reader_sees_whole_steps_while_the_solver_writes(self):
        self.file.unlink(missing_ok=True)
        looks, before = 0, 0
        with subprocess.Popen([self.folder / "c", self.file, "2000"], stdout=subprocess.DEVNULL) as solver:
            while solver.poll() is None or looks == 0:
                if not self.file.exists():
                    continue
                with shmformat.open(self.file) as mesh:
                    steps = len(mesh.step_times)
                    self.assertGreaterEqual(steps, before)
                    if steps:
                        values = mesh.point_data["temperature"]
                        self.assertEqual(len(values), steps)
                        np.testing.assert_array_equal(values[steps - 1], 300 + mesh.points[:, 0] * (0.5 * (steps - 1)))
                before, looks = steps, looks + 1
        self.assertEqual(solver.returncode, 0)
        self.assertGreater(looks, 20)
        self.expect_steps(2000)

    def test_data_is_on_the_disk_before_its_trailer(self):
        source, observer = self.folder / "observer.c", self.folder / "observer.so"
        source.write_text(OBSERVER, encoding="utf-8")
        self.build("gcc", "-shared", "-fPIC", source, "-ldl", "-o", observer)
        self.file.unlink(missing_ok=True)
        done = subprocess.run([self.folder / "c", self.file, "3"], capture_output=True, text=True, check=True,
                              env={**os.environ, "LD_PRELOAD": str(observer)})
        calls = " ".join(done.stderr.split())
        calls = re.sub(r"write( write)+", "write", calls)
        # Of the first commit: data and index, flush, trailer, flush, name, flush of the folder. Then of each commit:
        # data and index, flush, trailer, flush. At the end the index of the whole file.
        commit = "write fsync write fsync"
        self.assertEqual(calls, f"{commit} link fsync {commit} {commit} {commit}")

    def test_a_killed_run_continues(self):
        """The file of a run that is killed and continued has the same contents as that of one run."""
        solver = str(self.folder / "c")
        whole = self.folder / "whole.shm"
        subprocess.run([solver, str(whole), "60"], check=True, capture_output=True)
        self.file.unlink(missing_ok=True)
        with subprocess.Popen([solver, str(self.file), "40"], stdout=subprocess.PIPE, text=True) as run:
            for line in run.stdout:
                if "step 20" in line:
                    run.kill()
        with open(self.file, "ab") as file:
            file.write(b"SHMc and some bytes of a torn chunk")
        size = self.file.stat().st_size
        with shmformat.Writer.reopen(self.file) as writer:
            with shmformat.open(self.file) as mesh:
                x = mesh.points[:, 0]
            self.assertLess(self.file.stat().st_size, size)  # the torn bytes are gone
            for step in range(len(writer.step_times), 60):
                writer.write_step(0.5 * step, point_data={"temperature": 300 + x * (0.5 * step)})
                if step % 3 == 0:
                    writer.commit()
                    with shmformat.open(self.file) as mesh:
                        self.assertEqual(len(mesh.step_times), step + 1)
        self.expect_steps(60)
        digests = [json.loads(subprocess.run([SHM, "info", "--json", path], capture_output=True, check=True).stdout)["digest"]
                   for path in (self.file, whole)]
        self.assertEqual(digests[0], digests[1])
        diff = subprocess.run([SHM, "diff", self.file, whole], capture_output=True, text=True, check=False)
        self.assertEqual(diff.returncode, 0, diff.stdout + diff.stderr)
        other = self.folder / "other_name.shm"
        other.unlink(missing_ok=True)
        os.link(self.file, other)
        with self.assertRaisesRegex(shmformat.Error, "one name"):
            shmformat.Writer.reopen(self.file)
        other.unlink()
        os.symlink(self.file, other)
        with self.assertRaisesRegex(shmformat.Error, "symbolic link"):
            shmformat.Writer.reopen(other)
        other.unlink()
        protected = self.folder / "protected.shm"
        subprocess.run([SHM, "compress", self.file, "-o", protected, "--parity", "10%"], check=True, capture_output=True)
        with self.assertRaisesRegex(shmformat.Error, "parity"):
            shmformat.Writer.reopen(protected)

    def test_another_writer_is_refused(self):
        self.file.unlink(missing_ok=True)
        points = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
        cells = np.arange(8)[None, :]
        with shmformat.Writer(self.file, points, cells, point_data={"u": float, "v": (np.float32, 3)}, live=True) as one:
            one.write_step(0, point_data={"u": np.arange(8.0), "v": np.zeros((8, 3))})
            one.commit()
            with self.assertRaisesRegex(shmformat.Error, "is being written"):
                shmformat.Writer(self.file, points, cells, live=True, replace=True)
            with self.assertRaisesRegex(shmformat.Error, "is being written"):
                shmformat.write(self.file, points, cells, replace=True)
            one.write_step(1, point_data={"u": np.arange(8.0) + 1})
        with shmformat.open(self.file) as mesh:
            self.assertEqual((len(mesh.point_data["u"]), len(mesh.point_data["v"])), (2, 1))
        with self.assertRaisesRegex(ZeroDivisionError, "by zero"):
            with shmformat.Writer(self.file, points, cells, point_data={"u": float}, live=True, replace=True) as two:
                two.write_step(0, point_data={"u": np.arange(8.0)})
                two.commit()
                two.write_step(1, point_data={"u": np.arange(8.0)})
                1 / 0
        with shmformat.open(self.file) as mesh:
            self.assertEqual(len(mesh.step_times), 1)
        plain = self.folder / "plain.shm"
        with self.assertRaisesRegex(shmformat.Error, "not live"):
            with shmformat.Writer(plain, points, cells) as writer:
                writer.commit()
        self.assertFalse(plain.exists())
        with shmformat.Writer(plain, points, cells, point_data={"u": float}) as writer:
            with self.assertRaises(KeyError):
                writer.write_step(0, point_data={"u": np.arange(8.0), "v": np.arange(8.0)})
            writer.write_step(0, point_data={"u": np.arange(8.0)})
            size = writer.close()
        self.assertEqual(writer.close(), size)
        with self.assertRaisesRegex(shmformat.Error, "NULL"):
            writer.write_step(1, point_data={"u": np.arange(8.0)})


if __name__ == "__main__":
    unittest.main()
