#!/usr/bin/env python3
"""Tests the Python wheel: it can be built without network access, and it reads a file after it is installed
into a new environment.

  wheel_test.py LIBSHMFORMAT_C.SO

The test uses the NumPy and cffi that are installed on the system. The same wheel must work with every
installed version of CPython.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = str(Path(sys.argv.pop(1)).resolve())
# Every network access fails.
OFFLINE = {**os.environ, "SHMFORMAT_LIBRARY": LIBRARY, "http_proxy": "http://127.0.0.1:1", "https_proxy": "http://127.0.0.1:1",
           "PIP_NO_INDEX": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
PROGRAM = """
import shmformat, sys
mesh = shmformat.open(sys.argv[1])
print(shmformat.__file__, shmformat.__version__, len(mesh.points), len(mesh.cells))
"""


class Wheel(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def run_in(self, *command, **more):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False,
                              **{"env": OFFLINE, "cwd": self.path, **more})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_it_is_built_and_installed_and_reads(self):
        for part in ("python", "c"):
            shutil.copytree(ROOT / "bindings" / part, self.path / "bindings" / part,
                            ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
        # If neither --sdist nor --wheel is given, `python -m build` first creates the source distribution and
        # then builds the wheel from it.
        self.run_in(sys.executable, "-m", "build", "--no-isolation", "--outdir", self.path,
                    self.path / "bindings" / "python")
        (wheel,), (sources,) = self.path.glob("*.whl"), self.path.glob("*.tar.gz")
        listed = self.run_in("tar", "tzf", sources)
        for name in ("shmformat/shmformat.h", "shmformat_paraview.py"):
            self.assertIn(name, listed)
        for name in ("shmformat_paraview.py", "shmformat/_table.py"):
            self.assertIn(name, zipfile.ZipFile(wheel).namelist())
        self.assertRegex(wheel.name, r"^shmformat-\d+\.\d+\.\d+-py3-none-linux_\w+\.whl$")
        version = re.search(r"-(\d+\.\d+\.\d+)-", wheel.name)[1]
        self.run_in(sys.executable, "-m", "venv", "--system-site-packages", self.path / "new")
        python = self.path / "new" / "bin" / "python3"
        self.run_in(python, "-m", "pip", "install", "--no-deps", "--no-index", wheel)
        own = {name: value for name, value in os.environ.items() if name not in ("SHMFORMAT_LIBRARY", "PYTHONPATH")}
        told = self.run_in(python, "-c", PROGRAM, ROOT / "tests" / "golden" / "0.10" / "keep.shm", env=own).split()
        self.assertTrue(told[0].startswith(str(self.path / "new")), told)
        self.assertEqual(told[1:], [version, "36", "12"])


if __name__ == "__main__":
    unittest.main()
