#!/usr/bin/env python3
"""Tests shm_mpi. The ranks of an MPI program must write the same bytes as shm, or all of them must fail. If
the parts that the ranks write are joined by their number maps, the result must equal the mesh that shm
writes.

Usage: mpi_test.py PATH_OF_SHM PATH_OF_SHM_MPI PATH_OF_SHM_MAKE_MESH
"""
import glob
import json
import os
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import mpi_ranks
from mpi_ranks import CORPUS, Exodus, Joined, RanksTest, ranks, shm
from sample_meshes import exodus_text, mixed_vtk

class MpiTest(RanksTest):
    def steps(self, count, n):
        return self.ncgen("run.e", exodus_text(list(range(count)), n), "classic")

    def expect_nothing_left(self):
        self.assertEqual([name for name in os.listdir(self.directory.name) if "shm" in name], [])

    def test_made_meshes_in_both_orders(self):
        for family in ("grid", "ogrid", "shuffled"):
            mesh = self.made(family, 4000)
            for order in ("keep", "stream"):
                self.expect_same(mesh, (1, 2, 3, 4), "--segment-cells", 700, "--order", order)

    def test_levels_codecs_and_bounds(self):
        mesh = self.made("ogrid", 40000)
        for options in (["--level", "fast"], ["--codec", "shifts"], ["--rel", "1e-4"],
                        ["--codec", "shifts", "--order", "stream", "--delay", "0"],
                        ["--level", "fast", "--threads", "2"]):
            self.expect_same(mesh, (3,), "--segment-cells", 17000, *options)
        mesh = self.made("swept", 4000)
        for options in (["--level", "best"], ["--codec", "paper"],
                        ["--bits", "12", "--order", "stream"]):
            self.expect_same(mesh, (2, 4), "--segment-cells", 500, *options)

    def test_delay_buffers(self):
        mesh = self.made("grid", 3000)
        self.expect_same(mesh, (2, 3), "--segment-cells", 500, "--order", "stream", "--delay", 40)
        self.expect_same(mesh, (3,), "--segment-cells", 501, "--order", "keep", "--delay", 20)
        # No --delay is given, so a trial determines the size of the delay buffer.
        self.expect_same(self.made("shuffled", 9000), (2,), "--segment-cells", 3000, "--order",
                         "stream")

    def test_blocks_of_several_kinds_and_unused_points(self):
        mesh = self.write("mixed.vtk", mixed_vtk(8))
        for order in (["keep"], ["stream"], ["stream", "--delay", "30"]):
            self.expect_same(mesh, (1, 3, 4), "--segment-cells", 100, "--order", *order)

    def test_steps_sets_and_arrays_on_some_blocks(self):
        mesh = self.steps(12, 8)
        for order in (["keep"], ["stream"], ["stream", "--delay", "25"], ["keep", "--delay", "9"]):
            self.expect_same(mesh, (1, 2, 4), "--segment-cells", 60, "--order", *order)
        self.expect_same(mesh, (3,), "--segment-cells", 60, "--key-steps", 1)
        self.expect_same(mesh, (3,), "--segment-cells", 60, "--key-steps", 5, "--level", "best")
        self.expect_same(mesh, (3,), "--segment-cells", 60, "--abs", "1e-3")

    def test_more_ranks_than_segments(self):
        mesh = self.steps(3, 3)
        self.expect_same(mesh, (4,), "--segment-cells", 20)
        self.expect_same(mesh, (3,), "--segment-cells", 1000, "--order", "stream")
        nothing = self.write("nothing.vtk", "# vtk DataFile Version 3.0\nt\nASCII\n"
                             "DATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
                             "CELLS 0 0\nCELL_TYPES 0\n")
        self.expect_same(nothing, (1, 3), "--segment-cells", 8)

    def test_a_file_of_shm_is_read_too(self):
        mesh = self.steps(3, 6)
        inner = self.path("inner.shm")
        self.assertEqual(shm("compress", mesh, "-o", inner, "-q").returncode, 0)
        self.expect_same(inner, (3,), "--segment-cells", 50)

    def test_real_meshes(self):
        if not os.path.isdir(CORPUS):
            self.skipTest("SHM_CORPUS names no folder")
        names = ("exodus/libmesh__Cube_With_Sidesets.e", "exodus/moose__ex02.e",
                 "exodus/moose__master_out.e", "exodus/moab__mbtest1.g",
                 "exodus/libmesh__nontrivial_elem_num_map.exo", "exodus/moose__out.e.4.2",
                 "exodus/moose__diffusion_3d_hex27_out.e", "exodus/vtk-data__disk_out_ref.ex2",
                 "gmsh/arcanefem__bar_3D_hex_tetra_pyramids.msh", "gmsh/sofa__cylinder_Hexa.msh",
                 "other/vtk-data__can.vtu", "other/dealii__gerold_1.inp",
                 "vtk/mesquite__mixed-hex-pyr-tet.vtk", "vtk/vtk-data__AngularSector.vtk")
        meshes = [os.path.join(CORPUS, name) for name in names]
        meshes = [mesh for mesh in meshes if os.path.exists(mesh)]
        self.assertGreater(len(meshes), 0)
        for i, mesh in enumerate(meshes):
            cells = json.loads(shm("info", mesh, "--json").stdout)["cells"]
            for order in (["keep"], ["stream"], ["stream", "--delay", "40"]):
                self.expect_same(mesh, (2 + i % 3,), "--segment-cells", max(1, cells // 6),
                                 "--order", *order)

    # --- parts of a decomposed mesh

    def decompressed(self, mesh, n, *options):
        """Compresses a mesh with some options. Decompresses the result to parts with n ranks, and to a single
        file with shm. Returns the paths of the parts and the path of the single file."""
        packed, whole, out = self.path("packed"), self.path("whole.e"), self.path("out.e")
        done = shm("compress", mesh, "-o", packed, "-q", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(shm("decompress", packed, "-o", whole, "-q").returncode, 0)
        done = ranks(n, "decompress", packed, "-o", out, "-q")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout, "")
        parts = [f"{out}.{n}.{r}" for r in range(n)]
        self.assertEqual(sorted(glob.glob(out + "*")), parts)
        return parts, whole

    def expect_parts(self, mesh, n, *options):
        if not shutil.which("ncdump"):
            self.skipTest("ncdump is not installed")
        paths, path = self.decompressed(mesh, n, *options)
        parts, whole = [Exodus(part) for part in paths], Exodus(path)
        for part in parts:
            for name in ("num_el_blk", "num_node_sets", "num_side_sets"):
                self.assertEqual(part.size(name), whole.size(name), name)
            for name in ("eb_prop1", "ns_prop1", "ss_prop1", "eb_names", "ns_names", "ss_names",
                         "time_whole"):
                if any(whole.get(name)) and 0 not in whole.get(name):  # 0 is not a valid number of a set
                    self.assertEqual(part.get(name), whole.get(name), name)
            # A part may have more variables than the whole mesh: if the source was an Exodus file, its
            # attributes are also stored as variables.
            names = [] if part.size("num_nodes") == 0 else whole.get("name_nod_var")
            self.assertEqual(part.get("name_nod_var")[:len(names)], names)
            names = whole.get("name_elem_var")
            self.assertEqual(part.get("name_elem_var")[:len(names)], names)
            # Values that are float in the whole mesh are stored as double in the parts. They must be equal.
            part.types.update({k: v for k, v in whole.types.items() if v == "float"})
            for name, kind in part.types.items():
                if kind == "float" and name in part.values:
                    part.values[name] = [Exodus.number("float", v) for v in part.values[name]]
        expected, got = Joined([whole]).in_order(), Joined(parts, whole).in_order()
        for kind in ("nodal", "element"):
            of_whole = whole.get("name_nod_var") + whole.get("name_elem_var")
            got[kind] = {key: v for key, v in got[kind].items() if key[0] in of_whole}
        for kind, values in expected.items():
            self.assertTrue(got[kind] == values, f"{kind} of {n} parts: {mesh} {options}")
        for part in paths:
            os.remove(part)
        return parts

    def test_parts_of_made_meshes(self):
        for family in ("grid", "shuffled"):
            mesh = self.made(family, 1000)
            for n, order in ((1, "keep"), (2, "stream"), (3, "keep"), (4, "stream")):
                self.expect_parts(mesh, n, "--segment-cells", 150, "--order", order)
        # One segment, which all ranks decode.
        self.expect_parts(mesh, 3)
        self.expect_parts(mesh, 3, "--order", "free")

    def test_parts_of_several_blocks_and_unused_points(self):
        mesh = self.write("mixed.vtk", mixed_vtk(6))
        for options in ([], ["--segment-cells", "50"], ["--segment-cells", "50", "--delay", "20"],
                        ["--segment-cells", "77", "--order", "stream"]):
            for n in (1, 2, 4):
                self.expect_parts(mesh, n, *options)

    def test_parts_with_steps_sets_and_maps(self):
        mesh = self.steps(5, 6)
        for options in ([], ["--segment-cells", "40"], ["--segment-cells", "40", "--delay", "9"],
                        ["--segment-cells", "30", "--order", "stream", "--delay", "9"]):
            for n in (2, 3):
                self.expect_parts(mesh, n, *options)
        try:
            from extract_test import Grid
        except (ImportError, SystemExit):
            self.skipTest("NumPy or VTK is missing")
        Grid().write(self.path("grid.e"))
        for n, options in ((1, []), (2, ["--order", "stream"]), (3, ["--segment-cells", "100"]),
                           (4, ["--segment-cells", "64", "--delay", "20"])):
            parts = self.expect_parts(self.path("grid.e"), n, *options)
        # A part lists all blocks and sets of the mesh, even those of which it contains no members.
        self.assertEqual(parts[0].get("eb_prop1"), [10, 20, 30])
        self.assertEqual(parts[0].get("eb_status")[2], 0)
        self.assertEqual(parts[3].get("ns_status"), [0])
        self.assertEqual(parts[3].get("ns_names"), ["fixed"])

    def test_parts_of_blocks_that_an_array_tells(self):
        text = mixed_vtk(4).replace("SCALARS heat double 1", "SCALARS BlockId int 1")
        lines = text.splitlines()
        first = lines.index("LOOKUP_TABLE default") + 1
        cells = int(next(line for line in lines if line.startswith("CELL_DATA")).split()[1])
        # Some blocks exist only in some parts.
        lines[first:first + cells] = [str(7 + 5 * (c // 40) + c % 2) for c in range(cells)]
        mesh = self.write("blocks.vtk", "\n".join(lines) + "\n")
        parts = self.expect_parts(mesh, 3)
        self.assertGreater(parts[0].size("num_el_blk"), 4)

    def test_more_ranks_than_cells(self):
        self.expect_parts(self.made("grid", 1), 3)
        cell = "CELLS 1 9\n8 0 1 3 2 4 5 7 6\nCELL_TYPES 1\n12\n"
        points = "\n".join(f"{p % 2} {p // 2 % 2} {p // 4}" for p in range(10))
        head = f"# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 float\n{points}\n"
        self.expect_parts(self.write("one.vtk", head + cell), 4)
        self.expect_parts(self.write("none.vtk", head + "CELLS 0 0\nCELL_TYPES 0\n"), 2)

    def test_parts_can_be_compressed_and_joined(self):
        paths, _ = self.decompressed(self.steps(2, 6), 3, "--segment-cells", 40)
        done = shm("join", "-o", self.path("joined.shm"), *paths)
        self.assertEqual(done.returncode, 0, done.stderr)
        os.mkdir(self.path("back"))
        done = shm("split", self.path("joined.shm"), "--directory", self.path("back"))
        self.assertEqual(done.returncode, 0, done.stderr)
        for part in paths:
            back = os.path.join(self.path("back"), os.path.basename(part))
            self.assertEqual(shm("diff", back, part).returncode, 0)

    def test_parts_of_real_meshes(self):
        if not os.path.isdir(CORPUS):
            self.skipTest("SHM_CORPUS names no folder")
        names = ("exodus/moose__ex02.e", "exodus/libmesh__nontrivial_elem_num_map.exo",
                 "exodus/moab__mbtest1.g", "exodus/moose__diffusion_3d_hex27_out.e",
                 "gmsh/arcanefem__bar_3D_hex_tetra_pyramids.msh", "other/vtk-data__can.vtu",
                 "vtk/mesquite__mixed-hex-pyr-tet.vtk")
        meshes = [os.path.join(CORPUS, name) for name in names]
        meshes = [mesh for mesh in meshes if os.path.exists(mesh)]
        self.assertGreater(len(meshes), 0)
        for i, mesh in enumerate(meshes):
            cells = json.loads(shm("info", mesh, "--json").stdout)["cells"]
            for order in ("keep", "stream"):
                self.expect_parts(mesh, 2 + i % 3, "--segment-cells", max(1, cells // 6), "--order",
                                  order)

    # --- errors, on all ranks

    def expect_failure(self, code, words, *arguments, n=3):
        done = ranks(n, *arguments)
        self.assertEqual(done.returncode, code, done.stderr)
        # Exactly one rank reports the error.
        errors = [line for line in done.stderr.splitlines() if line.startswith("shm_mpi: ")]
        self.assertEqual(len(errors), 1, done.stderr)
        self.assertIn(words, errors[0])
        self.expect_nothing_left()

    def test_wrong_use(self):
        mesh = self.made("grid", 100, "none")
        out = ["-o", self.path("out.shm")]
        self.expect_failure(2, "--segment-cells", "compress", mesh, *out)
        self.expect_failure(2, "--order free", "compress", mesh, *out, "--segment-cells", 9,
                            "--order", "free")
        self.expect_failure(2, "standard input", "compress", "-", *out, "--segment-cells", 9)
        self.expect_failure(2, "--nonsense", "compress", mesh, *out, "--nonsense")
        self.expect_failure(2, "--memory", "compress", mesh, *out, "--segment-cells", 9, "--memory",
                            "foo")
        self.expect_failure(2, "--temp", "compress", mesh, *out, "--segment-cells", 9, "--temp",
                            self.path("nowhere"))
        self.expect_failure(2, "exclude each other", "compress", mesh, *out, "--segment-cells", 9,
                            "--abs", "1", "--rel", "1")
        self.expect_failure(2, "shifts", "compress", mesh, *out, "--segment-cells", 9, "--codec",
                            "shifts", "--order", "stream", "--delay", 5)

    def test_unreadable_input(self):
        out = ["-o", self.path("out.shm"), "--segment-cells", 20]
        self.expect_failure(3, "absent.vtk", "compress", self.path("absent.vtk"), *out)
        # Only one rank reads the cell with an invalid vertex number.
        text = mixed_vtk(4).splitlines()
        first = next(i for i, line in enumerate(text) if line.startswith("CELLS"))
        count = int(text[first].split()[1])
        for place in (1, count // 2, count):
            lines = list(text)
            corners = lines[first + place].split()
            lines[first + place] = " ".join(corners[:-1] + ["99999"])
            mesh = self.write("bad.vtk", "\n".join(lines) + "\n")
            self.expect_failure(3, f"cell {place - 1}", "compress", mesh, *out)

    def test_hostile_files_of_shm(self):
        mesh, inner = self.steps(3, 5), self.path("inner")
        self.assertEqual(shm("compress", mesh, "-o", inner, "-q", "--segment-cells", 30).returncode, 0)
        good = self.bytes(inner)
        for at in (40, len(good) // 3, len(good) - 20):
            damaged = self.path("damaged")
            with open(damaged, "wb") as file:
                file.write(good[:at] + bytes([good[at] ^ 0x55]) + good[at + 1:])
            alone = shm("compress", damaged, "-o", self.path("alone"), "-q")
            done = ranks(3, "compress", damaged, "-o", self.path("out.shm"), "--segment-cells", 20,
                         "-q")
            self.assertEqual(done.returncode, alone.returncode, done.stderr)
            if done.returncode != 0:
                self.expect_nothing_left()

    def test_output_that_cannot_be_written(self):
        mesh = self.made("ogrid", 20000)
        self.expect_failure(4, "no/such/folder", "compress", mesh, "-o",
                            self.path("no/such/folder/out.shm"), "--segment-cells", 2000)
        os.mkdir(self.path("folder"))
        self.expect_failure(4, "is a folder", "compress", mesh, "-o", self.path("folder"),
                            "--segment-cells", 2000)

    # --- parts that cannot be written

    def packed(self, mesh, *options):
        packed = self.path("packed")
        self.assertEqual(shm("compress", mesh, "-o", packed, "-q", *options).returncode, 0)
        return packed

    def left(self):
        """Returns the names of all files that belong to parts of the output, finished or not."""
        return sorted(name for name in os.listdir(self.directory.name) if "out." in name)

    def test_wrong_use_of_decompress(self):
        packed, out = self.packed(self.steps(2, 3)), self.path("out.e")
        self.expect_failure(2, "standard input", "decompress", "-", "-o", out)
        self.expect_failure(2, "standard input", "decompress", packed, "-o", "-")
        self.expect_failure(2, "--format exodus", "decompress", packed, "-o", self.path("out.vtk"))
        self.expect_failure(2, "out.what", "decompress", packed, "-o", self.path("out.what"))
        self.expect_failure(2, "there is no step 2", "decompress", packed, "-o", out, "--step", 2)
        self.expect_failure(2, "--threads", "decompress", packed, "-o", out, "--threads", 2)
        self.expect_failure(3, "absent", "decompress", self.path("absent"), "-o", out)
        self.expect_failure(3, "is not a .shm file", "decompress", self.path("run.e"), "-o", out)
        self.assertEqual(self.left(), [])
        # Nothing is missing, not even global variables.
        done = ranks(3, "decompress", packed, "-o", out, "--strict")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(len(self.left()), 3)

    def test_one_step_under_another_name(self):
        packed = self.packed(self.steps(3, 3), "--segment-cells", 10)
        done = ranks(2, "decompress", packed, "-o", self.path("out.what"), "--format", "exodus",
                     "--step", 1)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.left(), ["out.what.2.0", "out.what.2.1"])
        self.assertIn("1 time step", shm("info", self.path("out.what.2.1")).stdout)

    def test_names_have_as_many_digits_as_the_number_of_ranks(self):
        packed = self.packed(self.made("grid", 60, "none"))
        done = ranks(10, "decompress", packed, "-o", self.path("out.e"), "-q")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.left(), [f"out.e.10.0{r}" for r in range(10)])

    def test_cells_that_make_no_parts(self):
        lines = self.write("lines.vtk", "# vtk DataFile Version 3.0\nt\nASCII\n"
                           "DATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 2 2 0\n"
                           "CELLS 2 7\n2 0 1\n3 1 2 3\nCELL_TYPES 2\n4\n4\n")
        self.expect_failure(3, "different numbers of vertices", "decompress", self.packed(lines), "-o",
                            self.path("out.e"))
        self.assertEqual(self.left(), [])

    def test_hostile_files_make_no_parts(self):
        packed, out = self.packed(self.steps(3, 5), "--segment-cells", 30), self.path("out.e")
        parts = [f"{out}.3.{r}" for r in range(3)]
        self.assertEqual(ranks(3, "decompress", packed, "-o", out, "-q").returncode, 0)
        good, wanted, failures = self.bytes(packed), [self.bytes(part) for part in parts], 0
        places = [len(good) * i // 12 + 5 for i in range(12)] + [len(good) - 20]
        for damaged in ([good[:at] + bytes([good[at] ^ 0x55]) + good[at + 1:] for at in places] +
                        [good[:at] for at in places]):
            for name in self.left():
                os.remove(self.path(name))
            with open(packed, "wb") as file:
                file.write(damaged)
            done = ranks(3, "decompress", packed, "-o", out, "-q")
            if done.returncode == 0:
                self.assertTrue([self.bytes(part) for part in parts] == wanted)
                continue
            failures += 1
            self.assertIn(done.returncode, (3, 5), done.stderr)
            errors = [line for line in done.stderr.splitlines() if line.startswith("shm_mpi: ")]
            self.assertEqual(len(errors), 1, done.stderr)
            self.assertEqual(self.left(), [])
        self.assertGreater(failures, len(places))

    def test_parts_that_cannot_be_written(self):
        packed = self.packed(self.steps(2, 6), "--segment-cells", 50)
        self.expect_failure(4, "no/such/folder", "decompress", packed, "-o",
                            self.path("no/such/folder/out.e"))
        # If one rank cannot write its part, the other ranks do not write their parts either, and existing
        # files remain.
        os.mkdir(self.path("out.e.3.1"))
        self.write("out.e.3.0", "old")
        self.expect_failure(4, "is a folder", "decompress", packed, "-o", self.path("out.e"))
        self.assertEqual(self.left(), ["out.e.3.0", "out.e.3.1"])
        self.assertEqual(self.bytes(self.path("out.e.3.0")), b"old")

    def test_full_disk(self):
        disk = self.path("disk")
        os.mkdir(disk)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk],
                          capture_output=True, check=False).returncode != 0:
            self.skipTest("no small disk can be mounted")
        try:
            done = ranks(3, "compress", self.made("ogrid", 20000), "-o", disk + "/out.shm",
                         "--segment-cells", 2000, "-q")
            self.assertEqual(done.returncode, 4, done.stderr)
            self.assertEqual(os.listdir(disk), [])
            packed = self.packed(self.steps(3, 8), "--segment-cells", 60)
            done = ranks(3, "decompress", packed, "-o", disk + "/out.e", "-q", "--temp",
                         self.directory.name)
            self.assertEqual(done.returncode, 4, done.stderr)
            self.assertEqual(os.listdir(disk), [])
        finally:
            subprocess.run(["umount", disk], check=True)

    def test_old_file_stays_where_a_new_one_fails(self):
        out = self.write("out.keep", "old")
        done = ranks(2, "compress", self.path("absent.e"), "-o", out, "--segment-cells", 5)
        self.assertEqual(done.returncode, 3)
        self.assertEqual(self.bytes(out), b"old")
        self.assertEqual(glob.glob(self.path(".*")), [])


if __name__ == "__main__":
    mpi_ranks.run_all()
