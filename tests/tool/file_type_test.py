#!/usr/bin/env python3
"""Desktops and file(1) know what a .shm file is.

    file_type_test.py SHM

By packaging/shm.magic and packaging/shm.xml; archives and versions, too, and other files are none.
"""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "golden"
TYPE = "application/vnd.shmformat"


def told(*command, **more):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True, **more).stdout.strip()


class FileType(unittest.TestCase):
    def test_file_tells_version_and_archive(self):
        magic = ROOT / "packaging" / "shm.magic"
        self.assertEqual(told("file", "-b", "-m", magic, GOLDEN / "0.10" / "keep.shm"),
                         "compressed hexahedral mesh (.shm), version 0.10")
        self.assertEqual(told("file", "-b", "-m", magic, GOLDEN / "0.1" / "keep.shm"),
                         "compressed hexahedral mesh (.shm), version 0.1")
        self.assertEqual(told("file", "-b", "-m", magic, GOLDEN / "0.10" / "archive.shm"),
                         "compressed hexahedral mesh (.shm), version 0.10, archive of several meshes")
        self.assertEqual(told("file", "-b", "-m", magic, "--mime-type", GOLDEN / "0.10" / "keep.shm"), TYPE)
        self.assertNotIn("mesh", told("file", "-b", "-m", magic, ROOT / "README.md"))

    def test_desktops_know_name_and_content(self):
        with tempfile.TemporaryDirectory() as name:
            mime = Path(name) / "mime"
            (mime / "packages").mkdir(parents=True)
            (mime / "packages" / "shmformat.xml").write_bytes((ROOT / "packaging" / "shm.xml").read_bytes())
            told("update-mime-database", mime)
            self.assertIn(f":{TYPE}:*.shm\n", (mime / "globs2").read_text(encoding="utf-8"))
            magic = (mime / "magic").read_bytes()
            self.assertIn(b"[80:" + TYPE.encode() + b"]", magic)
            signature = (GOLDEN / "0.10" / "keep.shm").read_bytes()[:8]
            self.assertIn(b"=\0\x08" + signature, magic)
            self.assertTrue((mime / "application" / "vnd.shmformat.xml").exists())


if __name__ == "__main__":
    del sys.argv[1:]
    os.environ["LC_ALL"] = "C"
    unittest.main()
