#!/usr/bin/env python3
"""Tests options that bound errors: fill values, root mean squares, signal-to-noise ratios, and patterns of names.

Usage: bounds_test.py PATH_OF_SHM
"""
import json
import math
import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest
from sample_meshes import exodus_text

SIZE = (12, 11, 10)
COUNT = SIZE[0] * SIZE[1] * SIZE[2]
FILL = 9.96921e36


def temperature(i):
    return round(300 + 4 * math.sin(i * .013) + .37 * math.cos(i * 1.7), 4)


def is_missing(i):
    return i % 40 < 9


class BoundsTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.fields = {}

    def add(self, name, type_, value):
        self.fields[name] = type_, [value(i) for i in range(COUNT)]

    def write_mesh(self, name="mesh.vtk"):
        text = ["# vtk DataFile Version 3.0", "fields", "ASCII", "DATASET STRUCTURED_POINTS",
                "DIMENSIONS %d %d %d" % SIZE, "ORIGIN 0 0 0", "SPACING 1 1 1", f"POINT_DATA {COUNT}"]
        for field, (type_, values) in self.fields.items():
            text += [f"SCALARS {field} {type_} 1", "LOOKUP_TABLE default", " ".join(map(repr, values))]
        return self.write(name, "\n".join(text) + "\n")

    def restored(self, *options, errors=None):
        """Compresses the mesh with these options, and returns the restored values of each array. `errors`: a
        dictionary, to which the errors that `verify` reports are added by array."""
        mesh, packed = self.write_mesh(), self.path("mesh.shm")
        self.shm("compress", *options, mesh, "-o", packed, "-f", code=0)
        report = json.loads(self.shm("verify", packed, "--against", mesh, "--json"))
        if errors is not None:
            errors.update({error["what"]: error for error in report["quantized"]})
        self.shm("decompress", packed, "-o", "back.vtk", "-f")
        words, values, at = self.bytes("back.vtk").decode().split(), {}, 0
        while "SCALARS" in words[at:]:
            at = words.index("SCALARS", at) + 1
            begin = words.index("default", at) + 1
            values[words[at]] = [float(word) for word in words[begin:begin + COUNT]]
        return values

    def arrays(self):
        report = json.loads(self.shm("info", "mesh.shm", "--json"))
        return {array["name"]: array for array in report["arrays"]}

    def check_filled(self, values, field, fill, bound):
        for i, value in enumerate(values[field]):
            if is_missing(i):
                self.assertTrue(value == fill or (value != value and fill != fill), (i, value))
            else:
                self.assertLessEqual(abs(value - temperature(i)), bound * 1.0001)

    def test_fill_values_are_exact_and_do_not_count_for_the_range(self):
        for fill in (FILL, -9999.0):
            self.add("a", "float", lambda i, fill=fill: fill if is_missing(i) else temperature(i))
            self.add("b", "double", lambda i, fill=fill: fill if is_missing(i) else temperature(i))
            self.add("kept", "double", temperature)
            for level in ("fast", "default", "best"):
                for options in (["--fill", str(fill)], ["--array", f"a:fill={fill}", "--array", f"b:fill={fill}"],
                                ["--array", f"?:fill={fill}"]):
                    values = self.restored("--rel", "1e-4", "--level", level, *options)
                    for field in "ab":
                        self.check_filled(values, field, fill, 9e-4)
                        self.assertAlmostEqual(self.arrays()[field]["fills"][0], fill, delta=abs(fill) * 1e-7)
                        self.assertLess(self.arrays()[field]["max_error"], 9e-4)

    def test_fill_values_and_nan_need_few_bytes(self):
        sizes = {}
        for name, fill in (("none", None), ("fill", FILL), ("nan", math.nan)):
            self.add("t", "double", lambda i, fill=fill: temperature(i) if fill is None or i < 700 else fill)
            values = self.restored("--abs", "1e-3", "--fill", str(FILL))
            sizes[name] = os.path.getsize(self.path("mesh.shm"))
            if fill is not None:
                self.assertTrue(all(str(value) == str(fill) for value in values["t"][700:]))
        # An escape for each of the 620 special values would need 5 KB.
        self.assertLess(sizes["fill"], 1.2 * sizes["none"])
        self.assertLess(sizes["nan"], 1.2 * sizes["none"])

    def test_a_range_that_seems_to_contain_fill_values(self):
        self.add("with", "double", lambda i: FILL if i < 30 else temperature(i))
        self.add("without", "double", temperature)
        mesh = self.write_mesh()
        said = self.run_with_errors("compress", "--rel", "1e-4", mesh, "-o", "mesh.shm")
        self.assertIn("warning: the range of 'with' is more than a million times", said)
        self.assertNotIn("'without'", said)
        for options in (["--fill", str(FILL)], ["--array", "w*:abs=1", "--rel", "1e-4"]):
            said = self.run_with_errors("compress", "--rel", "1e-4", *options[:2], mesh, "-o", "mesh.shm", "-f")
            self.assertEqual(said, "")

    def run_with_errors(self, *words):
        done = subprocess.run([self.tool, *words], cwd=self.directory.name, capture_output=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stderr.decode()

    def test_bounds_relative_to_each_value(self):
        """Values of 20 magnitudes keep their digits, zeros, and signs."""
        def value(i):
            return 0.0 if i % 11 == 0 else (-1) ** i * 10 ** (i % 20 - 10) * (1 + .5 * math.sin(i * .07))

        self.add("wide", "double", value)
        self.add("narrow", "float", lambda i: round(value(i), 12))
        bounds = {"pwrel=1e-3": 1e-3, "digits=4": .5e-4, "pwrel=.2": .2}
        sizes = {}
        for how, bound in bounds.items():
            for level in ("fast", "default", "best"):
                errors = {}
                values = self.restored("--array", f"*:{how}", "--level", level, errors=errors)
                sizes[how, level] = os.path.getsize(self.path("mesh.shm"))
                for field, (_, own) in self.fields.items():
                    for before, after in zip(own, values[field]):
                        self.assertLessEqual(abs(after - before), abs(before) * (bound + 1e-7), (how, field))
                        self.assertEqual(math.copysign(1, before), math.copysign(1, after))
                    array = self.arrays()[field]
                    self.assertAlmostEqual(array["max_relative_error"], bound)
                    self.assertIsNone(array["max_error"])
                    error = errors[f"array '{field}'"]
                    self.assertEqual(error["promised_relative_error"], array["max_relative_error"])
                    self.assertLessEqual(error["largest_relative_error"], bound)
                    self.assertGreater(error["largest_relative_error"], bound / 8)
        self.assertLess(sizes["pwrel=.2", "default"], .6 * sizes["digits=4", "default"])
        mesh = self.write_mesh()
        for options, reason in ((["coordinates:pwrel=.1"], "coordinates cannot have"),
                                (["wide:pwrel=.5"], "below 0.5"), (["wide:digits=16"], "1 to 15"),
                                (["wide:digits=0"], "1 to 15"), (["wide:pwrel=0"], "above 0")):
            said = self.shm("compress", mesh, "-o", "x.shm", "--array", *options, code=2)
            self.assertIn(reason, said.decode())
        # Rounding to more than 13 digits would hardly save space.
        self.restored("--array", "wide:pwrel=1e-15")
        self.assertNotIn("max_relative_error", self.arrays()["wide"])
        self.shm("info", "mesh.shm")

    def test_fill_values_of_exodus_files(self):
        text = exodus_text(range(3), 4).replace(
            "data: time_whole", '  vals_nod_var1:_FillValue = -9999. ; vals_nod_var2:missing_value = 1.e30f ;\ndata: time_whole')
        self.ncgen("run.e", text.replace("vals_nod_var1 = ", "vals_nod_var1 = -9999., "
                                         ).replace(", -9999., 0.0,", ", -9999.,", 1))
        self.shm("compress", "run.e", "-o", "mesh.shm")
        arrays = self.arrays()
        self.assertEqual(arrays["u"]["fills"], [-9999.0])
        self.assertAlmostEqual(arrays["p"]["fills"][0], 1e30, delta=1e24)
        self.assertEqual(arrays["heat"]["fills"], [])
        self.assertIn("fill value -9999", self.shm("info", "mesh.shm").decode())

    def test_root_mean_square_and_signal_to_noise(self):
        self.add("t", "double", temperature)
        self.add("f", "float", lambda i: FILL if is_missing(i) else temperature(i))
        self.add("whole", "int", lambda i: i)
        for field in "tf":
            for how, value in (("rms", 1e-2), ("rms", 1e-4), ("psnr", 40.0), ("psnr", 83.5)):
                errors = {}
                values = self.restored("--fill", str(FILL), "--array", f"{field}:{how}={value}", errors=errors)
                pairs = [(values[field][i], temperature(i)) for i in range(COUNT) if field == "t" or not is_missing(i)]
                rms = math.sqrt(sum((a - b)**2 for a, b in pairs) / len(pairs))
                error = errors[f"array '{field}'"]
                # In the source, the values of f are rounded to float32.
                self.assertAlmostEqual(error["rms_error"], rms, delta=(1e-9 if field == "t" else .01) * rms)
                spread = max(b for _, b in pairs) - min(b for _, b in pairs)
                self.assertAlmostEqual(error["psnr"], 20 * math.log10(spread / rms), delta=.02)
                bound = value if how == "rms" else spread * 10**(-value / 20)
                self.assertLessEqual(rms, bound * (1 + 1e-6 if field == "t" else 1.001))
                self.assertGreater(rms, .9 * bound)  # the bound is used
        for wrong in ("t:rms=0", "t:rms=nan", "t:psnr=-3", "t:psnr=400", "whole:rms=1", "t:fill=nan", "whole:fill=1"):
            self.shm("compress", "--array", wrong, self.write_mesh(), "-o", "no.shm", code=2)
        self.assertFalse(os.path.exists(self.path("no.shm")))

    def test_rounding_never_makes_an_array_larger(self):
        self.add("few", "double", lambda i: i * 7919 % 5 / 3)
        self.add("decimal", "double", lambda i: i * i % 1000 / 1000)
        self.add("noise", "double", lambda i: math.sin(i * i))
        exact, packed = self.path("exact.shm"), self.path("mesh.shm")
        streams = lambda path: {name: stream["bytes"] for name, stream in json.loads(
            self.shm("info", path, "--json"))["streams"].items()}
        for level in ("fast", "default", "best"):
            self.shm("compress", "--level", level, self.write_mesh(), "-o", exact, "-f")
            for bound in ("1e-2", "1e-5", "1e-9", "1e-12"):
                self.restored("--rel", bound, "--level", level)
                before, now = streams(exact), streams(packed)
                for name in ("geometry", "array:point/few", "array:point/decimal", "array:point/noise"):
                    self.assertLessEqual(now[name], before[name] + 64, (level, bound, name))
                if bound == "1e-12":
                    self.assertIsNone(self.arrays()["decimal"]["max_error"])
                self.assertLessEqual(os.path.getsize(packed), os.path.getsize(exact))

    def test_patterns_of_names(self):
        for name in ("stress_x", "stress_y", "velocity", "s*"):
            self.add(name, "double", temperature)
        self.add("stress_id", "int", lambda i: i)

        def bounds(*options):
            words = [word for option in options for word in ("--array", option)]
            self.shm("compress", *words, self.write_mesh(), "-o", "mesh.shm", "-f")
            return [self.arrays()[name]["max_error"] for name in ("stress_x", "stress_y", "velocity", "s*")]

        self.assertEqual(bounds("stress_*:abs=1"), [1, 1, None, None])
        self.assertEqual(bounds("stress_?:abs=1", "stress_y:abs=2"), [1, 2, None, None])
        self.assertEqual(bounds("stress_y:abs=2", "*:abs=1"), [1, 2, 1, 1])
        self.assertEqual(bounds("*:abs=1", "*y:abs=3", "stress_x:lossless"), [None, 3, 3, 1])
        self.assertEqual(bounds("s*:abs=4"), [None, None, None, 4])  # an exact name
        self.assertEqual(bounds("s\\*:abs=4", "point/v*:abs=5"), [None, None, 5, 4])
        for wrong in ("x*:abs=1", "stress_id:abs=1", "*_id:abs=1", "cell/*:abs=1"):
            self.shm("compress", "--array", wrong, self.write_mesh(), "-o", "no.shm", code=2)

    # Hexahedra and tetrahedra alternate. They are the blocks 12 and 10.
    def write_two_blocks(self, values):
        points, cells = [], []
        for i in range(len(values)):
            corners = [(x, y, z) for z in (0, 1) for y, x in ((0, 0), (0, 1), (1, 1), (1, 0))][:8 if i % 2 == 0 else 4]
            if i % 2 == 1:
                corners[2:] = [(0, 1, 0), (0, 0, 1)]
            cells.append([len(points) + c for c in range(len(corners))])
            points += [(x + 2 * i, y, z) for x, y, z in corners]
        text = ["# vtk DataFile Version 3.0", "two blocks", "ASCII", "DATASET UNSTRUCTURED_GRID",
                f"POINTS {len(points)} double", *(" ".join(map(str, point)) for point in points),
                f"CELLS {len(cells)} {sum(map(len, cells)) + len(cells)}",
                *(" ".join(map(str, [len(cell), *cell])) for cell in cells), f"CELL_TYPES {len(cells)}",
                *("12" if len(cell) == 8 else "10" for cell in cells), f"CELL_DATA {len(cells)}"]
        for name, type_ in (("heat", "float"), ("a@b", "double"), ("id", "int")):
            text += [f"SCALARS {name} {type_} 1", "LOOKUP_TABLE default",
                     " ".join(str(i) if type_ == "int" else repr(v) for i, v in enumerate(values))]
        return self.write("two.vtk", "\n".join(text) + "\n")

    def test_bounds_of_blocks(self):
        values = [0.0 if i % 17 == 0 else FILL if i % 50 == 3 else temperature(i) * (1 if i % 3 else -1e-3)
                  for i in range(400)]
        mesh = self.write_two_blocks(values)

        def bounds(*options):
            words = [word for option in options for word in ("--array", option)]
            self.shm("compress", *words, "--fill", str(FILL), mesh, "-o", "two.shm", "-f")
            report = json.loads(self.shm("verify", "two.shm", "--against", mesh, "--json"))
            self.assertTrue(report["equal"])
            arrays = {array["name"]: array for array in json.loads(self.shm("info", "two.shm", "--json"))["arrays"]}
            self.shm("decompress", "two.shm", "-o", "back.vtk", "-f")
            self.shm("diff", "two.shm", "back.vtk")
            words, largest = self.bytes("back.vtk").decode().split(), {}
            for name in ("heat", "a@b"):
                at = words.index("default", words.index(name)) + 1
                errors = [[], []]
                for i, (value, word) in enumerate(zip(values, words[at:])):
                    errors[i % 2].append(abs(float(word) - value))
                    if value in (0, FILL):
                        self.assertLessEqual(errors[i % 2][-1], value * 1e-6)
                        errors[i % 2][-1] = 0
                largest[name] = [max(errors[0]), max(errors[1])]
            return largest, arrays

        largest, arrays = bounds("heat@12:abs=.5", "heat@10:abs=1e-3", "a@b:abs=.01")
        self.assertEqual(sorted(arrays["heat"]["max_error_of_blocks"]), [1e-3, .5])
        self.assertEqual(arrays["a@b"]["max_error"], .01)
        self.assertLessEqual(largest["heat"][0], .5001)
        self.assertGreater(largest["heat"][0], .1)
        self.assertLessEqual(largest["heat"][1], 1.1e-3)
        self.assertGreater(largest["heat"][1], 1e-4)
        text = self.shm("info", "two.shm").decode()
        self.assertRegex(text, "'heat'.*rounded, error at most [^,]* in block 1[02], [^,]* in block 1[02]")
        # Blocks without a bound of their own have that of the array.
        largest, _ = bounds("heat:abs=.01", "heat@12:lossless", "a@b@10:rel=.01")
        self.assertLessEqual(largest["heat"][0], 1e-4)  # decimal text of float32 values
        self.assertGreater(largest["heat"][1], 1e-3)
        self.assertEqual(largest["a@b"][0], 0)
        self.assertGreater(largest["a@b"][1], .1)
        self.assertLessEqual(largest["a@b"][1], .01 * 310)
        # A backslash removes the meaning of @, patterns select arrays, and exact names take precedence over them.
        largest, _ = bounds("a\\@b:abs=.5", "h*@10:abs=.5", "heat@10:abs=1e-3")
        self.assertGreater(max(largest["a@b"]), .1)
        self.assertLessEqual(largest["heat"][1], 1.1e-3)
        for wrong in (["heat@11:abs=1"], ["nix@10:abs=1"], ["id@10:abs=1"], ["heat@10:pwrel=.1"], ["heat@10:abs=0"],
                      ["heat@10:abs=1", "heat@10:abs=2"], ["heat@10:abs=1", "heat:digits=3"], ["coordinates@10:abs=1"]):
            words = [word for option in wrong for word in ("--array", option)]
            self.shm("compress", *words, mesh, "-o", "no.shm", code=2)
        # The errors are checked, block by block.
        changed = self.write("other.vtk", self.bytes(mesh).decode().replace(repr(values[11]), repr(values[11] + .1)))
        self.shm("verify", "two.shm", "--against", changed, code=1)

    def test_a_range_of_a_block_that_seems_to_contain_fill_values(self):
        mesh = self.write_two_blocks([FILL if i % 50 == 3 else temperature(i) for i in range(400)])

        def warning(*options):
            words = [word for option in options for word in ("--array", option)]
            said = self.run_with_errors("compress", *words, mesh, "-o", "two.shm", "-f")
            return said[:said.find("is more than a million times")]

        # Odd values, and therefore the fill values, are in block 10.
        self.assertEqual(warning("heat@10:rel=1e-4", "heat:abs=1"), "shm: warning: the range of 'heat@10' ")
        self.assertEqual(warning("heat@12:rel=1e-4", "heat:abs=1"), "")
        self.assertEqual(warning("heat@12:abs=1", "heat:rel=1e-4"), "shm: warning: the range of 'heat' ")
        self.assertEqual(warning("heat@10:rel=1e-4", "heat:abs=1", f"heat:fill={FILL}"), "")

    def test_appended_steps_keep_the_bounds_of_blocks(self):
        self.ncgen("all.e", exodus_text(range(4), 6))
        self.ncgen("first.e", exodus_text(range(2), 6))
        block = json.loads(self.shm("info", "first.e", "--json"))["blocks"][1]["id"]
        for order in ("keep", "stream", "free"):
            self.shm("compress", "first.e", "--array", f"heat@{block}:abs=.2", "-o", "run.shm", "-f", "--order", order)
            self.shm("append", "run.shm", "all.e")
            report = json.loads(self.shm("verify", "run.shm", "--against", "all.e", "--json"))
            self.assertTrue(report["equal"])
            self.assertEqual([(error["what"], error["promised_error"]) for error in report["quantized"]],
                             [("array 'heat'", .2)])
            self.assertGreater(report["quantized"][0]["largest_error"], .05)


if __name__ == "__main__":
    FolderTest.tool = os.path.abspath(sys.argv.pop(1))
    unittest.main()
