#!/usr/bin/env python3
"""Tests shm repair with damage that the parity cannot restore, or without parity. Every undamaged segment
must be restored, value for value, and shm verify must report all damage. The test itself determines from the
bytes of the file, according to the specification, which data can be restored.

Usage: salvage_test.py PATH_OF_SHM     (exit code 77, skipped, if VTK, NumPy or ncgen is missing)
"""
import json
import os
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError:
    print("no vtk or no numpy for Python")
    sys.exit(77)
if not shutil.which("ncgen"):
    print("no ncgen")
    sys.exit(77)

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import SANITIZED, SHARE, forced
from sample_meshes import hexahedra

SHM = "shm"
# N is the number of cells along each side of the mesh, SEGMENT the number of cells of a segment, SECTOR the
# size of a disk sector in bytes. The mesh has more than twenty segments. Each segment covers many sectors. The
# file is larger than one megabyte and therefore stores the schema twice.
N, SEGMENT, SECTOR = (22, 484, 2048) if SANITIZED else (30, 1250, 4096)
STEPS = 6
SCHEMA, GROUP, VALUES, TIMES, EXTRA, INDEX = range(1, 7)


class Mesh:
    """A mesh of hexahedra with random data: coordinates, an element attribute, fields on points and cells at
    six steps, and sets."""

    def __init__(self):
        rng = np.random.default_rng(54)
        m = N + 1
        z, y, x = np.meshgrid(range(m), range(m), range(m), indexing="ij")
        self.points = (np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
                       + rng.random((m ** 3, 3)) * .3)
        self.cells = np.array(hexahedra(N))
        count = len(self.cells)
        self.weight = rng.random(count)
        drift = np.arange(STEPS)[:, None] * .001
        self.u = rng.random(len(self.points))[None, :] + drift * rng.random((STEPS, len(self.points)))
        self.p = rng.random(count)[None, :] + drift * rng.random((STEPS, count))
        self.inlet = np.flatnonzero(np.arange(count) % N == 0)  # side 4 of Exodus
        self.fixed = np.flatnonzero(z.ravel() == 0)

    def write(self, path):
        numbers = lambda values: ",".join(map(repr, np.asarray(values).ravel().tolist()))
        text = f"""netcdf m {{
dimensions: len_string = 33 ; len_line = 81 ; len_name = 33 ; time_step = UNLIMITED ; num_dim = 3 ;
  num_nodes = {len(self.points)} ; num_elem = {len(self.cells)} ; num_el_blk = 1 ;
  num_el_in_blk1 = {len(self.cells)} ; num_nod_per_el1 = 8 ; num_att_in_blk1 = 1 ;
  num_side_sets = 1 ; num_side_ss1 = {len(self.inlet)} ; num_node_sets = 1 ;
  num_nod_ns1 = {len(self.fixed)} ; num_nod_var = 1 ; num_elem_var = 1 ;
variables: double time_whole(time_step) ; int eb_status(num_el_blk) ; int eb_prop1(num_el_blk) ;
  eb_prop1:name = "ID" ; int ss_status(num_side_sets) ; int ss_prop1(num_side_sets) ;
  ss_prop1:name = "ID" ; int ns_status(num_node_sets) ; int ns_prop1(num_node_sets) ;
  ns_prop1:name = "ID" ; int elem_ss1(num_side_ss1) ; int side_ss1(num_side_ss1) ;
  int node_ns1(num_nod_ns1) ; int connect1(num_el_in_blk1, num_nod_per_el1) ;
  connect1:elem_type = "HEX8" ; double attrib1(num_el_in_blk1, num_att_in_blk1) ;
  double coordx(num_nodes) ; double coordy(num_nodes) ; double coordz(num_nodes) ;
  char name_nod_var(num_nod_var, len_name) ; char name_elem_var(num_elem_var, len_name) ;
  double vals_nod_var1(time_step, num_nodes) ; double vals_elem_var1eb1(time_step, num_el_in_blk1) ;
  :api_version = 5.14f ; :version = 5.14f ; :floating_point_word_size = 8 ; :file_size = 1 ;
  :title = "noise" ;
data: time_whole = {numbers(np.arange(STEPS) * .5)} ; eb_status = 1 ; eb_prop1 = 7 ; ss_status = 1 ;
  ss_prop1 = 3 ; ns_status = 1 ; ns_prop1 = 4 ; elem_ss1 = {numbers(self.inlet + 1)} ;
  side_ss1 = {numbers(np.full(len(self.inlet), 4))} ; node_ns1 = {numbers(self.fixed + 1)} ;
  connect1 = {numbers(self.cells + 1)} ; attrib1 = {numbers(self.weight)} ;
  coordx = {numbers(self.points[:, 0])} ; coordy = {numbers(self.points[:, 1])} ;
  coordz = {numbers(self.points[:, 2])} ; name_nod_var = "u" ; name_elem_var = "p" ;
  vals_nod_var1 = {numbers(self.u)} ; vals_elem_var1eb1 = {numbers(self.p)} ;
}}"""
        subprocess.run(["ncgen", "-k", "cdf5", "-o", path], input=text.encode(), check=True)


class Chunk:
    """One chunk of an undamaged file. It is parsed according to section 2 of the specification, and its
    headers according to sections 6 and 7."""

    def __init__(self, data, at):
        self.at = at
        mark, what, self.sequence, self.segment = struct.unpack_from("<4sIIH", data, at)
        assert mark == b"SHMc"
        self.kind, version, payload = what & 15, what >> 4 & 7, what >> 8
        has_digest = self.kind in (GROUP, VALUES, TIMES, INDEX)
        assert version == (0 if self.kind == SCHEMA else 5 if has_digest else 1)
        self.place = at + 22
        self.end = self.place + payload
        self.place += 8 if has_digest else 0
        if self.kind == GROUP:
            self.first_cell, _, self.cells = (self.varint(data) for _ in range(3))
            for _ in range(5):
                self.varint(data)
            for _ in range(6):  # the box, as numbers of variable length
                count = self.byte(data)
                self.place += count
            self.streams = []  # kind, array, offset, bytes
            for _ in range(self.varint(data)):
                kind = self.byte(data)
                array = self.varint(data) if kind == 6 else None
                self.byte(data)
                self.streams.append([kind, array, 0, self.varint(data)])
                self.place += 4
            begin = self.place + 4
            for stream in self.streams:
                stream[2] = begin
                begin += stream[3]
            assert begin == self.end
        if self.kind == VALUES:
            # List of tuples, one for each part of the chunk: array, step, group, and whether the values of the
            # part refer to an earlier step.
            self.parts = []
            place, size = (0, 0, 0), 0
            for _ in range(self.varint(data)):
                place = tuple(before + self.signed(data) for before in place)
                self.varint(data)
                self.parts.append((*place, self.varint(data) != 0))
                self.byte(data)
                size += self.varint(data)
            assert self.place + size == self.end

    def byte(self, data):
        self.place += 1
        return data[self.place - 1]

    def varint(self, data):
        value = shift = 0
        while True:
            byte = self.byte(data)
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    def signed(self, data):
        value = self.varint(data)
        return value >> 1 ^ -(value & 1)


def chunks_of(data):
    chunks, at = [], 16
    while not chunks or chunks[-1].kind != INDEX:
        chunks.append(Chunk(data, at))
        at = chunks[-1].end
    return chunks


def read_vtk(path):
    reader = vtk.vtkUnstructuredGridReader()
    reader.SetFileName(path)
    reader.ReadAllScalarsOn()
    reader.ReadAllFieldsOn()
    reader.Update()
    grid = reader.GetOutput()
    arrays = {}
    for where, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData())):
        for i in range(data.GetNumberOfArrays()):
            arrays[where, data.GetArrayName(i)] = vtk_to_numpy(data.GetArray(i)).copy()
    cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).copy() if grid.GetNumberOfCells() else []
    points = vtk_to_numpy(grid.GetPoints().GetData()).copy()
    return points, np.reshape(cells, (-1, 8)), arrays


class Salvage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="shm-salvage-")
        cls.mesh = Mesh()
        cls.mesh.write(cls.path("m.e"))
        made = cls.shm("compress", cls.path("m.e"), "-o", cls.path("whole.shm"), "--segment-cells",
                       str(SEGMENT), "--key-steps", "3")
        assert made.returncode == 0, made.stderr
        with open(cls.path("whole.shm"), "rb") as file:
            cls.whole = file.read()
        cls.chunks = chunks_of(cls.whole)
        cls.groups = [c for c in cls.chunks if c.kind == GROUP]
        assert len(cls.groups) >= 20 and [g.segment for g in cls.groups] == list(range(len(cls.groups)))
        assert len(cls.whole) > 512 * SECTOR, len(cls.whole)
        schema = json.loads(cls.shm("info", cls.path("whole.shm"), "--json").stdout)["arrays"]
        cls.names = [(a["location"], a["name"]) for a in schema]
        segment_of_cell = np.arange(len(cls.mesh.cells)) // SEGMENT
        cls.owner = np.full(len(cls.mesh.points), len(cls.groups))
        np.minimum.at(cls.owner, cls.mesh.cells.ravel(), np.repeat(segment_of_cell, 8))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @staticmethod
    def shm(*words):
        return subprocess.run([SHM, *forced(words)], capture_output=True, timeout=300)

    def put(self, data, name="hurt.shm"):
        with open(self.path(name), "wb") as out:
            out.write(data)
        return self.path(name)

    def hurt(self, *ranges):
        data = bytearray(self.whole)
        for begin, end in ranges:
            data[begin:end] = bytes(b ^ 0xa5 for b in data[begin:end])
        return data

    def verify(self, data):
        done = self.shm("verify", self.put(data), "--json")
        self.assertEqual(done.returncode, 3, done.stderr)
        report = json.loads(done.stdout)
        self.assertFalse(report["sound"])
        return report["damage"]

    def repair(self, data, expected):
        path = self.put(data)
        done = self.shm("repair", path, "-o", self.path("rest.shm"), "--json")
        self.assertEqual(done.returncode, expected, done.stderr)
        with open(path, "rb") as file:
            self.assertEqual(file.read(), bytes(data))
        sound = self.shm("verify", self.path("rest.shm"))
        self.assertEqual(sound.returncode, 0, sound.stderr)
        return json.loads(done.stdout)

    def same_bytes(self):
        with open(self.path("rest.shm"), "rb") as file:
            self.assertTrue(file.read() == self.whole)

    def compare(self, touched, steps=(0, STEPS - 1), numbered=True):
        """Checks that all data in rest.shm is correct, and that the file contains at least all data from
        chunks that are not damaged."""
        mesh = self.mesh
        segments = {g.segment for g in self.groups} - {c.segment for c in touched if c.kind == GROUP}
        lost = {part[:3] for c in touched if c.kind == VALUES for part in c.parts}
        for step in steps:
            out = self.path("rest.vtk")
            done = self.shm("decompress", self.path("rest.shm"), "-o", out,
                            *([] if step is None else ["--step", str(step)]))
            self.assertEqual(done.returncode, 0, done.stderr)
            points, cells, arrays = read_vtk(out)
            vertex = arrays.get(("point", "shm_vertex_number"), np.arange(len(points)))
            cell = arrays.get(("cell", "shm_cell_number"), np.arange(len(cells)))
            self.assertEqual(("point", "shm_vertex_number") in arrays, numbered)
            np.testing.assert_array_equal(points, mesh.points[vertex])
            np.testing.assert_array_equal(vertex[cells], mesh.cells[cell])
            expected = np.flatnonzero(np.isin(np.arange(len(mesh.cells)) // SEGMENT, list(segments)))
            self.assertTrue(np.isin(expected, cell).all())
            weight = next(v for (w, n), v in arrays.items() if w == "cell" and n not in
                          ("shm_cell_number", "p") and v.dtype == np.float64)
            there = ~np.isnan(weight)
            np.testing.assert_array_equal(weight[there], mesh.weight[cell][there])
            self.assertTrue(there[np.isin(cell, expected)].all())
            if step is None:  # no step is left
                continue
            for name, where, numbers, segment, all_values in (
                    ("u", "point", vertex, self.owner, mesh.u),
                    ("p", "cell", cell, np.arange(len(mesh.cells)) // SEGMENT, mesh.p)):
                values = arrays[where, name]
                there = ~np.isnan(values)
                np.testing.assert_array_equal(values[there], all_values[step][numbers][there])
                could = [s for s in segments if not self.chain(name, where, step, s) & lost]
                self.assertTrue(there[np.isin(segment[numbers], could)].all(), (name, step))

    def chain(self, name, where, step, segment):
        """Returns the chunks that a reader needs to decode a value at a step."""
        array = self.names.index((where, name))
        parts = [part for c in self.chunks if c.kind == VALUES for part in c.parts if part[0] == array]
        needed = set()
        while True:
            needed.add((array, step, segment))
            if not any(refers for _, s, _, refers in parts if s == step):
                return needed
            step = max(s for _, s, group, _ in parts if group == segment and s < step)

    def test_sectors_at_random(self):
        sectors = (len(self.whole) - 1) // SECTOR + 1
        came = could = 0
        for seed in range(12 if SHARE == 1 and not SANITIZED else 4):
            lost = sorted(random.Random(seed).sample(range(sectors), sectors // 100))
            data = bytearray(self.whole)
            for sector in lost:
                size = len(data[sector * SECTOR:(sector + 1) * SECTOR])
                data[sector * SECTOR:sector * SECTOR + size] = bytes(size)
            touched = [c for c in self.chunks
                       if self.whole[c.at:c.end] != data[c.at:c.end]]
            report = self.repair(data, 7)
            self.assertTrue(report["missing"])
            self.compare(touched, steps=(seed % STEPS, STEPS - 1))
            could += len(self.groups) - len({c.segment for c in touched if c.kind == GROUP})
            came += report["cells"] / SEGMENT
        self.assertGreaterEqual(came, could)
        self.assertGreater(could, 0)

    def test_parity_above_the_damage(self):
        made = self.shm("compress", self.path("m.e"), "-o", self.path("parity.shm"), "--segment-cells",
                        str(SEGMENT), "--key-steps", "3", "--parity", "5%")
        if b"ISA-L" in made.stderr:
            self.skipTest("no ISA-L")
        with open(self.path("parity.shm"), "rb") as file:
            whole = file.read()
        sectors = (len(whole) - 1) // SECTOR + 1
        for seed in range(1 if SANITIZED else 5):
            data = bytearray(whole)
            for sector in random.Random(seed).sample(range(sectors), sectors // 100):
                size = len(data[sector * SECTOR:(sector + 1) * SECTOR])
                data[sector * SECTOR:sector * SECTOR + size] = bytes(size)
            report = self.repair(data, 0)
            self.assertEqual(report["outcome"], "healed")
            with open(self.path("rest.shm"), "rb") as file:
                self.assertTrue(file.read() == whole)
        # Damages a range that is too long for the parity. The intact parts are restored, and the new file has
        # parity, too.
        data = bytearray(whole)
        group = self.groups[4]
        begin, end = group.at, self.groups[9].end
        data[begin:end] = bytes(end - begin)
        report = self.repair(data, 7)
        self.compare([c for c in self.chunks if whole[c.at:c.end] != data[c.at:c.end]])
        verified = json.loads(self.shm("verify", self.path("rest.shm"), "--json").stdout)
        self.assertTrue(verified["parity"])

    def test_verify_names_what_is_hurt(self):
        group = self.groups[5]
        values = [c for c in self.chunks if c.kind == VALUES][7]
        [(array, step, _, _)] = values.parts
        geometry = next(s for s in group.streams if s[0] == 5)
        found = self.verify(self.hurt((geometry[2] + 9, geometry[2] + 10), (values.end - 3, values.end)))
        self.assertEqual(found, [
            {"what": "damaged", "section": "group", "offset": group.at, "bytes": group.end - group.at,
             "chunks": 1, "segment": 5, "first_cell": 5 * SEGMENT, "cells": SEGMENT},
            {"what": "damaged", "section": "step values", "offset": values.at,
             "bytes": values.end - values.at, "chunks": 1, "step": step,
             "arrays": ["/".join(self.names[array])]}])
        text = self.shm("verify", self.path("hurt.shm"))
        self.assertIn(b"damaged in 2 places", text.stderr)
        self.assertIn(f"cells {5 * SEGMENT}-{6 * SEGMENT - 1}".encode(), text.stderr)
        # With a damaged header.
        found = self.verify(self.hurt((group.at, group.at + 8)))
        self.assertEqual([(d["offset"], d["bytes"], d["segment"], d["first_cell"]) for d in found],
                         [(group.at, group.end - group.at, 5, 5 * SEGMENT)])

    def test_values_of_one_array(self):
        group = self.groups[6]
        stream = next(s for s in group.streams if s[0] == 6)
        data = self.hurt((stream[2] + 5, stream[2] + 6))
        found = self.verify(data)
        self.assertEqual([d.get("arrays") for d in found], [["/".join(self.names[stream[1]])]])
        report = self.repair(data, 7)
        self.assertEqual(report["cells"], len(self.mesh.cells))
        self.assertEqual([(m["what"], m.get("segment")) for m in report["missing"]],
                         [("values", 6), ("role", None)])
        self.compare([group])

    def test_where_things_are(self):
        """Damages only chunks without values. The repaired file must equal the original file, byte for
        byte."""
        schema, index = self.chunks[0], self.chunks[-1]
        for ranges, sections in (([(0, 8)], ["file start"]),
                                 ([(schema.at, schema.at + 15)], ["schema"]),
                                 ([(schema.at + 30, schema.at + 31)], ["schema"]),
                                 ([(0, schema.end)], ["file start", "schema"]),
                                 ([(index.end - 16, index.end)], ["index", "end record"]),
                                 ([(index.at, index.at + 22)], ["index"]),
                                 ([(index.at + 40, index.at + 41)], ["index"]),
                                 ([(index.at, index.end)], ["index", "end record"])):
            data = self.hurt(*ranges)
            self.assertEqual([d["section"] for d in self.verify(data)], sections)
            report = self.repair(data, 0)
            self.assertEqual(report["outcome"], "healed")
            self.assertEqual(report["new_index"], "index" in sections)
            self.same_bytes()
        # A file is repaired in place only if no data is lost.
        for hurt in ((index.end - 16, index.end), (index.at, index.at + 22)):
            path = self.put(self.hurt(hurt))
            self.assertEqual(self.shm("repair", path).returncode, 0)
            with open(path, "rb") as file:
                self.assertTrue(file.read() == self.whole)
        path = self.put(self.whole[:index.at])  # perhaps there were more chunks
        refused = self.shm("repair", path)
        self.assertEqual(refused.returncode, 3)
        self.assertIn(b"-o OUT.shm", refused.stderr)

    def test_index_of_rounded_values(self):
        """The index contains nothing that depends on the original values before rounding, so it can be rebuilt
        from the rounded values in the file."""
        made = self.shm("compress", self.path("m.e"), "-o", self.path("rounded.shm"), "--array",
                        "attrib1:abs=1e-3")
        self.assertEqual(made.returncode, 0, made.stderr)
        with open(self.path("rounded.shm"), "rb") as file:
            whole = file.read()
        index = chunks_of(whole)[-1]
        data = bytearray(whole)
        data[index.at:index.at + 8] = bytes(8)
        done = self.shm("repair", self.put(data), "-o", self.path("rest.shm"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(b"the index, which was rebuilt", done.stdout)
        with open(self.path("rest.shm"), "rb") as file:
            self.assertTrue(file.read() == whole)
        self.assertEqual(self.shm("verify", self.path("rest.shm"), "--against", self.path("m.e")).returncode, 0)

    def test_without_index_and_more(self):
        index = self.chunks[-1]
        group = self.groups[8]
        values = [c for c in self.chunks if c.kind == VALUES][40]
        for ranges in ([(group.at, group.at + 40)], [(values.at, values.at + 40)],
                       [(self.groups[0].at, self.groups[0].at + 5), (group.at, group.at + 4),
                        (self.groups[-1].at, self.groups[-1].at + 5)],
                       [(group.at, self.groups[11].at + 40)]):
            data = self.hurt((index.at, index.at + 22), *ranges)
            touched = [c for c in self.chunks if self.whole[c.at:c.end] != data[c.at:c.end]]
            self.repair(data, 7)
            self.compare(touched)

    def test_cut(self):
        for end in (self.groups[10].at + 100, self.groups[20].end, self.chunks[-1].at,
                    [c for c in self.chunks if c.kind == VALUES][30].end - 1):
            data = self.whole[:end]
            found = self.verify(data)
            self.assertIn("index", [d["section"] for d in found])
            self.repair(data, 7)
            first = next(c for c in self.chunks if c.kind == VALUES)
            self.compare([c for c in self.chunks if c.end > end],
                         steps=[0] if end >= first.end else [None])

    def test_repeated_and_reordered(self):
        pieces = [self.whole[c.at:c.end] for c in self.chunks]
        start = self.whole[:16]
        twice = start + b"".join(pieces[:9] + [pieces[5]] + pieces[9:])
        swapped = pieces[:]
        swapped[4], swapped[12] = swapped[12], swapped[4]
        swapped = start + b"".join(swapped)
        stray = start + b"".join(pieces[:7]) + b"SHMc no chunk and SHMC none" + b"".join(pieces[7:])
        for data, kind in ((twice, "repeated"), (swapped, "out of order"), (stray, "out of order")):
            self.assertIn(kind, [d["what"] for d in self.verify(data)])
            self.assertEqual(self.repair(data, 0)["outcome"], "healed")
            self.same_bytes()
            # Without an index, too.
            lame = bytearray(data)
            lame[-40:] = bytes(40)
            self.assertTrue(self.repair(lame, 0)["new_index"])
            self.same_bytes()
        removed = start + b"".join(pieces[:6] + pieces[8:])
        self.assertEqual([d["section"] for d in self.verify(removed) if d["what"] == "missing"],
                         ["group"] * 2)
        self.repair(removed, 7)
        self.compare(self.chunks[6:8])

    def test_sets_are_cut(self):
        group = self.groups[3]
        self.repair(self.hurt((group.at + 40, group.at + 41)), 7)
        self.assertEqual(self.shm("extract", self.path("rest.shm"), self.path("set.vtk"), "--set",
                                  "side_set_3", "--step", "0").returncode, 0)
        info = json.loads(self.shm("info", self.path("rest.shm"), "--json").stdout)
        self.assertEqual(info["cells"], len(self.mesh.cells) - SEGMENT)

    def test_roles_that_are_left_out_are_named(self):
        """The role of an array states its purpose in the source format. For the array of Gmsh node tags, the
        role is not stored with the array, but in an extra with other Gmsh data. If this extra is damaged, the
        array remains but loses its role."""
        nodes = "\n".join(f"{90 - 3 * i} {i & 1} {i >> 1 & 1} {i >> 2}" for i in range(8))
        with open(self.path("tags.msh"), "w", encoding="ascii") as file:
            file.write(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n{nodes}\n$EndNodes\n"
                       "$Elements\n1\n1 5 2 0 1 90 87 81 84 78 75 69 72\n$EndElements\n")
        self.assertEqual(self.shm("compress", self.path("tags.msh"), "-o", self.path("tags.shm")).returncode, 0)
        with open(self.path("tags.shm"), "rb") as file:
            data = bytearray(file.read())
        data[next(c for c in chunks_of(data) if c.kind == EXTRA).end - 1] ^= 1
        report = self.repair(data, 7)
        self.assertEqual([(m["array"], m["role"]) for m in report["missing"] if m["what"] == "role"],
                         [("gmsh:node_tag", "gmsh:node_tag")])


if __name__ == "__main__":
    SHM = sys.argv.pop(1)
    unittest.main()
