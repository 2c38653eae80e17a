#!/usr/bin/env python3
"""Tests reading files from a server: the package sends few requests, fetches only the required data, and
reports clear errors.

  remote_test.py LIBSHMFORMAT_C.SO SHM        SHM: path of the tool

The test runs its own server, which counts requests and can simulate faults.
"""
import http.server
import os
import re
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
LIBRARY, SHM = (str(Path(path).resolve()) for path in sys.argv[1:3])
del sys.argv[1:3]
os.environ["SHMFORMAT_LIBRARY"] = LIBRARY
sys.path.insert(0, str(ROOT / "bindings" / "python"))
import shmformat  # noqa: E402

MAKE_MESH = Path(SHM).with_name("shm_make_mesh")


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_GET(self):
        server = self.server
        server.asked.append((self.path, self.headers.get("Range")))
        if self.path == "/moved":
            return self.answer(302, b"", {"Location": "/mesh.shm"})
        if self.path == "/round":
            return self.answer(302, b"", {"Location": "/round"})
        data = server.files.get(self.path)
        if data is None:
            return self.answer(404, b"none")
        several = self.headers.get("Range", "").count(",") > 0
        if several and server.mode != "one range":
            return self.answer_several(data)
        wanted = re.fullmatch(r"bytes=(\d*)-(\d*)", self.headers.get("Range", ""))
        if server.mode == "no ranges" or wanted is None:
            return self.answer(200, data)
        if server.mode == "fails" and len(server.asked) > server.good:
            self.close_connection = True
            self.send_response(206)
            self.send_header("Content-Length", "1000")
            self.end_headers()
            return self.wfile.write(b"half")
        first = max(len(data) - int(wanted[2]), 0) if not wanted[1] else int(wanted[1])
        last = len(data) - 1 if not wanted[1] or not wanted[2] else min(int(wanted[2]), len(data) - 1)
        body = data[first:last + 1]
        server.given += len(body)
        if server.mode == "others":
            first += 1
        if server.mode == "all at once":
            body += bytes(1 << 20)
        tag = f'"{server.version}"'
        return self.answer(206, body, {"Content-Range": f"bytes {first}-{last}/{len(data)}", "ETag": tag})

    def answer_several(self, data):
        body = b""
        for first, last in re.findall(r"(\d+)-(\d+)", self.headers["Range"]):
            part = data[int(first):int(last) + 1]
            self.server.given += len(part)
            body += (b"\r\n--THEEND\r\nContent-Type: application/octet-stream\r\n"
                     b"Content-Range: bytes %d-%d/%d\r\n\r\n" % (int(first), int(last), len(data))) + part
        kind = {"Content-Type": "multipart/byteranges; boundary=THEEND", "ETag": f'"{self.server.version}"'}
        return self.answer(206, body + b"\r\n--THEEND--\r\n", kind)

    def answer(self, status, body, more=None):
        self.send_response(status)
        for name, value in {"Content-Length": str(len(body)), **(more or {})}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass

    def setup(self):
        super().setup()
        self.server.connections += 1


class Server(http.server.ThreadingHTTPServer):
    def handle_error(self, *_):
        pass  # ignores the error if a client closes the connection while the server is answering


class Remote(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """Creates a .shm file of several megabytes with several segments and three fields, one of which is
        static."""
        cls.folder = tempfile.TemporaryDirectory()
        source, packed = (os.path.join(cls.folder.name, name) for name in ("a.vtk", "a.shm"))
        subprocess.run([MAKE_MESH, "ogrid", "90000", source, "--double"], capture_output=True, check=True)
        subprocess.run([SHM, "compress", "--level", "fast", "--segment-cells", "12000", source, "-o", packed],
                       capture_output=True, check=True)
        cls.data = Path(packed).read_bytes()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        self.server = Server(("127.0.0.1", 0), Handler)
        self.server.files = {"/mesh.shm": self.data, "/empty": b"", "/text": b"no mesh at all " * 99}
        self.server.asked, self.server.given, self.server.connections = [], 0, 0
        self.server.mode, self.server.good, self.server.version = "", 0, 1
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.url = f"http://127.0.0.1:{self.server.server_port}"

    def open(self, name="/mesh.shm"):
        mesh = shmformat.open(self.url + name)
        self.addCleanup(mesh.close)
        return mesh

    def fails(self, words, call):
        with self.assertRaises(shmformat.Error) as caught:
            call()
        self.assertEqual(caught.exception.code, "io")
        self.assertIn(words, str(caught.exception))

    def test_opening_takes_three_requests_at_most_and_all_is_what_it_is(self):
        self.assertGreater(len(self.data), 1 << 20)
        mesh = self.open()
        self.assertLessEqual(len(self.server.asked), 3)
        here = shmformat.open(self.data)
        self.assertTrue(np.array_equal(mesh.points, here.points))
        self.assertTrue(np.array_equal(mesh.cells.connectivity, here.cells.connectivity))
        for name in here.cell_data:
            self.assertTrue(np.array_equal(mesh.cell_data[name], here.cell_data[name]), name)
        self.assertEqual(self.server.connections, 1)

    def asks(self, call):
        """Runs `call`. Returns the number of requests and the number of bytes that the call caused, and its
        result."""
        given, asked = self.server.given, len(self.server.asked)
        result = call()
        return len(self.server.asked) - asked, self.server.given - given, result

    def test_the_mesh_without_its_arrays_takes_two_requests(self):
        mesh, here = self.open(), shmformat.open(self.data)
        self.assertGreater(len(here.segments), 7)
        asked, _, arrays = self.asks(mesh.read)
        self.assertLessEqual(asked, 2)  # one request for headers, one for streams
        self.assertTrue(np.array_equal(arrays.points, here.points))
        asked, given, cells = self.asks(lambda: self.open().read(points=False).cells)
        self.assertLessEqual(asked, 5)
        self.assertLess(given, len(self.data) / 2)
        self.assertTrue(np.array_equal(cells.connectivity, here.cells.connectivity))

    def test_a_segment_takes_two_requests(self):
        where = shmformat.open(self.data).segments[4]
        piece = (where.first_cell, where.first_cell + where.cells)
        mesh = self.open()
        asked, given, one = self.asks(mesh.select(cells=piece).read)
        self.assertLessEqual(asked, 2)
        self.assertLess(given, where.bytes + (1 << 17))
        self.assertTrue(np.array_equal(one.points, shmformat.open(self.data).select(cells=piece).points))

    def test_a_server_of_single_ranges_serves_too(self):
        self.server.mode = "one range"
        mesh = self.open()
        asked, _, arrays = self.asks(mesh.read)
        self.assertLess(asked, 30)
        self.assertTrue(np.array_equal(arrays.points, shmformat.open(self.data).points))

    def test_what_is_near_is_fetched_at_once(self):
        from shmformat._remote import Remote

        class Counted:
            size = 1 << 20
            asked = []

            def fetch(self, ranges):
                self.asked.append(list(ranges))
                return [bytes(end - first) for first, end in ranges]

        told = Remote(Counted())
        told.tell([(400000, 400010), (0, 10), (65000, 65010), (130000, 130010)])
        told.read_into(5, memoryview(bytearray(5)))
        self.assertEqual(Counted.asked, [[(5, 130010), (400000, 400010)]])

    def test_what_was_fetched_is_not_fetched_again(self):
        from shmformat._remote import Remote

        class Counted:
            size = 20 << 20
            given = 0

            def fetch(self, ranges):
                Counted.given += sum(end - first for first, end in ranges)
                return [bytes(end - first) for first, end in ranges]

        told = Remote(Counted())
        told.tell([(8 << 20, 20 << 20)])
        for at in range(40):  # ranges that were not announced
            told.read_into(at << 17, memoryview(bytearray(200)))
        for at in range(8, 20):
            told.read_into(at << 20, memoryview(bytearray(1 << 20)))
        self.assertLess(Counted.given, 16 << 20)

    def test_a_server_that_gives_too_much_is_told(self):
        mesh = self.open()
        self.server.mode = "all at once"
        self.fails("did not return the requested bytes", mesh.verify)

    def test_reading_on_takes_few_requests(self):
        asked, _, _ = self.asks(self.open().verify)
        self.assertLessEqual(asked, 1 + len(self.data) // (16 << 20))

    def test_other_places_are_followed(self):
        self.assertEqual(self.open("/moved").cell_count, shmformat.open(self.data).cell_count)
        self.fails("without end", lambda: self.open("/round"))

    def test_errors_are_named(self):
        self.fails("404 Not Found", lambda: self.open("/none"))
        self.fails("empty", lambda: self.open("/empty"))
        self.fails("the connection failed", lambda: shmformat.open("http://127.0.0.1:1/mesh.shm"))
        with self.assertRaises(shmformat.Error) as caught:
            self.open("/text")
        self.assertIn(caught.exception.code, ("corrupt", "truncated"))
        for mode, words in (("no ranges", "does not support byte ranges"),
                            ("others", "did not return the requested bytes")):
            self.server.mode = mode
            self.fails(words, self.open)

    def test_a_server_that_fails_half_way_is_told(self):
        mesh = self.open()
        self.server.mode, self.server.good = "fails", len(self.server.asked)
        self.fails("the connection failed", mesh.verify)
        self.server.mode = ""
        mesh.verify()  # once the server works again, the same mesh object can be read

    def test_a_file_that_changes_is_told(self):
        mesh = self.open()
        self.server.version = 2
        self.fails("has changed", mesh.verify)

    def test_other_protocols_are_those_of_fsspec(self):
        try:
            import fsspec  # noqa: F401
        except ImportError:
            self.fails("without fsspec only http and https", lambda: shmformat.open("memory://mesh.shm"))
            return
        with fsspec.open("memory://mesh.shm", "wb") as file:
            file.write(self.data)
        self.assertEqual(shmformat.open("memory://mesh.shm").cell_count, shmformat.open(self.data).cell_count)
        self.fails("cannot be opened", lambda: shmformat.open("memory://none.shm"))


if __name__ == "__main__":
    unittest.main()
