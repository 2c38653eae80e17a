#!/usr/bin/env python3
"""Tests shm compress --parity and shm repair: lost data is restored, and the parity packets agree with section
40 of the specification. The test contains its own implementation of the parity arithmetic.

Usage: repair_test.py PATH_OF_SHM
"""
import ctypes
import json
import os
import random
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import forced
from sample_meshes import hexahedra

SHM = "shm"
BLOCK, PACKET, HEADER, TRAILER = 4096, 4136, 40, 16


def product(a, b):
    """Returns the product of two elements of the finite field with 2^8 elements."""
    out = 0
    while b:
        if b & 1:
            out ^= a
        a = a << 1 ^ (0x11d if a & 0x80 else 0)
        b >>= 1
    return out


def checksum(data):
    return struct.pack("<I", XXH64(bytes(data), len(data), 0) & 0xffffffff)


XXH64 = ctypes.CDLL("libxxhash.so.0").XXH64
XXH64.restype, XXH64.argtypes = ctypes.c_uint64, (ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint64)
INVERSE = {a: b for a in range(1, 256) for b in range(1, 256) if product(a, b) == 1}


def grid(n):
    """Returns the text of a legacy VTK file of n*n*n hexahedra. Its coordinates and its field are noisy and
    do not compress well."""
    rng = random.Random(n)
    m = n + 1
    points = "\n".join(f"{x + rng.random() / 4:.6f} {y + rng.random() / 4:.6f} {z}"
                       for z in range(m) for y in range(m) for x in range(m))
    cells = "\n".join("8 " + " ".join(map(str, corners)) for corners in hexahedra(n))
    count = n ** 3
    return (f"# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {m ** 3} double\n"
            f"{points}\nCELLS {count} {9 * count}\n{cells}\nCELL_TYPES {count}\n" + "12\n" * count)


class Repair(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="shm-repair-")
        cls.mesh, cls.plain, cls.whole = (os.path.join(cls.folder.name, name)
                                          for name in ("m.vtk", "plain.shm", "whole.shm"))
        with open(cls.mesh, "w") as out:
            out.write(grid(24))
        assert cls.shm("compress", cls.mesh, "-o", cls.plain).returncode == 0
        made = cls.shm("compress", cls.mesh, "-o", cls.whole, "--parity", "20%", "--json")
        if b"ISA-L" in made.stderr:
            sys.exit(77)
        cls.report = json.loads(made.stdout)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def shm(cls, *words, **options):
        return subprocess.run([SHM, *forced(words)], capture_output=True, timeout=300, **options)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    @staticmethod
    def bytes_of(path):
        with open(path, "rb") as file:
            return file.read()

    def damaged(self, sectors, name="damaged.shm"):
        data = bytearray(self.bytes_of(self.whole))
        for sector in sectors:
            data[sector * BLOCK:(sector + 1) * BLOCK] = bytes(len(data[sector * BLOCK:][:BLOCK]))
        with open(self.path(name), "wb") as out:
            out.write(data)
        return self.path(name)

    def test_packets_are_those_of_the_spec(self):
        plain, whole = self.bytes_of(self.plain), self.bytes_of(self.whole)
        self.assertEqual(whole[:len(plain)], plain)
        self.assertEqual(whole[-TRAILER:], plain[-TRAILER:])
        self.assertEqual(self.report["output_bytes"], len(whole))
        self.assertEqual(self.report["streams"]["parity"], len(whole) - len(plain))
        packets = whole[len(plain):-TRAILER]
        self.assertEqual(len(packets) % PACKET, 0)
        packets = [packets[i:i + PACKET] for i in range(0, len(packets), PACKET)]
        k, m = packets[0][6], packets[0][7]
        blocks = [plain[i:i + BLOCK].ljust(BLOCK, b"\0") for i in range(0, len(plain), BLOCK)]
        stripes = (len(blocks) - 1) // k + 1
        tables = (4 * len(blocks) - 1) // BLOCK + 1
        self.assertEqual(len(packets), 2 * tables + stripes * m)
        self.assertEqual([p[HEADER:] for p in packets[:tables]],
                         [p[HEADER:] for p in packets[-tables:]])
        for place, packet in enumerate(packets):
            mark, kind, version, data, parity, size, _, number, share = struct.unpack(
                "<4sBBBBQIQI", packet[:32])
            is_parity = tables <= place < tables + stripes * m
            self.assertEqual((mark, kind, version, data, parity, size, share),
                             (b"SHMP", 2 if is_parity else 1, 0, k, m, len(plain), 200000))
            first = tables if is_parity else 0 if place < tables else tables + stripes * m
            self.assertEqual(number, place - first)
        for stripe in range(stripes):
            for row in (0, m - 1):
                expected = bytearray(BLOCK)
                for position, block in enumerate(blocks[stripe::stripes]):
                    by = INVERSE[(k + row) ^ position]
                    times = bytes(product(by, value) for value in range(256))
                    for i, value in enumerate(block.translate(times)):
                        expected[i] ^= value
                self.assertEqual(packets[tables + stripe * m + row][HEADER:], bytes(expected))

    def test_repair_gives_back_the_very_bytes(self):
        whole = self.bytes_of(self.whole)
        sectors = (len(whole) - 1) // BLOCK + 1
        rng = random.Random(1)
        for lost in ([], [0], [sectors - 1], [5, 6, 7], rng.sample(range(sectors), sectors // 20)):
            path = self.damaged(lost)
            verified = self.shm("verify", path)
            self.assertEqual(verified.returncode, 3 if lost else 0, (lost, verified))
            repaired = self.shm("repair", path, "-o", self.path("out.shm"), "--json")
            self.assertEqual(repaired.returncode, 0, repaired.stderr)
            self.assertEqual(self.bytes_of(self.path("out.shm")), whole)
            self.assertGreaterEqual(len(lost), json.loads(repaired.stdout)["healed_blocks"])
        self.assertEqual(self.shm("repair", path).returncode, 0)  # in place
        self.assertEqual(self.bytes_of(path), whole)

    def test_verify_tells_of_parity(self):
        self.assertIn(b"parity", self.shm("verify", self.whole).stdout)
        self.assertNotIn(b"parity", self.shm("verify", self.plain).stdout)
        path = self.damaged([len(self.bytes_of(self.plain)) // BLOCK + 2])
        verified = self.shm("verify", path)
        self.assertEqual(verified.returncode, 3)
        self.assertIn(b"shm repair", verified.stdout + verified.stderr)
        path = self.damaged([1])
        verified = self.shm("verify", path)
        self.assertEqual(verified.returncode, 3)
        self.assertIn(b"shm repair", verified.stderr)
        sound = json.loads(self.shm("verify", self.whole, "--json").stdout)
        self.assertEqual((sound["sound"], sound["parity"], sound["damaged_blocks"]), (True, True, 0))
        path = self.damaged([len(self.bytes_of(self.plain)) // BLOCK + 2])
        lame = json.loads(self.shm("verify", path, "--json").stdout)
        self.assertEqual((lame["sound"], lame["parity"]), (True, True))
        self.assertGreater(lame["damaged_parity_packets"], 0)

    def test_more_than_parity_goes_for(self):
        path = self.damaged(range(0, len(self.bytes_of(self.plain)) // BLOCK // 2))
        before = self.bytes_of(path)
        repaired = self.shm("repair", path)
        self.assertEqual(repaired.returncode, 3)
        self.assertIn(b"cannot be repaired", repaired.stderr)
        self.assertEqual(self.bytes_of(path), before)
        self.assertEqual(self.shm("repair", self.mesh).returncode, 3)
        # Nothing to heal, and nothing changes.
        before = self.bytes_of(self.plain)
        self.assertEqual(self.shm("repair", self.plain).returncode, 0)
        self.assertEqual(self.bytes_of(self.plain), before)

    def test_blocks_whose_checksums_are_lost(self):
        """Both packets with checksums are lost. All blocks therefore count as damaged, although every block
        is intact."""
        plain, whole = self.bytes_of(self.plain), self.bytes_of(self.whole)
        data = bytearray(whole)
        for at in (len(plain), len(whole) - TRAILER - PACKET):
            data[at + 100:at + 104] = bytes(4)
        with open(self.path("damaged.shm"), "wb") as out:
            out.write(data)
        repaired = self.shm("repair", self.path("damaged.shm"), "-o", self.path("out.shm"))
        self.assertEqual(repaired.returncode, 0, repaired.stderr)
        self.assertEqual(self.bytes_of(self.path("out.shm")), whole)

    def test_parity_of_something_else(self):
        """A packet at its correct offset claims that the first block is the whole file."""
        plain = self.bytes_of(self.plain)
        k = m = 127
        place = BLOCK + (1 + m) * PACKET  # the second copy of the checksums
        self.assertLess(len(plain), place)
        payload = checksum(plain[:BLOCK]).ljust(BLOCK, b"\0")
        header = struct.pack("<4sBBBBQ4sQI4s", b"SHMP", 1, 0, k, m, BLOCK,
                             checksum(payload[:4]), 0, 0, checksum(payload))
        mixed = self.path("mixed.shm")
        with open(mixed, "wb") as out:
            out.write(plain.ljust(place, b"\0") + header + checksum(header) + payload
                      + plain[-TRAILER:])
        before = self.bytes_of(mixed)
        self.assertEqual(self.shm("verify", mixed).returncode, 0)
        repaired = self.shm("repair", mixed)
        self.assertEqual(repaired.returncode, 3)
        self.assertIn(b"whole", repaired.stderr)
        self.assertEqual(self.bytes_of(mixed), before)

    def test_readers_do_not_mind(self):
        for words in (["decompress"], ["extract", "--cells", "10:20"]):
            out = []
            for path in (self.plain, self.whole):
                target = self.path("back.vtk")
                done = self.shm(words[0], path, *(["-o"] if words[0] == "decompress" else []), target,
                                *words[1:])
                self.assertEqual(done.returncode, 0, done.stderr)
                out.append(self.bytes_of(target))
            self.assertEqual(*out)
        with open(self.whole, "rb") as pipe:
            back = self.shm("decompress", "-", "-o", "-", "--format", "vtk", stdin=pipe)
        self.assertEqual(back.returncode, 0, back.stderr)

    def test_pipes_and_wrong_use(self):
        piped = self.shm("compress", self.mesh, "-o", "-", "--parity", "20")
        self.assertEqual(piped.stdout, self.bytes_of(self.whole))
        for share in ("0", "-1", "101%", "5%%", "", "x"):
            self.assertEqual(self.shm("compress", self.mesh, "-o", self.path("no.shm"),
                                      f"--parity={share}").returncode, 2, share)
            self.assertFalse(os.path.exists(self.path("no.shm")))


if __name__ == "__main__":
    SHM = sys.argv.pop(1)
    unittest.main()
