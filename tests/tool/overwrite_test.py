#!/usr/bin/env python3
"""Tests that the tool does not destroy data by mistake. Runs each command with one of its inputs as its
output, with and without --force. The output is given under each name that the file has, such as a link. Also
tests existing output files, devices, pipes, quotas, full disks and terminals.

Usage: overwrite_test.py PATH_OF_SHM
"""
import os
import pty
import resource
import select
import subprocess
import sys
import threading
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest, lacks
from sample_meshes import write_vtk

SHM = "shm"


def snapshot(folder):
    """Returns the contents of a folder as a dictionary. For each name, it contains the bytes of the file or
    the target of the symbolic link."""
    found = {}
    for path in sorted(Path(folder).rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_symlink():
            found[name] = os.readlink(path)
        elif path.is_file():
            found[name] = path.read_bytes()
    return found


# For each command: a title, the words of the command line, and the input file that the test also uses as the
# output. In the command line, {} is replaced with a name of this file. setUp() creates all input files.
COMMANDS = [
    ("compress", ["compress", "mesh.vtk", "-o", "{}"], "mesh.vtk"),
    ("convert", ["convert", "mesh.vtk", "{}", "--format", "vtu"], "mesh.vtk"),
    ("decompress", ["decompress", "mesh.shm", "-o", "{}", "--format", "vtk"], "mesh.shm"),
    ("append, FILE", ["append", "steps.shm", "more.vtk", "--time", "9", "-o", "{}"], "steps.shm"),
    ("append, SOURCE", ["append", "steps.shm", "more.vtk", "--time", "9", "-o", "{}"], "more.vtk"),
    ("join", ["join", "-o", "{}", "mesh.shm", "mesh.vtk"], "mesh.vtk"),
    ("extract", ["extract", "mesh.shm", "{}", "--format", "vtk"], "mesh.shm"),
    ("layout", ["layout", "drawn.svg", "-o", "{}"], "drawn.svg"),
    ("preview", ["preview", "mesh.vtk", "-o", "{}"], "mesh.vtk"),
    ("surface", ["surface", "mesh.vtk", "-o", "{}", "--format", "ply"], "mesh.vtk"),
    ("view", ["view", "mesh.vtk", "-o", "{}", "--page", "page.html"], "mesh.vtk"),
    ("view, page", ["view", "mesh.vtk", "-o", "{}", "--page", "page.html"], "page.html"),
    ("repair", ["repair", "mesh.shm", "-o", "{}"], "mesh.shm"),
]


class OverwriteTest(FolderTest):
    def has(self, words):
        """Returns true if the tool was built with all libraries that the command needs."""
        return words[0] not in ("preview", "surface") or not lacks(SHM, words[0])

    def setUp(self):
        super().setUp()
        self.folder = Path(self.directory.name)
        write_vtk(self.path("mesh.vtk"), 4)
        write_vtk(self.path("more.vtk"), 4)
        Path(self.path("page.html")).write_text(
            '<script type="application/octet-stream" id="file" data-name=""></script>', encoding="ascii")
        write_vtk(self.path("drawn.svg"), 4)  # only .svg and .png files can be drawn
        self.run_tool("compress", "mesh.vtk", "-o", "mesh.shm", "-q")
        self.run_tool("compress", "mesh.vtk", "-o", "steps.shm", "-q")

    def run_tool(self, *words, code=0, **how):
        how.setdefault("stdin", subprocess.DEVNULL)
        done = subprocess.run([SHM, *words], cwd=self.folder, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, timeout=120, **how)
        text = done.stderr.decode(errors="replace")
        self.assertEqual(done.returncode, code, f"shm {' '.join(words)}\n{text}")
        return done.stdout, text

    def expect_refusal(self, *words, code=4, reason="", **how):
        before = snapshot(self.folder)
        out, text = self.run_tool(*words, code=code, **how)
        self.assertEqual(out, b"")
        self.assertRegex(text, "^shm: .*" + reason)
        self.assertEqual(snapshot(self.folder), before)

    def aliases(self, name):
        """Returns names of the file `name`: its own name, other paths, and symbolic and hard links."""
        self.symbolic, self.hard = (kind + Path(name).suffix for kind in ("symbolic", "hard"))
        (self.folder / "beside").mkdir(exist_ok=True)
        (self.folder / "linked").symlink_to(".")
        (self.folder / self.symbolic).symlink_to(name)
        os.link(self.folder / name, self.folder / self.hard)
        return [name, f"./{name}", f"beside/../{name}", str(self.folder / name), self.symbolic, self.hard,
                f"linked/{name}"]

    def remove_aliases(self):
        (self.folder / "beside").rmdir()
        for name in ("linked", self.symbolic, self.hard):
            (self.folder / name).unlink()

    def test_an_input_is_no_output(self):
        attempts = 0
        for name, words, read in COMMANDS:
            if not self.has(words):
                continue
            for alias in self.aliases(read):
                for force in ([], ["-f"]):
                    with self.subTest(command=name, alias=alias, force=force):
                        self.expect_refusal(*[word.format(alias) for word in words], *force,
                                            reason="is (an input|the same file as .* which is an input)")
                        attempts += 1
            self.remove_aliases()
        self.assertGreaterEqual(attempts, 40)

    def test_a_file_that_is_there_stays_unless_forced(self):
        for name, words, _ in COMMANDS:
            if not self.has(words):
                continue
            with self.subTest(command=name):
                other = self.folder / ("other.svg" if name == "layout" else "other.out")
                other.write_text("a year of work\n")
                words = [word.format(other.name) for word in words]
                self.expect_refusal(*words, reason="exists already")
                if not name.startswith("append"):
                    self.run_tool(*words, "--force")
                    self.assertNotEqual(other.read_bytes(), b"a year of work\n")
                other.unlink()

    def test_default_names_are_not_replaced_either(self):
        (self.folder / "mesh.vtk.shm").write_text("older")
        self.expect_refusal("compress", "mesh.vtk", reason="mesh.vtk.shm: exists already")
        self.run_tool("compress", "mesh.vtk", "-f")

    def test_split_replaces_nothing(self):
        self.run_tool("join", "-o", "all.shm", "mesh.vtk", "more.vtk")
        self.expect_refusal("split", "all.shm", reason="exists already")
        # If one of the output files exists, no output file is written.
        (self.folder / "out").mkdir()
        (self.folder / "out" / "more.vtk").write_text("mine")
        self.expect_refusal("split", "all.shm", "-d", "out", reason="more.vtk: exists already")
        # The archive has the same name as one of its members, so the output would replace the input.
        (self.folder / "all.shm").rename(self.folder / "out" / "mesh.vtk")
        self.expect_refusal("split", "out/mesh.vtk", "-d", "out", "-f", reason="an input")

    def test_standard_input_is_an_input(self):
        with open(self.folder / "mesh.vtk", "rb") as mesh:
            self.expect_refusal("compress", "-", "-o", "mesh.vtk", "-f", stdin=mesh, reason="an input")
        with open(self.folder / "mesh.vtk", "rb") as mesh:
            self.expect_refusal("compress", "/dev/stdin", "-o", "mesh.vtk", "-f", stdin=mesh,
                                reason="an input")

    def test_places_where_no_file_can_be(self):
        for place, reason in [("nowhere/out.shm", "there is no folder nowhere"),
                              ("mesh.vtk/out.shm", "cannot be written"),
                              ("x" * 300, "too long"), ("/proc/out.shm", "")]:
            with self.subTest(place=place[:20]):
                self.expect_refusal("compress", "mesh.vtk", "-o", place, reason=reason)
        (self.folder / "folder").mkdir()
        self.expect_refusal("convert", "mesh.vtk", "folder", "--format", "vtk", reason="is a folder")
        # The tool checks the output folder before it reads the mesh. The error is therefore the same if the
        # mesh does not exist.
        self.expect_refusal("compress", "no.vtk", "-o", "nowhere/out.shm", reason="no folder")

    def test_devices_and_pipes(self):
        whole = (self.folder / "mesh.shm").read_bytes()
        self.run_tool("compress", "mesh.vtk", "-o", "/dev/null")
        self.assertTrue(os.path.exists("/dev/null") and not os.path.isfile("/dev/null"))
        self.assertEqual(self.run_tool("compress", "mesh.vtk", "-o", "/dev/stdout")[0], whole)
        os.mkfifo(self.folder / "pipe")
        got = []
        reader = threading.Thread(target=lambda: got.append((self.folder / "pipe").read_bytes()))
        reader.start()
        self.run_tool("compress", "mesh.vtk", "-o", "pipe")
        reader.join(60)
        self.assertEqual(got, [whole])
        text = self.run_tool("decompress", "mesh.shm", "-o", "/dev/stdout", "--format", "vtk")[0]
        self.assertTrue(text.startswith(b"# vtk DataFile"))

    def test_a_quota_is_an_error_like_any_other(self):
        def limited():
            resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))

        (self.folder / "old.shm").write_bytes(b"old")
        for words in (["compress", "mesh.vtk", "-o", "old.shm", "-f"],
                      ["convert", "mesh.vtk", "old.shm", "-f", "--format", "vtk"],
                      ["decompress", "mesh.shm", "-o", "old.shm", "-f", "--format", "vtk"],
                      ["layout", "mesh.vtk", "-o", "old.svg", "-f"],
                      ["preview", "mesh.vtk", "-o", "old.png", "-f"],
                      ["surface", "mesh.vtk", "-o", "old.ply", "-f"],
                      ["view", "mesh.vtk", "-o", "old.html", "-f", "--page", "page.html"]):
            with self.subTest(words=words):
                if not self.has(words):
                    continue
                self.expect_refusal(*words, reason="File too large", preexec_fn=limited)

    def test_pipes_are_inputs(self):
        for name, words in [("mesh.vtk", ["compress", "{}", "-o", "-"]),
                            ("mesh.shm", ["decompress", "{}", "-o", "-", "--format", "vtk"]),
                            ("mesh.shm", ["info", "{}", "--json"]),
                            ("mesh.vtk", ["preview", "{}", "-o", "-"]),
                            ("mesh.shm", ["preview", "{}", "-o", "-"]),
                            ("mesh.vtk", ["surface", "{}", "-o", "-"]),
                            ("mesh.shm", ["surface", "{}", "-o", "-"]),
                            ("mesh.vtk", ["view", "{}", "-o", "-", "--page", "page.html"]),
                            ("mesh.vtk", ["layout", "{}", "-o", "-"])]:
            if not self.has(words):
                continue
            with self.subTest(words=words):
                with open(self.folder / name, "rb") as source:
                    expected = self.run_tool(*[word.format("-") for word in words], stdin=source)[0]
                os.mkfifo(self.folder / "pipe")
                feeder = threading.Thread(target=lambda: (self.folder / "pipe").write_bytes(
                    (self.folder / name).read_bytes()))
                feeder.start()
                got = self.run_tool(*[word.format("pipe") for word in words])[0]
                feeder.join(60)
                (self.folder / "pipe").unlink()
                for text in (expected, got):
                    self.assertGreater(len(text), 100)
                if words[0] in ("info", "layout"):  # these show the name
                    got, expected = len(got), len(expected) + len("pipe") - len("-")
                # The page that `shm view` writes contains the file name in the same element as the file
                # itself.
                if words[0] == "view":
                    got, expected = ((text.partition(b">")[2]) for text in (got, expected))
                self.assertEqual(got, expected)

    def test_a_full_device(self):
        _, text = self.run_tool("compress", "mesh.vtk", "-o", "/dev/full", code=4)
        self.assertIn("No space left", text)

    def on_terminal(self, words, answer):
        """Runs the tool in a pseudo-terminal. Returns its output and its exit code."""
        pid, terminal = pty.fork()
        if pid == 0:
            os.chdir(self.folder)
            os.execvp(SHM, [SHM, *words])
        shown = b""
        while True:
            try:
                ready = select.select([terminal], [], [], 60)[0]
                piece = os.read(terminal, 4096) if ready else b""
            except OSError:
                piece = b""
            if not piece:
                break
            shown += piece
            if shown.endswith(b"[y/N] "):
                os.write(terminal, answer)
        os.close(terminal)
        return shown.decode(), os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])

    def test_a_terminal_is_asked(self):
        (self.folder / "mesh.vtk.shm").write_bytes(b"old")
        for answer in (b"n\n", b"\n"):
            shown, code = self.on_terminal(["compress", "mesh.vtk"], answer)
            self.assertIn("mesh.vtk.shm exists already. Overwrite? [y/N]", shown)
            self.assertEqual(code, 4, shown)
            self.assertEqual((self.folder / "mesh.vtk.shm").read_bytes(), b"old")
        shown, code = self.on_terminal(["compress", "mesh.vtk"], b"y\n")
        self.assertEqual(code, 0, shown)
        self.assertEqual((self.folder / "mesh.vtk.shm").read_bytes(),
                         (self.folder / "mesh.shm").read_bytes())

    def test_compressed_bytes_do_not_go_to_a_terminal(self):
        shown, code = self.on_terminal(["compress", "mesh.vtk", "-o", "-"], b"")
        self.assertIn("is a terminal", shown)
        self.assertEqual(code, 4)


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
