#!/usr/bin/env python3
"""shm_mpi compress of a decomposed Exodus mesh: the bytes of the file that the whole mesh becomes,
or one error that names a part.

Usage: mpi_joined_test.py PATH_OF_SHM PATH_OF_SHM_MPI PATH_OF_SHM_MAKE_MESH
"""
import itertools
import os
import re
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import mpi_ranks
from mpi_ranks import CORPUS, Exodus, Joined, RanksTest, ranks, shm
from sample_meshes import hexahedra, mixed_vtk, wedges

NEMESIS = {"num_processors": None, "num_procs_file": 1, "num_int_node": 1}  # None: of parts


def whole_text(n, steps=3, sets=True, seed=0):
    """CDL of n*n*n hexahedra in two blocks, the last layer of it wedges in a third one, with all that
    parts have to share: fields, sets with factors and variables, attributes, records."""
    m = n + 1
    cells = hexahedra(n, first_node=1)
    layer = n * n
    blocks = [cells[:layer], cells[layer:-layer], []]
    for c in cells[-layer:]:
        blocks[2] += wedges(c)
    count, nodes = [len(b) for b in blocks], m ** 3 + 2  # two that no element uses
    text = lambda values: ", ".join(repr(v) if isinstance(v, float) else str(v) for v in values)
    axis = lambda a: text([round((v // m ** a % m) * .25 + v % 7 * .001, 6) for v in range(nodes)])
    nodal = lambda k: text([round((v % 97) * .01 * k + s * (.5 + v % 5) + seed, 4)
                            for s in range(steps) for v in range(nodes)])
    element = lambda b: text([round(c % 31 + s * .125, 4) for s in range(steps)
                              for c in range(count[b])])
    fixed = list(range(1, m * m + 1))
    hexes = count[0] + count[1]
    # Sides x = 0 of the hexahedra, and the lids of wedges, of three nodes.
    inlet = [(c + 1, 4) for c in range(hexes) if c % n == 0]
    inlet += [(hexes + w + 1, 5) for w in range(count[2])]
    factors = [round(e * .5 + k, 3) for e, side in inlet for k in range(4 if side == 4 else 3)]
    set_parts = ("", "", "") if not sets else (
        f"""num_node_sets = 1 ; num_nod_ns1 = {len(fixed)} ; num_side_sets = 1 ;
  num_side_ss1 = {len(inlet)} ; num_df_ss1 = {len(factors)} ; num_sset_var = 1 ;""",
        """int ns_status(num_node_sets) ; int ns_prop1(num_node_sets) ; ns_prop1:name = "ID" ;
  int ss_status(num_side_sets) ; int ss_prop1(num_side_sets) ; ss_prop1:name = "ID" ;
  char ss_names(num_side_sets, len_name) ; int node_ns1(num_nod_ns1) ;
  double dist_fact_ns1(num_nod_ns1) ; int elem_ss1(num_side_ss1) ; int side_ss1(num_side_ss1) ;
  double dist_fact_ss1(num_df_ss1) ; char name_sset_var(num_sset_var, len_name) ;
  double vals_sset_var1ss1(time_step, num_side_ss1) ;""",
        f"""ns_status = 1 ; ns_prop1 = 7 ; ss_status = 1 ; ss_prop1 = 3 ; ss_names = "inlet" ;
  node_ns1 = {text(fixed)} ; dist_fact_ns1 = {text([v * .25 for v in fixed])} ;
  elem_ss1 = {text([e for e, _ in inlet])} ; side_ss1 = {text([s for _, s in inlet])} ;
  dist_fact_ss1 = {text(factors)} ; name_sset_var = "flow" ;
  vals_sset_var1ss1 = {text([e + s * .5 for s in range(steps) for e, _ in inlet])} ;""")
    return f"""netcdf whole {{
dimensions: len_string = 33 ; len_line = 81 ; four = 4 ; len_name = 33 ; time_step = UNLIMITED ;
  num_dim = 3 ; num_nodes = {nodes} ; num_elem = {sum(count)} ; num_el_blk = 3 ;
  num_el_in_blk1 = {count[0]} ; num_nod_per_el1 = 8 ; num_att_in_blk1 = 2 ;
  num_el_in_blk2 = {count[1]} ; num_nod_per_el2 = 8 ; num_el_in_blk3 = {count[2]} ;
  num_nod_per_el3 = 6 ; {set_parts[0]} num_qa_rec = 1 ; num_info = 2 ; num_glo_var = 1 ;
  num_nod_var = 2 ; num_elem_var = 2 ; num_elem_maps = 1 ;
variables: double time_whole(time_step) ; char qa_records(num_qa_rec, four, len_string) ;
  char info_records(num_info, len_line) ; int eb_status(num_el_blk) ; int eb_prop1(num_el_blk) ;
  eb_prop1:name = "ID" ; char eb_names(num_el_blk, len_name) ; {set_parts[1]}
  double coordx(num_nodes) ; double coordy(num_nodes) ; double coordz(num_nodes) ;
  int connect1(num_el_in_blk1, num_nod_per_el1) ; connect1:elem_type = "HEX8" ;
  double attrib1(num_el_in_blk1, num_att_in_blk1) ;
  int connect2(num_el_in_blk2, num_nod_per_el2) ; connect2:elem_type = "HEX8" ;
  int connect3(num_el_in_blk3, num_nod_per_el3) ; connect3:elem_type = "WEDGE6" ;
  int em_prop1(num_elem_maps) ; em_prop1:name = "ID" ; int elem_map1(num_elem) ;
  char name_glo_var(num_glo_var, len_name) ; char name_nod_var(num_nod_var, len_name) ;
  char name_elem_var(num_elem_var, len_name) ; int elem_var_tab(num_el_blk, num_elem_var) ;
  double vals_glo_var(time_step, num_glo_var) ; double vals_nod_var1(time_step, num_nodes) ;
  float vals_nod_var2(time_step, num_nodes) ; double vals_elem_var1eb1(time_step, num_el_in_blk1) ;
  double vals_elem_var1eb3(time_step, num_el_in_blk3) ;
  double vals_elem_var2eb2(time_step, num_el_in_blk2) ;
  :api_version = 5.14f ; :version = 5.14f ; :floating_point_word_size = 8 ; :file_size = 1 ;
  :title = "in parts" ;
data: time_whole = {text([s * .5 for s in range(steps)])} ;
  qa_records = "tests", "1", "today", "now" ; info_records = "first", "second" ;
  eb_status = 1, 1, 1 ; eb_prop1 = 10, 20, 30 ; eb_names = "steel", "air", "lid" ; {set_parts[2]}
  coordx = {axis(0)} ; coordy = {axis(1)} ; coordz = {axis(2)} ;
  connect1 = {text(sum(blocks[0], []))} ; connect2 = {text(sum(blocks[1], []))} ;
  connect3 = {text(sum(blocks[2], []))} ;
  attrib1 = {text([c * .5 for c in range(2 * count[0])])} ;
  em_prop1 = 1 ; elem_map1 = {text([7 * c % 1000 + 1 for c in range(sum(count))])} ;
  name_glo_var = "energy" ; name_nod_var = "u", "p" ; name_elem_var = "heat", "flux" ;
  elem_var_tab = 1, 0, 0, 1, 1, 0 ; vals_glo_var = {text([s * 3. for s in range(steps)])} ;
  vals_nod_var1 = {nodal(1)} ; vals_nod_var2 = {nodal(2)} ;
  vals_elem_var1eb1 = {element(0)} ; vals_elem_var1eb3 = {element(2)} ;
  vals_elem_var2eb2 = {element(1)} ;
}}
"""


class Split:
    """One Exodus file cut into parts, each the same variables with the rows that it has."""

    def __init__(self, whole, owner, count, base=1):
        self.file, self.count, self.base = Exodus(whole), count, base
        head = subprocess.run(["ncdump", "-h", whole], capture_output=True, text=True,
                              check=True).stdout
        self.dimensions = re.findall(r"\n\t(\w+) = (UNLIMITED|\d+) ;", head)
        self.variables = re.findall(r"\n\t(\w+) (\w+)(?:\(([^)]*)\))? ;", head)
        self.attributes = re.findall(r"\n\t\t(\w*:[^=]+ = .*) ;", head)
        size, get = self.file.size, self.file.get
        self.nodes_of, self.cells_of = [set() for _ in range(count)], [[] for _ in range(count)]
        self.blocks, self.block_of = [], []
        for b in range(1, size("num_el_blk") + 1):
            cells, width = size(f"num_el_in_blk{b}"), size(f"num_nod_per_el{b}")
            self.blocks.append(len(self.block_of))
            for c in range(cells):
                part = owner(len(self.block_of)) % count
                self.cells_of[part].append(len(self.block_of))
                self.nodes_of[part].update(get(f"connect{b}")[c * width:(c + 1) * width])
                self.block_of.append(b)
        used = set().union(*self.nodes_of)
        self.nodes_of[-1].update(set(range(1, size("num_nodes") + 1)) - used)
        # Not in their order everywhere.
        self.nodes_of = [sorted(nodes, reverse=p % 2 == 1) for p, nodes in enumerate(self.nodes_of)]

    def rows(self, dimension, part):
        """Which rows of a dimension the part has; None for all."""
        nodes, cells = self.nodes_of[part], self.cells_of[part]
        get = self.file.get
        if dimension == "num_nodes":
            return [v - 1 for v in nodes]
        if dimension == "num_elem":
            return cells
        for prefix in ("num_el_in_blk", "num_nod_ns", "num_side_ss", "num_df_ss"):
            number = re.fullmatch(prefix + r"(\d+)", dimension)
            if not number:
                continue
            number = number[1]
            if prefix == "num_el_in_blk":
                return [c - self.blocks[int(number) - 1] for c in cells
                        if self.block_of[c] == int(number)]
            if prefix == "num_nod_ns":
                return [i for i, v in enumerate(get("node_ns" + number)) if v in set(nodes)]
            mine, members, sides = set(cells), get("elem_ss" + number), get("side_ss" + number)
            if prefix == "num_side_ss":
                return [i for i, e in enumerate(members) if e - 1 in mine]
            kept, at = [], 0
            for e, side in zip(members, sides):
                width = 4 if self.block_of[e - 1] < 3 else 3
                kept += range(at, at + width) if e - 1 in mine else []
                at += width
            return kept
        return None

    def text(self, part, change=lambda name, values: values, extra="", nemesis=True):
        rows = {name: self.rows(name, part) for name, _ in self.dimensions}
        gone = {name for name, kept in rows.items() if kept == []}
        lengths = {name: len(kept) if kept is not None else self.file.size(name)
                   for name, kept in rows.items()}
        local = {"node": {v: i + 1 for i, v in enumerate(self.nodes_of[part])},
                 "cell": {c + 1: i + 1 for i, c in enumerate(self.cells_of[part])}}
        declared, data, kinds = [], [], {}

        def put(name, kind, dimensions, values):
            values = change(name, values)
            if values is None:
                return
            kinds[name] = kind
            declared.append(f"{kind} {name}({', '.join(dimensions)}) ;" if dimensions else
                            f"{kind} {name} ;")
            quote = lambda v: '"' + v + '"' if kind == "char" else str(v)
            if values:
                data.append(f"{name} = {', '.join(map(quote, values))} ;")

        for kind, name, dimensions in self.variables:
            dimensions = dimensions.split(", ") if dimensions else []
            if gone & set(dimensions):
                continue
            values = self.file.get(name)
            spans = dimensions[:-1] if kind == "char" else dimensions
            kept = [rows[d] if rows[d] is not None else range(self.file.size(d)) for d in spans]
            places = []
            for place in itertools.product(*kept):
                at = 0
                for d, i in zip(spans, place):
                    at = at * self.file.size(d) + i
                places.append(at)
            values = [values[at] for at in places]
            if re.fullmatch(r"connect\d+|node_ns\d+", name):
                values = [local["node"][v] for v in values]
            if re.fullmatch(r"elem_ss\d+", name):
                values = [local["cell"][v] for v in values]
            if name == "eb_status":
                values = [int(f"num_el_in_blk{b + 1}" not in gone) for b in range(len(values))]
            if name == "elem_var_tab":
                width = self.file.size("num_elem_var")
                values = [v if f"num_el_in_blk{i // width + 1}" not in gone else 0
                          for i, v in enumerate(values)]
            put(name, kind, dimensions, values)
        shift = self.base - 1
        if self.nodes_of[part]:
            put("node_num_map", "int", ["num_nodes"], [v + shift for v in self.nodes_of[part]])
        if self.cells_of[part]:
            put("elem_num_map", "int", ["num_elem"], [c + 1 + shift for c in self.cells_of[part]])
        dims = [(name, length if length == "UNLIMITED" else lengths[name])
                for name, length in self.dimensions if name not in gone]
        if nemesis:
            dims[1:1] = [("num_processors", self.count), ("num_procs_file", 1), ("num_int_node", 2),
                         ("num_nodes_global", self.file.size("num_nodes"))]
            put("nem_ftype", "int", [], [0])
            put("node_mapi", "int", ["num_int_node"], [1, 2])
        attributes = [a for a in self.attributes if not a.split(":")[0] or a.split(":")[0] in kinds]
        return (f"netcdf part {{ dimensions: {' '.join(f'{n} = {v} ;' for n, v in dims)} {extra}\n"
                f"variables: {' '.join(declared)} {' '.join(a + ' ;' for a in attributes)}\n"
                f"data: {' '.join(data)} }}\n")


def interleaved(cell):
    return cell * 7 // 3


class JoinedTest(RanksTest):
    NEEDS = ("mpirun", "ncgen", "ncdump")

    def split(self, count, owner=interleaved, n=5, kind="64-bit-offset", base=1, **how):
        """The whole mesh and the name of its parts."""
        whole = self.ncgen("whole.e", whole_text(n, **how), kind)
        split = Split(whole, owner, count, base)
        for part in range(count):
            self.ncgen(f"mesh.e.{count}.{part:0{len(str(count))}}", split.text(part), kind)
        return whole, self.path(f"mesh.e.{count}")

    def expect_joined(self, whole, parts, counts, *options):
        self.expect_same(whole, counts, *options, parts=parts)

    # --- the same bytes

    def test_interleaved_cells(self):
        whole, parts = self.split(4)
        for order in (["keep"], ["stream"], ["stream", "--delay", "30"], ["keep", "--delay", "9"]):
            self.expect_joined(whole, parts, (1, 2, 3, 4, 6), "--segment-cells", 40, "--order", *order)

    def test_consecutive_cells_and_numbers_from_nought(self):
        whole, parts = self.split(3, lambda cell: cell // 60, base=0)
        self.expect_joined(whole, parts, (1, 2, 4), "--segment-cells", 50)

    def test_kinds_of_files(self):
        for kind in ("classic", "64-bit-data"):
            whole, parts = self.split(2, n=4, kind=kind)
            self.expect_joined(whole, parts, (3,), "--segment-cells", 30)
        # Chunks are those of the first part.
        whole, parts = self.split(2, n=4, kind="netCDF-4 classic model")
        self.expect_own_file(whole, parts, (3,))

    def test_one_part(self):
        whole, parts = self.split(1, n=3)
        self.expect_joined(whole, parts, (1, 3), "--segment-cells", 10)

    def test_bounds_and_levels(self):
        whole, parts = self.split(3)
        for options in (["--rel", "1e-3"], ["--bits", "12"], ["--abs", "1e-2", "--level", "best"],
                        ["--level", "fast", "--threads", "2"], ["--key-steps", "1"],
                        ["--array", "heat:rel=1e-2", "--array", "p:abs=.1"]):
            self.expect_joined(whole, parts, (2,), "--segment-cells", 40, *options)

    def test_delay_that_is_tried(self):
        whole, parts = self.split(2, lambda cell: cell // 1000, n=29, steps=1)
        self.expect_joined(whole, parts, (2,), "--segment-cells", 9000, "--order", "stream")

    def test_parts_without_elements_of_some_blocks(self):
        # The first part has the first block alone; the file of all is what becomes of the result.
        whole, parts = self.split(5, lambda cell: cell // 45)
        self.expect_own_file(whole, parts, (1, 3))

    def test_more_parts_than_elements(self):
        whole, parts = self.split(50, n=3, sets=False)
        self.expect_own_file(whole, parts, (2,))
        whole, parts = self.split(3, lambda cell: 1, n=3, sets=False)  # two without any
        self.expect_own_file(whole, parts, (2,))

    def expect_own_file(self, whole, parts, counts, *options):
        """Where names come in another order than in the whole file: what comes out is the whole
        mesh, and becomes itself again."""
        done = ranks(2, "compress", parts, "-o", self.path("first.shm"), "-q", "--segment-cells", 40)
        self.assertEqual(done.returncode, 0, done.stderr)
        back = self.path("back.e")
        done = shm("decompress", self.path("first.shm"), "-o", back)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.expect_joined(back, parts, counts, "--segment-cells", 40, *options)
        mine, all_of_it = Joined([Exodus(back)]).in_order(), Joined([Exodus(whole)]).in_order()
        for what, values in all_of_it.items():
            self.assertTrue(mine[what] == values, what)

    # --- parts that shm_mpi has made itself

    def expect_back(self, mesh, n, *options):
        packed, out = self.path("packed"), self.path("out.e")
        self.assertEqual(shm("compress", mesh, "-o", packed, "-q", *options).returncode, 0)
        done = ranks(n, "decompress", packed, "-o", out, "-q")
        self.assertEqual(done.returncode, 0, done.stderr)
        joined, back = self.path("first.shm"), self.path("back.e")
        done = ranks(2, "compress", f"{out}.{n}", "-o", joined, "-q", "--segment-cells", 60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(shm("decompress", joined, "-o", back).returncode, 0)
        self.expect_joined(back, f"{out}.{n}", (1, 3, 4), "--segment-cells", 60)
        self.expect_joined(back, f"{out}.{n}", (4,), "--segment-cells", 60, "--order", "stream")
        whole = self.path("whole.e")
        self.assertEqual(shm("decompress", packed, "-o", whole, "--format", "exodus").returncode, 0)
        mine, all_of_it = Joined([Exodus(back)]).in_order(), Joined([Exodus(whole)]).in_order()
        names = Exodus(whole).get("name_nod_var") + Exodus(whole).get("name_elem_var")
        for what in ("nodal", "element"):  # attributes and so on have become fields
            mine[what] = {key: v for key, v in mine[what].items() if key[0] in names}
        for what in ("nodes", "cells", "nodal", "element", "node sets", "side sets"):
            self.assertTrue(mine[what] == all_of_it[what], f"{what} of {n} parts: {mesh}")
        for part in range(n):
            os.remove(f"{out}.{n}.{part}")

    def test_parts_of_shm_mpi(self):
        whole = self.ncgen("mesh.e", whole_text(5))
        for n in (1, 2, 4):
            self.expect_back(whole, n, "--segment-cells", 50)
        self.expect_back(whole, 3, "--order", "stream", "--delay", "20")
        mixed = self.path("mixed.vtk")
        with open(mixed, "w", encoding="ascii") as file:
            # Blocks alternate, and Exodus has no NaN that ncdump tells apart.
            file.write(mixed_vtk(5).replace(" nan", " 1.5"))
        self.expect_back(mixed, 3, "--segment-cells", 30)

    def test_real_parts(self):
        parts = os.path.join(CORPUS, "exodus/moose__out.e.4")
        if not os.path.exists(parts + ".0"):
            self.skipTest("SHM_CORPUS has no parts")
        self.assertEqual(ranks(1, "compress", parts, "-o", self.path("first.shm"), "-q",
                               "--segment-cells", 500).returncode, 0)
        back = self.path("back.e")
        self.assertEqual(shm("decompress", self.path("first.shm"), "-o", back).returncode, 0)
        for order in (["keep"], ["stream"], ["stream", "--delay", "40"]):
            self.expect_joined(back, parts, (2, 3, 4), "--segment-cells", 500, "--order", *order)

    def test_parts_of_real_meshes(self):
        names = ("moose__ex02.e", "libmesh__nontrivial_elem_num_map.exo", "moab__mbtest1.g",
                 "moose__diffusion_3d_hex27_out.e")
        meshes = [os.path.join(CORPUS, "exodus", name) for name in names]
        meshes = [mesh for mesh in meshes if CORPUS and os.path.exists(mesh)]
        if not meshes:
            self.skipTest("SHM_CORPUS has no such files")
        for i, mesh in enumerate(meshes):
            self.expect_back(mesh, 2 + i % 3)

    # --- what goes wrong, on all ranks

    def expect_failure(self, words, code=3, n=3, parts=None):
        out = self.path("out.shm")
        done = ranks(n, "compress", parts or self.path("mesh.e.3"), "-o", out, "--segment-cells", 20)
        self.assertEqual(done.returncode, code, done.stderr)
        errors = [line for line in done.stderr.splitlines() if line.startswith("shm_mpi: ")]
        self.assertEqual(len(errors), 1, done.stderr)
        for word in [words] if isinstance(words, str) else words:
            self.assertIn(word, errors[0])
        self.assertFalse([name for name in os.listdir(self.directory.name) if "out" in name])

    def test_bad_parts(self):
        self.split(3, n=4)
        split = Split(self.path("whole.e"), interleaved, 3)
        good = [self.bytes(self.path(f"mesh.e.3.{p}")) for p in range(3)]

        def with_part(part, words, change, **how):
            self.ncgen(f"mesh.e.3.{part}", split.text(part, change, **how))
            self.expect_failure(words)
            with open(self.path(f"mesh.e.3.{part}"), "wb") as file:
                file.write(good[part])

        def put(name, place, value):
            """The variable with another value at one place."""
            def change(variable, values):
                if variable == name:
                    values = list(values)
                    values[place] = value(values[place]) if callable(value) else value
                return values
            return change

        without = lambda name: lambda variable, values: None if variable == name else values
        shared = (set(split.nodes_of[1]) & set(split.nodes_of[0])).pop()
        where = split.nodes_of[1].index(shared)
        name = ["mesh.e.3.1"]
        with_part(1, name + ["'elem_num_map'", "twice"], put("elem_num_map", 1, split.cells_of[1][0] + 1))
        with_part(1, ["mesh.e.3.", "'elem_num_map'", "also in"],
                  put("elem_num_map", 1, split.cells_of[2][0] + 1))
        with_part(2, ["mesh.e.3.2", "'elem_num_map'", "also in", "mesh.e.3.0"],
                  put("elem_num_map", 0, split.cells_of[0][0] + 1))
        with_part(1, name + ["'elem_num_map'", "999999"], put("elem_num_map", 3, 999999))
        with_part(1, name + ["'elem_num_map'", "-5"], put("elem_num_map", 3, -5))
        with_part(1, name + ["'node_num_map'", "twice"], put("node_num_map", 1, split.nodes_of[1][0]))
        with_part(1, name + ["'node_num_map'", "2147483647"], put("node_num_map", 1, 2147483647))
        with_part(1, name + ["'elem_num_map'", "missing"], without("elem_num_map"))
        with_part(1, name + ["'node_num_map'", "missing"], without("node_num_map"))
        with_part(1, [f"node {shared} ", "coordinates"], put("coordy", where, 77.5))
        nodes = len(split.nodes_of[1])
        with_part(1, [f"node {shared} ", "array 'p'", "step 2"],
                  put("vals_nod_var2", 2 * nodes + where, 77.5))
        with_part(1, name + ["element"], put("connect2", 3, 100000))
        with_part(1, name + ["'elem_ss1'", "member"], put("elem_ss1", 0, 100000))
        with_part(1, ["'node_ns1'", "other values"],
                  put("dist_fact_ns1", next(i for i, v in enumerate(v for v in split.file.get("node_ns1") if v in set(split.nodes_of[1])) if v in set(split.nodes_of[0])), 9.5))
        with_part(1, name + ["'dist_fact_ss1'", "distribution factors"], put("side_ss1", 0, 9))
        with_part(1, name + ["'time_whole'", "other values"], put("time_whole", 1, 99.5))
        with_part(1, name + ["'eb_prop1'", "other values"], put("eb_prop1", 1, 21))
        with_part(1, name + ["'vals_nod_var1'", "missing"], without("vals_nod_var1"))
        with_part(1, name + ["'vals_elem_var1eb1'", "missing"], without("vals_elem_var1eb1"))
        # A number that nobody has: the node is in one part alone.
        lonely = next(v for v in split.nodes_of[2] if v not in split.nodes_of[0] + split.nodes_of[1])
        text = split.text(2, put("node_num_map", split.nodes_of[2].index(lonely),
                                 split.file.size("num_nodes") + 1), nemesis=False)
        self.ncgen("mesh.e.3.2", text)
        for p in (0, 1):
            self.ncgen(f"mesh.e.3.{p}", split.text(p, nemesis=False))
        self.expect_failure([f"node {lonely} is in no part", "'node_num_map'"])

    def test_parts_that_are_not_alike(self):
        self.split(3, n=4)
        for n, how, words in ((3, {"sets": False}, "mesh.e.3"), (4, {"steps": 2}, "'time_step'"),
                              (4, {"seed": 1}, "array 'u'")):
            other = self.ncgen("other.e", whole_text(n, **how))
            keep = self.bytes(self.path("mesh.e.3.1"))
            self.ncgen("mesh.e.3.1", Split(other, interleaved, 3).text(1))
            self.expect_failure(words)
            with open(self.path("mesh.e.3.1"), "wb") as file:
                file.write(keep)
        shutil.copy(self.path("mesh.e.3.0"), self.path("mesh.e.3.1"))
        self.expect_failure("mesh.e.3.")
        os.remove(self.path("mesh.e.3.1"))
        self.expect_failure("mesh.e.3.1")

    def test_damaged_parts(self):
        self.split(3, n=3)
        path, failures = self.path("mesh.e.3.1"), 0
        good, packed = self.bytes(path), self.path("out.shm")
        damages = [good[:len(good) * i // 5] for i in range(5)]
        damages += [good[:at] + bytes([good[at] ^ 0x41]) + good[at + 1:]
                    for at in range(5, min(len(good), 6000), 419)]
        for damaged in damages:
            with open(path, "wb") as file:
                file.write(damaged)
            done = ranks(2, "compress", self.path("mesh.e.3"), "-o", packed, "--segment-cells", 9,
                         "-q")
            if done.returncode == 0:
                self.assertEqual(shm("verify", packed, "-q").returncode, 0)
                os.remove(packed)
                continue
            failures += 1
            self.assertIn(done.returncode, (3, 5), done.stderr)
            errors = [line for line in done.stderr.splitlines() if line.startswith("shm_mpi: ")]
            self.assertEqual(len(errors), 1, done.stderr)
            self.assertFalse(os.path.exists(packed))
        self.assertGreater(failures, 8)

    def test_what_is_no_decomposed_mesh(self):
        self.split(3, n=3)
        for name in ("mesh.e", "mesh.e.2", "mesh.e.03", "mesh.e.3x", "mesh.e.99999999999999999999"):
            self.expect_failure("cannot be read", parts=self.path(name))
        # A part is a mesh too.
        done = ranks(2, "compress", self.path("mesh.e.3.1"), "-o", self.path("one.shm"), "-q",
                     "--segment-cells", 9)
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    mpi_ranks.run_all()
