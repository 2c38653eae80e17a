#!/usr/bin/env python3
"""Tests shell completion and the manual, which are generated from the options of the tool.

Usage: options_test.py PATH_OF_SHM
"""
import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

SCRIPT = """
source <("$0" completion bash)
COMPREPLY=(left over)
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
_shm
printf '%s\\n' "${COMPREPLY[@]}"
"""


def shm(*words):
    return subprocess.run([SHM, *words], check=True, capture_output=True, text=True, timeout=60).stdout


def listed_commands():
    return re.findall(r"^  ([a-z]+) ", shm("--help").split("Subcommands:")[1], re.MULTILINE)


def listed_options(command):
    return re.findall(r"^  (?:-\w,)?(--[a-z-]+)", shm(command, "--help"), re.MULTILINE)


class CompletionTest(unittest.TestCase):
    def completed(self, *words):
        """Returns the completions that bash offers for the last word of a shm command line."""
        done = subprocess.run(["bash", "-c", SCRIPT, SHM, "shm", *words], check=True,
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def test_commands(self):
        self.assertEqual(self.completed("comp"), ["compress", "completion"])
        self.assertEqual(self.completed("help", "ver"), ["verify"])
        self.assertEqual(self.completed("--v"), ["--version"])

    def test_all_commands_and_options_of_the_help(self):
        listed = listed_commands()
        self.assertGreater(len(listed), 12)
        self.assertEqual([word for word in self.completed("") if not word.startswith("-")],
                         ["help", "version", *listed])
        for command in listed:
            with self.subTest(command=command):
                self.assertEqual(self.completed(command, "--"), listed_options(command))

    def test_words_of_options(self):
        self.assertEqual(self.completed("compress", "a.e", "--order", ""), ["keep", "stream", "free"])
        self.assertEqual(self.completed("compress", "--level", "b"), ["best"])
        self.assertEqual(self.completed("compress", "--level", "=", "b"), ["best"])
        self.assertEqual(self.completed("compress", "--level", "="), ["fast", "default", "best"])
        self.assertIn("gmsh", self.completed("convert", "a.e", "--format", ""))
        self.assertEqual(self.completed("completion", ""), ["bash", "zsh", "-h", "--help"])
        self.assertEqual(self.completed("manual", "e"), ["extract"])

    def test_all_else_is_a_file(self):
        for words in (["compress", ""], ["compress", "-o", ""], ["compress", "--cell-order", "--"]):
            self.assertEqual(self.completed(*words), [])
        self.assertIn("complete -o default -F _shm shm", shm("completion", "bash"))

    def test_zsh_can_read_it(self):
        script = shm("completion", "zsh")
        self.assertTrue(script.startswith("#compdef shm\n"))
        self.assertIn("'--order[keep\\: keep vertex and cell numbers (default); stream\\: ", script)
        self.assertIn("]:value:(keep stream free)'", script)
        if shutil.which("zsh") is None:
            self.skipTest("no zsh")
        subprocess.run(["zsh", "-n"], input=script, check=True, text=True, timeout=60)


class ManualTest(unittest.TestCase):
    def shown(self, roff):
        """Returns the text of a manual page as man shows it, with single spaces between words."""
        if shutil.which("groff") is None:
            self.skipTest("no groff")
        done = subprocess.run(["groff", "-man", "-Tascii", "-ww", "-P-c", "-P-bou", "-rLL=200n"],
                              input=roff, capture_output=True, check=True, text=True, timeout=60)
        self.assertEqual(done.stderr, "")
        return " ".join(done.stdout.split())

    def test_it_has_all(self):
        page = self.shown(shm("manual"))
        for command in listed_commands():
            with self.subTest(command=command):
                self.assertIn(f"shm {command} [OPTIONS]", page)
                part = page[page.rindex(f"shm {command} [OPTIONS]"):]
                place = 0
                for option in listed_options(command):
                    place = part.index(option, place)
        for code in ("0 done", "7 repair salvaged", "shm compress rotor.e"):
            self.assertIn(code, page)

    def test_each_command_has_a_page_that_is_installed(self):
        build = (ROOT / "converters" / "tool" / "CMakeLists.txt").read_text(encoding="utf-8")
        installed = re.search(r"foreach\(command ([^)]*)\)", build)[1].split()
        self.assertEqual(installed, sorted(listed_commands()))
        for command in installed:
            with self.subTest(command=command):
                page = self.shown(shm("manual", command))
                self.assertRegex(page, rf"NAME shm-{command} - [a-z][^.]*(\.shm[^.]*)?[^.] SYNOPSIS shm {command} \[OPTIONS\]")
                place = page.index(" OPTIONS ")
                for option in listed_options(command):
                    place = page.index(option, place)
                place = page.index(f" EXAMPLES shm {command} ", place)
                self.assertIn("EXIT CODES", page[place:])
        self.assertIn("NOTES Exact comparison: numbers", self.shown(shm("manual", "diff")))
        wrong = subprocess.run([SHM, "manual", "compres"], capture_output=True, text=True, timeout=60)
        self.assertEqual(wrong.returncode, 2)

    def test_the_page_of_the_format_says_what_the_specification_says(self):
        page = self.shown((ROOT / "packaging" / "shm.5").read_text(encoding="utf-8"))
        text = (ROOT / "spec" / "shm_format.md").read_text(encoding="utf-8")
        self.assertIn(f"format {re.search('version ([0-9.]+)', text)[1]} ", page)
        signature = re.search(r"\| signature \| [^|]*\| `([0-9a-f ]*)`", text)[1]
        self.assertIn(f"The signature, {signature}.", page)
        self.assertIn("SHMc", page)
        kinds = re.findall(r"^\| (\d+) \| (\w+) \| section", text.split("\n## 3 ")[0], re.MULTILINE)
        self.assertEqual(len(kinds), 7)
        for number, name in kinds:
            self.assertRegex(page, rf"\b{number} {name}\b")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop())
    unittest.main()
