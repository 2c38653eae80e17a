#!/usr/bin/env python3
"""Sets are stored as extras. Tests that the keys of these extras are the same for every format of the source.
Only files of version 0.9 have different keys, which are specific to Exodus.

sets_test.py SHM
"""
import json
import os
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))

from folder_test import FolderTest, forced
from sample_meshes import TWO_BLOCKS

SHM = "shm"
GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "0.9"

# The mesh TWO_BLOCKS with changed sets, so that the data of the sets follows from their members: all
# distribution factors are 1, and the id of each set is its position.
OF_ONES = (TWO_BLOCKS.replace("dist_fact_ss1 = 1, 1, 1, 1, 1, 1, 1, 2", "dist_fact_ss1 = 1, 1, 1, 1, 1, 1, 1, 1")
           .replace("ss_prop1 = 3", "ss_prop1 = 1"))
# The mesh TWO_BLOCKS with two unusual side sets. One has no members and the status 0. In the other, the
# number of factors differs from the number of nodes.
ODD = (TWO_BLOCKS.replace("num_side_sets = 1", "num_side_sets = 2").replace("ss_status = 1 ;", "ss_status = 1, 0 ;")
       .replace("ss_prop1 = 3", "ss_prop1 = 3, 9").replace('ss_names = "inlet"', 'ss_names = "inlet", ""')
       .replace("num_df_ss1 = 8", "num_df_ss1 = 1").replace("dist_fact_ss1 = 1, 1, 1, 1, 1, 1, 1, 2", "dist_fact_ss1 = 4")
       .replace("ns_status = 1", "ns_status = 7"))

# A Gmsh mesh with groups of surfaces and of volumes. One group has no name, and one group consists of two
# blocks.
GROUPS = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
2 7 "wall"
3 1 "steel"
3 5 "air"
$EndPhysicalNames
$Nodes
12
%s
$EndNodes
$Elements
5
1 3 2 7 1 1 2 3 4
2 3 2 9 2 9 10 11 12
3 5 2 1 1 1 2 3 4 5 6 7 8
4 5 2 5 2 5 6 7 8 9 10 11 12
5 3 2 7 3 5 6 7 8
$EndElements
""" % "\n".join(f"{i + 1} {(0, 1, 1, 0)[i % 4]} {(0, 0, 1, 1)[i % 4]} {i // 4}" for i in range(12))


class SetsTest(FolderTest):
    def shm(self, *words, code=0):
        done = subprocess.run([SHM, *forced(words)], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, code, f"shm {' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
        return done.stdout

    def keys(self, path):
        return [extra["key"] for extra in json.loads(self.shm("info", path, "--json"))["extras"]]

    def sets(self, path):
        return json.loads(self.shm("info", path, "--json"))["sets"]

    def dump(self, path):
        """Returns the text that ncdump prints for a netCDF file, without the name of the file."""
        self.need("ncdump")
        done = subprocess.run(["ncdump", "-p", "9,17", path], capture_output=True, text=True, check=True)
        return done.stdout.split("\n", 1)[1]

    def assert_comes_back(self, exodus, packed):
        self.shm("verify", packed, "--against", exodus)
        self.shm("decompress", packed, "-o", self.path("back.e"))
        self.assertEqual(self.dump(self.path("back.e")), self.dump(exodus))

    def test_keys_are_of_no_format(self):
        for text, wanted in (
                (TWO_BLOCKS, ["mesh/node_set/0/id", "mesh/node_set/0/name", "mesh/node_set/0/members",
                              "mesh/side_set/0/id", "mesh/side_set/0/name", "mesh/side_set/0/members",
                              "mesh/side_set/0/sides", "mesh/side_set/0/factors"]),
                (OF_ONES, ["mesh/node_set/0/id", "mesh/node_set/0/name", "mesh/node_set/0/members",
                           "mesh/side_set/0/name", "mesh/side_set/0/members", "mesh/side_set/0/sides"])):
            exodus, packed = self.ncgen("two.e", text), self.path("two.shm")
            self.shm("compress", exodus, "-o", packed)
            self.assertEqual(sorted(key for key in self.keys(packed) if "_set" in key), sorted(wanted))
            self.assertFalse([key for key in self.keys(packed) if "status" in key or "dist_fact" in key])
            self.assert_comes_back(exodus, packed)
            side = next(it for it in self.sets(packed) if it["kind"] == "side set")
            self.assertEqual((side["id"], side["name"], side["members"]),
                             ("1" if text == OF_ONES else "3", "inlet", 2))

    def test_odd_ones_come_back(self):
        exodus, packed = self.ncgen("odd.e", ODD), self.path("odd.shm")
        self.shm("compress", exodus, "-o", packed)
        self.assert_comes_back(exodus, packed)
        self.assertIn("exodus/variable/ns_status", self.keys(packed))
        self.assertNotIn("exodus/variable/ss_status", self.keys(packed))
        self.assertEqual([(it["kind"], it["id"]) for it in self.sets(packed)],
                         [("node set", "7"), ("side set", "3"), ("side set", "9")])
        for name in ("part.e", "part.shm", "part.vtk"):
            self.shm("extract", packed, self.path(name), "--set", "inlet")

    def test_old_files(self):
        for name, text in (("exodus_sets", TWO_BLOCKS), ("exodus_sets_of_ones", OF_ONES)):
            old, exodus = GOLDEN / (name + ".shm"), self.ncgen("two.e", text)
            self.assert_comes_back(exodus, old)
            fresh, again = self.path("fresh.shm"), self.path("again.shm")
            self.shm("compress", exodus, "-o", fresh)
            self.shm("compress", old, "-o", again)
            self.assertEqual(self.keys(old), self.keys(fresh))
            self.assertEqual(Path(again).read_bytes(), Path(fresh).read_bytes())
            self.assertEqual(self.sets(old), self.sets(fresh))
            for target in ("two.vtk", "two.vtu", "two.msh", "two.inp"):
                self.shm("decompress", old, "-o", self.path(target), "-q")
                before = Path(self.path(target)).read_bytes()
                self.shm("decompress", fresh, "-o", self.path(target), "-q")
                self.assertEqual(Path(self.path(target)).read_bytes(), before)
            for words in (["--set", "inlet"], ["--set", "fixed"], ["--block", "10"]):
                self.shm("extract", old, self.path("a.shm"), *words, "-q")
                self.shm("extract", fresh, self.path("b.shm"), *words, "-q")
                self.shm("diff", self.path("a.shm"), self.path("b.shm"))
            archive = self.path("both.shm")
            self.shm("join", old, fresh, "-o", archive)
            self.shm("decompress", archive, "--part", "fresh.shm", "-o", self.path("one.e"))
            self.assertEqual(self.dump(self.path("one.e")), self.dump(exodus))

    def test_steps_go_behind_an_old_file(self):
        exodus, grown = self.ncgen("two.e", TWO_BLOCKS), self.path("grown.shm")
        later = self.ncgen("later.e", TWO_BLOCKS.replace("time_whole = 0, 0.5, 2", "time_whole = 3, 4, 5"))
        shutil.copy(GOLDEN / "exodus_sets.shm", grown)
        self.shm("append", grown, later)
        self.shm("verify", grown)
        self.shm("decompress", grown, "-o", self.path("grown.e"))
        self.assertEqual(len(json.loads(self.shm("info", self.path("grown.e"), "--json"))["step_times"]), 6)
        # The new file equals the file before appending, except that it has more steps.
        self.shm("convert", self.path("grown.e"), self.path("first.e"), "--step", "0:3")
        self.assertEqual(self.sets(self.path("first.e")), self.sets(exodus))
        self.shm("diff", self.path("first.e"), exodus)

    def test_factors_go_into_a_piece(self):
        exodus, packed = self.ncgen("two.e", TWO_BLOCKS), self.path("two.shm")
        self.shm("compress", exodus, "-o", packed)
        piece = self.path("piece.e")
        self.shm("extract", packed, piece, "--block", "20")
        self.assertRegex(self.dump(piece), r"dist_fact_ss1 = 1, 1, 1, 2 ;")
        self.assertRegex(self.dump(piece), r"side_ss1 = 6 ;")

    def test_physical_groups(self):
        mesh, packed, back = self.write("groups.msh", GROUPS), self.path("groups.shm"), self.path("back.msh")
        self.shm("compress", mesh, "-o", packed)
        self.assertEqual([key for key in self.keys(packed) if key.startswith("mesh/")],
                         [f"mesh/element_set/{place}" for place in
                          ("0/id", "0/name", "0/blocks", "1/id", "1/blocks", "2/id", "2/name", "2/blocks",
                           "3/id", "3/name", "3/blocks")])
        self.assertNotIn("gmsh/section/1", self.keys(packed))  # the names
        self.assertEqual([(it["kind"], it["id"], it["name"], it["members"]) for it in self.sets(packed)
                          if it["kind"] == "element set"], [("element set", "9", "", 1)])
        self.assertEqual(sorted((it["kind"], it["id"], it["name"]) for it in self.sets(packed)),
                         [("element set", "9", ""), ("physical surface", "7", "wall"),
                          ("physical volume", "1", "steel"), ("physical volume", "5", "air")])
        old = GOLDEN / "gmsh_groups.shm"
        for file in (packed, old):
            self.shm("verify", file, "--against", mesh)
            self.shm("decompress", file, "-o", back)
            self.assertEqual(Path(back).read_text(), GROUPS)
        again = self.path("again.shm")
        self.shm("compress", old, "-o", again)
        self.assertEqual(Path(again).read_bytes(), Path(packed).read_bytes())
        for file, target in ((packed, self.path("new.e")), (old, self.path("old.e"))):
            self.shm("decompress", file, "-o", target, "-q")
            self.assertEqual([(it["kind"], it["id"], it["members"]) for it in self.sets(target)],
                             [("element set", "9", 1)])
        self.shm("extract", old, self.path("part.shm"), "--set", "element_set_9")

    def test_names_that_sets_do_not_tell_stay(self):
        for text in (GROUPS.replace("PhysicalNames\n3\n", 'PhysicalNames\n4\n1 8 "edge of nothing"\n', 1),
                     GROUPS.replace('3 1 "steel"', '3  1 "steel"')):
            mesh, packed, back = self.write("groups.msh", text), self.path("groups.shm"), self.path("back.msh")
            self.shm("compress", mesh, "-o", packed)
            self.assertIn("gmsh/section/1", self.keys(packed))
            self.shm("decompress", packed, "-o", back)
            self.assertEqual(Path(back).read_text(), text)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop())
    unittest.main()
