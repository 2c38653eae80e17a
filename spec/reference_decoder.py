#!/usr/bin/env python3
"""Prints all that a .shm file holds, decoded by the text of shm_format.md and by nothing else.

    reference_decoder.py FILE.shm             the text that stands beside the golden files (tests/golden)
    reference_decoder.py --digest FILE.shm    digests in place of numbers and values

This is the format's second implementation. It shares no code with libshmformat and was written from the text alone, so
that whoever cannot read the C++ any more, or doubts it, has another witness. It wants to be read beside the text: its
modules follow the sections, with their names, and it is simple rather than fast (some ten thousand values a second).
It holds the file, and all neighbourhoods of a file with time steps, in memory.

    section        module           section     module
    1, 3, 4        basics.py        22          neighbourhoods.py
    2, 8-10, 38    file.py          23          domains.py
    5              schema.py        24, 25      columns.py
    6, 17, 18, 21  group.py         29, 33      rows.py, row_frame.py
    7              steps.py         30          vertex_numbers.py (numbers of 18 and 36 too)
    12-14, 32      coders.py        31          replay.py
    15, 16         surface.py       34, 35, 39  shifts.py
    19, 20         connectivity.py  36          mid_nodes.py
                                    37          other_cells.py
                                    43, 44      patterns.py

What sections 26 and 27 limit and reject stands where it acts. All of it is raised as ShmError. Section 40 is for who
heals files, and is not here.

Python 3.10 or later, its standard library, and libzstd and libxxhash, which libshmformat needs too (Debian: libzstd1,
libxxhash0).
"""

import argparse
import sys

from reference_decoder import ShmError, text_of


def main():
    parser = argparse.ArgumentParser(description="Prints all that a .shm file holds.")
    parser.add_argument("--digest", action="store_true", help="digests in place of numbers and values")
    parser.add_argument("file")
    arguments = parser.parse_args()
    try:
        with open(arguments.file, "rb") as file:
            data = file.read()
        for piece in text_of(data, arguments.digest):
            sys.stdout.buffer.write(piece)
    except (ShmError, OSError) as error:
        sys.stdout.flush()
        print(f"{arguments.file}: {error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
