#!/usr/bin/env python3
"""Checks that reading a file designed to be expensive does not need much more work per byte than reading an
ordinary file. Bytes are those read from the file plus those delivered to the caller.

  hostile_work_test.py PROGRAM     (exit code 77, skipped: no valgrind)

PROGRAM is hostile_work_tests. Work is the number of instructions that callgrind counts. It does not depend on
the load of the machine.
"""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from counted_runs import counted_runs, instructions_of

# For each file: the limit on the work per byte, divided by the work per byte of the ordinary file. Each limit
# is twice the ratio measured with g++ 12 at -O3, but at least 0.2. A reader whose work is quadratic in the
# number of steps, chunks, blocks, arrays or extras exceeds these limits.
MOST = {"by item": {"ordinary": 1, "one cell in rows": 3, "one cell in shifts": 2, "one cell in tiny groups": 2.6,
                    "one cell in tiny segments": 4, "tiny segments": 9, "empty chunks": .5, "extras": 1.7, "blocks": 1.1,
                    "arrays": 43},
        "by index": {"ordinary": 1, "one cell in rows": 3.6, "one cell in shifts": 2.6, "one cell in tiny groups": 1.4,
                     "one cell in tiny segments": 1.1, "tiny segments": 1.9, "empty chunks": .2, "extras": .2, "blocks": .5,
                     "arrays": 32}}


def main():
    rates = {way: {} for way in MOST}
    for line, profile in counted_runs(sys.argv[1]):
        name, way, amount = line.split(",")
        rates[way][name] = instructions_of(profile) / int(amount)
    failed = False
    for way, limits in MOST.items():
        if limits.keys() != rates[way].keys():
            sys.exit(f"{way}: counted {', '.join(rates[way])}, but there are limits for {', '.join(limits)}")
        for name, most in limits.items():
            ratio = rates[way][name] / rates[way]["ordinary"]
            print(f"{name}, {way}: {ratio:.2f}, at most {most}{'' if ratio <= most else ': too much work'}")
            failed = failed or ratio > most
    return failed


if __name__ == "__main__":
    sys.exit(main())
