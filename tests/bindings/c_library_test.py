#!/usr/bin/env python3
"""Tests the C interface as C programs use it.

  c_library_test.py LIBSHMFORMAT_C.SO

The header compiles as C99 and C++11 without warnings, both alone and together with the headers of POSIX
shared memory. The example in its introduction is a correct program. The size of the library is below a limit.
The library exports exactly the symbols that the header declares, all with the prefix shmf_ and the same
symbol version.
"""
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "bindings" / "c" / "include"
HEADER = INCLUDE / "shmformat.h"
EXAMPLES = ROOT / "bindings" / "c" / "examples"
FORTRAN = ROOT / "bindings" / "fortran"
MESH = ROOT / "tests" / "golden" / "0.10" / "keep.shm"
MOST_BYTES = 2_500_000
LIBRARY = None

# The test inserts the example from the introduction of the header into this program.
PROGRAM = r"""
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include "shmformat.h"

int main(int argc, char **argv) {
  if (argc < 2 || chdir(argv[1]) != 0) return 99;
%s
  printf("%%" PRIu64 " %%" PRIu64 " %%g %%d\n", n.vertices, n.cells, ((double *)want[0].data)[0],
         (int)((int32_t *)want[1].data)[n.corners - 1]);
  free(want[0].data);
  free(want[1].data);
  return 0;
}
"""


def program_of_the_header():
    header = HEADER.read_text(encoding="utf-8")
    example = re.search(r"Example: points and hexahedra of a file\n(.*?)\n   Conventions", header, re.S)[1]
    return PROGRAM % re.sub(r"^   ", "", example, flags=re.M)


def run(*command, **more):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **more)


class Library(unittest.TestCase):
    def setUp(self):
        self.folder = TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def compiles(self, compiler, standard, text, name, *more):
        source = self.path / name
        source.write_text(text, encoding="utf-8")
        done = run(compiler, f"-std={standard}", "-pedantic", "-Wall", "-Wextra", "-Werror", "-D_POSIX_C_SOURCE=200809L",
                   f"-I{INCLUDE}", source, *more)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_header_is_c99_and_cplusplus11(self):
        beside = "#include <sys/ipc.h>\n#include <sys/mman.h>\n#include <sys/shm.h>\n"
        text = '#include "shmformat.h"\n#include "shmformat.h"\nint main(void) { return shmf_version() == 0; }\n'
        for before in ("", beside):
            self.compiles("gcc", "c99", "#define _XOPEN_SOURCE 700\n" + before + text, "a.c", "-fsyntax-only")
            self.compiles("g++", "c++11", before + text, "a.cpp", "-fsyntax-only")
        self.compiles("gcc", "c99", text + beside, "b.c", "-D_XOPEN_SOURCE=700", "-fsyntax-only")

    def test_the_example_of_the_header_works(self):
        # The example leaves out initializers of struct members, because C sets these members to zero. The
        # warning about missing initializers is therefore disabled.
        self.compiles("gcc", "c99", program_of_the_header(), "example.c", "-Wno-missing-field-initializers", LIBRARY,
                      f"-Wl,-rpath,{LIBRARY.parent}", "-o", self.path / "example")
        shutil.copy(MESH, self.path / "run.shm")
        done = run(self.path / "example", self.path)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        text = MESH.with_suffix(".txt").read_text(encoding="utf-8")
        vertices, cells = (int(re.search(rf"{word} (\d+)", text)[1]) for word in ("vertices", "cells"))
        self.assertEqual(done.stdout.split()[:2], [str(vertices), str(cells)])
        (self.path / "run.shm").write_bytes(b"not a mesh, but long enough to be looked at")
        done = run(self.path / "example", self.path)
        self.assertIn(done.returncode, (2, 3))  # SHMF_TRUNCATED, SHMF_CORRUPT
        self.assertIn("run.shm", done.stderr)

    def test_the_readme_compiles(self):
        text = (ROOT / "README.md").read_text(encoding="utf-8")
        code = re.search(r"```c\n(.*?)```", text, re.S)[1]
        self.assertLessEqual(code.count("\n"), 5)
        text = ('#include "shmformat.h"\nvoid f(shmf_target *targets);\nvoid f(shmf_target *targets) {\n  shmf_file *file;\n'
                f"  shmf_counts counts = {{sizeof counts}};\n  shmf_error why;\n{code}}}\n")
        self.compiles("gcc", "c99", text, "readme.c", "-Wno-missing-field-initializers", "-c", "-o", self.path / "o")

    def example(self, name, *arguments):
        """Runs an example; returns the finished process."""
        text = (EXAMPLES / f"{name}.c").read_text(encoding="utf-8")
        self.assertLessEqual(text.count("\n"), 60)
        self.compiles("gcc", "c99", text, f"{name}.c", "-Wno-missing-field-initializers", LIBRARY,
                      f"-Wl,-rpath,{LIBRARY.parent}", "-o", self.path / name)
        return run(self.path / name, *arguments)

    def test_the_examples_write_and_read(self):
        bar = self.path / "bar.shm"
        done = self.example("write_steps", bar)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        again = self.example("write_steps", bar)
        self.assertEqual(again.returncode, 7)  # SHMF_OUTPUT: nothing is replaced by default
        self.assertIn("exists already", again.stderr)
        done = self.example("first_array", bar)
        self.assertEqual(done.stdout, "404 vertices, 100 cells\ntemperature: 300 to 310\n", done.stderr)
        self.assertEqual(self.example("first_array", self.path / "none").returncode, 1)  # SHMF_IO

    def test_fortran_writes_and_reads(self):
        bar = self.path / "bar.shm"
        sources = [FORTRAN / "shmformat.f90", FORTRAN / "examples" / "write_steps.f90"]
        self.assertLess(sources[1].read_text(encoding="utf-8").count("\n"), 60)
        done = run("gfortran", "-std=f2003", "-pedantic", "-Wall", "-Wextra", "-Werror", f"-J{self.path}", *sources, LIBRARY,
                   f"-Wl,-rpath,{LIBRARY.parent}", "-o", self.path / "write_steps")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(self.path / "write_steps", bar)
        self.assertEqual((done.stdout.strip(), done.stderr), ("temperature:  300.0 to 310.0", ""))
        again = run(self.path / "write_steps", bar)
        self.assertNotEqual(again.returncode, 0)
        self.assertIn("exists already", again.stderr)

    def test_fortran_has_the_sizes_and_numbers_of_c(self):
        module = (FORTRAN / "shmformat.f90").read_text(encoding="utf-8")
        sizes = re.findall(r"type, bind\(c\) :: (\w+)\n\s+integer\(c_size_t\) :: struct_size = (\d+)", module)
        numbers = [pair for line in re.findall(r"parameter :: ((?:.*&\n)*.*)", module)
                   for pair in re.findall(r"(SHMF_\w+) = (\d+)", line)]
        self.assertGreater(len(sizes), 5)
        self.assertGreater(len(numbers), 40)
        checks = [f"_Static_assert(sizeof({name}) == {size}, \"{name}\");" for name, size in sizes]
        checks += [f"_Static_assert({name} == {number}, \"{name}\");" for name, number in numbers]
        self.compiles("gcc", "c11", '#include "shmformat.h"\n' + "\n".join(checks) + "\n", "sizes.c", "-fsyntax-only")

    def test_it_exports_its_interface_and_nothing_else(self):
        listed = run("nm", "-D", "--defined-only", LIBRARY).stdout
        names = {line.split()[2] for line in listed.splitlines()} - {"SHMF_1"}
        declared = set(re.findall(r"\b(shmf_\w+)\(", re.sub(r"/\*.*?\*/", "", HEADER.read_text(encoding="utf-8"),
                                                            flags=re.S)))
        self.assertEqual(names, {f"{name}@@SHMF_1" for name in declared})
        self.assertGreater(len(declared), 40)

    def test_it_is_small(self):
        run("strip", "-o", self.path / "stripped.so", LIBRARY)
        self.assertLessEqual((self.path / "stripped.so").stat().st_size, MOST_BYTES)

    def test_its_name_has_its_own_version(self):
        dynamic = run("readelf", "-d", LIBRARY).stdout
        self.assertRegex(dynamic, r"SONAME.*\[libshmformat_c\.so\.1\]")
        self.assertNotRegex(dynamic, r"NEEDED.*libshmformat\b")


if __name__ == "__main__":
    LIBRARY = Path(sys.argv.pop(1)).resolve()
    unittest.main()
