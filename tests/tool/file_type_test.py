#!/usr/bin/env python3
"""Tests that desktop environments and the command file(1) recognize .shm files.

  file_type_test.py SHM

Checks packaging/shm.magic, packaging/shm.xml and packaging/shm.thumbnailer. These files must describe .shm
files of all versions and archives, but no other files.
"""
import configparser
import os
import re
import shlex
import struct
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

    def test_desktops_draw_thumbnails(self):
        entry = configparser.ConfigParser(interpolation=None)
        entry.optionxform = str
        entry.read(ROOT / "packaging" / "shm.thumbnailer")
        entry = entry["Thumbnailer Entry"]
        self.assertEqual(entry["MimeType"], TYPE + ";")
        self.assertEqual(entry["TryExec"], "shm")
        with tempfile.TemporaryDirectory() as name:
            picture = Path(name) / "thumbnail"
            picture.write_bytes(b"")  # the caller has created the file
            values = {"%i": str(GOLDEN / "0.10" / "keep.shm"), "%o": str(picture), "%s": "128", "%%": "%"}
            words = [re.sub("%.", lambda found: values[found[0]], word) for word in shlex.split(entry["Exec"])]
            self.assertEqual(words[0], "shm")
            done = subprocess.run([SHM, *words[1:]], capture_output=True, text=True)
            if "without libpng" in done.stderr:
                self.skipTest("this shm was built without libpng")
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
            head = picture.read_bytes()[:24]
            self.assertEqual((head[:8], head[16:24]), (b"\x89PNG\r\n\x1a\n", struct.pack(">2I", 128, 128)))


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv[1])
    del sys.argv[1:]
    os.environ["LC_ALL"] = "C"
    unittest.main()
