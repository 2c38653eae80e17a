#!/usr/bin/env python3
"""Checks that the binary interface of the C library is unchanged.

    c_abi_test.py              compares the header with the stored description, bindings/c/shmformat.abi
    c_abi_test.py --renew      updates the stored description. Until the format is 1.0, do this only if the
                               change is intended, and in a separate commit

The test compiles the declarations of the header as a library of empty functions, and abidw describes the
binary interface of that library. The header may have new functions; any other difference from the stored
description is a failure. (The sources of the real library include the header, so the compiler checks that
they agree with it. c_library_test.py checks that the real library defines every function.)
"""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEADER = ROOT / "bindings" / "c" / "include" / "shmformat.h"
DESCRIPTION = ROOT / "bindings" / "c" / "shmformat.abi"
PROTOTYPE = re.compile(r"SHMF_API\s+([^;{}]*?)(\bshmf_\w+)(\([^;]*\));")


def run(*command, **more):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **more)


def described(header, folder):
    """Describes the interface of a header with abidw. Returns the path of the description and the number of
    functions."""
    plain = re.sub(r"/\*.*?\*/", " ", header, flags=re.S)
    (folder / "shmformat.h").write_text(header, encoding="utf-8")
    bodies = []
    for kind, name, arguments in PROTOTYPE.findall(plain):
        body = "{}" if kind.strip() == "void" else "{ return 0; }"
        bodies.append(f"{kind}{name}{arguments} {body}")
    # Relative paths, so that the description of the interface does not contain the names of folders
    # on this machine.
    source, library, out = "face.c", "libface.so", "face.abi"
    (folder / source).write_text('#include "shmformat.h"\n' + "\n".join(bodies) + "\n", encoding="utf-8")
    for command in (("gcc", "-std=c99", "-g", "-shared", "-fPIC", "-Wl,-soname,libshmformat_c.so.1", source, "-o", library),
                    ("abidw", "--no-show-locs", "--no-comp-dir-path", "--no-corpus-path", "--no-elf-needed", library,
                     "--out-file", out)):
        done = run(*command, cwd=folder)
        if done.returncode != 0:
            raise RuntimeError(done.stdout + done.stderr)
    return folder / out, len(bodies)


class Face(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.header = HEADER.read_text(encoding="utf-8")

    def difference(self, header):
        """Compares a header with the stored description. Returns None if they differ only by new functions,
        and abidiff's report otherwise."""
        face, _ = described(header, self.folder)
        done = run("abidiff", "--no-added-syms", DESCRIPTION, face)
        return "" if done.returncode == 0 else done.stdout + done.stderr

    def swapped(self, old, new):
        self.assertEqual(self.header.count(old), 1, old)
        return self.header.replace(old, new)

    def test_it_is_what_it_was(self):
        self.assertEqual(self.difference(self.header), "")
        _, functions = described(self.header, self.folder)
        self.assertGreater(functions, 40)
        self.assertEqual(functions, len(set(re.findall(r"<function-decl name='(\w+)'", DESCRIPTION.read_text()))))

    def test_a_function_may_be_added(self):
        last = "SHMF_API void shmf_writer_free(shmf_writer* writer);"
        more = self.swapped(last, last + "\nSHMF_API int32_t shmf_more(const shmf_file* file);")
        self.assertEqual(self.difference(more), "")

    def test_other_changes_are_seen(self):
        for old, new in (("uint64_t vertices, cells, corners;", "uint64_t cells, vertices, corners;"),
                         ("  int32_t status; ", "  int64_t status; "),
                         ("SHMF_CORRUPT = 3,", "SHMF_CORRUPT = 30,"),
                         ("SHMF_API void shmf_close(shmf_file* file);", "SHMF_API int shmf_close(shmf_file* file);"),
                         ("SHMF_API void shmf_close(shmf_file* file);", "")):
            self.assertNotEqual(self.difference(self.swapped(old, new)), "", new)


if __name__ == "__main__":
    if sys.argv[1:] == ["--renew"]:
        with tempfile.TemporaryDirectory() as name:
            DESCRIPTION.write_bytes(described(HEADER.read_text(encoding="utf-8"), Path(name))[0].read_bytes())
        sys.exit()
    unittest.main()
