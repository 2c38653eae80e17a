#!/usr/bin/env python3
"""Checks that the WebAssembly decoder is small and returns the same results as the native library.

  web_test.py LIBSHMFORMAT_C.SO PACKAGE [CLANG]

PACKAGE: the folder of the built web package; CLANG: the compiler of its decoder. The WebAssembly decoder and
the native library read valid and faulty golden files; some of the files are truncated or contain flipped
bits. Both must return the same arrays or the same error message. web_package_test.mjs tests the JavaScript
code that calls the decoder: workers, servers, aborted calls.
"""
import gzip
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

if len(sys.argv) < 3:
    sys.exit(__doc__)
LIBRARY, PACKAGE = (Path(path).resolve() for path in sys.argv[1:3])
CLANG = sys.argv[3] if len(sys.argv) > 3 else "clang-19"
del sys.argv[1:]
NODE = shutil.which("node") or shutil.which("nodejs")
if NODE is None or not (PACKAGE / "shmformat.wasm").exists():
    print("node or the web package is missing (run scripts/setup --web, build the target web): nothing was tested")
    sys.exit(77)

ROOT = Path(__file__).resolve().parents[2]
os.environ["SHMFORMAT_LIBRARY"] = str(LIBRARY)
sys.path[:0] = [str(ROOT / "bindings" / "python"), str(Path(__file__).resolve().parent)]
import numpy as np  # noqa: E402
import shmformat  # noqa: E402
import web_meshes  # noqa: E402

HEADER = ROOT / "bindings" / "c" / "include" / "shmformat.h"
GOLDEN = ROOT / "tests" / "golden"
CHANGED = ("arrays", "every_shape_values", "mixed_rows", "replay_keep", "segments", "shifts_steps", "steps_and_extras",
           "archive")
MOST_BYTES, MOST_PACKED = 1_200_000, 380_000


def node(script):
    """Runs a script and returns its output, parsed as JSON."""
    done = subprocess.run([NODE, "--input-type=module", "-e", script], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


class Decoder(unittest.TestCase):
    def test_is_small(self):
        wasm = (PACKAGE / "shmformat.wasm").read_bytes()
        self.assertLessEqual(len(wasm), MOST_BYTES)
        self.assertLessEqual(len(gzip.compress(wasm, 9, mtime=0)), MOST_PACKED)

    def test_imports_three_functions_and_exports_what_reads(self):
        imports, exports = node(f"""
            import {{ readFileSync }} from "node:fs";
            const module = new WebAssembly.Module(readFileSync({json.dumps(str(PACKAGE / "shmformat.wasm"))}));
            console.log(JSON.stringify([
              WebAssembly.Module.imports(module).map((one) => `${{one.module}}.${{one.name}}`).sort(),
              WebAssembly.Module.exports(module).map((one) => one.name)]));""")
        self.assertEqual(imports, ["page.prefetch", "page.progress", "page.read_at"])
        header = re.sub(r"/\*.*?\*/", " ", HEADER.read_text(encoding="utf-8"), flags=re.S)
        declared = set(re.findall(r"SHMF_API[^;(]*?(shmf_\w+)\(", header))
        reading = {name for name in declared if not name.startswith("shmf_writer_")} - {"shmf_open_path"}
        self.assertGreater(len(reading), 30)
        self.assertEqual({name for name in exports if name.startswith("shmf_")},
                         reading | {"shmf_page_source", "shmf_page_run", "shmf_page_last_words"})

    def test_structs_lie_where_the_header_has_them(self):
        layouts = node(f"""
            import {{ LAYOUTS }} from {json.dumps((PACKAGE / "structs.js").as_uri())};
            console.log(JSON.stringify(LAYOUTS));""")
        lines = ['#include <stddef.h>', '#include "shmformat.h"']
        for name, layout in layouts.items():
            lines.append(f'_Static_assert(sizeof({name}) == {layout["bytes"]}, "{name}");')
            for member, field in layout["fields"].items():
                lines.append(f'_Static_assert(offsetof({name}, {member}) == {field["offset"]}, "{name}.{member}");')
                kind = {"i32": "int32_t", "u32": "uint32_t: 1, size_t", "i64": "int64_t", "u64": "uint64_t", "f64": "double"}
                if field["type"] in kind and member != "struct_size" and field["count"] == 0:
                    lines.append(f'_Static_assert(_Generic((({name}*)0)->{member}, {kind[field["type"]]}: 1, default: 0), '
                                 f'"type of {name}.{member}");')
        with tempfile.TemporaryDirectory() as folder:
            source = Path(folder) / "layouts.c"
            source.write_text("\n".join(lines) + "\n", encoding="utf-8")
            done = subprocess.run([CLANG, "--target=wasm32-wasi", "-fsyntax-only", f"-I{HEADER.parent}", str(source)],
                                  capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)


class SameAsTheLibrary(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.web = web_meshes.Web(NODE, PACKAGE)
        cls.addClassCleanup(cls.web.__exit__)

    def same(self, path, flips=(), cut=None):
        ours, _ = web_meshes.native(path, flips, cut)
        theirs, _ = self.web(path, flips, cut)
        self.assertIsNone(web_meshes.difference(ours, theirs), f"{path}, bits {flips}, cut at {cut}")
        return ours

    def refused(self, lines):
        return any(value.startswith("! ") for _, value in lines)

    def test_golden_files(self):
        files = sorted(GOLDEN.glob("0.*/*.shm"))
        self.assertGreater(len(files), 150)
        for path in files:
            lines = self.same(path)
            self.assertIn(lines[0][0], ("mesh", "member"), path)
            self.assertGreater(len(lines), 8, path)

    def test_faulty_files_are_refused_with_the_same_sentence(self):
        # A file that is cut after a commit can be read up to that commit; only readers of streams refuse it.
        lines = (GOLDEN / "faulty" / "list.txt").read_text(encoding="utf-8").splitlines()
        cut = {line.split()[0] + ".shm" for line in lines if line.split()[1:3] == ["truncated", "Commit:"]}
        files = sorted((GOLDEN / "faulty").glob("*.shm"))
        self.assertGreater(len(files), 300)
        self.assertEqual({path.name for path in files if not self.refused(self.same(path))}, cut)

    def test_flipped_bits(self):
        chance = random.Random(1)
        refused = 0
        for name in CHANGED:
            path = GOLDEN / "0.10" / f"{name}.shm"
            for _ in range(25):
                flips = [(chance.randrange(path.stat().st_size), chance.randrange(8))]
                refused += self.refused(self.same(path, flips))
        self.assertGreater(refused, 20 * len(CHANGED))

    def test_cut_files(self):
        chance = random.Random(2)
        for name in CHANGED:
            path = GOLDEN / "0.10" / f"{name}.shm"
            for _ in range(8):
                self.assertTrue(self.refused(self.same(path, cut=chance.randrange(path.stat().st_size))))


class Package(unittest.TestCase):
    def test_around_the_decoder(self):
        """Runs the tests of web_package_test.mjs with a mesh that has several segments and needs several
        requests."""
        cells = 40_000
        chance = np.random.default_rng(3)
        corner = np.tile(np.arange(4), cells + 1)
        points = np.column_stack([np.repeat(np.arange(cells + 1.), 4), (corner == 1) | (corner == 2), corner >= 2])
        points += chance.random(points.shape) / 8
        hexahedra = np.arange(cells)[:, None] * 4 + np.arange(8)
        pressure = {step: chance.random(len(points)) for step in range(3)}
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "mesh.shm"
            shmformat.write(path, points, hexahedra.astype(np.int32), point_data={"pressure": pressure},
                            cell_data={"heat": chance.random(cells)}, step_times=[.5, 1, 2], level="fast")
            self.assertGreater(path.stat().st_size, 3 << 20)
            done = subprocess.run([NODE, str(Path(__file__).with_name("web_package_test.mjs")), str(PACKAGE), str(path),
                                   str(GOLDEN)], capture_output=True, text=True, check=False, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"# pass [1-9][0-9]")


if __name__ == "__main__":
    unittest.main()
