#!/usr/bin/env python3
"""Makes the page: one file with all that it needs inside.

    inline.py PAGE MODULES PACKAGE OUT

PAGE: the folder of index.html, style.css and main.js; MODULES: that of the web package's JavaScript; PACKAGE: the web
package as it is built, with shmformat.wasm, LICENSE and licences/. Modules become functions in one script, in the
order in which they need each other; the decoder is packed by gzip. The same sources give the same bytes, as far as
zlib does. The page's policy names script and style by their hashes: nothing else is run.
"""
import base64
import hashlib
import os
import re
import sys
import zlib
from pathlib import Path

IMPORT = re.compile(r"^import (\{[^}]*\})\s*from \"(\.[^\"]+)\";\n", re.M)
EXPORT = re.compile(r"^export (?=(?:async )?(?:function|class|const) (\w+))", re.M)
EXPORTED = re.compile(r"^export \{([^}]*)\};\n", re.M)
# Where the package starts its worker in browsers, and in Node.js, as bundlers look for it. The page's is no module:
# of a Blob of a page from file:// Chromium starts no other.
WORKER = 'new URL("./worker.js", import.meta.url), { type: "module" }'
NODES_WORKER = 'new URL("./worker.js", import.meta.url)'
# What the page has in itself, and gives to the package: it is never looked for.
DECODER = 'new URL("./shmformat.wasm", import.meta.url)'


def fail(sentence):
    sys.exit(f"inline.py: {sentence}")


def name_of(path):
    return "$" + re.sub(r"\W", "_", path.stem)


def module(path, done, into):
    """Adds a module to the list `into`, behind those that it imports."""
    if path in done:
        return
    done.add(path)
    source = path.read_text(encoding="utf-8")

    def taken(match):
        imported = (path.parent / match[2]).resolve()
        module(imported, done, into)
        return f"const {match[1].replace(' as ', ': ')} = {name_of(imported)};\n"

    source = IMPORT.sub(taken, source)
    exports = [word.strip() for match in EXPORTED.findall(source) for word in match.split(",")]
    source = EXPORTED.sub("", source)
    exports += EXPORT.findall(source)
    source = EXPORT.sub("", source)
    if re.search(r"^(import|export)\b", source, re.M):
        fail(f"{path}: an import or export of a kind that is not known here")
    into.append((path, source, exports))


def script_of(entry, worker_url=None):
    """One script of a module and all that it imports. The entry stands last, in no function."""
    modules = []
    module(entry.resolve(), set(), modules)
    names = [name_of(path) for path, _, _ in modules]
    if len(set(names)) != len(names):
        fail("two modules have one name")
    script = ""
    for path, source, exports in modules[:-1]:
        if path.name == "remote.js":
            if source.count(WORKER) != 1 or source.count(NODES_WORKER) != 2 or worker_url is None:
                fail(f"{path}: {WORKER} and {NODES_WORKER} were expected, each once")
            source = source.replace(WORKER, worker_url).replace(NODES_WORKER, "null")
        source = source.replace(DECODER, "null")
        script += f"const {name_of(path)} = (() => {{\n{source}return {{ {', '.join(exports)} }};\n}})();\n"
    script += modules[-1][1]
    if "import.meta" in script:
        fail("a script that is inside of a page has no place")
    if re.search(r"</script|<!--", script, re.I):
        fail("a script may not hold the end of one")
    return script


def packed(decoder):
    """As gzip has it, without the time."""
    make = zlib.compressobj(9, zlib.DEFLATED, 31)
    return base64.b64encode(make.compress(decoder) + make.flush()).decode("ascii")


def licences(package):
    """Those of the project, and of what is compiled into the decoder."""
    text = ""
    for path in [package / "LICENSE", *sorted((package / "licences").glob("*.txt"))]:
        text += f"\n==== {path.stem}\n\n{path.read_text(encoding='utf-8')}"
    if re.search(r"</script|<!--", text, re.I):
        fail("a licence may not hold the end of a script")
    return text


def hash_of(text):
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    page, modules, package, out = map(Path, sys.argv[1:])
    # opening.js is where the page has what the package looks for beside itself.
    script = "\n" + script_of(page / "main.js", "globalThis.shmWorkerUrl()")
    style = "\n" + (page / "style.css").read_text(encoding="utf-8")
    inside = {
        "style": style,
        "script": script,
        # Its module awaits, which scripts that are no modules do in functions alone.
        "worker": f"\n(async () => {{\n\"use strict\";\n{script_of(modules / 'worker.js')}}})();\n",
        "licences": licences(package),
        "decoder": packed((package / "shmformat.wasm").read_bytes()),
        "policy": f"default-src 'none'; script-src {hash_of(script)} 'wasm-unsafe-eval'; style-src {hash_of(style)}; "
                  "worker-src blob:; connect-src https: http:; base-uri 'none'; form-action 'none'",
    }
    template = (page / "index.html").read_text(encoding="utf-8")
    used = re.findall(r"\{(\w+)\}", template)
    if sorted(used) != sorted(inside):
        fail(f"index.html has {used}, and {sorted(inside)} were expected, each once")
    whole = re.sub(r"\{(\w+)\}", lambda match: inside[match[1]], template)
    # Under its name it is whole.
    part = out.with_name(out.name + ".part")
    part.write_text(whole, encoding="utf-8", newline="\n")
    os.replace(part, out)


if __name__ == "__main__":
    main()
