"""Section 5: the schema."""

import math
import struct
from dataclasses import dataclass, field

from .basics import (BEZIER, FACES, FLOAT32, FLOAT64, HEXAHEDRON, LAGRANGE, LINE, PYRAMID, QUAD, SCALAR_BYTES, SERENDIPITY,
                     TETRAHEDRON, TRIANGLE, WEDGE, Cursor, packed_blob)

KEEP, STREAM, FREE = range(3)
MOST_ARRAYS, MOST_STATIC_COMPONENTS, MOST_BLOCKS = 65536, 4096, 2**20  # limits of this reader (section 26)
MOST_STEP_BYTES = 2**30  # of an array that is neither on points nor on cells
POINT, CELL, GLOBAL, NODE_SET, SIDE_SET, ELEMENT_SET = range(6)
LOCATION_NAMES = (b"point", b"cell", b"global", b"node_set", b"side_set", b"element_set")
BOUND, RELATIVE = 64, 65  # `bits` of a quantization within an absolute bound, or one relative to each value


@dataclass
class Quantization:
    bits: int = 0
    max_abs: float = 0.0
    spacing: float = 0.0
    minimum: list = field(default_factory=list)  # of the ranges, or the anchors
    maximum: list = field(default_factory=list)
    max_rel: float = 0.0  # of a relative bound, whose spacing is a whole number

    def step(self):
        if self.bits == BOUND:
            return self.spacing
        side = max(high - low for low, high in zip(self.minimum, self.maximum))
        return side / (2**self.bits - 1) if side else 1.0

    def promise(self, type_):
        """By how much a restored value may differ, section 23."""
        if self.bits == BOUND:
            return self.max_abs
        largest = max(abs(value) for value in self.minimum + self.maximum)
        return self.step() / 2 + largest * (2**-23 if type_ == FLOAT32 else 2**-51)


@dataclass
class Block:
    id: int
    name: bytes
    shape: int
    nodes_per_cell: int
    scheme: int = LAGRANGE

    def hexahedral(self):
        return self.shape == HEXAHEDRON and self.nodes_per_cell >= 8


@dataclass
class Array:
    name: bytes
    location: int
    type: int
    components: int
    per_step: bool
    blocks: list
    role: bytes
    quantization: Quantization
    elements: int = 0  # of arrays that are not on the mesh
    fills: list = field(default_factory=list)

    def on_mesh(self):
        return self.location in (POINT, CELL)

    def is_float(self):
        return self.type in (FLOAT32, FLOAT64)

    def fill_bits(self):
        form = "f" if self.type == FLOAT32 else "d"
        return {int.from_bytes(struct.pack("<" + form, fill), "little") for fill in self.fills}

    def element_bytes(self):
        return self.components * SCALAR_BYTES[self.type]

    def covers(self, block):
        return not self.blocks or block in self.blocks


@dataclass
class Schema:
    order: int
    corner_order: bool
    delay: int
    coordinate_type: int
    coordinate_quantization: Quantization
    source_format: bytes
    blocks: list
    arrays: list
    step_references: int

    def coordinates(self):
        """The coordinates, as if they were an array."""
        return Array(b"", POINT, self.coordinate_type, 3, False, [], b"", self.coordinate_quantization)

    def all_hexahedral(self):
        return all(block.hexahedral() for block in self.blocks)

    def static_arrays(self):
        return [(i, array) for i, array in enumerate(self.arrays) if not array.per_step]

    def stepped_arrays(self):
        return [(i, array) for i, array in enumerate(self.arrays) if array.per_step]

    def stream_name(self, index):
        """The name of an array's bytes in the index (section 10)."""
        array = self.arrays[index]
        before = sum(a.location == array.location and a.name == array.name for a in self.arrays[:index])
        return b"array:" + LOCATION_NAMES[array.location] + b"/" + array.name + (b"#%d" % (before + 1) if before else b"")


def _bool(cursor):
    value = cursor.u8()
    if value > 1:
        cursor.fail("a bool above 1")
    return bool(value)


def _quantization(cursor, type_, components):
    quantization = Quantization(cursor.u8())
    if quantization.bits == 0:
        return quantization
    if type_ not in (FLOAT32, FLOAT64):
        cursor.fail("integers are not quantized")
    if quantization.bits == RELATIVE:
        quantization.max_rel, quantization.spacing = cursor.f64(), cursor.varint()
        least, most = (2, 2**23) if type_ == FLOAT32 else (1024, 2**52)
        if not (0 < quantization.max_rel <= 0.5 and least <= quantization.spacing <= most):
            cursor.fail("a quantization that cannot be")
        return quantization
    if quantization.bits == BOUND:
        quantization.max_abs, quantization.spacing = cursor.f64(), cursor.f64()
        quantization.minimum = cursor.list_of(cursor.f64)
        good = 0 < quantization.max_abs < 1e300 and 0 < quantization.spacing < 2e300
        good = good and all(abs(anchor) < 1e300 for anchor in quantization.minimum)
    elif quantization.bits <= 52:
        ranges = cursor.list_of(lambda: (cursor.f64(), cursor.f64()))
        quantization.minimum, quantization.maximum = [r[0] for r in ranges], [r[1] for r in ranges]
        good = all(math.isfinite(low + high) and -1e300 < low <= high < 1e300 for low, high in ranges)
    else:
        cursor.fail("a reserved kind of quantization")
    if not good or len(quantization.minimum) != components:
        cursor.fail("a quantization that cannot be")
    return quantization


def _block(cursor):
    id_, name, shape = cursor.svarint(), cursor.text(), cursor.u8()
    block = Block(id_, name, shape & 15, cursor.varint32(), shape >> 4)
    if block.shape > FACES or block.nodes_per_cell > 65536 or block.scheme > BEZIER:
        cursor.fail("a block that cannot be")
    if block.scheme != LAGRANGE and block.nodes_per_cell not in _orders(block.shape, block.scheme):
        cursor.fail("a block that no order has")
    return block


def _orders(shape, scheme):
    """Section 49: the orders from 2 to 10, by the number of nodes."""
    if scheme == SERENDIPITY:
        corners, edges = {TRIANGLE: (3, 3), QUAD: (4, 4), TETRAHEDRON: (4, 6), PYRAMID: (5, 8), WEDGE: (6, 9),
                          HEXAHEDRON: (8, 12)}.get(shape, (0, 0))
        return {corners + edges * (p - 1): p for p in range(3, 11)} if corners else {}
    count = {LINE: lambda n: n, TRIANGLE: lambda n: n * (n + 1) // 2, QUAD: lambda n: n * n,
             TETRAHEDRON: lambda n: n * (n + 1) * (n + 2) // 6, PYRAMID: lambda n: n * (n + 1) * (2 * n + 1) // 6,
             WEDGE: lambda n: n * n * (n + 1) // 2, HEXAHEDRON: lambda n: n**3}.get(shape)
    return {count(p + 1): p for p in range(2, 11)} if count else {}


def order_of(block):
    """The order of its cells, if it is 3 or more and all nodes of the scheme are there, else 0."""
    order = _orders(block.shape, block.scheme).get(block.nodes_per_cell, 0)
    return order if order >= 3 else 0


def _array(cursor, blocks):
    name, location, type_, components = cursor.text(), cursor.u8(), cursor.u8(), cursor.varint32()
    if location > ELEMENT_SET or not 1 <= type_ <= 10 or not 1 <= components <= 65535:
        cursor.fail("an array that cannot be")
    per_step, covers = _bool(cursor), cursor.list_of(cursor.varint32)
    elements = 0 if location <= CELL else cursor.varint()
    role = cursor.text()
    if covers and location in (POINT, GLOBAL):
        cursor.fail("a point or global array with blocks")
    if covers != sorted(set(covers)) or (location == CELL and any(block >= blocks for block in covers)):
        cursor.fail("an array on blocks that are not ascending, or do not exist")
    if location > CELL and not per_step:
        cursor.fail("a static array that is neither on points nor on cells")
    array = Array(name, location, type_, components, per_step, covers, role,
                  _quantization(cursor, type_, components), elements)
    if elements * array.element_bytes() > MOST_STEP_BYTES:
        cursor.fail("over limit: too many bytes at a step of an array")
    return array


def _fills(cursor, arrays):
    fills = cursor.list_of(lambda: (cursor.varint32(), cursor.f64()))
    if not fills or fills != sorted(fills, key=lambda fill: fill[0]) or fills[-1][0] >= len(arrays):
        cursor.fail("fill values of no array, or arrays that do not ascend")
    for index, fill in fills:
        array = arrays[index]
        array.fills.append(fill)
        if not array.is_float() or not math.isfinite(fill) or len(array.fills) > 16:
            cursor.fail("a fill value that cannot be")
        if array.type == FLOAT32 and abs(fill) > 3.4028234663852886e38:
            cursor.fail("a fill value that cannot be")
        if array.type == FLOAT32 and struct.unpack("<f", struct.pack("<f", fill))[0] != fill:
            cursor.fail("a fill value that cannot be")


def read_schema(payload, base, file_start):
    """`file_start`: the eight bytes behind the signature, which must stand here again."""
    cursor = Cursor(payload, base, "schema")
    if cursor.take(8) != file_start:
        cursor.fail("not the version and features of the file start")
    bounded = file_start[2] >= 10  # the minor version
    cursor = Cursor(packed_blob(cursor, bounded), base, "schema (unpacked)")
    order, corner_order, delay, coordinate_type = cursor.u8(), _bool(cursor), cursor.varint32(), cursor.u8()
    if order > FREE or (order == KEEP and not corner_order):
        cursor.fail("an order that cannot be")
    if coordinate_type not in (FLOAT32, FLOAT64):
        cursor.fail("coordinates that are not floating-point")
    quantization, source_format = _quantization(cursor, coordinate_type, 3), cursor.text()
    if quantization.bits == RELATIVE:
        cursor.fail("coordinates with a relative bound")
    blocks = cursor.list_of(lambda: _block(cursor))
    arrays = cursor.list_of(lambda: _array(cursor, len(blocks)))
    step_references = 3
    if cursor.left():
        step_references = cursor.u8()
        if step_references > (3 if cursor.left() else 2):
            cursor.fail("step references above 1")
        if cursor.left():
            _fills(cursor, arrays)
    cursor.end()
    static = sum(array.components for array in arrays if not array.per_step)
    if len(arrays) > MOST_ARRAYS or static > MOST_STATIC_COMPONENTS or len(blocks) > MOST_BLOCKS:
        cursor.fail("over limit: too many arrays, components or blocks")
    return Schema(order, corner_order, delay, coordinate_type, quantization, source_format, blocks, arrays,
                  step_references)
