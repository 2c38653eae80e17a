"""Creates a whole Exodus mesh with every kind of item that may be divided among parts, and divides it into
parts.

Needs ncgen and ncdump.
"""
import itertools
import re
import subprocess

from mpi_ranks import Exodus
from sample_meshes import hexahedra, wedges

def whole_text(n, steps=3, sets=True, seed=0):
    """Returns the CDL text of a mesh of n*n*n hexahedra in two blocks. Wedges in a third block replace the
    last layer. The mesh has every kind of item that may be divided among parts: fields, sets with factors and
    variables, attributes, records."""
    m = n + 1
    cells = hexahedra(n, first_node=1)
    layer = n * n
    blocks = [cells[:layer], cells[layer:-layer], []]
    for c in cells[-layer:]:
        blocks[2] += wedges(c)
    count, nodes = [len(b) for b in blocks], m ** 3 + 2  # two nodes that no element uses
    text = lambda values: ", ".join(repr(v) if isinstance(v, float) else str(v) for v in values)
    axis = lambda a: text([round((v // m ** a % m) * .25 + v % 7 * .001, 6) for v in range(nodes)])
    nodal = lambda k: text([round((v % 97) * .01 * k + s * (.5 + v % 5) + seed, 4)
                            for s in range(steps) for v in range(nodes)])
    element = lambda b: text([round(c % 31 + s * .125, 4) for s in range(steps)
                              for c in range(count[b])])
    fixed = list(range(1, m * m + 1))
    hexes = count[0] + count[1]
    # The side set contains the sides of hexahedra at x = 0 and triangular sides of the wedges. A triangular
    # side has three nodes.
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
    """Divides an Exodus file into parts. Each part has all variables of the file, but each variable contains
    only the values for the nodes, elements and set members of the part."""

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
        # The node lists of every second part are in descending order.
        self.nodes_of = [sorted(nodes, reverse=p % 2 == 1) for p, nodes in enumerate(self.nodes_of)]

    def rows(self, dimension, part):
        """Returns the indices along a netCDF dimension that belong to a part. Returns None if the part has all
        indices."""
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
