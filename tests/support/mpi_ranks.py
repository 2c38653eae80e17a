"""Runs shm_mpi as an MPI program, and reads the parts of an Exodus mesh with ncdump."""
import concurrent.futures
import os
import re
import struct
import subprocess
import sys
import unittest

from folder_test import FolderTest, forced

SHM, SHM_MPI, MAKE_MESH = "shm", "shm_mpi", "shm_make_mesh"
CORPUS = os.environ.get("SHM_CORPUS", "")

# Settings of Open MPI. ALLOW_RUN_AS_ROOT: allows it to run as root, e.g. in a container. rmaps and hwloc:
# allow more ranks than cores. pml and btl: prevent the search for networks, which needs a third of the time of
# a small run. yield_when_idle: waiting ranks yield the processor.
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                   OMPI_MCA_rmaps_base_oversubscribe="1", OMPI_MCA_hwloc_base_binding_policy="none",
                   OMPI_MCA_pml="ob1", OMPI_MCA_btl="self,vader",
                   OMPI_MCA_mpi_yield_when_idle="1")
# Number of tests that run in parallel. A single test does not keep a CPU core busy, because its ranks spend
# much time starting, ending and waiting for each other.
AT_ONCE = 3


def shm(*arguments):
    return subprocess.run([SHM, *forced([str(word) for word in arguments])], capture_output=True,
                          text=True, timeout=600)


def ranks(n, *arguments):
    """Runs the command on n ranks. If the ranks deadlock, raises TimeoutExpired, so that the test fails."""
    words = forced([str(word) for word in arguments])
    return subprocess.run(["mpirun", "-n", str(n), SHM_MPI, *words],
                          capture_output=True, text=True, timeout=300, env=ENVIRONMENT)


class AtOnce(unittest.TestSuite):
    """Runs several tests at a time. Each test has a separate folder."""

    def run(self, result, debug=False):
        with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
            for test in [pool.submit(test, result) for test in self]:
                test.result()
        return result


def run_all():
    """Runs the tests of the calling program, whose arguments are the paths of shm, shm_mpi and shm_make_mesh.
    Exits with code 77 if all tests were skipped."""
    global SHM, SHM_MPI, MAKE_MESH
    SHM, SHM_MPI, MAKE_MESH = sys.argv[1:4]
    del sys.argv[1:4]
    loader = unittest.TestLoader()
    loader.suiteClass = AtOnce
    result = unittest.main(testLoader=loader, exit=False).result
    everything_skipped = result.testsRun > 0 and len(result.skipped) == result.testsRun
    sys.exit(77 if everything_skipped else 0 if result.wasSuccessful() else 1)


class Exodus:
    """The contents of an Exodus file as printed by ncdump. Numbers are stored as text, with enough digits to
    distinguish all values."""

    def __init__(self, path):
        text = subprocess.run(["ncdump", "-p", "9,17", path], capture_output=True, text=True,
                              check=True).stdout
        head, _, data = text.partition("\ndata:\n")
        self.sizes = {name: int(size or current) for name, size, current in re.findall(
            r"\t(\w+) = (?:(\d+)|UNLIMITED) ;(?: // \((\d+) currently\))?", head)}
        self.types = {name: kind for kind, name in re.findall(r"\t(\w+) (\w+)(?:\([^)]*\))? ;\n", head)}
        self.values = {}
        for name, values in re.findall(r"\n (\w+) =\s*(.*?) ;(?=\n)", data, re.S):
            kind = self.types[name]
            texts = [text.split("\\000")[0] for text in re.findall(r'"(.*?)"', values)]
            self.values[name] = (texts if kind == "char" else
                                 [self.number(kind, v) for v in values.split(",") if v.strip()])

    @staticmethod
    def number(kind, text):
        if kind not in ("float", "double"):
            return int(text)
        value = float(text.strip().rstrip("f"))  # float() also parses ncdump's NaN
        return repr(struct.unpack("f", struct.pack("f", value))[0] if kind == "float" else value)

    def get(self, name):
        return self.values.get(name, [])

    def size(self, name):
        return self.sizes.get(name, 0)

    def axes(self):
        count, flat = self.size("num_nodes"), self.get("coord")
        return ([flat[count * axis:count * (axis + 1)] for axis in range(3)] if flat else
                [self.get("coord" + axis) for axis in "xyz"])

    def elements(self):
        """Returns a pair for each element: the index of its block in the file, and the element's number in the
        whole mesh."""
        elements = [b for b in range(self.size("num_el_blk"))
                    for _ in range(self.size(f"num_el_in_blk{b + 1}"))]
        numbers = self.get("elem_num_map") or range(1, len(elements) + 1)
        return [(block, number) for block, number in zip(elements, numbers)]

    def steps(self, variable):
        """Returns the values of a variable as a list with one entry per step."""
        values, count = self.get(variable), self.size("time_step")
        width = len(values) // count if count else 0
        return [values[width * i:width * (i + 1)] for i in range(count)]


class Joined:
    """The nodes, elements, values and sets of a single file, or of all parts of a mesh. A node is identified
    by its number in the whole mesh. An element is identified by its block and its position in the sorted list
    of the block's element numbers."""

    def __init__(self, files, whole=None):
        self.nodes, self.cells, self.nodal, self.element = {}, {}, {}, {}
        self.node_sets, self.side_sets, self.original = {}, {}, {}
        self.shared = set()
        for file in files:
            self.add(file, whole)

    def put(self, into, key, value):
        if into.setdefault(key, value) != value:
            raise AssertionError(f"parts differ at {key}: {value} and {into[key]}")

    def add(self, file, whole):
        # If the file contains the whole mesh, the number of a node or element is its position. If the file is
        # a part, its maps contain the numbers that its nodes and elements have in the whole mesh.
        alone = whole is None
        nodes = range(1, file.size("num_nodes") + 1) if alone else file.get("node_num_map")
        elements = file.elements()
        if alone:
            elements = [(block, i + 1) for i, (block, _) in enumerate(elements)]
        maps = ("node_num_map", "elem_num_map") if alone else ("node_map1", "elem_map1")
        for i, node in enumerate(nodes):
            self.put(self.nodes, node, tuple(axis[i] for axis in file.axes()))
        for v, name in enumerate(file.get("name_nod_var")):
            for step, values in enumerate(file.steps(f"vals_nod_var{v + 1}")):
                for node, value in zip(nodes, values):
                    self.put(self.nodal, (name, step, node), value)
        for node, number in zip(nodes, file.get(maps[0])):
            self.put(self.original, ("node", node), number)
        for element, number in zip(elements, file.get(maps[1])):
            self.put(self.original, element, number)
        at = 0
        for b in range(file.size("num_el_blk")):
            count = file.size(f"num_el_in_blk{b + 1}")
            corners, width = file.get(f"connect{b + 1}"), file.size(f"num_nod_per_el{b + 1}")
            for i in range(count):
                cell = elements[at + i]
                if cell in self.cells:
                    raise AssertionError(f"element {cell} is there twice")
                self.cells[cell] = [nodes[c - 1] for c in corners[i * width:(i + 1) * width]]
                for v, name in enumerate(file.get("name_elem_var")):
                    for step, values in enumerate(file.steps(f"vals_elem_var{v + 1}eb{b + 1}")):
                        if values:
                            self.element[(name, step) + cell] = values[i]
            at += count
        for s in range(file.size("num_node_sets")):
            self.node_sets.setdefault(s, []).extend(nodes[m - 1] for m in file.get(f"node_ns{s + 1}"))
        for s in range(file.size("num_side_sets")):
            self.side_sets.setdefault(s, []).extend(
                (elements[e - 1], side)
                for e, side in zip(file.get(f"elem_ss{s + 1}"), file.get(f"side_ss{s + 1}")))

    def in_order(self):
        """Returns all contents. An element is identified by its block and its position in the sorted list of
        the block's element numbers."""
        place, counts = {}, {}
        for cell in sorted(self.cells):
            counts[cell[0]] = counts.get(cell[0], -1) + 1
            place[cell] = (cell[0], counts[cell[0]])
        original = {place.get(key, key): number for key, number in self.original.items()}
        return {"nodes": self.nodes, "nodal": self.nodal, "original": original,
                "cells": {place[cell]: corners for cell, corners in self.cells.items()},
                "element": {key[:2] + place[key[2:]]: value for key, value in self.element.items()},
                "node sets": {s: sorted(set(members)) for s, members in self.node_sets.items()},
                "side sets": {s: sorted((place[cell], side) for cell, side in members)
                              for s, members in self.side_sets.items()}}


class RanksTest(FolderTest):
    """Base class of tests that compare the files that several ranks write with the file that shm writes."""

    NEEDS = ("mpirun",)

    def made(self, family, cells, fields="full"):
        path = self.path(family + ".vtk")
        subprocess.run([MAKE_MESH, family, str(cells), path, "--fields", fields], check=True,
                       capture_output=True)
        return path

    def expect_same(self, mesh, counts, *options, parts=None):
        """Checks that shm_mpi, with each number of ranks in `counts`, writes the same bytes as shm."""
        alone, shared = self.path("alone.shm"), self.path("shared.shm")
        done = shm("compress", mesh, "-o", alone, "-q", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        for n in counts:
            done = ranks(n, "compress", parts or mesh, "-o", shared, "-q", *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertTrue(self.bytes(shared) == self.bytes(alone),
                            f"{n} ranks write different bytes from shm: {parts or mesh} {options}")
            os.remove(shared)
