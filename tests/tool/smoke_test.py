#!/usr/bin/env python3
"""Each command of shm runs once on a small mesh. This is all that Python tests run with sanitizers.

Usage: smoke_test.py PATH_OF_SHM
"""
import os
import re
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest, lacks
from sample_meshes import write_vtk

# By command: its calls, in order, and the files that they write. Earlier commands write the inputs of later ones.
CALLS = {
    "compress": [["mesh.vtk", "-o", "mesh.shm", "--parity", "5"], ["mesh.vtk", "-o", "free.shm", "--order", "free", "--rel", "1e-3"],
                 ["moved.vtk", "-o", "moved.shm", "--level", "fast", "--segment-cells", "20"],
                 ["mesh.vtk", "-o", "best.shm", "--level", "best", "--order", "stream"]],
    "decompress": [["mesh.shm", "-o", "back.vtk"], ["moved.shm", "-o", "back.vtu"], ["free.shm", "-o", "back.msh"]],
    "convert": [["mesh.vtk", "converted.e"], ["mesh.vtk", "converted.msh"], ["mesh.vtk", "converted.inp"]],
    "info": [["mesh.shm"], ["mesh.vtk", "--json"]],
    "verify": [["mesh.shm", "--against", "mesh.vtk"], ["free.shm", "--against", "mesh.vtk"]],
    "diff": [["mesh.vtk", "back.vtk"]],
    "extract": [["mesh.shm", "part.vtk", "--box", "0,0,0,0.2,0.2,0.2"]],
    "append": [["best.shm", "mesh.vtk", "--time", "1"]],
    "repair": [["mesh.shm", "-o", "repaired.shm"]],
    "join": [["mesh.shm", "moved.shm", "-o", "joined.shm"]],
    "split": [["joined.shm", "-o", "members"]],
    "layout": [["mesh.vtk", "-o", "layout.svg"]],
    "preview": [["mesh.shm", "-o", "preview.png", "--size", "80x60"]],
    "surface": [["mesh.shm", "-o", "surface.ply"]],
    "view": [["mesh.shm", "-o", "view.html"]],
}


class SmokeTest(FolderTest):
    timeout = 300

    def test_each_command(self):
        write_vtk(self.path("mesh.vtk"), 5)
        write_vtk(self.path("moved.vtk"), 5, bend=0.1)
        help_text = self.shm("--help").decode()
        commands = re.findall(r"^  ([a-z]+)  ", help_text[help_text.index("Commands"):], re.MULTILINE)
        self.assertEqual(sorted(commands), sorted(CALLS))
        for command, calls in CALLS.items():
            if not lacks(self.tool, command):
                for words in calls:
                    with self.subTest(command=command, words=words):
                        self.shm(command, *words)


if __name__ == "__main__":
    SmokeTest.tool = os.path.abspath(sys.argv.pop(1))
    unittest.main()
