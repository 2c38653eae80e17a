#!/usr/bin/env python3
"""Checks that coding a coordinate runs code of only a limited number of units (sources with their headers),
and that docs/architecture.md lists these units.

  path_test.py PATH_OF_SHM     (exit code 77, skipped, if valgrind is missing)

The tool must be built with debug information and without optimization and sanitizers. The script compares the
units that scripts/path finds with the two lists in the document. It reports units that run but are not listed,
and units that are listed but do not run. When all sources were in only two folders, before they were divided
into modules, compression ran code of 80 units and decompression code of 69 units. The test allows at most 60 %
of these numbers.
"""
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs" / "architecture.md"
# For each command: `in` or `out`, the word in the comment (<!-- path in -->) that precedes the command's list
# of units in the document, and the maximum number of units.
COMMANDS = {"compress": ("in", 48), "decompress": ("out", 40)}


def documented(mark):
    text = DOCUMENT.read_text(encoding="utf-8")
    part = re.search(rf"<!-- path {mark} -->(.*?)<!-- end -->", text, re.DOTALL)
    return set(re.findall(r"`(\w+(?:/\w+)+)`", part[1]))


def found(tool):
    lines = subprocess.run([sys.executable, ROOT / "scripts" / "path", "--list-only", "--tool", tool],
                           stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    return {command: {unit for name, unit in map(str.split, lines) if name == command}
            for command in COMMANDS}


def main(tool):
    if not shutil.which("valgrind"):
        print("no valgrind")
        return 77
    faults = 0
    for command, units in found(tool).items():
        mark, most = COMMANDS[command]
        listed = documented(mark)
        print(f"{command}: {len(units)} units, {most} at most")
        faults += len(units) > most
        for unit in sorted(units - listed):
            print(f"  {unit} runs, and docs/architecture.md does not list it")
        for unit in sorted(listed - units):
            print(f"  {unit} is listed in docs/architecture.md, and does not run")
        faults += len(units ^ listed)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
