#!/usr/bin/env python3
"""Checks that references in documents are valid.

  docs_test.py

The test checks these rules. Every relative link of every document leads to a file, and its #anchor to a
heading in that file. Every path in backticks that begins with a folder of this repository exists. README.md
has at most 140 lines. docs/architecture.md has a line for every folder of sources, and each module/unit that
it names exists. Its layer diagrams show each module above the modules that it may include according to the
table in rules_test.cpp. Every section of the specification that a comment of the library cites exists. Every
claim that scripts/claims measures occurs in its document with the same figure. Doxygen processes the public
headers without a warning.
"""
import itertools
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[2]
README_LINES = 140
FOLDERS = (".ci", "bench", "bindings", "cmake", "converters", "docs", "fuzz", "libshmformat", "packaging",
           "scripts", "spec", "tests")
# For each source tree: the heading of its table in architecture.md.
SOURCES = {"libshmformat/src": "Modules of the library", "converters": "Modules of the converters"}
MAP = ROOT / "docs" / "architecture.md"

LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(\s*<?([^)\s>]+)>?[^)]*\)")
CODE = re.compile(r"(?<!`)`([^`]+)`(?!`)")
ROW = re.compile(r"\| `([a-z]+(?:/[a-z]+)*)` \|")
# Regular expressions for the table in rules_test.cpp. TREE matches the beginning of the table of a source
# tree, ALLOWED matches one line of it.
TREE = re.compile(r'\{"([a-z/]+)",\s*\{\s*\{"')
ALLOWED = re.compile(r'\{"([a-z/]+)",\s*\{((?:\s*"[a-z/]+",?)*)\s*\}\}')
CITED = re.compile(r'spec: ((?:"[^"]+"[, /\n]*)+)')
HEADING = re.compile(r"#{1,6}\s+(.*?)\s*#*$")


def documents():
    yield from sorted(ROOT.glob("*.md"))
    for folder in FOLDERS:
        yield from sorted((ROOT / folder).rglob("*.md"))


def prose(text):
    """Returns the lines of a document that are outside of fenced code, with their line numbers."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"\s*(```|~~~)", line)
        if mark and fence in (None, mark[1]):
            fence = None if fence else mark[1]
        elif not fence:
            yield number, line


def anchors(path):
    """Returns the anchors of a document's headings, as GitHub builds them."""
    found = set()
    for _, line in prose(path.read_text(encoding="utf-8")):
        heading = HEADING.match(line)
        if not heading:
            continue
        text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading[1]).replace("`", "").lower()
        anchor = re.sub(r"[^\w\- ]", "", text).replace(" ", "-")
        found.add(next(a for n in itertools.count()
                       if (a := f"{anchor}-{n}" if n else anchor) not in found))
    return found


def wrong_link(document, target):
    """Returns the reason why a link is wrong, or None if the link is correct."""
    if re.match(r"[a-z][a-z+.-]*:", target, re.IGNORECASE):
        return None  # an external link
    name, _, anchor = unquote(target).partition("#")
    path = (document.parent / name).resolve() if name else document
    if not path.is_relative_to(ROOT) or not path.exists():
        return f"the link {target} leads to no file"
    if anchor and path.suffix == ".md" and anchor not in anchors(path):
        return f"the link {target} leads to no heading"
    return None


def alternatives(path):
    """Expands a/{b,c} to a/b and a/c."""
    braces = re.search(r"\{([^{}]*)\}", path)
    if not braces:
        return [path]
    return [each for word in braces[1].split(",")
            for each in alternatives(path[:braces.start()] + word + path[braces.end():])]


def missing_paths(code):
    """Yields the paths in `code` that begin with a folder of this repository but do not exist."""
    for word in code.split():
        if "/" not in word or word.split("/")[0] not in FOLDERS:
            continue
        for path in alternatives(word.rstrip(".,:;")):
            if not any(ROOT.glob(path.rstrip("/"))):
                yield path


def modules(top):
    """Returns the source folders below `top` as a dictionary. The keys are the module names in
    architecture.md, such as "vtk/xml"."""
    return {path.parent.relative_to(ROOT / top).as_posix(): path.parent
            for path in (ROOT / top).rglob("*.*")
            if path.suffix in (".cpp", ".h") and path.parent != ROOT / top}


def rows_below(heading, lines):
    """Yields the first cell and the line number of each table row in the section below `heading`."""
    within = False
    for number, line in lines:
        if line.startswith("## "):
            within = line == f"## {heading}"
        elif within and (row := ROW.match(line)):
            yield row[1], number


def faults_of_map(lines):
    trees = [modules(top) for top in SOURCES]
    for folders, heading in zip(trees, SOURCES.values()):
        listed = dict(rows_below(heading, lines))
        for module in sorted(set(folders) - set(listed)):
            yield 1, f"no line for the folder {folders[module].relative_to(ROOT)}"
        for module in sorted(set(listed) - set(folders)):
            yield listed[module], f"there is no folder {module}"
    for number, line in lines:
        for code in CODE.findall(line):
            module, _, unit = code.rpartition("/")
            found = [any(folders[module].glob(unit + ".*")) for folders in trees if module in folders]
            if found and unit and not any(code in folders for folders in trees) and found.count(True) != 1:
                yield number, f"there is {'more than one' if any(found) else 'no'} unit {code}"


def layers(text):
    """Returns one dictionary for each layer diagram in `text`. The dictionary maps each module in the diagram
    to the number of its line."""
    section = text.partition("\n## Layers\n")[2].partition("\n## ")[0]
    numbered = enumerate(section.splitlines())
    return [{module: number for number, line in lines for module in line.split()}
            for is_picture, lines in itertools.groupby(numbered, lambda line: line[1].startswith("    "))
            if is_picture]


def allowed(rules):
    """Reads the tables in rules_test.cpp. Returns a dictionary from each tree to a list of pairs: a module,
    and the modules that it may include."""
    trees = list(TREE.finditer(rules))
    ends = [tree.start() for tree in trees[1:]] + [len(rules)]
    return {tree[1]: [(module, re.findall('"(.*?)"', others))
                      for module, others in ALLOWED.findall(rules[tree.start():end])]
            for tree, end in zip(trees, ends)}


def faults_of_layers(text):
    pictures = layers(text)
    tables = allowed((ROOT / "tests/library/rules_test.cpp").read_text(encoding="utf-8"))
    if list(tables) != list(SOURCES) or len(pictures) != len(tables):
        yield 1, f"there are {len(pictures)} pictures of the layers, and rules_test.cpp has {' and '.join(tables)}"
        return
    for heights, (top, table) in zip(pictures, tables.items()):
        for module in sorted(set(heights) ^ {module for module, _ in table}):
            yield 1, f"{top}: the module {module} must be in both the picture of the layers and rules_test.cpp"
        for module, may_include in table:
            for lower in may_include:
                if heights.get(lower, 0) <= heights.get(module, 0):
                    yield 1, f"{top}: {module} may include {lower}, which is not below it in the picture"


def faults_of_citations(text):
    """Returns the sections that comments of the library cite but that `text` does not contain as a heading or
    in bold."""
    sections = set(re.findall(r"^#+ (?:\d+ )?(.*)$", text, re.MULTILINE))
    sections |= set(re.findall(r"\*\*(.*?)\.?\*\*", text))
    for path in sorted((ROOT / "libshmformat").rglob("*.*")):
        if path.suffix not in (".h", ".cpp"):
            continue
        code = re.sub(r"\s*\n//+ ?", " ", path.read_text(encoding="utf-8"))
        for section in re.findall('"(.*?)"', " ".join(CITED.findall(code))):
            if section not in sections:
                yield 1, f'{path.relative_to(ROOT)} cites a section "{section}"'


def faults(document):
    text = document.read_text(encoding="utf-8")
    lines = list(prose(text))
    for number, line in lines:
        for target in LINK.findall(CODE.sub("", line)):
            if reason := wrong_link(document, target):
                yield number, reason
        for code in CODE.findall(line):
            for path in missing_paths(code):
                yield number, f"there is no {path}"
    if document == ROOT / "README.md" and len(text.splitlines()) > README_LINES:
        yield README_LINES, f"more than {README_LINES} lines"
    if document == MAP:
        yield from faults_of_map(lines)
        yield from faults_of_layers(text)
    if document == ROOT / "spec/shm_format.md":
        yield from faults_of_citations(text)


def lost_claims():
    """Finds the claims that scripts/claims lists for a document but that are missing from the text of this
    document. Line breaks are ignored."""
    claims = subprocess.run([sys.executable, ROOT / "scripts" / "claims", "--list"], check=True,
                            capture_output=True, text=True).stdout.splitlines()
    if not claims:
        yield "scripts/claims", "lists no claims"
    for claim in claims:
        name, _, words = claim.partition(": ")
        figure = re.search(r"\{[^{}]*\d[^{}]*\}|\{third\}", words)
        plain = words.replace("{", "").replace("}", "")
        if not figure or plain not in " ".join((ROOT / name).read_text(encoding="utf-8").split()):
            yield name, f"lacks a claim that scripts/claims measures: {words}"


def faults_of_headers():
    """Runs Doxygen and returns its warnings. Also checks two of the generated pages: each must contain a
    certain sentence from the comments."""
    (ROOT / "build").mkdir(exist_ok=True)
    done = subprocess.run(["doxygen", "docs/Doxyfile"], cwd=ROOT, capture_output=True, text=True)
    for line in done.stderr.splitlines() or ([done.stdout] if done.returncode else []):
        yield line.removeprefix(f"{ROOT}/")
    for page, words in (("shmformat_8h.html", "Fills all targets in one pass"),
                        ("classshm_1_1MeshExtractor.html", "Starts a request for a piece, and cancels the previous request.")):
        if words not in re.sub("<[^>]+>", "", (ROOT / "build/api/html" / page).read_text(encoding="utf-8")):
            yield f"{page} lacks: {words}"


def main():
    count = 0
    for document in documents():
        for number, reason in faults(document):
            print(f"{document.relative_to(ROOT)}:{number}: {reason}")
            count += 1
    for name, reason in lost_claims():
        print(f"{name}: {reason}")
        count += 1
    for reason in faults_of_headers():
        print(reason)
        count += 1
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
