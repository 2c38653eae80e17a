#!/usr/bin/env python3
"""shm_mpi: the ranks of an MPI program write the bytes that shm writes alone, or fail together.

Usage: mpi_test.py PATH_OF_SHM PATH_OF_SHM_MPI PATH_OF_SHM_MAKE_MESH
"""
import glob
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from append_test import exodus_text

SHM, SHM_MPI, MAKE_MESH = "shm", "shm_mpi", "shm_make_mesh"
CORPUS = os.environ.get("SHM_CORPUS", "")

# Open MPI asks for these where it runs as root, in a container, and on fewer cores than ranks.
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                   OMPI_MCA_rmaps_base_oversubscribe="1", OMPI_MCA_hwloc_base_binding_policy="none")


def shm(*arguments):
    return subprocess.run([SHM, *map(str, arguments)], capture_output=True, text=True, timeout=600)


def ranks(n, *arguments):
    """What n ranks do. A deadlock ends with TimeoutExpired, and thereby fails the test."""
    return subprocess.run(["mpirun", "-n", str(n), SHM_MPI, *map(str, arguments)],
                          capture_output=True, text=True, timeout=300, env=ENVIRONMENT)


def content(path):
    with open(path, "rb") as file:
        return file.read()


def mixed_vtk(n):
    """Layers of hexahedra, each under a layer of two wedges a cell, with fields on points and cells
    and some points that no cell uses."""
    m = n + 1
    at = lambda x, y, z: (z * m + y) * m + x
    cells, types = [], []
    for z in range(n):
        for y in range(n):
            for x in range(n):
                low = [at(x, y, z), at(x + 1, y, z), at(x + 1, y + 1, z), at(x, y + 1, z)]
                high = [v + m * m for v in low]
                if z % 2 == 0:
                    cells.append(low + high)
                    types.append(12)
                else:
                    for i, j, k in ((0, 1, 2), (0, 2, 3)):
                        cells.append([low[i], low[j], low[k], high[i], high[j], high[k]])
                        types.append(13)
    points = m * m * m + 5
    lines = ["# vtk DataFile Version 3.0", "mixed", "ASCII", "DATASET UNSTRUCTURED_GRID",
             f"POINTS {points} float"]
    lines += [f"{p % m + p % 7 * .01:.4g} {p // m % m} {p // (m * m)}" for p in range(points)]
    lines.append(f"CELLS {len(cells)} {sum(len(c) + 1 for c in cells)}")
    lines += [" ".join(map(str, [len(c), *c])) for c in cells]
    lines.append(f"CELL_TYPES {len(cells)}")
    lines += map(str, types)
    lines += [f"CELL_DATA {len(cells)}", "SCALARS heat double 1", "LOOKUP_TABLE default"]
    lines += [f"{c % 37 * .125}" for c in range(len(cells))]
    lines += [f"POINT_DATA {points}", "VECTORS v float"]
    lines += [f"{p % 5} {-0.0 if p % 3 else p * .5:.6g} nan" for p in range(points)]
    return "\n".join(lines) + "\n"


class MpiTest(unittest.TestCase):
    def setUp(self):
        if not shutil.which("mpirun"):
            self.skipTest("mpirun is not installed")
        self.directory = tempfile.TemporaryDirectory(prefix="shm-mpi-test-")
        self.addCleanup(self.directory.cleanup)

    def path(self, name):
        return os.path.join(self.directory.name, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="ascii") as file:
            file.write(text)
        return self.path(name)

    def made(self, family, cells, fields="full"):
        path = self.path(family + ".vtk")
        subprocess.run([MAKE_MESH, family, str(cells), path, "--fields", fields], check=True,
                       capture_output=True)
        return path

    def steps(self, count, n):
        if not shutil.which("ncgen"):
            self.skipTest("ncgen is not installed")
        text = self.write("run.cdl", exodus_text(list(range(count)), n))
        subprocess.run(["ncgen", "-o", self.path("run.e"), text], check=True)
        return self.path("run.e")

    def expect_same(self, mesh, counts, *options):
        alone, shared = self.path("alone.shm"), self.path("shared.shm")
        done = shm("compress", mesh, "-o", alone, "-q", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        for n in counts:
            done = ranks(n, "compress", mesh, "-o", shared, "-q", *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertTrue(content(shared) == content(alone),
                            f"{n} ranks write other bytes: {mesh} {options}")
            os.remove(shared)

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
        # A trial finds the buffer.
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

    # --- what goes wrong, on all ranks

    def expect_failure(self, code, words, *arguments, n=3):
        done = ranks(n, *arguments)
        self.assertEqual(done.returncode, code, done.stderr)
        # One rank says it.
        said = [line for line in done.stderr.splitlines() if line.startswith("shm_mpi: ")]
        self.assertEqual(len(said), 1, done.stderr)
        self.assertIn(words, said[0])
        self.expect_nothing_left()

    def test_wrong_use(self):
        mesh = self.made("grid", 100, "none")
        out = ["-o", self.path("out.shm")]
        self.expect_failure(2, "--segment-cells", "compress", mesh, *out)
        self.expect_failure(2, "--order free", "compress", mesh, *out, "--segment-cells", 9,
                            "--order", "free")
        self.expect_failure(2, "standard input", "compress", "-", *out, "--segment-cells", 9)
        self.expect_failure(2, "--nonsense", "compress", mesh, *out, "--nonsense")
        self.expect_failure(2, "exclude each other", "compress", mesh, *out, "--segment-cells", 9,
                            "--abs", "1", "--rel", "1")
        self.expect_failure(2, "shifts", "compress", mesh, *out, "--segment-cells", 9, "--codec",
                            "shifts", "--order", "stream", "--delay", 5)

    def test_unreadable_input(self):
        out = ["-o", self.path("out.shm"), "--segment-cells", 20]
        self.expect_failure(3, "absent.vtk", "compress", self.path("absent.vtk"), *out)
        # The corner that no vertex belongs to is in the part of one rank.
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
        good = content(inner)
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
        self.expect_failure(4, "no regular file", "compress", mesh, "-o", self.path("folder"),
                            "--segment-cells", 2000)

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
        finally:
            subprocess.run(["umount", disk], check=True)

    def test_old_file_stays_where_a_new_one_fails(self):
        out = self.write("out.keep", "old")
        done = ranks(2, "compress", self.path("absent.e"), "-o", out, "--segment-cells", 5)
        self.assertEqual(done.returncode, 3)
        self.assertEqual(content(out), b"old")
        self.assertEqual(glob.glob(self.path(".*")), [])


if __name__ == "__main__":
    SHM, SHM_MPI, MAKE_MESH = sys.argv[1:4]
    del sys.argv[1:4]
    result = unittest.main(exit=False).result
    everything_skipped = result.testsRun > 0 and len(result.skipped) == result.testsRun
    sys.exit(77 if everything_skipped else 0 if result.wasSuccessful() else 1)
