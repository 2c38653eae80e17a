#!/usr/bin/env python3
"""Builds the page shm.html: a single HTML file that contains its scripts, its style and the decoder.

    inline.py PAGE MODULES PACKAGE OUT

PAGE: the folder of index.html, style.css and main.js. MODULES: the folder of the web package's JavaScript. PACKAGE: the
folder of the built web package, with shmformat.wasm, LICENSE and licences/. OUT: the file to write. All modules are
joined into one script, in which each module is a function and comes after its dependencies. The decoder is compressed
with gzip. With the same version of zlib, the same sources produce the same bytes. The page's Content-Security-Policy
allows only the script and the style of the page, identified by their hashes.
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
# The expressions in remote.js that locate the worker: in browsers (WORKER) and in Node.js (NODES_WORKER). This script
# replaces them. The page uses a classic script as worker, because Chromium does not start a module worker from a Blob
# URL if the page was opened from file://.
WORKER = 'new URL("./worker.js", import.meta.url), { type: "module" }'
NODES_WORKER = 'new URL("./worker.js", import.meta.url)'
# The expression that locates the decoder. It is replaced by null, because the page passes its embedded decoder to the
# npm package.
DECODER = 'new URL("./shmformat.wasm", import.meta.url)'


def fail(sentence):
    sys.exit(f"inline.py: {sentence}")


def name_of(path):
    return "$" + re.sub(r"\W", "_", path.stem)


def module(path, done, into):
    """Adds the modules that a module imports, and then the module itself, to the list `into`. Modules in `done` are
    skipped."""
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
        fail(f"{path}: unsupported form of import or export")
    into.append((path, source, exports))


def script_of(entry, worker_url=None):
    """Returns a script that consists of a module and all modules that it imports. The module itself comes last, and is
    not inside a function."""
    modules = []
    module(entry.resolve(), set(), modules)
    names = [name_of(path) for path, _, _ in modules]
    if len(set(names)) != len(names):
        fail("two modules have the same name")
    script = ""
    for path, source, exports in modules[:-1]:
        if path.name == "remote.js":
            if source.count(WORKER) != 1 or source.count(NODES_WORKER) != 2 or worker_url is None:
                fail(f"{path} must contain {WORKER} exactly once, and {NODES_WORKER} exactly once elsewhere")
            source = source.replace(WORKER, worker_url).replace(NODES_WORKER, "null")
        source = source.replace(DECODER, "null")
        script += f"const {name_of(path)} = (() => {{\n{source}return {{ {', '.join(exports)} }};\n}})();\n"
    script += modules[-1][1]
    if "import.meta" in script:
        fail("a script that is embedded in the page cannot use import.meta")
    if re.search(r"</script|<!--", script, re.I):
        fail("a script must not contain </script or <!--")
    return script


def packed(decoder):
    """Compresses the decoder with gzip, without a time stamp, and returns the result as base64."""
    make = zlib.compressobj(9, zlib.DEFLATED, 31)
    return base64.b64encode(make.compress(decoder) + make.flush()).decode("ascii")


def licences(package):
    """Returns the texts of the licences of the project and of the libraries in the decoder."""
    text = ""
    for path in [package / "LICENSE", *sorted((package / "licences").glob("*.txt"))]:
        text += f"\n==== {path.stem}\n\n{path.read_text(encoding='utf-8')}"
    if re.search(r"</script|<!--", text, re.I):
        fail("a licence text must not contain </script or <!--")
    return text


def hash_of(text):
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    page, modules, package, out = map(Path, sys.argv[1:])
    # The npm package normally loads its decoder and its worker from files in its own folder. In the page, opening.js
    # supplies them instead.
    script = "\n" + script_of(page / "main.js", "globalThis.shmWorkerUrl()")
    style = "\n" + (page / "style.css").read_text(encoding="utf-8")
    inside = {
        "style": style,
        "script": script,
        # The script of the worker is wrapped in an async function, because it uses top-level await, which is not
        # allowed in a classic script.
        "worker": f"\n(async () => {{\n\"use strict\";\n{script_of(modules / 'worker.js')}}})();\n",
        "licences": licences(package),
        "decoder": packed((package / "shmformat.wasm").read_bytes()),
        "policy": f"default-src 'none'; script-src {hash_of(script)} 'wasm-unsafe-eval'; style-src {hash_of(style)}; "
                  "worker-src blob:; connect-src https: http:; base-uri 'none'; form-action 'none'",
    }
    template = (page / "index.html").read_text(encoding="utf-8")
    used = re.findall(r"\{(\w+)\}", template)
    if sorted(used) != sorted(inside):
        fail(f"index.html has the placeholders {used}, but each of {sorted(inside)} must occur exactly once")
    whole = re.sub(r"\{(\w+)\}", lambda match: inside[match[1]], template)
    # Writes a temporary file first, so that OUT is complete when it appears under its name.
    part = out.with_name(out.name + ".part")
    part.write_text(whole, encoding="utf-8", newline="\n")
    os.replace(part, out)


if __name__ == "__main__":
    main()
