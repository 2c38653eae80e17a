#!/usr/bin/python3
"""Runs every file of the corpus through the tool, as a user would.

corpus_test.py SHM            SHM: path of the tool; the corpus is the folder in SHM_CORPUS

For each file:
- It is compressed with orders `keep`, `stream` and `free`, and with order `stream` at level `fast`. `verify --against`
  reports that the result equals the source, and so does `diff`, with --match if the order changed.
- Each stream has the size that bench/ledger.csv lists, if it lists the file. `bench/ledger` updates the table
  after a change that alters sizes.
- Small files are converted to the other formats. `diff --match` reports only losses that the other format makes
  unavoidable.
- The streams of --json add up to the size of the output.
- The .shm file is decompressed to the source's format, and an independent reader (VTK, gmsh, netCDF's tools)
  finds source and result equal.
Prints a table of the features that each file exercises. A file of an unknown format is a failure. SHM_SHARE
limits the run to a sample (folder_test.py).
Exit code 0 if all checks succeed, 1 if one fails, 77 (skipped) if no corpus exists.
"""
import collections
import concurrent.futures
import csv
import json
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
LEDGER = os.path.join(os.path.dirname(os.path.dirname(HERE)), "bench", "ledger.csv")
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "support"))
from folder_test import sample_of  # noqa: E402

ORACLES = {  # key: source_format of `shm info`; value: extension for decompress, and the script that compares the files
    "vtk": (".vtk", "vtk_oracle.py"),
    "gmsh": (".msh", "gmsh_oracle.py"),
    "exodus": (".e", "exodus_oracle.py"),
    "ucd": (".inp", "ucd_oracle.py"),
    "vtu": (".vtu", "vtu_oracle.py"),
}
# Largest size in bytes of a source that is converted to all other formats. Converting larger files would be
# slow and would not test anything more.
LARGEST_CONVERTED = 1 << 20
FOLDERS = ("exodus", "vtk", "gmsh", "other")
# The values of --order and --level for each compression. The .shm file of the last entry is also decompressed.
CHOICES = (("stream", "fast"), ("stream", "default"), ("free", "default"), ("keep", "default"))


def run(command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    return done.returncode, (done.stderr + done.stdout).strip()[:400], done.stdout


def sizes_in_ledger():
    """Returns a dictionary that maps (mesh, order, level) to the size in bytes of each stream."""
    sizes = collections.defaultdict(dict)
    with open(LEDGER, newline="", encoding="utf-8") as table:
        for row in csv.DictReader(table):
            sizes[row["mesh"], row["order"], row["level"]][row["stream"]] = int(row["bytes"])
    return sizes


def exercised(info):
    """Returns the columns of a table row that describe a mesh, from `shm info --json`."""
    shapes = {}
    for block in info["blocks"]:
        kind = block["shape"] + (str(block["nodes_per_cell"] or "") if block["cells"] else " 0")
        shapes[kind] = shapes.get(kind, 0) + block["cells"]
    arrays = {}
    for array in info["arrays"]:
        kind = (array["role"].split(":")[-1] if array["role"]
                else f"{array['location']} {array['type']}x{array['components']}")
        arrays[kind] = arrays.get(kind, 0) + 1
    counts = [f"{n} {noun}" for noun, n in (("vertices", info["vertices"]),
                                            ("blocks", len(info["blocks"])),
                                            ("steps", len(info["step_times"])), ("sets", len(info["sets"])),
                                            ("extras", len(info["extras"]))) if n]
    return [info["source_format"], ", ".join(counts),
            ", ".join(f"{n} {kind}" for kind, n in sorted(shapes.items())),
            ", ".join(kind if n == 1 else f"{n} {kind}" for kind, n in sorted(arrays.items()))]


def cannot_hold(difference):
    """Returns true if a difference is an unavoidable loss that the conversion reports. Such losses are time
    steps and cell shapes that the other format does not have. Sets are another: the converted file (B) stores
    them as arrays or cells, which exist only in B."""
    kind, what = difference["kind"], difference["what"]
    if kind == "cells":
        return all(" of other cells " in place["value_b"] for place in difference["places"])
    if kind == "count" and what == "cells":
        return int(difference["b"]) > int(difference["a"])
    if kind == "values" and what == "array 'cell/BlockId'":
        # If blocks of different dimensions have the same number, the conversion replaces some of the numbers.
        return True
    return kind in ("steps", "only_in_b") or (kind, what) == ("unmatched", "cells of B")


def check_conversions(shm, path, source_format, scratch):
    wrong = []
    if os.path.getsize(path) > LARGEST_CONVERTED:
        return wrong
    for other, (extension, _) in ORACLES.items():
        converted = os.path.join(scratch, "converted" + extension)
        if other == source_format or run([shm, "convert", "-f", path, converted])[0] != 0:
            continue  # the other format does not accept some cells
        code, text, out = run([shm, "diff", path, converted, "--match", "--json"])
        if code not in (0, 1):
            wrong.append(f"diff with {other}: exit {code}: {text}")
        elif not all(map(cannot_hold, json.loads(out)["differences"])):
            wrong.append(f"diff with {other}: {text}")
    return wrong


def check(shm, path, sizes, scratch):
    """Checks one file. Returns the features that it exercises, and a list of errors."""
    code, text, out = run([shm, "info", path, "--json"])
    if code != 0:
        return [], [f"info: exit {code}: {text}"]
    info = json.loads(out)
    return exercised(info), round_trip(shm, path, info["source_format"], sizes, scratch)


def name_of(path):
    return "/".join(path.split(os.sep)[-2:])


def round_trip(shm, path, source_format, sizes, scratch):
    wrong = []
    packed = os.path.join(scratch, "packed.shm")
    for order, level in CHOICES:
        code, text, out = run([shm, "compress", "-f", path, "-o", packed, "--order", order, "--level", level, "--json"])
        if code != 0:
            wrong.append(f"compress {order} {level}: exit {code}: {text}")
            continue
        report = json.loads(out)
        streams = report["streams"]
        if sum(streams.values()) != report["output_bytes"]:
            wrong.append(f"{order} {level}: streams do not add up to the output")
        if os.path.getsize(packed) != report["output_bytes"]:
            wrong.append(f"{order} {level}: output_bytes is not the size of the file")
        listed = sizes.get((name_of(path), order, level), streams)
        if streams != listed:
            wrong.append(f"{order} {level}: streams have {streams} bytes, but bench/ledger.csv lists {listed}")
        code, text, _ = run([shm, "verify", packed, "--against", path])
        if code != 0:
            wrong.append(f"verify {order} {level}: exit {code}: {text}")
        code, text, _ = run([shm, "diff", path, packed] + ([] if order == "keep" else ["--match"]))
        if code != 0:
            wrong.append(f"diff {order} {level}: exit {code}: {text}")
    wrong += check_conversions(shm, path, source_format, scratch)
    if wrong:
        return wrong
    extension, oracle = ORACLES[source_format]
    back = os.path.join(scratch, "back" + extension)
    code, text, _ = run([shm, "decompress", "-f", packed, "-o", back])
    if code != 0:
        return [f"decompress: exit {code}: {text}"]
    code, text, _ = run(["/usr/bin/python3", os.path.join(os.path.dirname(HERE), "support", oracle), path, back])
    if code != 0:
        wrong.append(f"{oracle}: exit {code}: {text}")
    return wrong


def main():
    shm = sys.argv[1]
    corpus = os.environ.get("SHM_CORPUS", "")
    if not os.path.isdir(corpus):
        print("skipped: SHM_CORPUS names no folder, so no corpus file was tried")
        return 77
    files = sample_of([os.path.join(corpus, folder, name)
                       for folder in FOLDERS for name in sorted(os.listdir(os.path.join(corpus, folder)))])

    sizes = sizes_in_ledger()

    def one(path):
        with tempfile.TemporaryDirectory() as scratch:
            return check(shm, path, sizes, scratch)

    bad = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for path, (columns, wrong) in zip(files, pool.map(one, files)):
            name = name_of(path)
            print(" | ".join([name, *columns]))
            for sentence in wrong:
                print(f"{name}: {sentence}")
            bad += bool(wrong)
    print(f"{len(files) - bad} of {len(files)} corpus files pass all checks")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
