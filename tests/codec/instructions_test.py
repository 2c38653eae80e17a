#!/usr/bin/env python3
"""Checks that encoding and decoding execute about the same number of instructions as before.

  instructions_test.py [PROGRAM LIBRARY] [--renew]     (exit code 77, skipped: no valgrind)

PROGRAM is counted_coding, LIBRARY the shared library that it uses, both built as for a release; the default
is build/release. callgrind counts only the instructions of LIBRARY, because those of zstd, xxHash and the C
library depend on the processor and on their versions. The counts are the same in every run, however busy
the machine is. bench/instructions.csv contains the previous counts; a count may differ from its previous
value by at most 5 %. --renew stores the new counts in bench/instructions.csv.
"""
import argparse
import csv
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from counted_runs import counted_runs

LEDGER, RELEASE = ROOT / "bench" / "instructions.csv", ROOT / "build" / "release"
COLUMNS = ["mesh", "hexahedra", "level", "way", "instructions"]
WITHIN = .05


def instructions_of(profile, library):
    """Returns the number of instructions executed in the code of `library` itself, according to a callgrind
    file. Instructions of other libraries that it calls are not counted."""
    total, ours, of_call = 0, False, False
    with open(profile, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            if line.startswith("ob="):
                ours = os.path.realpath(line[3:].strip()) == library
            elif line.startswith("calls="):
                of_call = True  # the next line contains the number of instructions of the called function
            elif line[:1].isdigit():
                if ours and not of_call:
                    total += int(line.split()[1])
                of_call = False
    return total


def count(program, library):
    """Runs the program under callgrind. Returns a dictionary that maps (mesh, hexahedra, level, way) to the
    number of instructions. The way is "encode" or "decode"."""
    counted = {tuple(line.split(",")): instructions_of(profile, os.path.realpath(library))
               for line, profile in counted_runs(program)}
    if not counted or not all(counted.values()):
        sys.exit(f"{program} does not run with {library}: none of its instructions were counted")
    return counted


def read_ledger():
    with open(LEDGER, newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == COLUMNS, f"{LEDGER} has other columns than {', '.join(COLUMNS)}"
    return {tuple(row[:-1]): int(row[-1]) for row in rows}


def write_ledger(counted):
    with open(LEDGER, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([*key, figure] for key, figure in counted.items())


def faults(counted, before):
    """Yields a message for each count that differs too much from its previous value."""
    for key in [*before, *(new for new in counted if new not in before)]:
        mesh, hexahedra, level, way = key
        name = f"{mesh}, {hexahedra} hexahedra, level {level}, {way}"
        if key not in counted or key not in before:
            yield f"{name}: only {'in the ledger' if key in before else 'counted now'}"
        elif abs(counted[key] - before[key]) > WITHIN * before[key]:
            more = 100 * (counted[key] / before[key] - 1)
            yield (f"{name}: {before[key]} -> {counted[key]} instructions, {more:+.1f} %, "
                   f"which is not within {100 * WITHIN:g} %")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", nargs="?", default=RELEASE / "bin" / "counted_coding")
    parser.add_argument("library", nargs="?",
                        default=RELEASE / "libshmformat" / "libshmformat.so")
    parser.add_argument("--renew", action="store_true")
    options = parser.parse_args()
    counted = count(options.program, options.library)
    if options.renew:
        write_ledger(counted)
        return 0
    found = list(faults(counted, read_ledger()))
    for fault in found:
        print(fault)
    if found:
        again = f"python3 {' '.join(sys.argv)} --renew"
        print(f"If this change is intended, {again} writes bench/{LEDGER.name} again")
    else:
        print(f"{len(counted)} counts agree with bench/{LEDGER.name}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
