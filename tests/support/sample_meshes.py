"""Creates sample meshes for Python tests: legacy VTK files of grids of hexahedra, and Exodus files as CDL
text for ncgen."""
import random


def hexahedra(n, first_node=0):
    """Returns the corners of the n*n*n hexahedra of a grid. In the numbering of cells and nodes, x varies
    fastest."""
    m = n + 1
    at = lambda x, y, z: (z * m + y) * m + x + first_node
    return [[at(x, y, z), at(x + 1, y, z), at(x + 1, y + 1, z), at(x, y + 1, z),
             at(x, y, z + 1), at(x + 1, y, z + 1), at(x + 1, y + 1, z + 1), at(x, y + 1, z + 1)]
            for z in range(n) for y in range(n) for x in range(n)]


def wedges(c):
    """Divides the hexahedron with these corners into two wedges. Returns the corners of the wedges."""
    return [[c[0], c[1], c[2], c[4], c[5], c[6]], [c[0], c[2], c[3], c[4], c[6], c[7]]]


def write_vtk(path, n, bend=0.0, shuffled=False, window=1, noise=0.0):
    """Writes a legacy VTK file in ASCII: a grid of n*n*n hexahedra with one point array and one cell array.
    The order of the cells is random. If `window` is given, cells are shuffled only within runs of `window`
    consecutive cells. Interior points, and values of the point array between 0 and 1, change by random numbers
    below `noise`."""
    m = n + 1
    points, cells = [], []
    jitter = random.Random(3)
    for z in range(m):
        for y in range(m):
            for x in range(m):
                inside = noise if all(0 < i < n for i in (x, y, z)) else 0
                moved = [jitter.random() * inside for _ in range(3)]
                points.append(f"{x * 0.1 + bend * z + moved[0]} {y * 0.1 + moved[1]} {z * 0.1 + moved[2]}")
    number = list(range(len(points)))
    if shuffled:
        random.Random(1).shuffle(number)
        points = [place for _, place in sorted(zip(number, points))]
    for corners in hexahedra(n):
        cells.append("8 " + " ".join(str(number[v]) for v in corners))
    if shuffled:
        random.Random(2).shuffle(cells)
    for first in range(0, len(cells) if window > 1 else 0, window):
        some = cells[first:first + window]
        random.Random(first).shuffle(some)
        cells[first:first + window] = some
    with open(path, "w") as out:
        out.write("# vtk DataFile Version 3.0\na grid\nASCII\nDATASET UNSTRUCTURED_GRID\n")
        out.write(f"POINTS {len(points)} double\n" + "\n".join(points) + "\n")
        out.write(f"CELLS {len(cells)} {9 * len(cells)}\n" + "\n".join(cells) + "\n")
        out.write(f"CELL_TYPES {len(cells)}\n" + "12\n" * len(cells))
        out.write(f"POINT_DATA {len(points)}\nFIELD data 1\nheat 1 {len(points)} double\n")
        heat = [i % 17 / 16 for i in range(len(points))]
        out.write("\n".join(str(h + jitter.random() * noise if 0 < h < 1 else h) for h in heat) + "\n")
        out.write(f"CELL_DATA {len(cells)}\nFIELD data 1\nzone 1 {len(cells)} int\n")
        out.write("\n".join(str(i // 7) for i in range(len(cells))) + "\n")


def mixed_vtk(n):
    """Returns the text of a VTK file in which layers of hexahedra and layers of wedges alternate, with two
    wedges above each hexahedron. The mesh has fields on points and cells, and points that no cell uses."""
    m = n + 1
    cells, types = [], []
    for i, cell in enumerate(hexahedra(n)):
        if i // (n * n) % 2 == 0:
            cells.append(cell)
            types.append(12)
        else:
            cells += wedges(cell)
            types += [13, 13]
    points = m * m * m + 5
    lines = ["# vtk DataFile Version 3.0", "mixed", "ASCII", "DATASET UNSTRUCTURED_GRID",
             f"POINTS {points} float"]
    lines += [f"{p % m + p % 7 * .01:.4g} {p // m % m} {p // (m * m)}" for p in range(points)]
    lines.append(f"CELLS {len(cells)} {sum(len(c) + 1 for c in cells)}")
    lines += [" ".join(map(str, [len(c), *c])) for c in cells]
    lines.append(f"CELL_TYPES {len(cells)}")
    lines += map(str, types)
    lines += [f"CELL_DATA {len(cells)}", "SCALARS heat double 1", "LOOKUP_TABLE default"]
    lines += [f"{c % 37 * .125}" for c in range(len(cells))]
    lines += [f"POINT_DATA {points}", "VECTORS v float"]
    lines += [f"{p % 5} {-0.0 if p % 3 else p * .5:.6g} nan" for p in range(points)]
    return "\n".join(lines) + "\n"


def exodus_text(steps, n, title="steps", first_node_moved=False):
    """Returns the CDL text of an Exodus file of n*n*n hexahedra in two blocks. It has a node set, and global,
    nodal and element variables at the given steps. The values at a step depend only on the number of the
    step."""
    m = n + 1
    half = n * n * (n // 2)
    cells = hexahedra(n, first_node=1)
    blocks = [cells[:half], cells[half:]]
    text = lambda values: ", ".join(repr(v) if isinstance(v, float) else str(v) for v in values)
    coordinate = lambda axis: text([round((node // m ** axis % m) * .25 + node % 7 * .001 +
                                          (.5 if first_node_moved and node == 0 else 0), 6)
                                    for node in range(m ** 3)])
    nodal = lambda v: text([round((node % 97) * .01 * (v + 1) + step * (.5 + node % 5), 4)
                            for step in steps for node in range(m ** 3)])
    element = text([round(cell % 31 + step * .125, 4)
                    for step in steps for cell in range(len(blocks[1]))])
    return f"""netcdf run {{
dimensions: len_string = 33 ; len_line = 81 ; four = 4 ; len_name = 33 ; time_step = UNLIMITED ;
  num_dim = 3 ; num_nodes = {m ** 3} ; num_elem = {len(cells)} ; num_el_blk = 2 ;
  num_el_in_blk1 = {len(blocks[0])} ; num_nod_per_el1 = 8 ;
  num_el_in_blk2 = {len(blocks[1])} ; num_nod_per_el2 = 8 ;
  num_node_sets = 1 ; num_nod_ns1 = 3 ; num_glo_var = 2 ; num_nod_var = 2 ; num_elem_var = 1 ;
variables: double time_whole(time_step) ; int eb_status(num_el_blk) ; int eb_prop1(num_el_blk) ;
  eb_prop1:name = "ID" ; int ns_status(num_node_sets) ; int ns_prop1(num_node_sets) ;
  ns_prop1:name = "ID" ; int node_ns1(num_nod_ns1) ;
  int connect1(num_el_in_blk1, num_nod_per_el1) ; connect1:elem_type = "HEX8" ;
  int connect2(num_el_in_blk2, num_nod_per_el2) ; connect2:elem_type = "HEX8" ;
  double coordx(num_nodes) ; double coordy(num_nodes) ; double coordz(num_nodes) ;
  char name_glo_var(num_glo_var, len_name) ; char name_nod_var(num_nod_var, len_name) ;
  char name_elem_var(num_elem_var, len_name) ; int elem_var_tab(num_el_blk, num_elem_var) ;
  double vals_glo_var(time_step, num_glo_var) ; double vals_nod_var1(time_step, num_nodes) ;
  float vals_nod_var2(time_step, num_nodes) ; double vals_elem_var1eb2(time_step, num_el_in_blk2) ;
  :api_version = 5.14f ; :version = 5.14f ; :floating_point_word_size = 8 ; :file_size = 1 ;
  :title = "{title}" ;
data: time_whole = {text([step * .5 for step in steps])} ; eb_status = 1, 1 ; eb_prop1 = 10, 20 ;
  ns_status = 1 ; ns_prop1 = 7 ; node_ns1 = 1, 4, 12 ;
  connect1 = {text(sum(blocks[0], []))} ; connect2 = {text(sum(blocks[1], []))} ;
  coordx = {coordinate(0)} ; coordy = {coordinate(1)} ; coordz = {coordinate(2)} ;
  name_glo_var = "energy", "mass" ; name_nod_var = "u", "p" ; name_elem_var = "heat" ;
  elem_var_tab = 0, 1 ; vals_glo_var = {text([v for step in steps for v in (step * 3., 7.5)])} ;
  vals_nod_var1 = {nodal(0)} ; vals_nod_var2 = {nodal(1)} ; vals_elem_var1eb2 = {element} ;
}}
"""


# CDL text of a mesh of two hexahedra in two blocks, with three steps, a node set and a side set.
TWO_BLOCKS = """netcdf two {
dimensions: len_string = 33 ; len_line = 81 ; four = 4 ; len_name = 33 ; time_step = UNLIMITED ;
  num_dim = 3 ; num_nodes = 12 ; num_elem = 2 ; num_el_blk = 2 ; num_el_in_blk1 = 1 ;
  num_nod_per_el1 = 8 ; num_el_in_blk2 = 1 ; num_nod_per_el2 = 8 ; num_side_sets = 1 ;
  num_side_ss1 = 2 ; num_df_ss1 = 8 ; num_node_sets = 1 ; num_nod_ns1 = 3 ; num_qa_rec = 1 ;
  num_nod_var = 3 ; num_elem_var = 1 ;
variables: double time_whole(time_step) ; int eb_status(num_el_blk) ; int eb_prop1(num_el_blk) ;
  eb_prop1:name = "ID" ; char eb_names(num_el_blk, len_name) ; int ss_status(num_side_sets) ;
  int ss_prop1(num_side_sets) ; ss_prop1:name = "ID" ; char ss_names(num_side_sets, len_name) ;
  int ns_status(num_node_sets) ; int ns_prop1(num_node_sets) ; ns_prop1:name = "ID" ;
  char ns_names(num_node_sets, len_name) ; int elem_ss1(num_side_ss1) ; int side_ss1(num_side_ss1) ;
  double dist_fact_ss1(num_df_ss1) ; int node_ns1(num_nod_ns1) ;
  int connect1(num_el_in_blk1, num_nod_per_el1) ; connect1:elem_type = "HEX8" ;
  int connect2(num_el_in_blk2, num_nod_per_el2) ; connect2:elem_type = "HEX8" ;
  double coordx(num_nodes) ; double coordy(num_nodes) ; double coordz(num_nodes) ;
  int elem_map(num_elem) ; char qa_records(num_qa_rec, four, len_string) ;
  char name_nod_var(num_nod_var, len_name) ; char name_elem_var(num_elem_var, len_name) ;
  double vals_nod_var1(time_step, num_nodes) ; double vals_nod_var2(time_step, num_nodes) ;
  double vals_nod_var3(time_step, num_nodes) ; int elem_var_tab(num_el_blk, num_elem_var) ;
  double vals_elem_var1eb2(time_step, num_el_in_blk2) ;
  :api_version = 5.14f ; :version = 5.14f ; :floating_point_word_size = 8 ; :file_size = 1 ;
  :title = "two blocks" ;
data: time_whole = 0, 0.5, 2 ; eb_status = 1, 1 ; eb_prop1 = 10, 20 ; eb_names = "steel", "air" ;
  ss_status = 1 ; ss_prop1 = 3 ; ss_names = "inlet" ; ns_status = 1 ; ns_prop1 = 7 ;
  ns_names = "fixed" ; elem_ss1 = 1, 2 ; side_ss1 = 4, 6 ; dist_fact_ss1 = 1, 1, 1, 1, 1, 1, 1, 2 ;
  node_ns1 = 1, 4, 12 ; connect1 = 1, 2, 3, 4, 5, 6, 7, 8 ; connect2 = 5, 6, 7, 8, 9, 10, 11, 12 ;
  coordx = 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0 ; coordy = 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1 ;
  coordz = 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2 ; elem_map = 2, 1 ;
  qa_records = "code", "1", "today", "now" ; name_nod_var = "v_x", "v_y", "v_z" ;
  name_elem_var = "heat" ; elem_var_tab = 0, 1 ;
  vals_nod_var1 = 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12,
    31, 32, 33, 34, 35, 36, 37, 38, 39, 40, 41, 42 ;
  vals_nod_var2 = 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12,
    51, 52, 53, 54, 55, 56, 57, 58, 59, 60, 61, 62 ;
  vals_nod_var3 = 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12,
    71, 72, 73, 74, 75, 76, 77, 78, 79, 80, 81, 82 ;
  vals_elem_var1eb2 = 0.25, 0.5, 0.75 ;
}
"""
