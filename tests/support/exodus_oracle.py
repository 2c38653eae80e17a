#!/usr/bin/env python3
"""Compares two Exodus II files with netCDF's own ncdump. The script does not use this project's code.

usage: exodus_oracle.py A B

Compares the kind of netCDF file, all dimensions, variables, attributes and values, and the storage
options (chunks, filters, byte order, filling). The order of definitions does not matter. Only the attributes
in which netCDF records its own versions are ignored. Numbers are printed with enough digits to distinguish
all values except NaNs with different payloads. Exit code: 0 equal, 1 different (the differences are printed),
2 a file cannot be read.
"""
import re
import subprocess
import sys

# Argument of ncdump -p: numbers of significant digits for floats and for doubles. With these numbers of digits,
# different values have different texts.
DIGITS = "9,17"
# Names of attributes that record the versions of netCDF and HDF5 that wrote the file. They are not compared.
MADE_BY = (":_NCProperties", ":_SuperblockVersion")


def run(*command):
    result = subprocess.run(command, capture_output=True, text=True, errors="surrogateescape")
    if result.returncode != 0:
        print(f"{' '.join(command)}: {result.stderr.strip()}")
        sys.exit(2)
    return result.stdout


def statements(text):
    """Splits CDL text at semicolons and section headings, but not inside strings and comments."""
    token = re.compile(r'"(?:[^"\\]|\\.)*"|//[^\n]*|;|[^";/]+|/', re.DOTALL)
    current = []
    for match in token.finditer(text):
        piece = match.group()
        if piece.startswith("//"):
            # ncdump prints the current length of an unlimited dimension as a comment. All other comments are
            # ignored.
            if "currently" in piece:
                yield "length " + piece
            continue
        if piece == ";":
            yield "".join(current).strip()
            current = []
        else:
            current.append(piece)


def contents(path):
    """Returns the contents of a file as a dictionary from the name of each item to its text."""
    kind = run("ncdump", "-k", path).strip()
    storage = ["-s"] if kind.startswith("netCDF-4") else []  # ncdump -s fails on CDF-5
    text = run("ncdump", *storage, "-p", DIGITS, path)
    text = text[text.index("{") + 1:text.rindex("}")]
    found = {"kind": kind}
    section, last_dimension = "", ""
    for statement in statements(text):
        head = re.match(r"(dimensions|variables|data|group):", statement)
        if head:
            section = head.group(1)
            statement = statement[head.end():].strip()
        if not statement:
            continue
        if statement.startswith("length "):
            found[f"length of {last_dimension}"] = statement
            continue
        if section == "dimensions" and "=" in statement and not statement.startswith(":"):
            last_dimension = statement.split("=")[0].strip()
            found[f"dimension {last_dimension}"] = " ".join(statement.split())
            continue
        name, equals, value = statement.partition(" =")
        if section == "data" and equals:
            found[f"values of {name.strip()}"] = value if '"' in value else " ".join(value.split())
        elif equals and name.strip().endswith(MADE_BY):
            continue
        elif equals and ":" in name:
            found[f"attribute {name.strip()}"] = value.strip()
        else:
            declared = re.match(r"(\S+)\s+(\S+?)\s*(\(.*\))?$", statement, re.DOTALL)
            if declared is None:
                found[f"statement {statement}"] = ""
            else:
                found[f"variable {declared.group(2)}"] = " ".join(statement.split())
    return found


def shorten(text):
    return text if len(text) < 200 else text[:200] + "..."


def first_difference(a, b):
    """Describes where two long values differ."""
    left, right = a.split(","), b.split(",")
    if len(left) != len(right):
        return f"{len(left)} against {len(right)} values"
    for i, (x, y) in enumerate(zip(left, right)):
        if x != y:
            return f"value {i}: {shorten(x.strip())} against {shorten(y.strip())}"
    return ""


def main():
    if len(sys.argv) != 3:
        print(__doc__)
        sys.exit(2)
    a, b = contents(sys.argv[1]), contents(sys.argv[2])
    differences = []
    for item in sorted(a.keys() | b.keys()):
        if item not in b:
            differences.append(f"{item}: only in the first file")
        elif item not in a:
            differences.append(f"{item}: only in the second file")
        elif a[item] != b[item]:
            detail = (first_difference(a[item], b[item]) if item.startswith("values")
                      else f"{shorten(a[item])} against {shorten(b[item])}")
            differences.append(f"{item}: {detail}")
    for line in differences[:20]:
        print(line)
    if len(differences) > 20:
        print(f"... and {len(differences) - 20} more differences")
    sys.exit(1 if differences else 0)


main()
