#!/usr/bin/env python3
"""Tests shm_mpi compress with a decomposed Exodus mesh. The program must write the same bytes as for the
whole mesh, or report a single error that names a part.

Usage: mpi_joined_test.py PATH_OF_SHM PATH_OF_SHM_MPI PATH_OF_SHM_MAKE_MESH
"""
import os
import shutil
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import mpi_ranks
from decomposed import Split, interleaved, whole_text
from mpi_ranks import CORPUS, Exodus, Joined, RanksTest, ranks, shm
from sample_meshes import mixed_vtk


class JoinedTest(RanksTest):
    NEEDS = ("mpirun", "ncgen", "ncdump")

    def split(self, count, owner=interleaved, n=5, kind="64-bit-offset", base=1, **how):
        """Creates a mesh and its parts. Returns the path of the whole mesh, and the common beginning of the
        paths of its parts."""
        whole = self.ncgen("whole.e", whole_text(n, **how), kind)
        split = Split(whole, owner, count, base)
        for part in range(count):
            self.ncgen(f"mesh.e.{count}.{part:0{len(str(count))}}", split.text(part), kind)
        return whole, self.path(f"mesh.e.{count}")

    def expect_joined(self, whole, parts, counts, *options):
        self.expect_same(whole, counts, *options, parts=parts)

    # --- identical files

    def test_interleaved_cells(self):
        whole, parts = self.split(4)
        for order in (["keep"], ["stream"], ["stream", "--delay", "30"], ["keep", "--delay", "9"]):
            self.expect_joined(whole, parts, (1, 2, 3, 4, 6), "--segment-cells", 40, "--order", *order)

    def test_consecutive_cells_and_numbers_from_nought(self):
        whole, parts = self.split(3, lambda cell: cell // 60, base=0)
        self.expect_joined(whole, parts, (1, 2, 4), "--segment-cells", 50)

    def test_kinds_of_files(self):
        for kind in ("classic", "64-bit-data"):
            whole, parts = self.split(2, n=4, kind=kind)
            self.expect_joined(whole, parts, (3,), "--segment-cells", 30)
        # The result stores the netCDF chunk sizes of the first part, so it may differ from the result for the
        # whole mesh.
        whole, parts = self.split(2, n=4, kind="netCDF-4 classic model")
        self.expect_own_file(whole, parts, (3,))

    def test_one_part(self):
        whole, parts = self.split(1, n=3)
        self.expect_joined(whole, parts, (1, 3), "--segment-cells", 10)

    def test_bounds_and_levels(self):
        whole, parts = self.split(3)
        for options in (["--rel", "1e-3"], ["--bits", "12"], ["--abs", "1e-2", "--level", "best"],
                        ["--level", "fast", "--threads", "2"], ["--key-steps", "1"],
                        ["--array", "heat:rel=1e-2", "--array", "p:abs=.1"]):
            self.expect_joined(whole, parts, (2,), "--segment-cells", 40, *options)

    def test_delay_that_is_tried(self):
        whole, parts = self.split(2, lambda cell: cell // 1000, n=29, steps=1)
        self.expect_joined(whole, parts, (2,), "--segment-cells", 9000, "--order", "stream")

    def test_parts_without_elements_of_some_blocks(self):
        # The first part contains only cells of the first block. The order of names therefore differs from the
        # order in the file of the whole mesh.
        whole, parts = self.split(5, lambda cell: cell // 45)
        self.expect_own_file(whole, parts, (1, 3))

    def test_more_parts_than_elements(self):
        whole, parts = self.split(50, n=3, sets=False)
        self.expect_own_file(whole, parts, (2,))
        whole, parts = self.split(3, lambda cell: 1, n=3, sets=False)  # two parts have no elements
        self.expect_own_file(whole, parts, (2,))

    def expect_own_file(self, whole, parts, counts, *options):
        """Compresses parts that do not result in the same bytes as the whole mesh, e.g. because the order of
        names differs. Checks that the resulting file contains the whole mesh, and that decompressing this file
        and compressing it again restores the same bytes."""
        done = ranks(2, "compress", parts, "-o", self.path("first.shm"), "-q", "--segment-cells", 40)
        self.assertEqual(done.returncode, 0, done.stderr)
        back = self.path("back.e")
        done = shm("decompress", self.path("first.shm"), "-o", back)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.expect_joined(back, parts, counts, "--segment-cells", 40, *options)
        mine, all_of_it = Joined([Exodus(back)]).in_order(), Joined([Exodus(whole)]).in_order()
        for kind, values in all_of_it.items():
            self.assertTrue(mine[kind] == values, kind)

    # --- parts that shm_mpi wrote itself

    def expect_back(self, mesh, n, *options):
        packed, out = self.path("packed"), self.path("out.e")
        self.assertEqual(shm("compress", mesh, "-o", packed, "-q", *options).returncode, 0)
        done = ranks(n, "decompress", packed, "-o", out, "-q")
        self.assertEqual(done.returncode, 0, done.stderr)
        joined, back = self.path("first.shm"), self.path("back.e")
        done = ranks(2, "compress", f"{out}.{n}", "-o", joined, "-q", "--segment-cells", 60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(shm("decompress", joined, "-o", back).returncode, 0)
        self.expect_joined(back, f"{out}.{n}", (1, 3, 4), "--segment-cells", 60)
        self.expect_joined(back, f"{out}.{n}", (4,), "--segment-cells", 60, "--order", "stream")
        whole = self.path("whole.e")
        self.assertEqual(shm("decompress", packed, "-o", whole, "--format", "exodus").returncode, 0)
        mine, all_of_it = Joined([Exodus(back)]).in_order(), Joined([Exodus(whole)]).in_order()
        names = Exodus(whole).get("name_nod_var") + Exodus(whole).get("name_elem_var")
        for kind in ("nodal", "element"):  # attributes and other data have become fields
            mine[kind] = {key: v for key, v in mine[kind].items() if key[0] in names}
        for kind in ("nodes", "cells", "nodal", "element", "node sets", "side sets"):
            self.assertTrue(mine[kind] == all_of_it[kind], f"{kind} of {n} parts: {mesh}")
        for part in range(n):
            os.remove(f"{out}.{n}.{part}")

    def test_parts_of_shm_mpi(self):
        whole = self.ncgen("mesh.e", whole_text(5))
        for n in (1, 2, 4):
            self.expect_back(whole, n, "--segment-cells", 50)
        self.expect_back(whole, 3, "--order", "stream", "--delay", "20")
        mixed = self.path("mixed.vtk")
        with open(mixed, "w", encoding="ascii") as file:
            # The blocks alternate. NaNs are replaced, because ncdump does not distinguish the NaNs of Exodus
            # files.
            file.write(mixed_vtk(5).replace(" nan", " 1.5"))
        self.expect_back(mixed, 3, "--segment-cells", 30)

    def test_real_parts(self):
        parts = os.path.join(CORPUS, "exodus/moose__out.e.4")
        if not os.path.exists(parts + ".0"):
            self.skipTest("SHM_CORPUS has no parts")
        self.assertEqual(ranks(1, "compress", parts, "-o", self.path("first.shm"), "-q",
                               "--segment-cells", 500).returncode, 0)
        back = self.path("back.e")
        self.assertEqual(shm("decompress", self.path("first.shm"), "-o", back).returncode, 0)
        for order in (["keep"], ["stream"], ["stream", "--delay", "40"]):
            self.expect_joined(back, parts, (2, 3, 4), "--segment-cells", 500, "--order", *order)

    def test_parts_of_real_meshes(self):
        names = ("moose__ex02.e", "libmesh__nontrivial_elem_num_map.exo", "moab__mbtest1.g",
                 "moose__diffusion_3d_hex27_out.e")
        meshes = [os.path.join(CORPUS, "exodus", name) for name in names]
        meshes = [mesh for mesh in meshes if CORPUS and os.path.exists(mesh)]
        if not meshes:
            self.skipTest("SHM_CORPUS has no such files")
        for i, mesh in enumerate(meshes):
            self.expect_back(mesh, 2 + i % 3)

    # --- errors, on all ranks

    def expect_failure(self, words, code=3, n=3, parts=None):
        out = self.path("out.shm")
        done = ranks(n, "compress", parts or self.path("mesh.e.3"), "-o", out, "--segment-cells", 20)
        self.assertEqual(done.returncode, code, done.stderr)
        errors = [line for line in done.stderr.splitlines() if line.startswith("shm_mpi: ")]
        self.assertEqual(len(errors), 1, done.stderr)
        for word in [words] if isinstance(words, str) else words:
            self.assertIn(word, errors[0])
        self.assertFalse([name for name in os.listdir(self.directory.name) if "out" in name])

    def test_bad_parts(self):
        self.split(3, n=4)
        split = Split(self.path("whole.e"), interleaved, 3)
        good = [self.bytes(self.path(f"mesh.e.3.{p}")) for p in range(3)]

        def with_part(part, words, change, **how):
            self.ncgen(f"mesh.e.3.{part}", split.text(part, change, **how))
            self.expect_failure(words)
            with open(self.path(f"mesh.e.3.{part}"), "wb") as file:
                file.write(good[part])

        def put(name, place, value):
            """Returns a function that replaces one value of the variable `name`."""
            def change(variable, values):
                if variable == name:
                    values = list(values)
                    values[place] = value(values[place]) if callable(value) else value
                return values
            return change

        without = lambda name: lambda variable, values: None if variable == name else values
        shared = (set(split.nodes_of[1]) & set(split.nodes_of[0])).pop()
        where = split.nodes_of[1].index(shared)
        name = ["mesh.e.3.1"]
        with_part(1, name + ["'elem_num_map'", "twice"], put("elem_num_map", 1, split.cells_of[1][0] + 1))
        with_part(1, ["mesh.e.3.", "'elem_num_map'", "also in"],
                  put("elem_num_map", 1, split.cells_of[2][0] + 1))
        with_part(2, ["mesh.e.3.2", "'elem_num_map'", "also in", "mesh.e.3.0"],
                  put("elem_num_map", 0, split.cells_of[0][0] + 1))
        with_part(1, name + ["'elem_num_map'", "999999"], put("elem_num_map", 3, 999999))
        with_part(1, name + ["'elem_num_map'", "-5"], put("elem_num_map", 3, -5))
        with_part(1, name + ["'node_num_map'", "twice"], put("node_num_map", 1, split.nodes_of[1][0]))
        with_part(1, name + ["'node_num_map'", "2147483647"], put("node_num_map", 1, 2147483647))
        with_part(1, name + ["'elem_num_map'", "missing"], without("elem_num_map"))
        with_part(1, name + ["'node_num_map'", "missing"], without("node_num_map"))
        with_part(1, [f"node {shared} ", "coordinates"], put("coordy", where, 77.5))
        nodes = len(split.nodes_of[1])
        with_part(1, [f"node {shared} ", "array 'p'", "step 2"],
                  put("vals_nod_var2", 2 * nodes + where, 77.5))
        with_part(1, name + ["element"], put("connect2", 3, 100000))
        with_part(1, name + ["'elem_ss1'", "member"], put("elem_ss1", 0, 100000))
        with_part(1, ["'node_ns1'", "differ from"],
                  put("dist_fact_ns1", next(i for i, v in enumerate(v for v in split.file.get("node_ns1") if v in set(split.nodes_of[1])) if v in set(split.nodes_of[0])), 9.5))
        with_part(1, name + ["'dist_fact_ss1'", "distribution factors"], put("side_ss1", 0, 9))
        with_part(1, name + ["'time_whole'", "differ from"], put("time_whole", 1, 99.5))
        with_part(1, name + ["'eb_prop1'", "differ from"], put("eb_prop1", 1, 21))
        with_part(1, name + ["'vals_nod_var1'", "missing"], without("vals_nod_var1"))
        with_part(1, name + ["'vals_elem_var1eb1'", "missing"], without("vals_elem_var1eb1"))
        # Changes the number of a node that only this part contains, so no part contains the original number.
        lonely = next(v for v in split.nodes_of[2] if v not in split.nodes_of[0] + split.nodes_of[1])
        text = split.text(2, put("node_num_map", split.nodes_of[2].index(lonely),
                                 split.file.size("num_nodes") + 1), nemesis=False)
        self.ncgen("mesh.e.3.2", text)
        for p in (0, 1):
            self.ncgen(f"mesh.e.3.{p}", split.text(p, nemesis=False))
        self.expect_failure([f"node {lonely} is in no part", "'node_num_map'"])

    def test_parts_that_are_not_alike(self):
        self.split(3, n=4)
        for n, how, words in ((3, {"sets": False}, "mesh.e.3"), (4, {"steps": 2}, "'time_step'"),
                              (4, {"seed": 1}, "array 'u'")):
            other = self.ncgen("other.e", whole_text(n, **how))
            keep = self.bytes(self.path("mesh.e.3.1"))
            self.ncgen("mesh.e.3.1", Split(other, interleaved, 3).text(1))
            self.expect_failure(words)
            with open(self.path("mesh.e.3.1"), "wb") as file:
                file.write(keep)
        shutil.copy(self.path("mesh.e.3.0"), self.path("mesh.e.3.1"))
        self.expect_failure("mesh.e.3.")
        os.remove(self.path("mesh.e.3.1"))
        self.expect_failure("mesh.e.3.1")

    def test_damaged_parts(self):
        self.split(3, n=3)
        path, failures = self.path("mesh.e.3.1"), 0
        good, packed = self.bytes(path), self.path("out.shm")
        damages = [good[:len(good) * i // 5] for i in range(5)]
        damages += [good[:at] + bytes([good[at] ^ 0x41]) + good[at + 1:]
                    for at in range(5, min(len(good), 6000), 419)]
        for damaged in damages:
            with open(path, "wb") as file:
                file.write(damaged)
            done = ranks(2, "compress", self.path("mesh.e.3"), "-o", packed, "--segment-cells", 9,
                         "-q")
            if done.returncode == 0:
                self.assertEqual(shm("verify", packed, "-q").returncode, 0)
                os.remove(packed)
                continue
            failures += 1
            self.assertIn(done.returncode, (3, 5), done.stderr)
            errors = [line for line in done.stderr.splitlines() if line.startswith("shm_mpi: ")]
            self.assertEqual(len(errors), 1, done.stderr)
            self.assertFalse(os.path.exists(packed))
        self.assertGreater(failures, 8)

    def test_what_is_no_decomposed_mesh(self):
        self.split(3, n=3)
        for name in ("mesh.e", "mesh.e.2", "mesh.e.03", "mesh.e.3x", "mesh.e.99999999999999999999"):
            self.expect_failure("cannot be read", parts=self.path(name))
        # A part is a mesh too.
        done = ranks(2, "compress", self.path("mesh.e.3.1"), "-o", self.path("one.shm"), "-q",
                     "--segment-cells", 9)
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    mpi_ranks.run_all()
