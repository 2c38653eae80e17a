"""Writes mesh files as simulation codes do. The formats are Exodus II (through netCDF), legacy VTK as text, VTU,
and Gmsh MSH 4.1; meshes.py writes binary legacy VTK. The output is deterministic."""
import base64
import struct
import zlib

import netCDF4
import numpy as np

# Nodes of each side of a hexahedron. Sides and nodes are in the order of Exodus; nodes are numbered from 0.
HEX_SIDES = np.array([(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1),
                      (4, 5, 6, 7)])
VTK_POLYGON, VTK_HEXAHEDRON, VTK_POLYHEDRON = 7, 12, 42
NAME_LENGTH, LINE_LENGTH = 32, 80
XML_TYPES = {"float64": "Float64", "int32": "Int32", "int64": "Int64", "uint8": "UInt8"}


class Exodus:
    """Writes an Exodus file with the layout that libexodusII writes: first the dimensions, then the data.

    Node and element numbers in the arguments start at 0. `blocks` contains a tuple for each block: id, name and cells.
    The cells of a block of hexahedra are an array with one row of eight corners per hexahedron. The cells of a block of
    polygons are a list with the nodes of each polygon. The cells of a block of polyhedra are a list with the
    indices of the faces of each polyhedron; `faces` contains the nodes of each face. `node_sets` contains a tuple for
    each set: name and nodes. `side_sets` contains a tuple for each set: name, elements and sides. `word` is the type of all
    real numbers of the file, f4 or f8. put_step() writes the values of all arrays at one time step."""

    def __init__(self, path, title, points, blocks, faces=(), node_sets=(), side_sets=(), times=(),
                 node_names=(), cell_names=(), qa=(), info=(), maps=False, factors=False,
                 kind="NETCDF3_64BIT_OFFSET", word="f8"):
        self.blocks, self.word = blocks, word
        self.file = netCDF4.Dataset(path, "w", format=kind)
        self.file.set_fill_off()
        self.sizes = [len(of) for _, _, of in blocks]
        self.file.setncatts({"api_version": np.float32(8.11), "version": np.float32(8.11),
                             "floating_point_word_size": np.int32(word[1]), "file_size": np.int32(1),
                             "maximum_name_length": np.int32(NAME_LENGTH),
                             "int64_status": np.int32(0), "title": title})
        # variables and their values, which are written after all dimensions and variables have been defined
        self.later = []
        for name, size in (("len_string", 33), ("len_name", NAME_LENGTH + 1),
                           ("len_line", LINE_LENGTH + 1), ("four", 4), ("num_dim", 3),
                           ("time_step", None), ("num_nodes", len(points)),
                           ("num_elem", sum(self.sizes)), ("num_el_blk", len(blocks))):
            self.file.createDimension(name, size)
        self.define("time_whole", word, ("time_step",), np.array(times))
        self.texts("coor_names", ("num_dim", "len_name"), ["x", "y", "z"])
        for axis, letter in enumerate("xyz"):
            self.define(f"coord{letter}", word, ("num_nodes",), points[:, axis])
        if maps:
            self.define("node_num_map", "i4", ("num_nodes",), np.arange(1, len(points) + 1))
            self.define("elem_num_map", "i4", ("num_elem",), np.arange(1, sum(self.sizes) + 1))
        if len(faces):
            self.put_faces(faces)
        self.things("eb", "num_el_blk", [i for i, _, _ in blocks], [name for _, name, _ in blocks])
        for number, (_, _, of) in enumerate(blocks, 1):
            self.put_block(number, of, bool(len(faces)))
        if qa:
            self.file.createDimension("num_qa_rec", len(qa))
            self.texts("qa_records", ("num_qa_rec", "four", "len_string"), qa)
        if info:
            self.file.createDimension("num_info", len(info))
            self.texts("info_records", ("num_info", "len_line"), info)
        self.put_sets(node_sets, side_sets, factors)
        self.values = {}
        self.put_variables(node_names, cell_names)
        for variable, value in self.later:
            variable[:] = value

    def define(self, name, kind, dimensions, value, /, **attributes):
        variable = self.file.createVariable(name, kind, dimensions)
        variable.setncatts(attributes)
        self.later.append((variable, value))

    def texts(self, name, dimensions, lines):
        length = len(self.file.dimensions[dimensions[-1]])
        flat = [text.encode()[:length - 1].ljust(length, b"\0") for text in np.ravel(lines)]
        shape = [len(self.file.dimensions[dimension]) for dimension in dimensions]
        self.define(name, "S1", dimensions, np.frombuffer(b"".join(flat), "S1").reshape(shape))

    def things(self, prefix, dimension, ids, names):
        self.define(f"{prefix}_status", "i4", (dimension,), np.ones(len(ids), "i4"))
        self.define(f"{prefix}_prop1", "i4", (dimension,), np.array(ids), name="ID")
        self.texts(f"{prefix}_names", (dimension, "len_name"), names)

    def lists(self, connectivity, counts, dimension, total, lists, kind, of, to):
        """Defines two variables: `connectivity` contains the elements of all lists, one list after the other, and
        `counts` contains the length of each list."""
        self.file.createDimension(total, sum(map(len, lists)))
        self.define(connectivity, "i4", (total,), np.concatenate(lists) + 1, elem_type=kind)
        self.define(counts, "i4", (dimension,), np.array([len(some) for some in lists]),
                    entity_type1=of, entity_type2=to)

    def put_faces(self, faces):
        for name, size in (("num_face", len(faces)), ("num_fa_blk", 1), ("num_fa_in_blk1", len(faces))):
            self.file.createDimension(name, size)
        self.things("fa", "num_fa_blk", [1], ["faces"])
        self.lists("fbconn1", "fbepecnt1", "num_fa_in_blk1", "num_nod_per_fa1", faces, "nsided",
                   "NODE", "FACE")

    def put_block(self, number, of, of_faces):
        elements = f"num_el_in_blk{number}"
        self.file.createDimension(elements, len(of))
        if isinstance(of, np.ndarray):
            nodes = f"num_nod_per_el{number}"
            self.file.createDimension(nodes, of.shape[1])
            self.define(f"connect{number}", "i4", (elements, nodes), of + 1, elem_type="HEX8")
        elif of_faces:
            self.lists(f"facconn{number}", f"ebepecnt{number}", elements, f"num_fac_per_el{number}", of,
                       "nfaced", "FACE", "ELEM")
        else:
            self.lists(f"connect{number}", f"ebepecnt{number}", elements, f"num_nod_per_el{number}", of,
                       "nsided", "NODE", "ELEM")

    def put_sets(self, node_sets, side_sets, factors):
        for sets, prefix, dimension in ((node_sets, "ns", "num_node_sets"),
                                        (side_sets, "ss", "num_side_sets")):
            if sets:
                self.file.createDimension(dimension, len(sets))
                self.things(prefix, dimension, range(1, len(sets) + 1), [one[0] for one in sets])
        for number, (_, nodes) in enumerate(node_sets, 1):
            self.file.createDimension(f"num_nod_ns{number}", len(nodes))
            self.define(f"node_ns{number}", "i4", (f"num_nod_ns{number}",), nodes + 1)
            if factors:
                self.define(f"dist_fact_ns{number}", self.word, (f"num_nod_ns{number}",), np.ones(len(nodes)))
        for number, (_, elements, sides) in enumerate(side_sets, 1):
            dimension, of_nodes = f"num_side_ss{number}", f"num_df_ss{number}"
            self.file.createDimension(dimension, len(elements))
            self.define(f"elem_ss{number}", "i4", (dimension,), elements + 1)
            self.define(f"side_ss{number}", "i4", (dimension,), sides + 1)
            if factors:
                self.file.createDimension(of_nodes, 4 * len(elements))
                self.define(f"dist_fact_ss{number}", self.word, (of_nodes,), np.ones(4 * len(elements)))

    def put_variables(self, node_names, cell_names):
        for names, what in ((node_names, "nod"), (cell_names, "elem")):
            if names:
                self.file.createDimension(f"num_{what}_var", len(names))
                self.texts(f"name_{what}_var", (f"num_{what}_var", "len_name"), names)
        if cell_names:
            self.define("elem_var_tab", "i4", ("num_el_blk", "num_elem_var"),
                        np.ones((len(self.sizes), len(cell_names)), "i4"))
        for number, name in enumerate(node_names, 1):
            self.values["node", name] = [self.file.createVariable(
                f"vals_nod_var{number}", self.word, ("time_step", "num_nodes"))]
        for number, name in enumerate(cell_names, 1):
            self.values["cell", name] = [self.file.createVariable(
                f"vals_elem_var{number}eb{block}", self.word, ("time_step", f"num_el_in_blk{block}"))
                for block in range(1, len(self.sizes) + 1)]

    def put_step(self, step, node_values, cell_values):
        """Writes the values of one time step. node_values and cell_values map names of arrays to values."""
        for where, values in (("node", node_values), ("cell", cell_values)):
            for name, its in values.items():
                begin = 0
                variables = self.values[where, name]
                for variable in variables:
                    size = variable.shape[1]
                    variable[step, :] = its[begin:begin + size]
                    begin += size

    def close(self):
        self.file.close()


def text_of(values, form="%.9g"):
    """Formats an array as text, with one row per line."""
    rows = np.atleast_2d(values) if values.ndim > 1 else values[:, None]
    return "".join(" ".join(form % value for value in row) + "\n" for row in rows.tolist())


def write_ascii_vtk(path, title, points, corners, point_arrays=None, cell_arrays=None):
    """Writes hexahedra as legacy VTK in text form. point_arrays and cell_arrays map names to scalar arrays."""
    with open(path, "w") as file:
        file.write(f"# vtk DataFile Version 3.0\n{title}\nASCII\nDATASET UNSTRUCTURED_GRID\n"
                   f"POINTS {len(points)} double\n{text_of(points)}\n"
                   f"CELLS {len(corners)} {9 * len(corners)}\n")
        file.write("".join(f"8 {line}\n" for line in text_of(corners, "%d").splitlines()))
        file.write(f"\nCELL_TYPES {len(corners)}\n" + f"{VTK_HEXAHEDRON}\n" * len(corners))
        for section, count, arrays in (("POINT_DATA", len(points), point_arrays),
                                       ("CELL_DATA", len(corners), cell_arrays)):
            if arrays:
                file.write(f"\n{section} {count}\n")
            for name, values in (arrays or {}).items():
                kind, form = ("int", "%d") if values.dtype.kind == "i" else ("double", "%.9g")
                file.write(f"SCALARS {name} {kind} 1\nLOOKUP_TABLE default\n{text_of(values, form)}")


def write_vtu(path, points, cells, kinds, faces=None, point_arrays=None, cell_arrays=None,
              form="ascii"):
    """Writes a VTU file. `cells` contains the points of each cell. `faces` contains the face list of each cell, in
    VTK's form. `form` is the encoding of the data: ascii, raw (appended), or zlib (inline base64, VTK's default)."""
    appended = []

    def array(name, values, components=1):
        values = np.ascontiguousarray(values)
        head = (f'<DataArray type="{XML_TYPES[values.dtype.name]}" Name="{name}"'
                + (f' NumberOfComponents="{components}"' if components > 1 else ""))
        if form == "raw":
            offset = sum(map(len, appended))
            appended.append(struct.pack("<Q", values.nbytes) + values.tobytes())
            return f'{head} format="appended" offset="{offset}"/>\n'
        if form == "zlib":
            return f'{head} format="binary">\n{zipped(values.tobytes())}\n</DataArray>\n'
        rows = values.reshape(-1, components) if components > 1 else values.reshape(1, -1)
        text = text_of(rows, "%d" if values.dtype.kind in "iu" else "%.17g")
        return f'{head} format="ascii">\n{text}</DataArray>\n'

    head = ' compressor="vtkZLibDataCompressor"' if form == "zlib" else ""
    lines = ['<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" '
             f'byte_order="LittleEndian" header_type="UInt64"{head}>\n<UnstructuredGrid>\n'
             f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">\n']
    for section, arrays in (("PointData", point_arrays), ("CellData", cell_arrays)):
        lines += [f"<{section}>\n", *(array(*named) for named in (arrays or {}).items()), f"</{section}>\n"]
    lines += ["<Points>\n", array("Points", points, 3), "</Points>\n<Cells>\n",
              array("connectivity", np.concatenate(cells).astype(np.int64)),
              array("offsets", np.cumsum([len(cell) for cell in cells]).astype(np.int64)),
              array("types", np.full(len(cells), kinds, np.uint8))]
    if faces:
        lines += [array("faces", np.concatenate(faces).astype(np.int64)),
                  array("faceoffsets", np.cumsum([len(of) for of in faces]).astype(np.int64))]
    lines.append("</Cells>\n</Piece>\n</UnstructuredGrid>\n")
    with open(path, "wb") as file:
        file.write("".join(lines).encode())
        if appended:
            file.write(b'<AppendedData encoding="raw">\n_' + b"".join(appended) + b"\n</AppendedData>\n")
        file.write(b"</VTKFile>\n")


def zipped(data, block=32768):
    """Compresses data as vtkZLibDataCompressor does. The result is a header with the sizes of the blocks, followed by
    the blocks; both are base64 text."""
    blocks = [zlib.compress(data[at:at + block], 5) for at in range(0, len(data), block)]
    header = struct.pack(f"<{3 + len(blocks)}Q", len(blocks), block, len(data) % block, *map(len, blocks))
    return (base64.b64encode(header) + base64.b64encode(b"".join(blocks))).decode()


def write_msh(path, points, corners, sides):
    """Writes an ASCII file in MSH 4.1 format, with a volume and surfaces. `sides` contains a tuple for each surface:
    its name, and an array with one row of four nodes (numbered from 0) per quadrilateral. The volume and each surface
    are entities with a physical group. All nodes belong to the volume."""
    low, high = points.min(axis=0), points.max(axis=0)
    box = " ".join("%.9g" % value for value in (*low, *high))
    with open(path, "w") as file:
        file.write("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
                   f"$PhysicalNames\n{len(sides) + 1}\n")
        for number, (name, _) in enumerate(sides, 1):
            file.write(f'2 {number} "{name}"\n')
        file.write(f'3 {len(sides) + 1} "volume"\n$EndPhysicalNames\n$Entities\n0 0 {len(sides)} 1\n')
        for number in range(1, len(sides) + 1):
            file.write(f"{number} {box} 1 {number} 0 \n")
        bounds = "".join(f"{number} " for number in range(1, len(sides) + 1))
        file.write(f"1 {box} 1 {len(sides) + 1} {len(sides)} {bounds}\n$EndEntities\n"
                   f"$Nodes\n1 {len(points)} 1 {len(points)}\n3 1 0 {len(points)}\n"
                   + "".join(f"{number}\n" for number in range(1, len(points) + 1))
                   + text_of(points, "%.16g") + "$EndNodes\n")
        total = len(corners) + sum(len(of) for _, of in sides)
        file.write(f"$Elements\n{len(sides) + 1} {total} 1 {total}\n")
        number = 0
        for dimension, tag, kind, rows in [(2, i, 3, of) for i, (_, of) in enumerate(sides, 1)] + [
                (3, 1, 5, corners)]:
            file.write(f"{dimension} {tag} {kind} {len(rows)}\n")
            for row in (rows + 1).tolist():
                number += 1
                file.write(f"{number} {' '.join(map(str, row))} \n")
        file.write("$EndElements\n")
