#!/usr/bin/env python3
"""Checks that the page shm.html is a single small file without references to other files, and that its modules work.

  page_test.py PACKAGE

PACKAGE is the folder of the built web package, which contains shm.html. scripts/test-web tests the page in a
browser (page_in_browser.py). page_modules_test.mjs tests the functions of the page's modules with Node.js.
"""
import base64
import gzip
import hashlib
import html.parser
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

if len(sys.argv) < 2:
    sys.exit(__doc__)
PACKAGE = Path(sys.argv[1]).resolve()
del sys.argv[1:]
NODE = shutil.which("node") or shutil.which("nodejs")
if NODE is None or not (PACKAGE / "shm.html").exists():
    print("node or the page is missing (run scripts/setup --web, build the target web): nothing was tested")
    sys.exit(77)

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "bindings" / "web" / "page"
MOST_BYTES = 1_600_000
FETCHING = {"src", "href", "srcset", "data", "action", "formaction", "poster", "background", "style", "srcdoc", "ping"}


class Elements(html.parser.HTMLParser):
    """An HTML parser that collects the attributes of all elements, and the contents of scripts and styles."""

    def __init__(self, page):
        super().__init__(convert_charrefs=True)
        self.found, self.inside, self.open = [], {}, None
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        self.open = dict(attrs).get("id", dict(attrs).get("type", tag)) if tag in ("script", "style") else None
        if self.open is not None:
            self.inside[self.open] = ""

    def handle_data(self, data):
        if self.open is not None:
            self.inside[self.open] += data

    def handle_endtag(self, tag):
        if tag in ("script", "style"):
            self.open = None


def colours():
    """Returns the colours that converters/picture uses for blocks and values."""
    text = (ROOT / "converters" / "picture" / "colours.cpp").read_text(encoding="utf-8")

    def table(name):
        inside = re.search(rf"{name} = \{{\{{(.*?)\}}\}};", text, re.S)[1]
        return [[int(part, 0) for part in one.split(",")] for one in re.findall(r"\{([^{}]+)\}", inside + "}")]

    def between(a, b, part, of):
        return [(x * (of - part) + y * part + of // 2) // of for x, y in zip(a, b)]

    hues = table("kHues")
    return {"blocks": hues + [between(hue, [0] * 3, 2, 5) for hue in hues]
            + [between(hue, [255] * 3, 1, 2) for hue in hues], "values": table("kValues"), "none": [150] * 3}


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.bytes = (PACKAGE / "shm.html").read_bytes()
        cls.text = cls.bytes.decode("utf-8")
        cls.elements = Elements(cls.text)

    def test_is_small(self):
        self.assertGreater(len(self.bytes), 100_000)
        self.assertLess(len(self.bytes), MOST_BYTES)

    def test_refers_to_nothing_else(self):
        for tag, attributes in self.elements.found:
            self.assertFalse(FETCHING & set(attributes), f"<{tag}> {attributes}")
            self.assertFalse([name for name in attributes if name.startswith("on")], f"<{tag}> {attributes}")
            self.assertNotIn(tag, ("link", "iframe", "object", "embed", "base", "img"))
        self.assertNotRegex(self.elements.inside["style"], r"url\(|@import")
        for script in ("module", "worker"):
            self.assertNotRegex(self.elements.inside[script], r"https?://[\w.]")
            loaded = set(re.findall(r"\bimport\(([^)]*)\)", self.elements.inside[script]))
            self.assertLessEqual(loaded, {'"node:fs/promises"', '"node:url"', '"node:worker_threads"'})

    def test_words_of_files_become_text(self):
        for name in SOURCE.glob("*.js"):
            self.assertNotRegex(name.read_text(encoding="utf-8"),
                                r"innerHTML|outerHTML|insertAdjacent|document\.write|\beval\(|new Function", name)

    def test_policy_lets_run_what_is_inside_alone(self):
        policies = [attributes["content"] for tag, attributes in self.elements.found
                    if tag == "meta" and attributes.get("http-equiv") == "Content-Security-Policy"]
        self.assertEqual(len(policies), 1)
        rules = dict(rule.strip().split(" ", 1) for rule in policies[0].split(";"))

        def hashed(text):
            return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"

        self.assertEqual(rules, {
            "default-src": "'none'", "script-src": f"{hashed(self.elements.inside['module'])} 'wasm-unsafe-eval'",
            "style-src": hashed(self.elements.inside["style"]), "worker-src": "blob:",
            "connect-src": "https: http:", "base-uri": "'none'", "form-action": "'none'"})
        # The security policy must precede every element that it restricts.
        self.assertLess(self.text.index("Content-Security-Policy"), self.text.index("<style>"))

    def test_decoder_is_that_of_the_package(self):
        packed = base64.b64decode(self.elements.inside["decoder"], validate=True)
        self.assertEqual(gzip.decompress(packed), (PACKAGE / "shmformat.wasm").read_bytes())

    def test_licences_come_along(self):
        for word in ("libshmformat", "zstd", "xxHash", "WebAssembly", "LLVM"):
            self.assertIn(word, self.elements.inside["licences"])

    def test_is_made_the_same_again(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "again.html"
            subprocess.run([sys.executable, SOURCE / "inline.py", SOURCE, SOURCE.parent / "npm",
                            PACKAGE, out], check=True)
            self.assertEqual(out.read_bytes(), self.bytes)

    def test_scripts_are_whole(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("module", "worker"):
                script = Path(folder) / f"{name}.mjs"
                script.write_text(self.elements.inside[name], encoding="utf-8")
                done = subprocess.run([NODE, "--check", script], capture_output=True, text=True, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)

    def test_place_for_a_file(self):
        """`shm view` (converters/tool/shown/page.cpp) embeds a file in the script element `file`, and expects
        exactly this tag."""
        place = '<script type="application/octet-stream" id="file" data-name=""></script>'
        self.assertEqual(self.text.count(place), 1)
        self.assertIn(place, (ROOT / "converters" / "tool" / "shown" / "page.cpp").read_text(encoding="utf-8"))

    def test_words_of_the_page_have_elements(self):
        """Every id that main.js looks up exists exactly once, and labels refer to existing elements."""
        ids = [attributes["id"] for _, attributes in self.elements.found if "id" in attributes]
        self.assertEqual(len(ids), len(set(ids)))
        wanted = set(re.findall(r'\$\("([\w-]+)"\)', (SOURCE / "main.js").read_text(encoding="utf-8")))
        self.assertGreater(len(wanted), 30)
        self.assertLessEqual(wanted, set(ids))
        for _, attributes in self.elements.found:
            if "for" in attributes:
                self.assertIn(attributes["for"], ids)


class Modules(unittest.TestCase):
    def test_functions(self):
        with tempfile.TemporaryDirectory() as folder:
            for module in SOURCE.glob("*.js"):
                shutil.copy(module, folder)
            (Path(folder) / "package.json").write_text('{"type": "module"}', encoding="utf-8")
            environment = {**os.environ, "SHM_PAGE": folder, "SHM_COLOURS": json.dumps(colours())}
            done = subprocess.run([NODE, str(Path(__file__).with_name("page_modules_test.mjs"))], env=environment,
                                  capture_output=True, text=True, check=False, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"# pass [1-9]")


if __name__ == "__main__":
    unittest.main()
