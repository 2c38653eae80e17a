#!/usr/bin/env python3
"""Tests commands that process many files: folders, skipped files, sources compressed with gzip, --rm, and the
conventions of gzip, xz, zstd and cp.

Usage: files_test.py PATH_OF_SHM
"""
import gzip
import json
import lzma
import os
import pty
import re
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import write_vtk

SHM = "shm"


class FilesTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.folder = Path(self.directory.name)
        for name in ("a.vtk", "b.vtk", "sub/c.vtk", "sub/deep/a.vtk"):
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_vtk(self.path(name), 3 + len(name) % 3)
        self.write("sub/notes.txt", "no mesh\n")

    def shm(self, *words, code=0, **how):
        how.setdefault("stdin", subprocess.DEVNULL)
        done = subprocess.run([SHM, *words], cwd=self.folder, capture_output=True, timeout=120, **how)
        text = done.stderr.decode(errors="replace")
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{text}")
        return done.stdout.decode(errors="replace"), text

    def names(self, pattern="**/*"):
        return sorted(str(p.relative_to(self.folder)) for p in self.folder.glob(pattern) if p.is_file())

    def test_one_line_each_and_a_sum(self):
        out, text = self.shm("compress", "b.vtk", "a.vtk")
        lines = out.splitlines()
        self.assertRegex(lines[0], "^b.vtk.shm: ")
        self.assertRegex(lines[1], "^a.vtk.shm: ")
        self.assertRegex(lines[2], r"^2 files: 2 done; \d+ bytes from \d+, [\d.]+ times smaller$")
        self.assertEqual((len(lines), text), (3, ""))
        for name in ("a", "b"):
            self.shm("compress", f"{name}.vtk", "-o", "alone.shm", "-f")
            self.assertEqual(self.bytes("alone.shm"), self.bytes(f"{name}.vtk.shm"))
        out, _ = self.shm("info", "a.vtk.shm", "b.vtk.shm")
        self.assertEqual(len(out.splitlines()), 3)
        out, _ = self.shm("compress", "-q", "-f", "a.vtk", "b.vtk")
        self.assertEqual(out, "")

    def test_folders(self):
        _, text = self.shm("compress", "sub", code=2)
        self.assertIn("sub: is a folder; use -r to process the files in it", text)
        out, _ = self.shm("compress", "-r", "sub")
        self.assertIn("2 files: 2 done", out)
        self.assertIn("skipped 1 other file in folders", out)
        self.assertEqual(self.names("**/*.shm"), ["sub/c.vtk.shm", "sub/deep/a.vtk.shm"])
        # Symbolic links are not followed.
        (self.folder / "sub" / "round").symlink_to("..")
        (self.folder / "sub" / "link.shm").symlink_to("c.vtk.shm")
        out, _ = self.shm("verify", "-r", "sub")
        self.assertIn("2 files: 2 done", out)
        # If an output folder is given, each output file has the same relative path in it as its source in the
        # source folder.
        (self.folder / "out").mkdir()
        self.shm("decompress", "-r", "sub", "-o", "out")
        self.assertEqual(self.names("out/**/*"), ["out/c.vtk", "out/deep/a.vtk"])
        self.assertIn("0 files", self.shm("decompress", "-r", "out", code=0)[0])

    def test_outputs_of_one_name(self):
        (self.folder / "out").mkdir()
        _, text = self.shm("compress", "a.vtk", "sub/deep/a.vtk", "-o", "out", code=4)
        self.assertIn("out/a.vtk.shm: is the output of a.vtk, too", text)
        self.assertEqual(self.names("out/*"), ["out/a.vtk.shm"])

    def test_several_files_want_a_folder(self):
        _, text = self.shm("compress", "a.vtk", "b.vtk", "-o", "out.shm", code=2)
        self.assertIn("there is no folder out.shm", text)
        _, text = self.shm("compress", "a.vtk", "b.vtk", "-c", code=2)
        self.assertIn("only one output", text)
        self.assertEqual(self.names("**/*.shm"), [])
        (self.folder / "out").mkdir()
        self.shm("compress", "a.vtk", "-o", "out")
        self.assertEqual(self.names("**/*.shm"), ["out/a.vtk.shm"])

    def test_one_bad_file_does_not_stop_the_others(self):
        self.write("bad.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 9 f")
        out, text = self.shm("compress", "bad.vtk", "no.vtk", "a.vtk", code=3)
        self.assertIn("shm: bad.vtk: ", text)
        self.assertIn("shm: no.vtk: cannot be read", text)
        self.assertIn("3 files: 1 done, 2 failed", out)
        self.assertEqual(self.names("**/*.shm"), ["a.vtk.shm"])
        # The largest exit code wins.
        (self.folder / "b.vtk.shm").write_text("mine")
        self.shm("compress", "no.vtk", "b.vtk", code=4)
        self.assertEqual(self.bytes("b.vtk.shm"), b"mine")

    def test_shm_files_are_passed_over(self):
        self.shm("compress", "a.vtk")
        before = self.bytes("a.vtk.shm")
        _, text = self.shm("compress", "a.vtk.shm")
        self.assertIn("a.vtk.shm: is already a .shm file", text)
        out, text = self.shm("compress", "a.vtk.shm", "b.vtk")
        self.assertIn("2 files: 1 done, 1 passed over", out)
        self.assertEqual(self.bytes("a.vtk.shm"), before)
        # Typing shm compress * a second time.
        _, text = self.shm("compress", "a.vtk", "a.vtk.shm", code=4)
        self.assertIn("a.vtk.shm: exists already; --force replaces it", text)
        self.shm("compress", "a.vtk.shm", "-o", "smaller.shm", "--order", "free")

    def test_an_input_is_no_output_of_another(self):
        os.link(self.path("b.vtk"), self.path("a.vtk.shm"))
        before = self.bytes("b.vtk")
        _, text = self.shm("compress", "-f", "a.vtk", "b.vtk", code=4)
        self.assertIn("is one of the inputs", text)
        self.assertEqual(self.bytes("b.vtk"), before)

    def test_json_is_an_object_a_line(self):
        self.write("bad.vtk", "# vtk DataFile Version 3.0\n")
        out, _ = self.shm("compress", "--json", "a.vtk", "bad.vtk", "b.vtk", code=3)
        a, bad, b, total = [json.loads(line) for line in out.splitlines()]
        self.assertEqual((a["output"], b["output"]), ("a.vtk.shm", "b.vtk.shm"))
        self.assertEqual((bad["file"], bad["exit_code"]), ("bad.vtk", 3))
        self.assertIn("bad.vtk", bad["error"])
        self.assertEqual((total["files"], total["done"], total["failed"]), (3, 2, 1))
        self.assertEqual(total["output_bytes"], a["output_bytes"] + b["output_bytes"])
        out, _ = self.shm("verify", "--json", "a.vtk.shm", "b.vtk.shm")
        self.assertEqual([json.loads(line).get("sound") for line in out.splitlines()], [True, True, None])

    def test_names_come_back(self):
        self.shm("compress", "a.vtk")
        os.rename(self.path("a.vtk"), self.path("source.vtk"))
        for name, written in [("a.vtk.shm", "a.vtk"), ("part.shm", "part.vtk"), ("data", "data.vtk"),
                              ("mesh.e.shm", "mesh.e.vtk")]:
            with self.subTest(name=name):
                if name != "a.vtk.shm":
                    (self.folder / name).write_bytes(self.bytes("a.vtk.shm"))
                self.shm("decompress", name)
                self.shm("diff", "source.vtk", written)
        self.shm("decompress", "part.shm", "--format", "vtu")
        self.shm("diff", "source.vtk", "part.vtu")
        self.assertIn("vtk DataFile", self.shm("decompress", "part.shm", "-c")[0])

    def test_packed_files(self):
        self.need("zstd")
        plain = self.bytes("a.vtk")
        self.shm("compress", "a.vtk", "-o", "expected.shm")
        (self.folder / "a.vtk.gz").write_bytes(gzip.compress(plain[:500]) + gzip.compress(plain[500:]))
        (self.folder / "a.vtk.xz").write_bytes(lzma.compress(plain))
        subprocess.run(["zstd", "-q", "-k", self.path("a.vtk")], check=True)
        for ending in ("gz", "xz", "zst"):
            with self.subTest(ending=ending):
                packed = self.bytes("a.vtk." + ending)
                self.shm("compress", "a.vtk." + ending, "-f")
                self.assertEqual(self.bytes("a.vtk.shm"), self.bytes("expected.shm"))
                self.shm("verify", "a.vtk.shm", "--against", "a.vtk." + ending)
                with open(self.path("a.vtk." + ending), "rb") as source:
                    self.shm("compress", "-", "-o", "piped.shm", "-f", stdin=source)
                self.assertEqual(self.bytes("piped.shm"), self.bytes("expected.shm"))
                for cut in (7, len(packed) // 2, len(packed) - 1):
                    (self.folder / "cut").write_bytes(packed[:cut])
                    self.shm("compress", "cut", code=3)
                for flipped in range(6, len(packed), len(packed) // 40 + 1):
                    changed = bytearray(packed)
                    changed[flipped] ^= 0x55
                    (self.folder / "cut").write_bytes(changed)
                    done = subprocess.run([SHM, "compress", "cut", "-c"], cwd=self.folder, timeout=60,
                                          capture_output=True)
                    self.assertIn(done.returncode, (0, 3), done.stderr)
                    if done.returncode == 0:
                        self.assertEqual(done.stdout, self.bytes("expected.shm"))
        # Sources compressed with gzip are accepted. This includes .shm files, and Exodus files, which the
        # netCDF library must open by name.
        (self.folder / "again.shm.gz").write_bytes(gzip.compress(self.bytes("expected.shm")))
        self.shm("verify", "again.shm.gz", "--against", "a.vtk")
        self.shm("decompress", "again.shm.gz", "-o", "again.vtk")
        self.shm("diff", "again.vtk", "a.vtk")
        self.shm("convert", "a.vtk", "a.e")
        (self.folder / "a.e.gz").write_bytes(gzip.compress(self.bytes("a.e")))
        self.shm("compress", "a.e.gz", "-q")
        self.shm("verify", "a.e.shm", "--against", "a.e")

    def test_what_is_removed_comes_back(self):
        source = self.bytes("a.vtk")
        out, _ = self.shm("compress", "--rm", "a.vtk", "b.vtk")
        self.assertIn("2 files: 2 done", out)
        self.assertEqual(self.names("*.*"), ["a.vtk.shm", "b.vtk.shm"])
        (self.folder / "before.vtk").write_bytes(source)
        self.shm("decompress", "--rm", "a.vtk.shm")
        self.assertFalse((self.folder / "a.vtk.shm").exists())
        self.shm("diff", "before.vtk", "a.vtk")
        for order in ("stream", "free"):
            self.shm("compress", "--rm", "-f", "a.vtk", "--order", order)
            self.assertFalse((self.folder / "a.vtk").exists())
            self.shm("verify", "a.vtk.shm", "--against", "before.vtk")
            self.shm("decompress", "--rm", "a.vtk.shm")
            self.shm("diff", "--match", "before.vtk", "a.vtk")
        self.shm("compress", "-k", "a.vtk")
        self.assertTrue((self.folder / "a.vtk").exists())

    def test_what_is_not_given_back_is_not_removed(self):
        for words in (["--rel", "1e-3"], ["--bits", "8"], ["--abs", "1"], ["--array", "x:abs=1"],
                      ["-c"], ["-o", "-"], ["-k"]):
            with self.subTest(words=words):
                self.shm("compress", "--rm", "a.vtk", *words, code=2)
                self.assertEqual(self.names("*.vtk"), ["a.vtk", "b.vtk"])
        (self.folder / "link.vtk").symlink_to("a.vtk")
        _, text = self.shm("compress", "--rm", "link.vtk", code=4)
        self.assertIn("is a link", text)
        self.assertEqual(self.names("*.vtk"), ["a.vtk", "b.vtk", "link.vtk"])
        # If the output format cannot store some data, the tool lists the data, and --rm does not remove the
        # .shm file.
        self.shm("convert", "a.vtk", "a.e")
        self.shm("compress", "a.e")
        before = self.bytes("a.e.shm")
        subprocess.run([SHM, "decompress", "--rm", "a.e.shm", "--format", "ucd"], cwd=self.folder,
                       capture_output=True, timeout=60)
        self.assertEqual(self.bytes("a.e.shm"), before)
        # In a read-only folder, --rm cannot remove the source.
        if os.getuid() != 0:
            os.chmod(self.folder / "sub", 0o500)
            self.addCleanup(os.chmod, self.folder / "sub", 0o700)
            self.shm("compress", "--rm", "sub/c.vtk", "-o", "c.shm", code=4)
            self.assertTrue((self.folder / "sub/c.vtk").exists())

    def test_found_and_given_to_xargs(self):
        before = {name: self.bytes(name) for name in self.names("**/*.vtk")}
        subprocess.run(f"find . -name '*.vtk' -print0 | xargs -0 {SHM} compress --rm", shell=True,
                       cwd=self.folder, check=True, stdout=subprocess.DEVNULL, timeout=120)
        self.assertEqual(self.names("**/*.vtk"), [])
        for name, source in before.items():
            self.write("before.vtk", source.decode())
            self.shm("decompress", name + ".shm")
            self.shm("diff", "before.vtk", name)

    def test_other_words_for_commands_and_levels(self):
        self.shm("-z", "a.vtk")
        self.assertIn("sound", self.shm("-t", "a.vtk.shm")[0])
        self.assertIn("vertices", self.shm("-l", "a.vtk.shm")[0])
        self.assertIn("vtk DataFile", self.shm("-d", "a.vtk.shm", "-c")[0])
        for word, level in [("-1", "fast"), ("-3", "fast"), ("-6", "default"), ("-9", "best"),
                            ("--fast", "fast"), ("--best", "best")]:
            self.shm("compress", word, "a.vtk", "-o", "x.shm", "-f")
            self.shm("compress", "--level", level, "a.vtk", "-o", "y.shm", "-f")
            self.assertEqual(self.bytes("x.shm"), self.bytes("y.shm"))
        _, text = self.shm("a.vtk", code=2)
        self.assertIn("did you mean shm compress a.vtk?", text)

    def shares_on_terminal(self, *words):
        """Runs the tool in a terminal. Returns the percentages that it shows, in the order in which they
        appear."""
        pid, terminal = pty.fork()
        if pid == 0:
            os.chdir(self.folder)
            os.execv(SHM, [SHM, *words])
        shown = b""
        while True:
            try:
                piece = os.read(terminal, 65536)
            except OSError:
                piece = b""
            if not piece:
                break
            shown += piece
        os.close(terminal)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), 0, shown)
        self.assertIn(b"\r\x1b[K", shown)  # progress was wiped
        return [int(share) for share in re.findall(rb"(\d+) %", shown)]

    def test_progress_only_grows(self):
        # Increases the size of the mesh until the run takes long enough to show progress.
        for side in (24, 48, 72, 96, 128):
            write_vtk(self.path("large.vtk"), side)
            if self.shares_on_terminal("compress", "-f", "large.vtk"):
                break
        else:
            self.fail("no progress was shown")
        for words in (["compress", "-f", "large.vtk"],
                      ["decompress", "-f", "large.vtk.shm", "-o", "back.vtk"],
                      ["verify", "large.vtk.shm", "--against", "large.vtk"],
                      ["compress", "-f", "-T", "1", "a.vtk", "b.vtk", "large.vtk", "sub/c.vtk"]):
            with self.subTest(words=words):
                shares = self.shares_on_terminal(*words)
                self.assertEqual(shares, sorted(shares))
                self.assertTrue(all(share <= 100 for share in shares))
                self.assertEqual(self.shm(*words)[1], "")

    def test_threads_change_nothing(self):
        for threads in ("1", "3"):
            self.shm("compress", "-r", ".", "-T", threads, "-f", "-q")
            found = {name: self.bytes(name) for name in self.names("**/*.shm")}
            self.assertEqual(len(found), 4)
            self.assertEqual(found, getattr(self, "found", found))
            self.found = found

    def test_who_ends_it_ends_all(self):
        os.mkfifo(self.path("never"))
        writer = os.open(self.path("never"), os.O_RDWR)  # so that reading waits
        running = subprocess.Popen([SHM, "compress", "never", "a.vtk", "-T", "1"], cwd=self.folder,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        children = f"/proc/{running.pid}/task/{running.pid}/children"
        for _ in range(200):
            if Path(children).read_text().strip():
                break
            time.sleep(.05)
        child = Path(children).read_text().split()[0]
        running.send_signal(signal.SIGKILL)
        running.wait(60)
        for _ in range(200):
            if not Path(f"/proc/{child}").exists() or "Z" in Path(f"/proc/{child}/stat").read_text().split():
                break
            time.sleep(.05)
        else:
            self.fail("the process of the file outlives the tool")
        os.close(writer)
        self.assertEqual(self.names("**/*.shm"), [])


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
