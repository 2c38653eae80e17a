"""What Python tests of the tool share: a folder of its own for each, and ncgen."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

SANITIZED = "SHM_SANITIZED" in os.environ  # some ten times slower: the release takes all cases

WRITERS = {"append", "compress", "convert", "decompress", "extract", "join", "layout", "preview", "repair", "split",
           "surface", "view"}


def lacks(tool, command):
    """The library of which a command says that the tool was built without it; or nothing."""
    text = subprocess.run([tool, command, "-", "-o", "-"], capture_output=True, text=True, input="").stderr
    found = re.search(r"this shm was built without (\w+)", text)
    return found and found[1]


def forced(words):
    """A command of the tool that may write over what the test wrote before."""
    return [*words, "-f"] if words and words[0] in WRITERS else list(words)


def tell(what, **numbers):
    """What a test counted, for scripts/trust: a line of JSON in the file that SHM_EVIDENCE names, if it does."""
    path = os.environ.get("SHM_EVIDENCE")
    if path:
        with open(path, "a", encoding="utf-8") as out:
            out.write(json.dumps({"what": what, **numbers}) + "\n")


class FolderTest(unittest.TestCase):
    """Tests that write into a folder which is gone when they end."""

    NEEDS = ()  # programs without which they are skipped
    tool, timeout = "shm", 120  # and seconds that a run of it may take

    def shm(self, *words, code=0, **how):
        """What the tool prints, as bytes; where it is to fail, its complaint too."""
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
        """The netCDF file that a text describes."""
        self.need("ncgen")
        description = self.write(name + ".cdl", text)
        subprocess.run(["ncgen", "-k", kind, "-o", self.path(name), description], check=True)
        os.remove(description)
        return self.path(name)
