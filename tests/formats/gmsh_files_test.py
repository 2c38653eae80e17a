#!/usr/bin/env python3
"""Tests round trips of files that Gmsh itself wrote. Gmsh reads source and result. In order `keep`, it finds
no difference. In orders `stream` and `free`, it finds the same mesh with the same data, but numbered
differently.

Usage: gmsh_files_test.py PATH_OF_SHM     (exit code 77, skipped, without Gmsh for Python)
"""
import concurrent.futures
import os
import struct
import subprocess
import sys
import unittest

try:
    import gmsh
except ImportError:
    print("no gmsh for Python")
    sys.exit(77)
try:
    import meshio  # an independent reader of binary MSH 4.0
except ImportError:
    meshio = None
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import gmsh_oracle
from folder_test import FolderTest, forced, is_sampled

NATIVE = "<" if sys.byteorder == "little" else ">"
SHM = "shm"
# Tested pairs of MSH version and file type (1: binary, 0: text). Gmsh 4.8 writes version 4.0 only as text.
FILES = ((1, 0), (2.2, 0), (2.2, 1), (3.0, 0), (4.0, 0), (4.1, 0), (4.1, 1))

# Affine map that translates by one unit along x, as a 4 x 4 matrix.
AFFINE = [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]


def apart(function, *words):
    """Runs a function in a separate process, because Gmsh may crash, and because initializing Gmsh again does
    not reset its state."""
    with concurrent.futures.ProcessPoolExecutor(1) as pool:
        return pool.submit(function, *words).result()


def box(size=0.6):
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.setSize(gmsh.model.getEntities(0), size)


def groups():
    for dimension, tags, tag, name in ((3, [1], 7, "body of \N{GREEK SMALL LETTER ALPHA}"),
                                       (2, [1, 2], 8, "in"), (2, [2, 3], 9, "shared"),
                                       (1, [4], 3, ""), (0, [1, 2], 5, "corner points")):
        gmsh.model.addPhysicalGroup(dimension, tags, tag)
        if name:
            gmsh.model.setPhysicalName(dimension, tag, name)


def tetrahedra():
    box()
    gmsh.model.mesh.generate(3)


def periodic(grouped=True):
    box()
    if grouped:
        groups()
    gmsh.model.mesh.setPeriodic(2, [2], [1], AFFINE)
    gmsh.model.mesh.generate(3)
    gmsh.option.setNumber("Mesh.SaveAll", 1)


def parametric():
    box()
    gmsh.model.mesh.generate(2)
    gmsh.option.setNumber("Mesh.SaveParametric", 1)


def partitioned(topology):
    box(0.5)
    gmsh.model.mesh.setPeriodic(2, [2], [1], AFFINE)
    gmsh.model.mesh.generate(3)
    gmsh.option.setNumber("Mesh.PartitionCreateGhostCells", 1)
    gmsh.option.setNumber("Mesh.PartitionCreateTopology", topology)
    gmsh.model.mesh.partition(3)


def hexahedra(order=1, incomplete=0):
    base = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.extrude([(2, base)], 0, 0, 1, [2], recombine=True)
    gmsh.model.occ.synchronize()
    for _, curve in gmsh.model.getEntities(1):
        gmsh.model.mesh.setTransfiniteCurve(curve, 3)
    for _, surface in gmsh.model.getEntities(2):
        gmsh.model.mesh.setTransfiniteSurface(surface)
        gmsh.model.mesh.setRecombine(2, surface)
    groups()
    gmsh.option.setNumber("Mesh.SaveAll", 1)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)


def curved(order):
    box(1)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)


def prisms(order, incomplete):
    base = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.extrude([(2, base)], 0, 0, 1, [2], recombine=True)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    gmsh.model.mesh.setSize(gmsh.model.getEntities(0), 0.7)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)


def sparse_tags():
    """Creates a mesh whose tags are far apart and whose entities have no geometry."""
    gmsh.model.addDiscreteEntity(3, 4)
    gmsh.model.addDiscreteEntity(2, 9, [])
    tags = [10, 3, 70000, 5, 4000, 2, 9, 8]
    xyz = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1]
    gmsh.model.mesh.addNodes(3, 4, tags, xyz)
    gmsh.model.mesh.addElements(3, 4, [5], [[123456]], [tags])
    gmsh.model.mesh.addElements(2, 9, [3], [[1]], [tags[:4]])
    gmsh.option.setNumber("Mesh.SaveAll", 1)


def every_type():
    """Creates one element of each Gmsh type, except types without a shape, for which Gmsh stops with an
    error."""
    without_shape = {*range(67, 71), *range(84, 90), *range(100, 106), *range(125, 137)}
    node, element = 1, 1
    for kind in range(1, 141):
        try:
            _, dimension, _, count, _, _ = gmsh.model.mesh.getElementProperties(kind)
        except Exception:
            continue
        if kind in without_shape or not count:
            continue
        entity = gmsh.model.addDiscreteEntity(dimension, kind)
        tags = list(range(node, node + count))
        xyz = [(tag * 7 % 11 + k + tag) / 13 for tag in tags for k in range(3)]
        gmsh.model.mesh.addNodes(dimension, entity, tags, xyz)
        gmsh.model.mesh.addElements(dimension, entity, [kind], [[element]], [tags])
        node, element = node + count, element + 1
    gmsh.option.setNumber("Mesh.SaveAll", 1)


def add_views(path):
    """Writes nodal, elemental and corner data with steps for the mesh in memory. Some of the data covers all
    nodes or elements, some only a few of them."""
    name = gmsh.model.getCurrent()
    nodes = [int(n) for n in gmsh.model.mesh.getNodes()[0]]
    kinds, tags, corners = gmsh.model.mesh.getElements()
    elements = [int(t) for of_kind in tags for t in of_kind]
    kind = max(range(len(kinds)), key=lambda k: kinds[k])
    per_element = len(corners[kind]) // len(tags[kind])
    for title, where, which, width in (
            ("temperature", "NodeData", nodes, 1), ("velocity, all \"quoted\"", "NodeData", nodes, 3),
            ("stress", "ElementData", elements, 9),
            ("some", "NodeData", nodes[::3], 1), ("few", "ElementData", elements[::-2], 3),
            ("corners", "ElementNodeData", [int(t) for t in tags[kind]], per_element)):
        view = gmsh.view.add(title)
        for step in range(3 if title != "some" else 1):
            data = [[(n * 13 % 101 + c) / 7 + step for c in range(width)] for n in which]
            gmsh.view.addModelData(view, step, name, where, which, data, 0.5 * step, -1 if
                                   where != "ElementNodeData" else 1)
        gmsh.view.write(view, path, True)


MODELS = {
    "tetrahedra": tetrahedra,
    "periodic": periodic,
    "periodic alone": lambda: periodic(False),
    "parametric": parametric,
    "partitions with topology": lambda: partitioned(1),
    "partitions": lambda: partitioned(0),
    "hexahedra": hexahedra,
    "hexahedra of order 2": lambda: hexahedra(2),
    "hexahedra of order 2, incomplete": lambda: hexahedra(2, 1),
    "hexahedra of order 3": lambda: hexahedra(3),
    "tetrahedra of order 2": lambda: curved(2),
    "tetrahedra of order 4": lambda: curved(4),
    "tetrahedra of order 5": lambda: curved(5),
    "prisms": lambda: prisms(1, 0),
    "prisms of order 2": lambda: prisms(2, 0),
    "prisms of order 2, incomplete": lambda: prisms(2, 1),
    "sparse tags": sparse_tags,
    "every type": every_type,
}


def make(path, model, version, binary, views):
    gmsh.initialize(["gmsh"], False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("made")
    MODELS[model]()
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.option.setNumber("PostProcessing.SaveMesh", 0)
    gmsh.write(path)
    if views:
        add_views(path)
    gmsh.finalize()


class Binary40:
    """Converts an MSH 4.0 file in ASCII to the binary form that Gmsh 4.0 wrote. Current versions of Gmsh
    cannot read this form. Integers have 32 bits, long integers 64."""

    def __init__(self, text, order):
        self.order, self.out, self.names = order, b"", []
        for section in text.split("$End")[:-1]:
            name, content = section[section.index("$") + 1:].split("\n", 1)
            if name == "PhysicalNames":
                data = content.encode()
            elif name == "MeshFormat":
                data = b"4.0 1 8\n" + struct.pack(order + "i", 1) + b"\n"
            else:
                self.words, self.data = iter(content.split()), b""
                getattr(self, name)()
                assert next(self.words, None) is None, name
                data = self.data + b"\n"
            self.names.append(name)
            self.out += f"${name}\n".encode() + data + f"$End{name}\n".encode()

    def put(self, kinds):
        """Converts the next words of the text to binary and appends them to the data. `kinds` has one letter
        per word: i is int, q is long, d is double. Returns the values."""
        values = [(float if k == "d" else int)(next(self.words)) for k in kinds]
        self.data += struct.pack(self.order + kinds, *values)
        return values

    def Entities(self, partitions=False):
        for dimension, count in enumerate(self.put("qqqq")):
            for _ in range(count):
                self.put("i")
                if partitions:
                    self.put("i" * self.put("iii")[2])
                self.put("d" * 6)
                for _ in range(1 if dimension == 0 else 2):
                    self.put("i" * self.put("q")[0])

    def PartitionedEntities(self):
        self.put("ii" * self.put("ii")[1])
        self.Entities(True)

    def Nodes(self):
        for _ in range(self.put("qq")[0]):
            _, dimension, parametric, count = self.put("iiiq")
            self.put(("iddd" + "d" * (dimension % 3 * parametric)) * count)

    def Elements(self):
        for _ in range(self.put("qq")[0]):
            _, _, kind, count = self.put("iiiq")
            self.put("i" * count * (1 + {1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 15: 1}[kind]))

    def Periodic(self):
        for _ in range(self.put("i")[0]):
            self.put("iii")
            word = next(self.words)
            if word == "Affine":
                self.data += struct.pack(self.order + "q", -1)
                self.put("d" * 16)
                word = next(self.words)
            self.data += struct.pack(self.order + "q", int(word))
            self.put("ii" * int(word))

    def GhostElements(self):
        for _ in range(self.put("i")[0]):
            self.put("i" * self.put("iii")[2])


def seen_by_meshio(path):
    """Returns the cells with their entities and groups, and the periodic links. Nodes are identified by their
    coordinates."""
    mesh = meshio.read(path, "gmsh")
    place = [tuple(p) for p in mesh.points.tolist()]
    rows = {name: [str(v) for block in data for v in block]
            for name, data in mesh.cell_data.items() if name.startswith("gmsh:")}
    cells = [(block.type, *(place[n] for n in cell)) for block in mesh.cells for cell in block.data]
    links = [(int(dimension), tuple(map(int, tags)), str(affine),
              sorted((place[a], place[b]) for a, b in nodes))
             for dimension, tags, affine, nodes in mesh.gmsh_periodic or []]
    return {"cells": sorted(zip(*rows.values(), map(str, cells))), "links": links,
            "names": {name: tuple(tag) for name, tag in mesh.field_data.items()}}


class GmshFilesTest(FolderTest):
    def there_and_back(self, source, order):
        packed, back = self.path("packed.shm"), self.path(order + ".msh")
        for words in (["compress", source, "-o", packed, "--order", order],
                      ["verify", packed, "--against", source],
                      ["decompress", packed, "-o", back]):
            done = subprocess.run([SHM, *forced(words), "-q"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, f"{words} {done.stdout} {done.stderr}")
        return back

    def check(self, source):
        expected = apart(gmsh_oracle.load, source)
        exact = self.there_and_back(source, "keep")
        self.assertEqual(gmsh_oracle.compare(expected, apart(gmsh_oracle.load, exact)), [])
        expected = gmsh_oracle.renumbered(apart(gmsh_oracle.load, source, False))
        for order in ("stream", "free"):
            result = apart(gmsh_oracle.load, self.there_and_back(source, order), False)
            self.assertEqual(gmsh_oracle.compare(expected, gmsh_oracle.renumbered(result)), [],
                             order)

    def test_models_in_all_versions(self):
        for model in MODELS:
            for version, binary in FILES:
                if version == 1 and model in ("every type", "parametric"):
                    continue  # Gmsh writes files that it cannot read
                if not is_sampled(f"{model} {version} {binary}"):
                    continue
                with self.subTest(model=model, version=version, binary=binary):
                    source = self.path("source.msh")
                    apart(make, source, model, version, binary, False)
                    self.check(source)

    def test_version_4_0_in_binary(self):
        text, binary = self.path("text.msh"), self.path("binary.msh")
        for model in ("periodic", "partitions with topology", "parametric", "hexahedra",
                      "periodic alone", "prisms"):
            apart(make, text, model, 4.0, 0, False)
            with open(text, encoding="utf-8") as file:
                content = file.read()
            with open(text, "w", encoding="utf-8") as file:
                file.write(content.replace("\n4 0 8\n", "\n4.0 0 8\n"))  # meshio: "4" is 4.1
            for order in "<>":
                with self.subTest(model=model, order=order):
                    encoded = Binary40(content, order)
                    if "partitions" in model:
                        self.assertEqual(encoded.names[-2:], ["Periodic", "GhostElements"])
                    with open(binary, "wb") as file:
                        file.write(encoded.out)
                    with open(self.there_and_back(binary, "keep"), "rb") as file:
                        self.assertEqual(file.read(), encoded.out)
                    # meshio does not support parameters and partitions, and requires that every cell belongs
                    # to a group.
                    if (order != NATIVE or meshio is None or
                            model not in ("periodic alone", "prisms")):
                        continue
                    expected = seen_by_meshio(text)
                    self.assertTrue(expected["cells"])
                    self.assertEqual(bool(expected["links"]), model == "periodic alone")
                    self.assertEqual(seen_by_meshio(binary), expected)
                    for kind in ("stream", "free"):
                        self.assertEqual(seen_by_meshio(self.there_and_back(binary, kind)),
                                         expected)

    def test_views(self):
        for model in ("hexahedra", "hexahedra of order 2", "sparse tags", "prisms of order 2"):
            for version, binary in FILES[1:]:
                with self.subTest(model=model, version=version, binary=binary):
                    source = self.path("source.msh")
                    apart(make, source, model, version, binary, True)
                    with open(source, "rb") as file:
                        self.assertIn(b"$ElementNodeData", file.read())
                    self.check(source)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    SHM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
