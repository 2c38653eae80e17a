#!/usr/bin/env python3
"""Tests the memory use of shm for meshes of different widths and lengths. The memory use must never exceed
the figures in the documents, and must be about the same for a mesh that is four times as long.

Usage: memory_use_test.py PATH_OF_SHM
"""
import os
import struct
import subprocess
import sys
import unittest

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest, forced

SHM = "shm"
MB = 1 << 20

# Figures from docs/tool.md, section "Memory": the memory in bytes that a run with one float32 field on cells
# needs.
BASE = {"compress": 42 * MB, "verify": 27 * MB, "decompress": 27 * MB}
FOR_ACTIVE_VERTEX = {"compress": 1100, "verify": 500, "decompress": 500}
FOR_MEMORY_OPTION = 16 * MB
INFO = 20 * MB
# Allowed increase of the memory use, in bytes, for a mesh that is four times as long. Tables may use up to
# half of --memory. The tables of the short mesh use less than that, so the tables of the long mesh are larger.
# The rest of the allowed increase is a margin.
SAME = 10 * MB


def write_block(path, side, layers):
    """Writes a warped block of side x side x layers hexahedra in binary legacy VTK, layer by layer."""
    points = side + 1
    cells = side * side * layers
    corner = np.arange(points * points, dtype=np.int64).reshape(points, points)[:-1, :-1].ravel()
    steps = np.array([0, 1, points + 1, points])
    layer = corner[:, None] + np.concatenate([steps, steps + points * points])
    x, y = np.meshgrid(np.linspace(0, 1, points), np.linspace(0, 1, points))
    with open(path, "wb") as out:
        out.write(b"# vtk DataFile Version 3.0\nwarped\nBINARY\nDATASET UNSTRUCTURED_GRID\n")
        out.write(b"POINTS %d float\n" % (points * points * (layers + 1)))
        for k in range(layers + 1):
            z = k / side
            xyz = np.stack([x + 0.1 * np.sin(3 * y + z), y + 0.1 * np.sin(2 * z + x),
                            z + 0.1 * np.sin(x * y)], axis=-1)
            out.write(xyz.astype(">f4").tobytes())
        out.write(b"\nCELLS %d %d\n" % (cells, 9 * cells))
        for k in range(layers):
            rows = np.full((side * side, 9), 8, dtype=">i4")
            rows[:, 1:] = layer + k * points * points
            out.write(rows.tobytes())
        out.write(b"\nCELL_TYPES %d\n" % cells)
        out.write(np.full(cells, 12, dtype=">i4").tobytes())
        out.write(b"\nCELL_DATA %d\nSCALARS heat float 1\nLOOKUP_TABLE default\n" % cells)
        heat = np.sin(np.arange(side * side) / side)
        for k in range(layers):
            out.write((heat + np.cos(k / side)).astype(">f4").tobytes())
        out.write(b"\n")


def is_sanitized():
    """Returns true if the tool was built with sanitizers. Their shadow memory would count as memory of the
    tool."""
    with open(SHM, "rb") as program:
        return b"__asan_init" in program.read()


class MemoryUseTest(FolderTest):
    def peak(self, *words):
        """Runs the tool and returns its largest resident size in bytes. The result cannot be smaller than the
        resident size of this script, because a child process starts as a copy of its parent."""
        process = subprocess.Popen([SHM, *forced(words), "--threads", "1", "--memory", "16M", "-q"])
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        self.assertEqual(process.returncode, 0, words)
        return usage.ru_maxrss * 1024

    def peaks(self, mesh, order, level):
        packed, back = self.path("mesh.shm"), self.path("back.vtk")
        peaks = {
            "compress": self.peak("compress", mesh, "-o", packed, "--order", order, "--level", level),
            "verify": self.peak("verify", packed),
            "decompress": self.peak("decompress", packed, "-o", back),
        }
        os.remove(back)
        return peaks

    def info(self):
        """Runs shm info. Returns the number of active vertices, and the largest resident size of the tool in
        bytes. An intermediate program starts the tool, so that the memory of this script does not count."""
        run = subprocess.run(["/usr/bin/time", "-f", "%M", SHM, "info", "-v", self.path("mesh.shm")],
                             capture_output=True, text=True, check=True)
        width = next(line for line in run.stdout.splitlines() if line.startswith("width"))
        return int(width.split()[1]), 1024 * int(run.stderr)

    def test_memory_follows_the_width(self):
        sanitized = is_sanitized()
        side_lists = [(12, 20)] if sanitized else [(40, 160), (160, 10)]
        for side, layers in side_lists:
            for order, level in [("keep", "default"), ("stream", "fast")]:
                with self.subTest(side=side, order=order, level=level):
                    seen = []
                    for times in (1, 4):
                        mesh = self.path("mesh.vtk")
                        write_block(mesh, side, times * layers)
                        peaks = self.peaks(mesh, order, level)
                        active, of_info = self.info()
                        seen.append(peaks)
                        print(side, times * layers, order, level, "active", active,
                              {name: peak // 1024 for name, peak in peaks.items()},
                              "info", of_info // 1024, flush=True)
                        if sanitized:
                            continue
                        for name, peak in peaks.items():
                            bound = (BASE[name] + FOR_MEMORY_OPTION +
                                     active * FOR_ACTIVE_VERTEX[name])
                            self.assertLessEqual(peak, bound, name)
                        self.assertLessEqual(of_info, INFO, "info")
                    if not sanitized:
                        for name in seen[0]:
                            self.assertLessEqual(seen[1][name], seen[0][name] + SAME, name)


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
