#!/usr/bin/env python3
"""Tests the conventions that shm shares with other tools. Each row of the table in docs/tool.md, section
"Habits", has a test, and each test has a row. Also tests the output of short commands in a terminal.

Usage: habits_test.py PATH_OF_SHM
"""
import gzip
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
SOURCE = Path(__file__).resolve().parents[2]
ROWS = {}


def row(name):
    def added(test):
        ROWS[name] = test
        return test
    return added


class HabitsTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.folder = Path(self.directory.name)
        write_vtk(self.path("run.vtk"), 4)

    def shm(self, *words, code=0, **how):
        how.setdefault("stdin", subprocess.DEVNULL)
        done = subprocess.run([SHM, *words], cwd=self.folder, capture_output=True, timeout=120, **how)
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{done.stderr.decode()}")
        return done.stdout, done.stderr.decode()

    def names(self):
        return sorted(path.name for path in self.folder.iterdir())

    def test_the_table_has_these_rows(self):
        table = (SOURCE / "docs" / "tool.md").read_text().split("## Habits")[1].split("\n## ")[0]
        rows = re.findall(r"^\| ([^|]+) \|", table, re.MULTILINE)
        self.assertEqual([name for name in rows if name not in ("habit", "---")], list(ROWS))

    @row("name of the output")
    def test_name_of_what_is_made(self):
        self.shm("compress", "run.vtk")
        self.assertEqual(self.names(), ["run.vtk", "run.vtk.shm"])

    @row("name of the restored file")
    def test_name_of_what_comes_back(self):
        self.shm("compress", "run.vtk")
        os.rename(self.path("run.vtk"), self.path("before.vtk"))
        self.shm("decompress", "run.vtk.shm")
        self.shm("diff", "before.vtk", "run.vtk")

    @row("the source file")
    def test_the_source_stays(self):
        for words, left in [([], ["run.vtk", "run.vtk.shm"]), (["-k"], ["run.vtk", "run.vtk.shm"]),
                            (["--rm"], ["run.vtk.shm"])]:
            self.shm("compress", "run.vtk", "-f", *words)
            self.assertEqual(self.names(), left)

    @row("mode and time")
    def test_mode_and_time(self):
        os.chmod(self.path("run.vtk"), 0o640)
        os.utime(self.path("run.vtk"), (1e9, 1.2e9))
        self.shm("compress", "run.vtk", "--rm")
        self.shm("decompress", "run.vtk.shm")
        for name in ("run.vtk.shm", "run.vtk"):
            status = os.stat(self.path(name))
            self.assertEqual((oct(status.st_mode & 0o777), status.st_mtime), ("0o640", 1.2e9))

    @row("an existing output")
    def test_a_file_that_is_there(self):
        (self.folder / "run.vtk.shm").write_bytes(b"mine")
        self.assertIn("exists already", self.shm("compress", "run.vtk", code=4)[1])
        self.assertEqual(self.bytes("run.vtk.shm"), b"mine")
        shown, code = self.on_terminal(["compress", "run.vtk"], b"n\n")
        self.assertIn("Overwrite? [y/N]", shown)
        self.assertEqual((code, self.bytes("run.vtk.shm")), (4, b"mine"))
        self.shm("compress", "run.vtk", "-f")
        self.assertNotEqual(self.bytes("run.vtk.shm"), b"mine")

    @row("output is the input")
    def test_output_is_the_input(self):
        os.link(self.path("run.vtk"), self.path("other.vtk"))
        before = self.bytes("run.vtk")
        self.shm("convert", "run.vtk", "other.vtk", "-f", code=4)
        self.assertEqual(self.bytes("run.vtk"), before)

    @row("standard streams")
    def test_standard_streams(self):
        self.shm("compress", "run.vtk")
        whole = self.bytes("run.vtk.shm")
        self.assertEqual(self.shm("compress", "-c", "run.vtk")[0], whole)
        with open(self.path("run.vtk"), "rb") as source:
            self.assertEqual(self.shm("compress", "-", stdin=source)[0], whole)

    @row("compressed bytes on a terminal")
    def test_compressed_bytes_on_a_terminal(self):
        shown, code = self.on_terminal(["compress", "-c", "run.vtk"])
        self.assertIn("is a terminal", shown)
        self.assertEqual(code, 4)

    @row("many files")
    def test_many_files(self):
        write_vtk(self.path("two.vtk"), 3)
        out, text = self.shm("compress", "no.vtk", "run.vtk", "two.vtk", code=3)
        self.assertIn("no.vtk", text)
        self.assertIn(b"3 files: 2 done, 1 failed", out)
        self.assertEqual(self.names(), ["run.vtk", "run.vtk.shm", "two.vtk", "two.vtk.shm"])

    @row("folders")
    def test_folders(self):
        os.mkdir(self.path("sub"))
        os.rename(self.path("run.vtk"), self.path("sub/run.vtk"))
        self.shm("compress", "-r", "sub")
        self.assertTrue((self.folder / "sub" / "run.vtk.shm").exists())

    @row("a folder for outputs")
    def test_a_folder_for_outputs(self):
        write_vtk(self.path("two.vtk"), 3)
        os.mkdir(self.path("out"))
        self.shm("compress", "run.vtk", "two.vtk", "-o", "out")
        self.assertEqual(sorted(os.listdir(self.path("out"))), ["run.vtk.shm", "two.vtk.shm"])

    @row("an input already compressed")
    def test_what_is_compressed_already(self):
        self.shm("compress", "run.vtk")
        before = self.bytes("run.vtk.shm")
        self.assertIn("is already a .shm file", self.shm("compress", "run.vtk.shm", "-f")[1])
        self.assertEqual((self.names(), self.bytes("run.vtk.shm")),
                         (["run.vtk", "run.vtk.shm"], before))

    @row("packed inputs")
    def test_packed_inputs(self):
        (self.folder / "run.vtk.gz").write_bytes(gzip.compress(self.bytes("run.vtk")))
        self.shm("compress", "run.vtk.gz")
        self.shm("verify", "run.vtk.shm", "--against", "run.vtk")

    @row("letters for commands")
    def test_letters_for_commands(self):
        self.shm("-z", "run.vtk")
        os.rename(self.path("run.vtk"), self.path("before.vtk"))
        self.shm("-d", "run.vtk.shm")
        self.assertIn(b"sound", self.shm("-t", "run.vtk.shm")[0])
        self.assertIn(b"hexahedra", self.shm("-l", "run.vtk.shm")[0])
        self.shm("diff", "before.vtk", "run.vtk")

    @row("levels")
    def test_levels(self):
        written = {word: self.shm("compress", "-c", word, "run.vtk")[0]
                   for word in ("-1", "--fast", "-5", "-9", "--best", "--level=best")}
        self.assertEqual(written["-1"], written["--fast"])
        self.assertEqual(written["-9"], written["--best"])
        self.assertEqual(written["-9"], written["--level=best"])
        self.assertEqual(written["-5"], self.shm("compress", "-c", "run.vtk")[0])

    @row("threads")
    def test_threads(self):
        self.assertEqual(self.shm("compress", "-c", "-T", "2", "--segment-cells", "9", "run.vtk")[0],
                         self.shm("compress", "-c", "-T1", "--segment-cells", "9", "run.vtk")[0])

    @row("quiet, verbose")
    def test_quiet_verbose(self):
        self.assertEqual(self.shm("compress", "-q", "run.vtk"), (b"", ""))
        self.assertNotIn(b"streams", self.shm("info", "run.vtk.shm")[0])
        self.assertIn(b"streams", self.shm("info", "-v", "run.vtk.shm")[0])

    @row("help and version")
    def test_help_and_version(self):
        for words in (["-h"], ["--help"], ["help"], ["help", "compress"], ["compress", "-h"]):
            out, text = self.shm(*words)
            self.assertIn(b"Usage: ", out)
            self.assertEqual(text, "")
        for word in ("-V", "--version", "version"):
            self.assertRegex(self.shm(word)[0], rb"^shm \d+\.\d+\.\d+\n$")

    @row("no arguments")
    def test_no_words_at_all(self):
        out, text = self.shm(code=2)
        self.assertEqual(out, b"")
        self.assertIn("Usage: ", text)

    @row("a typo")
    def test_a_typo(self):
        self.assertIn("did you mean compress?", self.shm("comprss", "run.vtk", code=2)[1])
        text = self.shm("compress", "--levle", "best", "run.vtk", code=2)[1]
        self.assertIn("did you mean --level?", text)
        self.assertIn("shm compress --help", text)

    @row("the output format")
    def test_format_of_what_is_written(self):
        self.shm("convert", "run.vtk", "run.vtu")
        self.assertIn(b"<VTKFile", self.bytes("run.vtu")[:200])
        self.shm("convert", "run.vtk", "run.out", "--format", "vtu")
        self.assertEqual(self.bytes("run.out"), self.bytes("run.vtu"))
        self.assertIn("--format", self.shm("convert", "run.vtk", "run.what", code=2)[1])

    @row("reading headers only")
    def test_a_look_at_the_head(self):
        self.shm("compress", "run.vtk")
        whole = bytearray(self.bytes("run.vtk.shm"))
        expected = self.shm("info", "--json", "run.vtk.shm")[0]
        # Searches the file for a byte that belongs to the values. `info --json` must not read it, because it
        # reads values only if ranges are requested.
        for at in range(len(whole)):
            whole[at] ^= 0xff
            (self.folder / "hurt.shm").write_bytes(whole)
            whole[at] ^= 0xff
            looked = subprocess.run([SHM, "info", "--json", "hurt.shm"],
                                    cwd=self.folder, capture_output=True)
            if looked.stdout == expected.replace(b"run.vtk.shm", b"hurt.shm"):
                self.shm("verify", "hurt.shm", code=3)
                return
        self.fail("info reads every byte")

    @row("interruption")
    def test_interrupted(self):
        os.mkfifo(self.path("slow"))
        running = subprocess.Popen([SHM, "compress", "slow", "-o", "out.shm"], cwd=self.folder,
                                   stderr=subprocess.DEVNULL)
        feeder = os.open(self.path("slow"), os.O_WRONLY)
        os.write(feeder, self.bytes("run.vtk")[:1000])
        time.sleep(.3)
        running.send_signal(signal.SIGINT)
        self.assertEqual(running.wait(60), -signal.SIGINT)
        os.close(feeder)
        self.assertEqual(self.names(), ["run.vtk", "slow"])

    @row("a closed pipe")
    def test_the_reader_of_a_pipe_goes(self):
        done = subprocess.run(f"{SHM} help compress | true; echo ${{PIPESTATUS[0]}}", shell=True,
                              executable="/bin/bash", capture_output=True, timeout=60)
        self.assertEqual(done.stderr, b"")
        self.assertIn(done.stdout, (b"0\n", b"4\n"))

    def on_terminal(self, words, answer=b""):
        """Runs the tool in a pseudo-terminal. Returns its output and its exit code."""
        pid, terminal = pty.fork()
        if pid == 0:
            os.chdir(self.folder)
            os.execvp(SHM, [SHM, *words])
        shown = b""
        while True:
            try:
                piece = os.read(terminal, 4096)
            except OSError:
                piece = b""
            if not piece:
                break
            shown += piece
            if shown.endswith(b"[y/N] "):
                os.write(terminal, answer)
        os.close(terminal)
        return shown.decode(), os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])

    def transcript(self, command):
        """Runs a command in a pseudo-terminal that the program `script` creates. Returns its output and its
        exit code."""
        self.need("script")
        done = subprocess.run(["script", "-qec", command, os.devnull], cwd=self.folder, timeout=120,
                              stdin=subprocess.DEVNULL, capture_output=True,
                              env={**os.environ, "PATH": os.path.dirname(SHM) + ":" + os.environ["PATH"]})
        return re.sub(r"\r|\x1b\[K", "", done.stdout.decode()), done.returncode

    def test_who_types_little(self):
        if os.path.basename(SHM) != "shm":
            self.skipTest("the tool has another name")
        write_vtk(self.path("two.vtk"), 3)
        self.write("notes.txt", "no mesh")
        shown, code = self.transcript("shm")
        self.assertIn("Usage: shm", shown)
        self.assertEqual(code, 2)
        shown, code = self.transcript("shm compress")
        self.assertIn("IN is required (see shm compress --help)", shown)
        self.assertEqual(code, 2)
        shown, code = self.transcript("shm compress *")
        self.assertIn("notes.txt", shown)
        self.assertIn("3 files: 2 done, 1 failed", shown)
        self.assertEqual(code, 3)
        shown, code = self.transcript("shm compress *.vtk*")
        self.assertIn("2 passed over", shown)
        self.assertIn("run.vtk.shm", shown)
        os.remove(self.path("run.vtk"))
        os.remove(self.path("two.vtk"))
        shown, code = self.transcript("shm decompress *.shm")
        self.assertIn("2 files: 2 done", shown)
        self.assertEqual(code, 0)
        self.assertEqual(self.names(),
                         ["notes.txt", "run.vtk", "run.vtk.shm", "two.vtk", "two.vtk.shm"])
        shown, code = self.transcript("shm -h")
        self.assertIn("Exit codes", shown)
        self.assertEqual(code, 0)

    def test_man(self):
        for program in ("man", "groff"):
            self.need(program)
        os.mkdir(self.path("man1"))
        (self.folder / "man1" / "shm.1").write_bytes(self.shm("manual")[0])
        done = subprocess.run(["man", "-M", str(self.folder), "shm"], capture_output=True, timeout=60,
                              env={**os.environ, "MANPAGER": "cat", "MANWIDTH": "80"})
        if done.returncode != 0 and b"minimized" in done.stdout + done.stderr:
            self.skipTest("man does not work here")
        self.assertIn(b"compress", done.stdout)


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
