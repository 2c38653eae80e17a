#!/usr/bin/env python3
"""Checks that digests find wrong decoders. Each mistake is put into a copy of the reference decoder. The mistaken
decoder must refuse each golden file of which it would return other contents, and at least one of them because of its
digest.

wrong_decoders_test.py [--only NAME] [--files N]

--only runs the mistakes with NAME in their descriptions. --files tries N golden files for each mistake; by default,
stops after the first file with a wrong digest.
"""
import argparse
import importlib
import os
import shutil
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
SPEC = os.path.join(os.path.dirname(os.path.dirname(HERE)), "spec")
GOLDEN = os.path.join(HERE, "0.10")
OPTIONS = None

# Description, module, text, replacement, and words in the names of golden files that show the mistake.
MISTAKES = [
    ("fused multiply-add in fitted predictions", "columns",
     "total += (weight / 36864.0) * y",
     "total = float(__import__('fractions').Fraction(weight / 36864.0) * __import__('fractions').Fraction(y) "
     "+ __import__('fractions').Fraction(total)) if y - y == 0 else total + y", "rounding arrays"),
    ("weights of fitted predictions are multiplied, then divided", "columns",
     "total += (weight / 36864.0) * y", "total += weight * y / 36864.0", "rounding arrays"),
    ("rounding half to even", "domains", "return low + (p - low >= 0.5)", "return low + (p - low > 0.5)",
     "quantized bounded relative"),
    ("a number of patterns is one higher", "patterns",
     "self._number(self.numbers.svarint() if k & OWN_NUMBER else 1)",
     "self._number(self.numbers.svarint() if k & OWN_NUMBER else 2)", "patterns digests_fast"),
    ("bundles follow a trend at the second step", "bundles",
     "if self.predictor == STEPS and s > 1:", "if self.predictor == STEPS and s > 2:", "bundles"),
    ("bundles predict from steps where they do from both", "bundles",
     "return self._sum(x(s - 1, e), x(s, e - 1), x(s - 1, e - 1))",
     "return self._sum(x(s - 1, e), x(s, e - 1), x(s, e - 1))", "bundles"),
    ("a shift is added twice", "shifts", "last[i] = (last[i] + by) & MASK64", "last[i] = (last[i] + 2 * by) & MASK64",
     "shifts"),
    ("the stride of the opposite axis is not set", "vertex_numbers",
     "self.strides[d ^ 1] = -self.strides[d]", "pass", "keep segments rows holes ring"),
    ("the parallelogram of vertex numbers lacks a corner", "vertex_numbers",
     "return (a[0] + a[1] - a[2]) & MASK64", "return (a[0] + a[1]) & MASK64", "keep segments holes ring"),
    ("special values are those of the values before", "special_values", "values[i] = bits", "values[i - 1] = bits",
     "special filled"),
    ("the trend of steps starts one step late", "steps", "result = one + (one - two)", "result = two + (one - two)",
     "steps"),
    ("lines continue with another slope", "columns", "2.0 * n - b", "3.0 * n - 2.0 * b",
     "steps arrays values tensors"),
    ("the mean of midpoints", "columns", "(x[3] + x[4]) * 0.5", "x[3] + (x[4] - x[3]) * 0.25", "second_order"),
    ("residuals of mid nodes' numbers are halved", "vertex_numbers",
     "self.step[p, rule] = signed64(number - base)", "self.step[p, rule] = signed64(number - base) // 2",
     "second_order high_order grid"),
    ("adaptive bits slow down early", "coders", "def update(self, value, limit=160):",
     "def update(self, value, limit=150):", "mixed_rows rounding steps"),
    ("curves lack their third", "columns", "return 3.0 * (n - b) + f if mode >= 7",
     "return 3.0 * (n - b) + n if mode >= 7",
     "rounding steps tensors"),
    ("the second mode of last values", "columns", "return 2.0 * self.last - self.before_last", "return self.last",
     "steps arrays rounding"),
    ("thirds have another sign", "columns", "return self.lattice() + third if third",
     "return self.lattice() - third if third",
     "rounding steps arrays tensors"),
    ("the mean of lines", "columns", "return mean(lines) if lines else self.lattice()",
     "return mean(lines[:2]) if lines else self.lattice()", "rounding steps arrays tensors"),
    ("the mean of near values", "columns", "return mean(nears) if nears else self.last\n        if mode == 18",
     "return mean(nears[:1]) if nears else self.last\n        if mode == 18", "rounding steps arrays tensors"),
    ("the base of fitted predictions is the last value", "columns", "return base + total", "return self.last + total",
     "rounding arrays"),
    ("a weighted value is rounded down", "weighted", "return self.minimum + float(index) * self.down if self.linear",
     "return self.minimum + float(index - 1) * self.down if self.linear", "weighted steps"),
]


def files_with(words):
    """The golden files with one of these words in their names, the smallest first."""
    found = [name for name in os.listdir(GOLDEN)
             if name.endswith(".shm") and any(word in name for word in words.split())]
    return sorted(found, key=lambda name: (os.path.getsize(os.path.join(GOLDEN, name)), name))


def decoder_with(folder, number, mistake):
    """Imports a copy of the reference decoder with this mistake."""
    _, module, text, replacement, _ = mistake
    package = f"wrong_decoder_{number}"
    shutil.copytree(os.path.join(SPEC, "reference_decoder"), os.path.join(folder, package))
    path = os.path.join(folder, package, module + ".py")
    with open(path, encoding="utf-8") as file:
        source = file.read()
    assert text in source, f"{module}.py has no {text!r}"
    with open(path, "w", encoding="utf-8") as file:
        file.write(source.replace(text, replacement))
    return importlib.import_module(package)


def outcome(decoder, name):
    """"right" if the decoder returns the contents of the file, "silent" if it returns other contents, "digest" if it
    refuses the file because of a digest, "refused" if it does so for another reason."""
    with open(os.path.join(GOLDEN, name), "rb") as file:
        data = file.read()
    with open(os.path.join(GOLDEN, name[:-4] + ".txt"), "rb") as file:
        expected = file.read()
    try:
        text = b"".join(decoder.text_of(data))
    except decoder.ShmError as error:
        return "digest" if error.section == "digest" else "refused"
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):  # as mistaken decoders fail
        return "refused"
    return "right" if text == expected else "silent"


class WrongDecoders(unittest.TestCase):
    def test_digests_find_mistakes(self):
        with tempfile.TemporaryDirectory() as folder:
            sys.path.insert(0, folder)
            for name in ("dictionary.txt", "dictionary_tables.bin"):
                shutil.copy(os.path.join(SPEC, name), folder)
            self.addCleanup(sys.path.remove, folder)
            for number, mistake in enumerate(MISTAKES):
                if OPTIONS.only in mistake[0]:
                    with self.subTest(mistake[0]):
                        self.expect_found(decoder_with(folder, number, mistake), mistake)

    def expect_found(self, decoder, mistake):
        found = []
        for name in files_with(mistake[4])[: OPTIONS.files or None]:
            found.append((outcome(decoder, name), name))
            if found[-1][0] == "digest" and not OPTIONS.files:
                break
        print(f"{mistake[0]}: {', '.join(f'{name[:-4]} {how}' for how, name in found if how != 'right')}", flush=True)
        self.assertNotIn("silent", [how for how, _ in found], found)
        self.assertIn("digest", [how for how, _ in found], "no digest shows it")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="")
    parser.add_argument("--files", type=int, default=0)
    OPTIONS, rest = parser.parse_known_args()
    unittest.main(argv=sys.argv[:1] + rest)
