#!/usr/bin/env python3
"""Runs each command of shm once on a small mesh. Unlike most Python tests of the tool, this test also runs with sanitizers.

Usage: smoke_test.py PATH_OF_SHM
"""
import os
import re
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest, lacks
from sample_meshes import write_vtk

# For each command: the command lines to run, in order. Each command is listed after the commands that write
# its input files.
CALLS = {
    "compress": [["mesh.vtk", "-o", "mesh.shm", "--parity", "5"], ["mesh.vtk", "-o", "free.shm", "--order", "free", "--rel", "1e-3"],
                 ["moved.vtk", "-o", "moved.shm", "--level", "fast", "--segment-cells", "20"],
                 ["mesh.vtk", "-o", "best.shm", "--level", "best", "--order", "stream"],
                 ["step_%d.vtk", "-o", "steps.shm"]],
    "decompress": [["mesh.shm", "-o", "back.vtk"], ["moved.shm", "-o", "back.vtu"], ["free.shm", "-o", "back.msh"]],
    "convert": [["mesh.vtk", "converted.e"], ["mesh.vtk", "converted.msh"], ["mesh.vtk", "converted.inp"]],
    "info": [["mesh.shm"], ["mesh.vtk", "--json"]],
    "verify": [["mesh.shm", "--against", "mesh.vtk"], ["free.shm", "--against", "mesh.vtk"]],
    "diff": [["mesh.vtk", "back.vtk"]],
    "extract": [["mesh.shm", "part.vtk", "--box", "0,0,0,0.2,0.2,0.2"]],
    "append": [["steps.shm", "step_1.vtk", "--time", "5"]],
    "repair": [["mesh.shm", "-o", "repaired.shm"]],
    "join": [["back.vtk", "free.shm", "-o", "joined.shm"]],
    "split": [["joined.shm", "-d", "members"]],
    "layout": [["mesh.vtk", "-o", "layout.svg"]],
    "preview": [["mesh.shm", "-o", "preview.png", "--size", "80x60"]],
    "surface": [["mesh.shm", "-o", "surface.ply"]],
    "view": [["mesh.shm", "-o", "view.html", "--page", "page.html"]],
    "completion": [["bash"], ["zsh"]],
    "manual": [[]],
}


class SmokeTest(FolderTest):
    timeout = 300

    def write(self, name, text):
        with open(self.path(name), "w", encoding="ascii") as file:
            file.write(text)

    def test_each_command(self):
        write_vtk(self.path("mesh.vtk"), 5)
        write_vtk(self.path("moved.vtk"), 5, bend=0.1)
        with open(self.path("mesh.vtk"), encoding="ascii") as file:
            text = file.read()
        # Two steps of the same mesh, which differ only in the first value of the point array.
        for step in range(2):
            self.write(f"step_{step}.vtk", text.replace("\n0.0625\n", f"\n0.{step}25\n"))
        os.mkdir(self.path("members"))
        self.write("page.html", '<script type="application/octet-stream" id="file" data-name=""></script>')
        help_text = self.shm("--help").decode()
        commands = re.findall(r"^  ([a-z]+)  ", help_text[help_text.index("Subcommands:"):], re.MULTILINE)
        self.assertEqual(sorted(commands), sorted(CALLS))
        for command, calls in CALLS.items():
            if not lacks(self.tool, command):
                for words in calls:
                    with self.subTest(command=command, words=words):
                        self.shm(command, *words)


if __name__ == "__main__":
    SmokeTest.tool = os.path.abspath(sys.argv.pop(1))
    unittest.main()
