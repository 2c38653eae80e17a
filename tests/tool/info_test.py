#!/usr/bin/env python3
"""Tests that shm info shows the title, size, box, times, blocks, sets, and arrays with their ranges. Also
tests that every key in the JSON output of info, compress, verify and join is documented.

Usage: info_test.py PATH_OF_SHM
"""
import json
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import write_vtk

SHM = "shm"
SOURCE = Path(__file__).resolve().parents[2]

STEPS = """netcdf mesh {
dimensions:
  len_string = 33 ; len_line = 81 ; four = 4 ; time_step = UNLIMITED ; num_dim = 3 ; num_nodes = 8 ;
  num_elem = 1 ; num_el_blk = 1 ; num_el_in_blk1 = 1 ; num_nod_per_el1 = 8 ; num_nod_var = 1 ;
  len_name = 33 ;
variables:
  double time_whole(time_step) ;
  int eb_prop1(num_el_blk) ; eb_prop1:name = "ID" ;
  double coordx(num_nodes) ; double coordy(num_nodes) ; double coordz(num_nodes) ;
  char name_nod_var(num_nod_var, len_name) ;
  double vals_nod_var1(time_step, num_nodes) ;
  int connect1(num_el_in_blk1, num_nod_per_el1) ; connect1:elem_type = "HEX8" ;
  :api_version = 8.03f ; :version = 8.03f ; :floating_point_word_size = 8 ; :file_size = 1 ;
  :title = "%s" ;
data:
  time_whole = %s ;
  eb_prop1 = 7 ;
  coordx = 0, 2, 2, 0, 0, 2, 2, 0 ; coordy = 0, 0, 1, 1, 0, 0, 1, 1 ;
  coordz = -3, -3, -3, -3, 5, 5, 5, 5 ;
  name_nod_var = "T" ;
  vals_nod_var1 = %s ;
  connect1 = 1, 2, 3, 4, 5, 6, 7, 8 ;
}
"""


class InfoTest(FolderTest):
    def shm(self, *words):
        return subprocess.run([SHM, *words], cwd=self.directory.name, check=True, capture_output=True,
                              text=True, timeout=60).stdout

    def steps(self, title="a box"):
        times = ", ".join(f"{step / 4}" for step in range(20))
        values = ", ".join("NaN" if (step, v) == (3, 2) else str(step - v) for step in range(20)
                           for v in range(8))
        self.ncgen("mesh.e", STEPS % (title, times, values))
        self.shm("compress", "mesh.e")

    def test_cells_of_higher_order(self):
        golden = Path(__file__).resolve().parents[1] / "golden" / "0.10"
        text = self.shm("info", str(golden / "grid_nodes.shm"))
        self.assertIn("id 1: 8 cells, hexahedron of 64 nodes, order 3\n", text)
        blocks = json.loads(self.shm("info", "--json", str(golden / "grid_nodes.shm")))["blocks"]
        self.assertEqual([block["order"] for block in blocks], [3, 4, 2])
        blocks = json.loads(self.shm("info", "--json", str(golden / "second_order.shm")))["blocks"]
        orders = {(block["shape"], block["nodes_per_cell"]): block["order"] for block in blocks}
        self.assertEqual(orders["hexahedron", 8], 1)
        self.assertEqual(orders["hexahedron", 20], 2)
        self.assertEqual(orders["pyramid", 13], 2)
        self.assertIsNone(orders["hexahedron", 22])

    def test_what_an_engineer_reads_first(self):
        self.steps()
        for name in ("mesh.e", "mesh.e.shm"):
            text = self.shm("info", name)
            for line in ("title        'a box'", "source       exodus",
                         "box          x 0 to 2, y 0 to 1, z -3 to 5",
                         "time         20 steps, times 0, 0.25, 0.5, ..., 4.75",
                         "  id 7: 1 cell, hexahedron of 8 nodes",
                         "  'T': point data, 1 x float64, each step, -7 to 19, 1 not finite"):
                self.assertIn(line + "\n", text)
            self.assertNotIn("streams", text)
            self.assertEqual(self.shm("info", "--ranges", name), text)
            self.assertNotIn('"range"', self.shm("info", "--json", name))
            report = json.loads(self.shm("info", "--ranges", "--json", name))
            self.assertEqual(report["box"], [0, 0, -3, 2, 1, 5])
            array = next(a for a in report["arrays"] if a["name"] == "T")
            self.assertEqual((array["range"], array["not_finite"]), ([-7, 19], 1))
            self.assertEqual(report["title"], "a box")
        self.assertRegex(self.shm("info", "mesh.e.shm"),
                         r"size         \d+ bytes from 1504 of numbers in memory, ")
        self.assertIn("\nstreams ", self.shm("info", "-v", "mesh.e.shm"))

    def test_large_values_are_read_when_asked_for(self):
        write_vtk(self.path("large.vtk"), 60)
        self.shm("compress", "--level", "fast", "large.vtk")
        self.assertIn("arrays (--ranges reads their values)\n", self.shm("info", "large.vtk.shm"))
        self.assertRegex(self.shm("info", "--ranges", "large.vtk.shm"), r"arrays\n  'heat': .* to ")

    def test_values_that_cannot_be_read(self):
        write_vtk(self.path("mesh.vtk"), 12)
        self.shm("compress", "mesh.vtk")
        whole = self.shm("info", "mesh.vtk.shm")
        file = bytearray(self.bytes(self.path("mesh.vtk.shm")))
        file[len(file) // 2] ^= 1
        with open(self.path("mesh.vtk.shm"), "wb") as out:
            out.write(file)
        damaged = self.shm("info", "mesh.vtk.shm")
        self.assertIn("arrays (not all values can be read: see shm verify)\n", damaged)
        self.assertEqual(damaged.split("arrays")[0], whole.split("arrays")[0])

    def test_names_move_no_cursor(self):
        self.steps(title="a\\033[2Jb\\000\\000")
        text = self.shm("info", "mesh.e.shm")
        self.assertIn("title        'a?[2Jb'\n", text)
        self.assertNotIn("\033", text)

    def keys_of(self, value, prefix=""):
        """Returns the names of all keys in a JSON value, including the keys of objects in lists. For a map
        from names of streams or arrays to their data, the names themselves are not returned."""
        found = set()
        if isinstance(value, list):
            for item in value:
                found |= self.keys_of(item, prefix)
        elif isinstance(value, dict):
            if value and all(isinstance(v, (dict, int)) for v in value.values()) and \
                    prefix in ("streams.", "arrays."):
                for item in value.values():
                    found |= self.keys_of(item, prefix)
                return found
            for key, item in value.items():
                found.add(prefix + key)
                # The members of an archive are described with the same keys as a single file.
                inner = prefix if key == "members" else prefix + key + "."
                found |= self.keys_of(item, inner)
        return found

    def test_every_key_is_documented(self):
        self.steps()
        write_vtk(self.path("mesh.vtk"), 4)
        documented = dict(re.findall(r"^\| `(\w+) --json` \| (.*) \|$",
                                     (SOURCE / "docs" / "tool.md").read_text(), re.MULTILINE))
        runs = {"compress": [["mesh.vtk", "-f"], ["mesh.e", "-f"]],
                "info": [["mesh.e.shm", "--ranges"], ["mesh.e"], ["mesh.vtk.shm"], ["all.shm"]],
                "verify": [["mesh.e.shm"], ["mesh.e.shm", "--against", "mesh.e"], ["strays.shm"]],
                "join": [["-o", "all.shm", "mesh.vtk", "mesh.e", "-f"]],
                "preview": [["mesh.vtk", "-f"], ["mesh.e", "-f", "--array", "T@0"]],
                "surface": [["mesh.vtk", "-f"], ["mesh.e", "-f", "--array", "T@0"]]}
        self.assertEqual(sorted(documented), sorted(runs))
        self.shm("join", "-o", "all.shm", "mesh.vtk", "mesh.e")
        self.shm("compress", "mesh.vtk")
        with open(self.path("strays.shm"), "wb") as out:
            out.write(self.bytes("mesh.e.shm") + b"stray")
        for command, variants in runs.items():
            listed = set(re.findall(r"`(\w[\w.]*)`", documented[command]))
            printed = set()
            for words in variants:
                done = subprocess.run([SHM, command, *words, "--json"], cwd=self.directory.name,
                                      capture_output=True, text=True, timeout=60)
                printed |= self.keys_of(json.loads(done.stdout))
            with self.subTest(command=command):
                self.assertLessEqual(printed, listed)
                rare = {"parity", "parity_blocks", "damaged_blocks", "damaged_parity_packets", "error",
                        "damage", "quantized.what", "quantized.largest_error",
                        "quantized.promised_error", "quantized.rms_error", "quantized.psnr",
                        "sets.kind", "sets.id", "sets.name", "sets.members"}
                self.assertLessEqual(listed - rare, printed)


if __name__ == "__main__":
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
