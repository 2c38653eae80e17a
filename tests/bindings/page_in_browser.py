#!/usr/bin/env python3
"""Tests the page shm.html in headless Chromium: the pictures of real meshes, and the number of bytes that the
page fetches.

  page_in_browser.py PAGE SHM FOLDER HEXAHEDRA SECOND_ORDER MIXED [TEST...]

PAGE: shm.html. SHM: the tool. FOLDER: a folder for generated files. HEXAHEDRA, SECOND_ORDER and MIXED: .shm files of
hexahedra, of second-order cells, and of cells of several shapes. TEST: names of the tests to run, in the form
that unittest expects; by default, all tests are run. The script prints its measurements. scripts/test-web
runs it. Needs the program chromium.
"""
import functools
import http.server
import json
import random
import shutil
import subprocess
import sys
import threading
import unittest
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from browser import PROGRAM, Browser  # noqa: E402

MOST_SECONDS = 2.0  # maximum wall-clock time, on two cores, until a mesh of 35 thousand hexahedra is visible
PAGE = SHM = FOLDER = None
MESHES = {}
# Maximum number of bytes that the package reads from the beginning and the end of a file to open it.
FOUND = 24 << 10
# Error messages of the library: for a file of another format, for an empty file, and for a truncated file.
FOREIGN, EMPTY, CUT = "this is not a .shm file", "the file is too short", "has been cut"
# Messages of the package about a server.
NO_FILE, CLOSED = "there is no such file: the server answers 404", "the connection failed"

# Computes the contrast ratio between each text and its background, as defined by WCAG.
CONTRASTS = """(() => {
  const parts = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const light = (colour) => parts(colour).slice(0, 3).map((part) => part / 255)
    .map((part) => (part <= .04045 ? part / 12.92 : ((part + .055) / 1.055) ** 2.4))
    .reduce((sum, part, i) => sum + part * [.2126, .7152, .0722][i], 0);
  const ground = (one) => {
    const { backgroundColor: colour } = getComputedStyle(one);
    return (parts(colour)[3] ?? 1) > 0 ? colour : ground(one.parentElement);
  };
  for (const more of document.querySelectorAll("details")) more.open = true;
  return [...document.querySelectorAll("aside *, #legend *, #welcome *, dialog *, #error")]
    .filter((one) => [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim() !== ""))
    .filter((one) => !one.disabled)
    .map((one) => {
      const [a, b] = [light(getComputedStyle(one).color), light(ground(one))].sort((x, y) => y - x);
      return [`${one.tagName} ${one.id} ${one.textContent.slice(0, 20)}`, (a + .05) / (b + .05)];
    });
})()"""


def bent_bar(path, side, warmer=0, rough=0):
    """Writes a curved bar of side x side x 4*side hexahedra as legacy VTK. `warmer` is added to the values of
    vertices above the middle. `rough` is the largest random change of a coordinate. Returns the number of
    cells."""
    chance = random.Random(side)
    nodes = [(x, y, z) for z in range(4 * side + 1) for y in range(side + 1) for x in range(side + 1)]
    lines = ["# vtk DataFile Version 3.0", "bar", "ASCII", "DATASET UNSTRUCTURED_GRID", f"POINTS {len(nodes)} double"]
    lines += [f"{x + z * z / (16 * side) + rough * chance.random()} {y + x * y / (9 * side) + rough * chance.random()} {z}"
              for x, y, z in nodes]
    row, layer = side + 1, (side + 1) ** 2
    cells = []
    for z in range(4 * side):
        for y in range(side):
            for x in range(side):
                a = z * layer + y * row + x
                cells.append(f"8 {a} {a + 1} {a + 1 + row} {a + row} "
                             f"{a + layer} {a + 1 + layer} {a + 1 + row + layer} {a + row + layer}")
    lines += [f"CELLS {len(cells)} {9 * len(cells)}", *cells, f"CELL_TYPES {len(cells)}", *["12"] * len(cells)]
    lines += [f"POINT_DATA {len(nodes)}", "SCALARS height double 1", "LOOKUP_TABLE default"]
    lines += [str(z + x / 10 + (warmer if z > 2 * side else 0)) for x, y, z in nodes]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return len(cells)


@functools.cache
def long_file():
    """Creates a .shm file that is larger than a megabyte, with 131 thousand hexahedra in eight segments.
    Returns its path and cell count."""
    source, packed = FOLDER / "long.vtk", FOLDER / "long.shm"
    cells = bent_bar(source, 32, rough=.25)
    subprocess.run([SHM, "compress", source, "-fqo", packed, "--segment-cells", str(cells // 8)], check=True)
    return packed, cells


@functools.cache
def steps_file():
    """Creates a file with values at four time steps."""
    for step in range(4):
        bent_bar(FOLDER / f"run_{step}.vtk", 4, 5 * step)
    packed = FOLDER / "run.shm"
    subprocess.run([SHM, "compress", FOLDER / "run_%d.vtk", "-fqo", packed], check=True)
    return packed


class Ranges(http.server.SimpleHTTPRequestHandler):
    """An HTTP server that supports range requests, allows requests from pages of any origin, and counts the
    requests and the bytes that it sends. Files below /whole/ are always sent completely. Files below /closed/
    are sent only to pages of this server."""
    sent = requests = 0

    def do_GET(self):
        Ranges.requests += 1
        kind, _, rest = self.path.lstrip("/").partition("/")
        if kind in ("whole", "closed"):
            self.path = f"/{rest}"
        self.is_closed = kind == "closed"
        if self.headers.get("Range") is None or kind == "whole" or not Path(self.translate_path(self.path)).exists():
            return super().do_GET()
        data = Path(self.translate_path(self.path)).read_bytes()
        first, last = (int(part) for part in self.headers["Range"].removeprefix("bytes=").split("-"))
        body = data[first:last + 1]
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {first}-{first + len(body) - 1}/{len(data)}")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        Ranges.sent += len(body)
        self.wfile.write(body)
        return None

    def do_OPTIONS(self):
        self.send_response(204)
        self.end_headers()

    def end_headers(self):
        if not getattr(self, "is_closed", False):
            self.send_header("Access-Control-Allow-Origin", "*")
        self.send_header("Access-Control-Allow-Headers", "Range")
        self.send_header("Access-Control-Expose-Headers", "Content-Range, ETag")
        super().end_headers()

    def log_message(self, *_):
        pass


class Page(unittest.TestCase):
    def setUp(self):
        self.browser = Browser()
        self.addCleanup(self.browser.__exit__)
        self.browser.go(PAGE.as_uri())
        self.browser.wait("document.readyState === 'complete' && document.querySelector('#triad line[x2]') !== null")

    def go(self, address):
        """Opens a page and waits until it shows a mesh."""
        self.browser.go(address)
        self.browser.wait(f"location.href === {json.dumps(address)} && Number(document.body?.dataset.shown ?? 0) > 0")

    def shown(self):
        return int(self.browser.run("document.body.dataset.shown ?? 0"))

    def open(self, path):
        before = self.shown()
        self.browser.run("document.getElementById('error').hidden = true")
        root = self.browser.call("DOM.getDocument")["root"]["nodeId"]
        node = self.browser.call("DOM.querySelector", nodeId=root, selector="#file-input")["nodeId"]
        self.browser.call("DOM.setFileInputFiles", files=[str(path)], nodeId=node)
        return self.seen(before)

    def seen(self, before):
        return self.browser.wait(f"Number(document.body.dataset.shown ?? 0) > {before} "
                                 "|| !document.getElementById('error').hidden")

    def choose(self, control, value):
        before = self.shown()
        self.browser.run(f"(() => {{ const c = document.getElementById({json.dumps(control)}); "
                         f"c.value = {json.dumps(value)}; c.dispatchEvent(new Event('change', {{bubbles: true}})); "
                         "c.dispatchEvent(new Event('input', {bubbles: true})); })()")
        self.seen(before)

    def text(self, name="summary"):
        return self.browser.run(f"document.getElementById({json.dumps(name)}).textContent")

    def drawn(self):
        """Returns the number of pixels of each colour in the picture, excluding the white background."""
        _, _, found = self.browser.picture("#picture")
        counts = Counter(found)
        ground = (255, 255, 255)
        self.assertGreater(counts.pop(ground), 1000)
        return counts

    def no_errors(self):
        self.assertEqual(self.browser.errors, [])

    def serve(self):
        """Serves FOLDER until the test ends. Returns the URL of the server."""
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Ranges, directory=str(FOLDER)))
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        return f"http://127.0.0.1:{server.server_address[1]}"

    def facts(self, path):
        return json.loads(subprocess.run([SHM, "info", "--json", path], capture_output=True, check=True).stdout)

    def test_real_meshes_are_drawn_and_turned(self):
        for kind, path in MESHES.items():
            with self.subTest(kind):
                seconds = self.open(path)
                self.assertTrue(self.browser.run("document.getElementById('error').hidden"), self.text("error"))
                words = self.text()
                print(f"{kind}: {words} ({seconds:.2f} s)")
                info = self.facts(path)
                self.assertIn(f"{info['vertices']:,} vert", words)
                self.assertIn(f"{info['cells']:,} cell", words)
                drawn = self.drawn()
                self.assertGreater(sum(drawn.values()), 20_000)
                self.assertGreater(len(drawn), 8)
                pictures = {json.dumps(sorted(drawn.items()))}
                self.browser.run("document.getElementById('picture').focus()")
                self.browser.drag((300, 300), (420, 350))
                pictures.add(json.dumps(sorted(self.drawn().items())))
                for key in ("ArrowLeft", "1", "5"):
                    self.browser.key(key)
                    pictures.add(json.dumps(sorted(self.drawn().items())))
                self.assertEqual(len(pictures), 5)
                self.no_errors()

    def test_35_thousand_hexahedra_are_seen_soon(self):
        source, packed = FOLDER / "bar.vtk", FOLDER / "bar.shm"
        cells = bent_bar(source, 21)
        subprocess.run([SHM, "compress", source, "-fqo", packed], check=True)
        before = self.browser.processor_seconds()
        seconds = self.open(packed)
        processor = self.browser.processor_seconds() - before
        print(f"{cells} hexahedra are visible after {seconds:.2f} s (limit: {MOST_SECONDS} s); "
              f"{processor:.2f} s of CPU time")
        self.assertIn(f"{cells:,} cells", self.text())
        faces = 2 * 21 * 21 + 4 * 21 * 84
        self.assertIn(f"{faces:,} faces", self.text())
        self.assertLess(seconds, MOST_SECONDS)
        # Values, and the colours of their legend.
        before = self.drawn()
        self.choose("array", "0")
        self.assertIn("Colours: height, 0 to 86.1", self.text())
        self.assertEqual(self.text("legend-greatest"), "86.1")
        # The mesh leaves space for the legend.
        self.assertEqual([one for one in self.browser.picture("#legend-name")[2] if max(one) - min(one) > 40], [])
        yellow = sum(count for (red, green, blue), count in self.drawn().items() if min(red, green) > 2 * blue)
        self.assertGreater(yellow, 300)
        self.assertNotEqual(before, self.drawn())
        # A cut hides some cells and makes the interior of the mesh visible.
        self.choose("clip", "2")
        self.assertRegex(self.text(), r"Cut across z at 42\.")
        self.assertIn(f"{2 * 21 * 21 + 4 * 21 * 43:,} faces", self.text())
        self.choose("clip", "")
        self.assertIn(f"{faces:,} faces", self.text())
        self.no_errors()

    def axes(self):
        """Returns the directions of the axes."""
        return self.browser.run("[...document.querySelectorAll('#triad line')].map((one) => "
                                "[one.getAttribute('x2'), one.getAttribute('y2')]).join()")

    def size(self):
        """Returns the number of pixels that show the mesh or the frame that marks keyboard focus."""
        return sum(self.drawn().values())

    def test_fingers_wheel_and_keys(self):
        self.open(MESHES["hexahedra"])
        self.browser.run("document.getElementById('picture').focus()")
        axes, size = self.axes(), self.size()
        self.browser.touch([(300, 300), (340, 320), (380, 340)])
        self.assertNotEqual(self.axes(), axes)
        self.browser.key("7")
        self.assertEqual(self.axes(), axes)
        self.browser.touch([(300, 280), (300, 260), (300, 240)], [(300, 320), (300, 340), (300, 360)])
        self.assertEqual(self.axes(), axes)  # two fingers do not rotate the mesh
        self.assertGreater(self.size(), 1.5 * size)
        self.browser.key("f")
        self.browser.wheel((330, 300), -200)
        self.assertGreater(self.size(), 1.2 * size)
        # The same with the keyboard.
        self.browser.key("f")
        self.browser.key("+")
        self.assertGreater(self.size(), 1.2 * size)
        self.browser.key("-")
        self.assertEqual(self.size(), size)
        before = self.browser.picture("#picture")
        self.browser.key("ArrowRight", shift=True)
        self.assertEqual(self.axes(), axes)
        self.assertNotEqual(self.browser.picture("#picture"), before)
        self.browser.key("ArrowUp")
        self.assertNotEqual(self.axes(), axes)
        self.browser.key("7")
        self.assertEqual(self.axes(), axes)
        self.assertEqual(self.browser.picture("#picture"), before)
        self.browser.key("e")
        self.assertFalse(self.browser.run("document.getElementById('edges').checked"))
        self.assertNotEqual(self.browser.picture("#picture"), before)
        shown = self.shown()
        self.browser.key("c")
        self.seen(shown)
        self.assertIn("Cut across x", self.text())
        self.browser.key("?")
        self.assertTrue(self.browser.run("document.getElementById('help').open"))
        self.no_errors()

    def test_controls_have_names_and_are_reached_by_keys(self):
        self.browser.run("document.activeElement.blur()")
        self.browser.key("Tab")
        self.browser.key("Tab")
        self.assertEqual(self.browser.run("getComputedStyle(document.querySelector('#file-input:focus-visible + "
                                          "label[for=file-input]')).outlineStyle"), "solid")
        self.open(steps_file())
        self.choose("array", "0")
        self.choose("clip", "0")
        named = self.browser.named_controls()
        self.assertGreater(len(named), 12)
        self.assertEqual([role for role, name in named if not name.strip()], [], named)
        wanted = set(self.browser.run("[...document.querySelectorAll('#picture, input, select, button, summary')]"
                                      ".filter((one) => one.getClientRects().length > 0 && !one.disabled)"
                                      ".map((one, i) => (one.dataset.i = String(i)))"))
        self.browser.run("document.activeElement.blur()")
        reached = set()
        for _ in range(len(wanted) + 2):
            self.browser.key("Tab")
            reached.add(self.browser.run("document.activeElement.dataset.i"))
        self.assertGreaterEqual(reached, wanted)

    def test_lost_cards_come_back(self):
        self.open(MESHES["second order"])
        before = self.drawn()
        self.browser.run("globalThis.card = document.getElementById('picture').getContext('webgl2')"
                         ".getExtension('WEBGL_lose_context'); card.loseContext()")
        self.browser.wait("!document.getElementById('error').hidden")
        self.assertIn("reappears", self.text("error"))
        for axis, words in (("1", "Cut across y"), ("", "faces")):  # a choice made meanwhile takes effect
            self.choose("clip", axis)
            self.browser.wait(f"/{words}[^C]*$/.test(document.getElementById('summary').textContent)")
            self.assertIn("reappears", self.text("error"))
            self.assertFalse(self.browser.run("document.getElementById('error').hidden"))
        self.browser.run("card.restoreContext()")
        self.browser.wait("document.getElementById('error').hidden")
        self.assertEqual(self.drawn(), before)
        self.no_errors()

    def test_files_of_an_archive(self):
        packed = FOLDER / "archive.shm"
        subprocess.run([SHM, "join", MESHES["hexahedra"], MESHES["mixed"], "-fqo", packed], check=True)
        self.open(packed)
        for member, kind in enumerate(("hexahedra", "mixed")):
            self.choose("member", str(member))
            self.assertIn(f"{self.facts(MESHES[kind])['cells']:,} cells", self.text())
            self.assertGreater(sum(self.drawn().values()), 5000)
        self.no_errors()

    def test_words_are_read_in_light_and_in_darkness(self):
        self.open(MESHES["mixed"])
        for scheme in ("light", "dark"):
            self.browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            ratios = self.browser.run(CONTRASTS)
            self.assertGreater(len(ratios), 15)
            self.assertEqual([one for one in ratios if one[1] < 4.5], [], scheme)
            width, _, found = self.browser.picture("#picture")
            self.assertEqual(min(found[width // 2]) > 200, scheme == "light")
        self.no_errors()

    def test_more_than_there_is_memory_for(self):
        package = FOLDER / "small"
        shutil.copytree(PAGE.parent, package, dirs_exist_ok=True)
        decoder = (package / "shmformat.wasm").read_bytes()
        # Limits the memory of the decoder: replaces the maximum number of 64-KiB pages in the WebAssembly
        # file, 65536, with 144.
        at = decoder.index(bytes([0x80, 0x80, 0x04]), 8)
        (package / "shmformat.wasm").write_bytes(decoder[:at] + bytes([0x90, 0x81, 0x00]) + decoder[at + 3:])
        source = Path(__file__).resolve().parents[2] / "bindings" / "web"
        page = package / "small.html"
        subprocess.run([sys.executable, source / "page" / "inline.py", source / "page", source / "npm", package, page],
                       check=True)
        self.browser.go(page.as_uri())
        self.browser.wait("document.querySelector('#triad line[x2]') !== null && location.href.endsWith('small.html')")
        self.open(long_file()[0])
        self.assertIn("long.shm: this needs more memory than a page can use", self.text("error"))
        self.open(MESHES["hexahedra"])
        self.assertTrue(self.browser.run("document.getElementById('error').hidden"))
        self.assertGreater(sum(self.drawn().values()), 5000)
        self.no_errors()

    def test_steps_and_blocks(self):
        self.open(steps_file())
        self.choose("array", "0")
        self.assertRegex(self.text(), r"at step 3, 0 to 31\.4\.")
        pictures = set()
        for place in range(3):
            self.choose("step", str(place))
            self.assertRegex(self.text(), rf"at step {place}\b")
            pictures.add(json.dumps(sorted(self.drawn().items())))
        self.assertEqual(len(pictures), 3)
        before = self.shown()
        self.browser.run("document.getElementById('picture').focus()")
        self.browser.key("]")
        self.seen(before)
        self.assertRegex(self.text(), r"at step 3\b")
        before = self.shown()
        self.browser.run("document.querySelector('#blocks input').click()")
        self.seen(before)
        self.assertIn("1 block off", self.text())
        self.no_errors()

    def test_what_is_no_file_is_told_by_the_library(self):
        cases = {"foreign.shm": (b"solid cube\n" * 20, FOREIGN), "empty.shm": (b"", EMPTY),
                 "cut.shm": (MESHES["hexahedra"].read_bytes()[:-100], CUT)}
        for name, (content, sentence) in cases.items():
            path = FOLDER / name
            path.write_bytes(content)
            self.open(path)
            print(f"{name}: {self.text('error')}")
            self.assertIn(sentence, self.text("error"))
            self.assertIn(name, self.text("error"))
            self.assertIn("No file is open", self.text())
        self.open(MESHES["hexahedra"])
        self.assertTrue(self.browser.run("document.getElementById('error').hidden"))
        self.no_errors()

    def test_words_of_a_file_are_text(self):
        source = FOLDER / "<img src=x onerror=alert(1)>.vtk"
        bent_bar(source, 1)
        source.write_text(source.read_text().replace("height", "<b>&amp;\"'"))
        page = FOLDER / "marked.html"
        subprocess.run([SHM, "view", source, "-fqo", page, "--page", PAGE], check=True)
        self.go(page.as_uri())
        self.assertIn("<img src=x onerror=alert(1)>.vtk", self.text())
        self.assertIn("<b>&amp;\"'", self.text("array"))
        self.assertEqual(self.browser.run("document.querySelectorAll('img, b').length"), 0)
        self.assertGreater(sum(self.drawn().values()), 5000)
        self.no_errors()

    def test_of_a_server_only_the_segment_is_fetched(self):
        packed, cells = long_file()
        whole = packed.stat().st_size
        self.assertGreater(whole, 1_500_000)
        address = f"{self.serve()}/long.shm"
        for segment, part, most in (("", 1, 12), ("&segment=4", 1 / 8, 6)):
            Ranges.sent = Ranges.requests = 0
            self.go(f"{PAGE.as_uri()}?url={address}{segment}")
            print(f"{Ranges.requests} requests fetched {Ranges.sent} of {whole} bytes from a server"
                  f"{segment and ' to show one segment'}")
            self.assertIn(f"{cells:,} cells", self.text())
            self.assertLess(Ranges.sent, part * whole + FOUND)
            self.assertLessEqual(Ranges.requests, most)
            self.assertGreater(sum(self.drawn().values()), 5000)
        self.assertIn("Segment 4 of", self.text())
        self.no_errors()

    def test_servers_that_give_all_or_nothing(self):
        (FOLDER / "foreign.shm").write_bytes(b"solid cube\n" * 9999)
        (FOLDER / "server.shm").write_bytes(MESHES["hexahedra"].read_bytes())
        at = self.serve()
        self.go(f"{PAGE.as_uri()}?url={at}/whole/server.shm")
        self.assertIn("hexahedra", self.text("facts"))
        self.assertGreater(sum(self.drawn().values()), 5000)
        self.no_errors()
        for name, sentence in (("foreign.shm", FOREIGN), ("whole/foreign.shm", FOREIGN), ("none.shm", NO_FILE),
                               ("closed/server.shm", CLOSED)):
            self.browser.go(f"{PAGE.as_uri()}?url={at}/{name}")
            self.browser.wait(f"location.href.endsWith({json.dumps(name)}) "
                              "&& document.getElementById('error')?.hidden === false")
            print(f"{name}: {self.text('error')}")
            self.assertIn(f"/{name}: {sentence}", self.text("error"))


def main():
    global PAGE, SHM, FOLDER
    if len(sys.argv) < 7:
        sys.exit(__doc__)
    if PROGRAM is None:
        print("chromium is not installed: the page was not tested")
        sys.exit(77)
    PAGE, SHM, FOLDER = (Path(path).resolve() for path in sys.argv[1:4])
    FOLDER.mkdir(parents=True, exist_ok=True)
    for kind, path in zip(("hexahedra", "second order", "mixed"), sys.argv[4:7]):
        MESHES[kind] = Path(path).resolve()
    unittest.main(argv=sys.argv[:1] + sys.argv[7:])


if __name__ == "__main__":
    main()
