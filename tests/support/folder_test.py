"""Shared code of the tool's Python tests: a temporary folder for each test, and a function that runs ncgen."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
import zlib

# Builds with sanitizers are about ten times slower, so only the release build runs all cases.
SANITIZED = "SHM_SANITIZED" in os.environ

# On average, tests of the corpus process one in SHARE files. The hash of the file name and SEED determines
# which files.
SHARE = int(os.environ.get("SHM_SHARE") or 1)
SEED = os.environ.get("SHM_SEED", "")

WRITERS = {"append", "compress", "convert", "decompress", "extract", "join", "layout", "preview", "repair", "split",
           "surface", "view"}


def sample_of(paths):
    """Returns those paths that belong to the sample of this run. Whether a path belongs to it depends on
    SEED."""
    return [path for path in paths if is_sampled(path)]


def is_sampled(path):
    folder_and_name = "/".join(str(path).split(os.sep)[-2:])
    return zlib.crc32(f"{SEED} {folder_and_name}".encode()) % SHARE == 0


def lacks(tool, command):
    """Returns the name of a library that the command needs but that the tool was built without. Returns None
    if no library is missing."""
    text = subprocess.run([tool, command, "-", "-o", "-"], capture_output=True, text=True, input="").stderr
    found = re.search(r"this shm was built without (\w+)", text)
    return found and found[1]


def forced(words):
    """Returns the words of a command. Adds -f if the command writes files, so that it can overwrite the files
    of earlier commands."""
    return [*words, "-f"] if words and words[0] in WRITERS else list(words)


def tell(what, **numbers):
    """Records the counts of a test for scripts/trust. If the environment variable SHM_EVIDENCE is set,
    appends a line of JSON to the file that it names."""
    path = os.environ.get("SHM_EVIDENCE")
    if path:
        with open(path, "a", encoding="utf-8") as out:
            out.write(json.dumps({"what": what, **numbers}) + "\n")


class FolderTest(unittest.TestCase):
    """Base class of tests that write into a temporary folder. The folder is removed at the end of each
    test."""

    # Programs that the tests need. If one of them is missing, the tests are skipped.
    NEEDS = ()
    # Path of the tool, and maximum duration of one run of the tool in seconds.
    tool, timeout = "shm", 120

    def shm(self, *words, code=0, **how):
        """Runs the tool and checks its exit code. Returns its standard output as bytes. If `code` is not 0,
        standard error is appended to the standard output."""
        done = subprocess.run([self.tool, *words], cwd=self.directory.name, capture_output=True,
                              timeout=self.timeout, **how)
        self.assertEqual(done.returncode, code, f"shm {words}\n{done.stdout[:500]}{done.stderr}")
        return done.stdout + done.stderr if code else done.stdout

    def setUp(self):
        for program in self.NEEDS:
            self.need(program)
        self.directory = tempfile.TemporaryDirectory(prefix="shm-test-")
        self.addCleanup(self.directory.cleanup)

    def need(self, program):
        if not shutil.which(program):
            self.skipTest(program + " is not installed")

    def path(self, name):
        return os.path.join(self.directory.name, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as out:
            out.write(text)
        return self.path(name)

    def bytes(self, name):
        with open(self.path(name), "rb") as source:
            return source.read()

    def ncgen(self, name, text, kind="64-bit-offset"):
        """Creates a netCDF file from CDL text."""
        self.need("ncgen")
        description = self.write(name + ".cdl", text)
        subprocess.run(["ncgen", "-k", kind, "-o", self.path(name), description], check=True)
        os.remove(description)
        return self.path(name)
