"""What a file holds, as text: the same that stands beside the golden files, and digests of it.

Floating-point numbers are written as the shortest decimal that reads back as the same bits, NaN with its payload.
"""

import math
import struct

from .basics import FLOAT32, FLOAT64, MASK64, SCALAR_BYTES, SCALAR_CODES, SCALAR_NAMES, SCHEME_NAMES, SHAPE_NAMES, xxh64
from .domains import as_float32
from .file import Extra, File, StepTimes, Totals, is_archive, read_archive
from .group import Tile
from .schema import BOUND, RELATIVE

ORDER_NAMES = ("keep", "stream", "free")


def _shortest_float32(x):
    """Digits and decimal exponent of the shortest decimal that reads back as x, the nearest of these."""
    for precision in range(9):
        text = f"{x:.{precision}e}"
        if as_float32(float(text)) == x:
            return text
        mantissa, exponent = text.split("e")  # where the gaps beside x differ the next one may fit as well
        unit = 10.0 ** (int(exponent) - precision)
        for other in (float(text) - unit, float(text) + unit):
            text = f"{other:.{precision}e}"
            if as_float32(float(text)) == x:
                return text
    return f"{x:.8e}"


def float_text(x, single):
    """As C++ writes it: the shorter of the fixed and the scientific form, the fixed one where both are as long."""
    if math.isinf(x):
        return "inf" if x > 0 else "-inf"
    if x == 0:
        return "-0" if math.copysign(1, x) < 0 else "0"
    sign, size = ("-", -x) if x < 0 else ("", x)
    text = _shortest_float32(size) if single else repr(size)
    mantissa, _, exponent = text.partition("e")
    whole, _, part = mantissa.partition(".")
    point = len(whole) + int(exponent or 0)  # digits before the decimal point
    digits = (whole + part).lstrip("0")
    point -= len(whole + part) - len(digits)
    digits = digits.rstrip("0")
    n, exponent = len(digits), point - 1
    scientific = digits[0] + ("." + digits[1:] if n > 1 else "") + f"e{exponent:+03d}"
    if point >= n:
        fixed = f"{size:.0f}"
    elif point > 0:
        fixed = digits[:point] + "." + digits[point:]
    else:
        fixed = "0." + "0" * -point + digits
    return sign + (fixed if len(fixed) <= len(scientific) else scientific)


def scalar_text(type_, bits):
    if type_ not in (FLOAT32, FLOAT64):
        sign = 1 << (8 * SCALAR_BYTES[type_] - 1)
        return str(bits - 2 * sign if type_ % 2 and bits & sign else bits)
    x = struct.unpack("<" + SCALAR_CODES[type_], bits.to_bytes(SCALAR_BYTES[type_], "little"))[0]
    return f"nan:{bits:x}" if x != x else float_text(x, type_ == FLOAT32)


class Text:
    def __init__(self, schema, digest):
        self.schema, self.digest, self.out = schema, digest, []

    def line(self, text):
        self.out.append(text.encode("utf-8", "surrogateescape") + b"\n")

    @staticmethod
    def word(name):
        return name.decode("utf-8", "surrogateescape")

    def doubles(self, values):
        return "".join(" " + ("nan" if x != x else float_text(x, False)) for x in values)

    def values(self, type_, values):
        if self.digest:
            width = SCALAR_BYTES[type_]
            data = b"".join(value.to_bytes(width, "little") for value in values)
            return f" {len(values)} values, xxh64 {xxh64(data):016x}"
        return "".join(" " + scalar_text(type_, value) for value in values)

    def quantization(self, q):
        if q.bits == 0:
            return ""
        if q.bits == RELATIVE:
            return f", within{self.doubles([q.max_rel])} of each value by{self.doubles([float(q.spacing)])}"
        if q.bits == BOUND:
            return (f", within{self.doubles([q.max_abs])} by steps of{self.doubles([q.spacing])}"
                    f" from{self.doubles(q.minimum)}")
        return f", quantized to bits {q.bits} from{self.doubles(q.minimum)} to{self.doubles(q.maximum)}"

    def add_schema(self):
        s = self.schema
        references = "" if s.step_references == 3 else f", step references {s.step_references}"
        self.line(f"order {ORDER_NAMES[s.order]}, corners {'in order' if s.corner_order else 'may turn'}, "
                  f"delay {s.delay}{references}, coordinates {SCALAR_NAMES[s.coordinate_type]}"
                  f"{self.quantization(s.coordinate_quantization)}, source '{self.word(s.source_format)}'")
        for block in s.blocks:
            self.line(f"block id {block.id} '{self.word(block.name)}' {SHAPE_NAMES[block.shape]}, "
                      f"nodes {block.nodes_per_cell}" + (f", {SCHEME_NAMES[block.scheme]}" if block.scheme else ""))
        for i, array in enumerate(s.arrays):
            of = "blocks" if array.on_mesh() else "sets"
            blocks = f", on {of}" + "".join(f" {b}" for b in array.blocks) if array.blocks else ""
            blocks += "" if array.on_mesh() else f", elements {array.elements}"
            role = f", role '{self.word(array.role)}'" if array.role else ""
            fills = f", fills{self.doubles(array.fills)}" if array.fills else ""
            self.line(f"{self.word(s.stream_name(i))} {SCALAR_NAMES[array.type]} x {array.components}, "
                      f"{'by step' if array.per_step else 'static'}{blocks}{role}"
                      f"{self.quantization(array.quantization)}{fills}")

    def add(self, item):
        if isinstance(item, Tile):
            self.add_tile(item)
        elif isinstance(item, StepTimes):
            self.line("step times:" + self.doubles(item.times))
        elif isinstance(item, Extra):
            width = SCALAR_BYTES[item.type]
            values = [int.from_bytes(item.data[i : i + width], "little") for i in range(0, len(item.data), width)]
            self.line(f"extra '{self.word(item.key)}' {SCALAR_NAMES[item.type]} shape"
                      + "".join(f" {side}" for side in item.shape)
                      + f", refers {item.refers}:{self.values(item.type, values)}")
        elif isinstance(item, Totals):
            blocks = "".join(f" {count}" for count in item.block_cells)
            self.line(f"totals: vertices {item.vertices}, cells {item.cells}, hexahedra {item.hexahedra}, "
                      f"most active vertices {item.max_active_vertices}, steps {item.steps}, "
                      f"cells by block{blocks}, trailing bytes {item.trailing_bytes}")
        else:
            array = self.schema.arrays[item.array]
            self.line(f"step {item.step} from element {item.first}, {self.word(self.schema.stream_name(item.array))}:"
                      + self.values(array.type, item.values))

    def add_tile(self, tile):
        self.line(f"mesh: first vertex {tile.first_vertex}, vertices {len(tile.vertex_numbers)}, "
                  f"first cell {tile.first_cell}, cells {len(tile.cells)}")
        type_ = self.schema.coordinate_type
        if self.digest:
            def digest(name, numbers):
                data = b"".join(number.to_bytes(8, "little") for number in numbers)
                self.line(f"  {name}: {len(numbers)} values, xxh64 {xxh64(data):016x}")
            digest("vertex numbers", tile.vertex_numbers)
            self.line("  coordinates:" + self.values(type_, tile.xyz))
            digest("cell numbers", [cell[0] for cell in tile.cells])
            digest("cell blocks", [cell[1] for cell in tile.cells])
            digest("corners", [corner for cell in tile.cells for corner in cell[2]])
            digest("last uses", [cell[3] & MASK64 for cell in tile.cells])
        else:
            done = 0
            for before, (number, block, corners, last_use) in zip(tile.vertices_before_cell, tile.cells):
                self.add_vertices(tile, done, before)
                done = before
                farther = [corner for i, corner in enumerate(corners) if i >= 64 and last_use >> i & 1]
                self.line(f"  cell {number} of block {block}:" + "".join(f" {corner}" for corner in corners)
                          + f", last use {last_use & MASK64}" + "".join(f" and of {vertex}" for vertex in farther))
            self.add_vertices(tile, done, len(tile.vertex_numbers))
        for i, values in sorted(tile.arrays.items()):
            if values:
                name, type_ = self.word(self.schema.stream_name(i)), self.schema.arrays[i].type
                self.line(f"  {name}:" + self.values(type_, values))

    def add_vertices(self, tile, begin, end):
        type_ = self.schema.coordinate_type
        for e in range(begin, end):
            self.line(f"  vertex {tile.vertex_numbers[e]}:" + self.values(type_, tile.xyz[3 * e : 3 * e + 3]))


def _lines_of_mesh(data, digest):
    file = File(data)
    text = Text(file.schema, digest)
    text.add_schema()
    for item in file.items():
        text.add(item)
        yield b"".join(text.out)
        text.out = []


def text_of(data, digest=False):
    """The text of a whole file, in pieces; of an archive that of each member under its name."""
    if not is_archive(data):
        yield from _lines_of_mesh(data, digest)
        return
    for name, member in read_archive(data):
        yield b"member " + name + b"\n"
        yield from _lines_of_mesh(member, digest)
