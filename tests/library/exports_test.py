#!/usr/bin/env python3
"""Checks that the shared library exports exactly the names that its public headers declare.

  exports_test.py LIBSHMFORMAT.SO     (exit code 77, skipped, if nm is missing)

Each name that nm lists must be in namespace shm, and each part of the name must occur in a header of
include/shm. The library must not export members of Impl classes, of inner namespaces, or of templates of the
standard library.
"""
import re
import shutil
import subprocess
import sys
from pathlib import Path

HEADERS = Path(__file__).resolve().parents[2] / "libshmformat" / "include" / "shm"
KINDS = re.compile(r"^(vtable for|typeinfo for|typeinfo name for|non-virtual thunk to) ")


def exported(library):
    listed = subprocess.run(["nm", "--dynamic", "--defined-only", "--demangle", library],
                            capture_output=True, text=True, check=True).stdout
    return sorted({line.split(maxsplit=2)[2] for line in listed.splitlines()})


def words_of_headers():
    code = "\n".join(path.read_text(encoding="utf-8") for path in HEADERS.glob("*.h"))
    return set(re.findall(r"\w+", re.sub(r"//.*", "", code))) - {"Impl", "std", "detail"}


def fault(symbol, words):
    """Returns the reason why a symbol must not be exported, or None if exporting it is correct."""
    name = KINDS.sub("", symbol).split("(")[0]
    parts = re.sub(r"\[abi:\w+\]", "", name).split("::")
    if parts[0] != "shm" or len(parts) < 2:
        return "is not of namespace shm"
    unknown = [part for part in parts if part.removeprefix("~") not in words
               and not part.startswith("operator")]
    return f"{unknown[0]} is in no public header" if unknown else None


def main(library):
    if not shutil.which("nm"):
        print("no nm")
        return 77
    symbols, words = exported(library), words_of_headers()
    faults = [f"{symbol}: {reason}" for symbol in symbols if (reason := fault(symbol, words))]
    for name in ("shm::Writer::finish()", "shm::Reader::next()", "typeinfo for shm::ByteSink",
                 "non-virtual thunk to shm::SectionSource::read("):
        if not any(symbol.startswith(name) for symbol in symbols):
            faults.append(f"{name} is missing")
    print("\n".join(faults) or f"{len(symbols)} names, all part of the public interface")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
