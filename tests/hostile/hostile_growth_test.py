#!/usr/bin/env python3
"""Checks that the work of reading, converting and comparing files grows in proportion to their size.

  hostile_growth_test.py PROGRAM     (exit code 77, skipped: no valgrind)

PROGRAM is hostile_files_tests. Each of its tests named Growth does the same work twice: on a small input, and
on an input that is four times larger. Proportional work multiplies the number of instructions by 4, quadratic
work by 16.
"""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from counted_runs import counted_runs, instructions_of

LARGER, MOST = 4, 6


def main():
    counts = {}
    for line, profile in counted_runs(sys.argv[1], "--gtest_filter=Growth.*"):
        name, size = line.split(",")
        counts.setdefault(name, []).append((int(size), instructions_of(profile)))
    failed = not counts
    for name, ((small, few), (large, many)) in counts.items():
        assert large == LARGER * small
        print(f"{name}, {small} and {large}: {many / few:.2f} times as many instructions, at most {MOST}")
        failed = failed or many > MOST * few
    return failed


if __name__ == "__main__":
    sys.exit(main())
