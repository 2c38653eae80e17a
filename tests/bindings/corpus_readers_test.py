#!/usr/bin/env python3
"""Checks for every mesh of the corpus that all readers read the same data from its .shm file.

  corpus_readers_test.py LIBSHMFORMAT_C.SO SHM        SHM: path of the tool; SHM_CORPUS: folder of the corpus

Each file is compressed once. The Python package reads all arrays at all steps. This data is compared bit for bit with
- the source as read by VTK, meshio and Gmsh,
- the same .shm file as read by a VTK pipeline, by meshio and by C programs (read_all.c, and the example of the
  header),
- the .vtu files that `shm decompress` writes, as read by VTK.
Points are compared in the precision of the
reader. corpus_exceptions.tsv lists files that a reader does not read, and justified differences. If a line of
this file is no longer needed, the test fails. Exit code 77 (skipped) if no corpus exists. `pytest
corpus_readers_test.py` takes the paths from the environment variables SHMFORMAT_LIBRARY and SHM_TOOL; the
default is build/release.
"""
import multiprocessing
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
if __name__ == "__main__":
    LIBRARY, SHM = (str(Path(path).resolve()) for path in sys.argv[1:3])
    del sys.argv[1:3]
else:
    BUILT = ROOT / "build" / "release"
    LIBRARY = os.environ.get("SHMFORMAT_LIBRARY", str(BUILT / "bindings" / "c" / "libshmformat_c.so.1"))
    SHM = os.environ.get("SHM_TOOL", str(BUILT / "bin" / "shm"))
os.environ["SHMFORMAT_LIBRARY"] = LIBRARY
sys.path[:0] = [str(HERE), str(ROOT / "bindings" / "python"), str(ROOT / "tests" / "support")]
from folder_test import SHARE, is_sampled  # noqa: E402
from c_library_test import program_of_the_header  # noqa: E402

CORPUS = Path(os.environ.get("SHM_CORPUS") or "/nowhere")
EXCEPTIONS = HERE / "corpus_exceptions.tsv"
SKIPPED = "SHM_CORPUS is not a folder, so no corpus file was read"
# For each source format, as named by `shm info`: the independent readers for it.
OTHERS = {"exodus": ("vtk", "meshio"), "vtk": ("vtk", "meshio"), "vtu": ("vtk", "meshio"), "ucd": ("vtk", "meshio"),
          "gmsh": ("gmsh", "meshio")}
PROGRAMS = None  # folder of two compiled programs: read_all and the example of shmformat.h


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, timeout=600, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{command[0]}: exit {done.returncode}: {done.stderr.decode(errors='replace')[:300]}")
    return done.stdout


def decompressed(packed, steps, folder):
    """Returns the paths of a series of .vtu files, one for each step."""
    folder.mkdir()
    run(SHM, "decompress", "-q", "-T", "1", packed, "-o", folder / ("step_%04d.vtu" if steps else "mesh.vtu"))
    return sorted(folder.iterdir())


def header_example(folder, mesh):
    """Checks the output of the header's example program for FOLDER/run.shm: the counts, the first coordinate
    and the last corner."""
    expected = "%d %d %g %d\n" % (len(mesh.points), len(mesh.types), mesh.points[0, 0], mesh.corners[-1])
    printed = run(PROGRAMS / "example", folder).decode()
    return [] if printed == expected else [("all", f"it prints {printed!r}, not {expected!r}")]


def compare_file(name):
    """Compares the readers for one file. Returns a list of differences for each reader. A difference is a pair
    (subject, sentence). If a reader fails, its list has one entry, with the subject "all"."""
    import corpus_meshes as meshes
    import shmformat
    source, found = CORPUS / name, {}
    with tempfile.TemporaryDirectory() as scratch:
        packed = Path(scratch) / "run.shm"
        run(SHM, "compress", "-q", "-T", "1", "--level", "fast", source, "-o", packed)
        mesh, roles = meshes.by_python(packed), meshes.roles_of(packed)
        with shmformat.open(packed) as file:
            kind, steps = file.source_format, file.step_count
        ways = {"vtk": lambda: meshes.by_vtk(source), "meshio": lambda: meshes.by_meshio(source, kind),
                "gmsh": lambda: meshes.by_gmsh(source, mesh),
                "shmformat.vtk": lambda: meshes.by_our_vtk(packed),
                "shmformat.meshio": lambda: meshes.by_our_meshio(packed, len(mesh.steps)),
                "read_all": lambda: meshes.by_c(run(PROGRAMS / "read_all", packed), len(mesh.steps)),
                "shm decompress": lambda: meshes.by_vtu(decompressed(packed, steps, Path(scratch) / "vtu"))}
        for reader in (*OTHERS[kind], "shmformat.vtk", "shmformat.meshio", "read_all", "shm decompress"):
            ours = reader in ("shmformat.vtk", "shmformat.meshio", "read_all")
            try:
                found[reader] = meshes.differences(ways[reader](), mesh, frozenset() if ours else roles)
            except meshes.Refused as why:
                found[reader] = [("all", f"refused: {why}")]
        found["header example"] = header_example(scratch, mesh)
    return found


def compare_or_tell(name):
    try:
        return compare_file(name)
    except Exception as why:  # one file must not hide the others
        return {"compare": [("all", f"{type(why).__name__}: {why}")]}


def exceptions():
    """Returns (file, reader, subject): reason."""
    lines = EXCEPTIONS.read_text(encoding="utf-8").splitlines()
    rows = [line.split("\t") for line in lines[1:]]
    return {tuple(row[:3]): "".join(row[3:]) for row in rows if is_sampled(row[0])}


class Corpus(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        global PROGRAMS
        if not CORPUS.is_dir():
            raise unittest.SkipTest(SKIPPED)
        files = sorted((path for path in CORPUS.glob("*/*") if path.is_file() and is_sampled(path)), key=lambda path: -path.stat().st_size)
        cls.names = [path.relative_to(CORPUS).as_posix() for path in files]
        with tempfile.TemporaryDirectory() as folder:
            PROGRAMS = Path(folder)
            (PROGRAMS / "example.c").write_text(program_of_the_header(), encoding="utf-8")
            for source, more in ((HERE / "read_all.c", []), (PROGRAMS / "example.c", ["-Wno-missing-field-initializers"])):
                run("gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-D_POSIX_C_SOURCE=200809L", *more, "-O1",
                    f"-I{ROOT / 'bindings/c/include'}", source, LIBRARY, f"-Wl,-rpath,{Path(LIBRARY).parent}", "-o",
                    PROGRAMS / source.stem)
            with multiprocessing.get_context("fork").Pool(min(os.cpu_count() or 1, 2)) as pool:
                cls.found = dict(zip(cls.names, pool.map(compare_or_tell, cls.names, chunksize=1)))
        cls.excepted = exceptions()

    def test_all_read_the_same(self):
        for name, readers in self.found.items():
            for reader, wrong in readers.items():
                left = [f"{what}: {sentence}" for what, sentence in wrong if (name, reader, what) not in self.excepted]
                with self.subTest(file=name, reader=reader):
                    self.assertEqual(left[:5], [])
        self.assertGreater(len(self.names), 100 / (2 * SHARE))

    def test_exceptions_have_reasons_and_are_needed(self):
        for key, reason in self.excepted.items():
            name, reader, what = key
            with self.subTest(exception=key):
                self.assertGreater(len(reason.split()), 3)
                self.assertIn(what, {kind for kind, _ in self.found.get(name, {}).get(reader, [])})

    def test_each_is_read_by_somebody_else(self):
        counts, alone = {}, []
        for name, readers in self.found.items():
            others = [reader for reader in ("vtk", "meshio", "gmsh") if reader in readers
                      and (name, reader, "all") not in self.excepted]
            for reader in others:
                counts[reader] = counts.get(reader, 0) + 1
            if not others:
                alone.append(name)
        print(f"{len(self.found)} files; sources read by " + ", ".join(f"{k}: {n}" for k, n in sorted(counts.items()))
              + f"; by none of them: {', '.join(sorted(alone)) or 'no file'}", file=sys.stderr)
        self.assertLessEqual(len(alone), 2)


if __name__ == "__main__":
    if not CORPUS.is_dir():
        print(f"skipped: {SKIPPED}")
        sys.exit(77)
    unittest.main()
