#!/usr/bin/env python3
"""Checks that the gallery page, its pictures and scripts/gallery, which creates both, agree.

Usage: gallery_test.py PATH_OF_SHM

If SHM_CORPUS names a folder of meshes, three of the pictures are drawn again. They must equal the stored
pictures byte for byte. (This requires the libpng and zlib of Debian 12; other versions may compress
differently.)
"""
import os
import re
import struct
import subprocess
import sys
import tempfile
import unittest
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from folder_test import lacks

# Maximum size in bytes of all pictures together.
MOST_BYTES = 900_000
# Names of the pictures that are drawn again: one with steps and values, one with many blocks, and one with a
# palette.
DRAWN = ("mug-late", "biplane", "loose")

SHM = Path("shm")


def script():
    sys.dont_write_bytecode = True
    spec = spec_from_loader("gallery", SourceFileLoader("gallery", str(ROOT / "scripts" / "gallery")))
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


gallery = script()


class GalleryTest(unittest.TestCase):
    def test_the_page_is_as_the_script_writes_it(self):
        self.assertEqual(gallery.PAGE.read_text(encoding="utf-8"), gallery.page(),
                         "scripts/gallery --document updates it")

    def test_each_picture_is_shown_once_with_its_command(self):
        shown = re.findall(r"!\[([^]]*)\]\(gallery/([^)]*)\.png\)(.*?)(?= \|)",
                           gallery.PAGE.read_text(encoding="utf-8"))
        names = [name for _, name, _ in shown]
        self.assertEqual(len(names), 26)
        self.assertEqual(sorted(names), sorted(path.stem for path in gallery.PICTURES.iterdir()))
        for word, name, text in shown:
            self.assertEqual(word, name)
            self.assertRegex(text, f"`shm preview [^ ]+ [^`]*-o {name}.png`$")

    def test_options_are_those_of_the_tool(self):
        done = subprocess.run([SHM, "preview", "--help"], capture_output=True, text=True, check=True)
        known = set(re.findall(r"(?<![\w-])--?[a-z]+", done.stdout))
        self.assertIn("--clip", known)
        for shown in gallery.ALL:
            for word in shown.command().split()[2:]:
                if word.startswith("-"):
                    self.assertIn(word.partition("=")[0], known, shown.command())

    def test_each_mesh_has_an_owner_or_is_made(self):
        for shown in gallery.ALL:
            owner = gallery.owner(shown)
            self.assertTrue(owner is None or owner in gallery.OWNERS, shown.name)
        self.assertEqual(set(gallery.OWNERS), {gallery.owner(shown) for shown in gallery.ALL} - {None})

    def test_pictures_are_small(self):
        across, down = map(int, gallery.SIZE.split("x"))
        total = 0
        for path in gallery.PICTURES.iterdir():
            data = path.read_bytes()
            total += len(data)
            self.assertEqual((data[:8], data[12:16]), (b"\x89PNG\r\n\x1a\n", b"IHDR"), path.name)
            self.assertEqual(struct.unpack(">2I", data[16:24]), (across, down), path.name)
        self.assertLess(total, MOST_BYTES)

    def test_pictures_come_out_as_they_stand(self):
        corpus = os.environ.get("SHM_CORPUS")
        if not corpus:
            self.skipTest("SHM_CORPUS is not set")
        if lacks(SHM, "preview"):
            self.skipTest("this shm was built without libpng")
        some = [shown for shown in gallery.ALL if shown.name in DRAWN]
        self.assertEqual(len(some), len(DRAWN))
        with tempfile.TemporaryDirectory(prefix="shm-test-") as folder:
            for shown in some:
                with self.subTest(picture=shown.name):
                    drawn = gallery.draw(shown, SHM.parent, Path(corpus), Path(folder), Path(folder))
                    self.assertEqual(drawn.read_bytes(), (gallery.PICTURES / drawn.name).read_bytes(),
                                     "scripts/gallery updates it")


if __name__ == "__main__":
    SHM = Path(os.path.abspath(sys.argv.pop(1)))
    unittest.main()
