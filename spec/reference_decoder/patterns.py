"""Sections 43 and 44: patterns, values by terms."""

import struct
from bisect import bisect_left
from functools import lru_cache

from .basics import HEXAHEDRON, MASK64, Cursor, reject_unless, signed64, unzigzag, zstd_frame
from .domains import FLOATS, INTEGERS, NARROW, as_double, nearest
from .mid_nodes import BODY, EDGE, grid_of, mid_nodes_of
from .other_cells import corners_of, sides_of
from .schema import KEEP, Block
from .shifts import COPY, domain_of_differences, from_residual, signed_of, widest_residual
from .surface import CORNER_BITS

TERMS = 14  # codec of values
BEFORE, ON, LAST, DISTANCE, NEW, SLOT, SAME, SOURCES = 0, 1, 4, 18, 19, 20, 21, 22
OWN_NUMBER, IMPORTED = 1, 2  # bits of the place of a new vertex
MOST_REFERRED = 3
COPIED_VERTICES, FARTHEST = 15, 65536

# ---------------------------------------------------------------------------- 43 Patterns


def plane(cursor, n):
    size = cursor.varint()
    reject_unless(size <= n, "a plane of more bytes than it has when unpacked")
    data = cursor.take(size)
    if size == n:
        return data
    return zstd_frame(data, n) if size else bytes(n)


def numbers_of_planes(cursor, n, width):
    numbers = [0] * n
    for byte in range(width):
        numbers = [number | b << 8 * byte for number, b in zip(numbers, plane(cursor, n))]
    return numbers


def list_of_planes(cursor, n):
    width = cursor.u8()
    reject_unless(width <= 4, "numbers of more than four bytes")
    return numbers_of_planes(cursor, n, width)


class PatternVertex:
    """`cells`: the last that used it, and the last but one."""

    __slots__ = ("slot", "number", "imported", "cells")

    def __init__(self, slot, number, imported, c):
        self.slot, self.number, self.imported, self.cells = slot, number, imported, (c, c)


class PatternCell:
    """What a group learns of a cell. `new`: new vertices, each with the slots of its terms."""

    __slots__ = ("block_index", "v", "new", "last_use")


class Patterns:
    """What a segment with patterns keeps."""

    def __init__(self, schema, segment, first_vertex):
        self.schema, self.segment, self.keep = schema, segment, schema.order == KEEP
        self.next_vertex = first_vertex
        self.most_nodes = max((block.nodes_per_cell for block in schema.blocks), default=0)
        self.words = 2 if self.most_nodes > 32 else 1
        self.live, self.free, self.slots = {}, [], 0  # live: by slot
        self.rows, self.history_bits, self.on, self.next_cell = {}, 0, [], 0
        self.last_number = MASK64

    def begin_group(self, data, header):
        blocks, cursor = self.schema.blocks, Cursor(data)
        bits = cursor.u8()
        most = 2**23 // max(block.nodes_per_cell for block in self.schema.blocks)
        reject_unless(self.history_bits <= bits <= 20 and 2**bits <= most, "a history that shrinks, or that is too long")
        self.history_bits = bits
        runs, cells = [], [0] * len(blocks)
        for _ in range(cursor.varint()):
            block, count = cursor.varint(), cursor.varint()
            reject_unless(block < len(blocks) and count > 0, "a run of no block, or of no cells")
            cells[block] += count
            reject_unless(sum(cells) <= header.cells, "runs of more cells than the group has")
            runs.append((block, count))
        reject_unless(sum(cells) == header.cells, "runs of fewer cells than the group has")
        self.block_of_cells = [block for block, count in runs for _ in range(count)]
        self.patterns = {b: self._patterns(cursor, blocks[b].nodes_per_cell, n) for b, n in enumerate(cells) if n}
        self.places = list_of_planes(cursor, header.cells)
        words = list_of_planes(cursor, header.cells * self.words)
        self.last_uses = [sum(words[c + k] << 32 * k for k in range(self.words))
                          for c in range(0, len(words), self.words)]
        self.distances = self._list(cursor, header.decoded_bytes // 8)
        self.told_slots = self._list(cursor, header.decoded_bytes // 8)
        size = cursor.varint()
        reject_unless(size <= 10 * header.decoded_bytes, "more numbers than a group can have")
        self.numbers = Cursor(plane(cursor, size))
        cursor.end()
        self.at = 0

    def _patterns(self, cursor, nodes, cells):
        """Of a block: for each pattern its nodes' (source, place)."""
        count = cursor.varint()
        reject_unless(1 <= count <= cells, "no patterns, or more than cells")
        data = plane(cursor, 2 * count * nodes)
        patterns = [[(data[2 * i * count + k], data[(2 * i + 1) * count + k]) for i in range(nodes)]
                    for k in range(count)]
        for pattern in patterns:
            for i, (source, place) in enumerate(pattern):
                self._check(i, source, place)
        return patterns

    def _check(self, i, source, place):
        reject_unless(source < SOURCES, "a source that there is not")
        if source == NEW:
            good = place <= 3 and (self.keep or not place & OWN_NUMBER) and (self.segment or not place & IMPORTED)
        else:
            good = place < (i if source == SAME else self.most_nodes)
        reject_unless(good, "a place that cannot be")
        reject_unless(not LAST <= source < DISTANCE or (source - LAST) // 2 < i, "a source of a node still to come")

    @staticmethod
    def _list(cursor, most):
        count = cursor.varint()
        reject_unless(count <= most, "more numbers than a group can have")
        return iter(list_of_planes(cursor, count))

    @staticmethod
    def _next(numbers):
        number = next(numbers, None)
        reject_unless(number is not None, "too few distances or slots")
        return number

    def cell(self, imported_number):
        """`imported_number()`: the stream number of an imported vertex."""
        c, cell = self.next_cell, PatternCell()
        cell.block_index, cell.last_use = self.block_of_cells[self.at], self.last_uses[self.at]
        patterns, place = self.patterns[cell.block_index], self.places[self.at]
        reject_unless(place < len(patterns), "a pattern that there is not")
        pattern = patterns[place]
        reject_unless(cell.last_use >> len(pattern) == 0, "a last use of nodes that there are not")
        cell.v, new, refers, users = [], [], [], []
        for i, (source, k) in enumerate(pattern):
            if source == NEW:
                vertex = self._introduce(c, k, imported_number)
                new.append((i, vertex))
            elif source == SAME:
                vertex = cell.v[k]
            else:
                vertex = self.live.get(self._slot(c, users, source, k, refers))
                reject_unless(vertex, "a node that is not alive")
            users.append(vertex.cells)
            if vertex.cells[0] != c:
                vertex.cells = c, vertex.cells[0]
            cell.v.append(vertex)
        self.on = refers
        introduced = {vertex for _, vertex in new}
        known = {i for i, vertex in enumerate(cell.v) if vertex not in introduced and vertex not in cell.v[:i]}
        block = self.schema.blocks[cell.block_index]
        cell.new = [(vertex, [cell.v[j].slot for j in terms_of(block.shape, block.nodes_per_cell, block.scheme, i, known)])
                    for i, vertex in new]
        self.rows[c] = [vertex.slot for vertex in cell.v]
        self.rows.pop(c - 2**self.history_bits, None)
        self.next_cell, self.at = c + 1, self.at + 1
        return cell

    def _slot(self, c, users, source, k, refers):
        """The slot of a node of cell c; none if there is no such row or place. `users`: of the nodes before it."""
        if source == SLOT:
            return self._next(self.told_slots)
        if source == BEFORE:
            f = c - 1
        elif source < LAST:
            reject_unless(source <= len(self.on), "a cell that the one before did not refer to")
            f = self.on[source - ON] + 1
        elif source < DISTANCE:
            f = users[(source - LAST) // 2][source % 2]
        else:
            f = c - self._next(self.distances)
        if source != BEFORE and f not in refers and len(refers) < MOST_REFERRED:
            refers.append(f)
        row = self.rows.get(f, ())
        return row[k] if k < len(row) else None

    def _introduce(self, c, k, imported_number):
        imported = bool(k & IMPORTED)
        if self.keep:
            number = self._number(self.numbers.svarint() if k & OWN_NUMBER else 1)
        else:
            number = imported_number() if imported else self._own_number()
        slot = self.free.pop() if self.free else self.slots
        self.slots = max(self.slots, slot + 1)
        vertex = self.live[slot] = PatternVertex(slot, number, imported, c)
        return vertex

    def finalize(self, cell):
        """The vertices that die."""
        gone = []
        for i, vertex in enumerate(cell.v):
            if cell.last_use >> i & 1 and self.live.get(vertex.slot) is vertex:
                gone.append(self.live.pop(vertex.slot))
                self.free.append(vertex.slot)
        return gone

    def _number(self, by):
        self.last_number = (self.last_number + by) & MASK64
        return self.last_number

    def _own_number(self):
        self.next_vertex += 1
        return self.next_vertex - 1

    def unused(self):
        """The number of a vertex that no cell uses."""
        return self._number(self.numbers.svarint()) if self.keep else self._own_number()

    def end_group(self):
        left = next(self.distances, None) is not None or next(self.told_slots, None) is not None
        reject_unless(not left and not self.numbers.left(), "distances, slots or numbers that are left over")


# ---------------------------------------------------------------------------- 44 Values by terms


def _middle_of(node, nodes):
    """The two nodes that a mid node is in the middle of."""
    if node.kind == BODY:
        return (16, 18) if nodes == 27 else (0, 0)
    return node.corners if node.kind == EDGE else node.corners[::2]


def _along_grid(grid, i):
    """Section 48: the terms that a node of a grid may have, the best first."""
    place, order = grid.places[i], grid.order
    inner = [axis for axis in range(3) if 0 < place[axis] < order]
    a, b, c = axes = inner + [axis for axis in range(3) if axis not in inner]
    moved = {axis: place[axis] - 1 if axis in inner else order - place[axis] for axis in axes}
    at = lambda *those: grid.at.get(tuple(moved[axis] if axis in those else place[axis] for axis in range(3)))
    choices = [(at(a), at(b), at(c), at(a, b), at(a, c), at(b, c), at(a, b, c))]
    choices += [(at(x), at(y), at(x, y)) for x, y in ((a, b), (a, c), (b, c))]
    before = tuple(place[axis] - 2 if axis == a else place[axis] for axis in range(3))
    choices.append((at(a), at(a), grid.at.get(before)))
    return [choice for choice in choices if None not in choice]


@lru_cache(maxsize=None)
def _choices(block_shape, nodes, scheme, i):
    """The terms that node i may have, as nodes, the best first."""
    hexahedral = block_shape == HEXAHEDRON and nodes >= 8
    if hexahedral and i < 8:
        a, b, c, ab, ac, bc, abc = (CORNER_BITS[CORNER_BITS[i] ^ x] for x in (1, 2, 4, 3, 5, 6, 7))
        return ((a, b, c, ab, ac, bc, abc), (a, b, ab), (a, c, ac), (b, c, bc), (c,), (b,), (a,))
    block = Block(0, b"", block_shape, nodes, scheme)
    corners, choices = corners_of(block, nodes), []
    if not hexahedral and i < corners:
        at = [(side, side.index(i)) for side in sides_of(block_shape, corners) if i in side]
        choices += [(side[(p + 1) % 4], side[p - 1], side[(p + 2) % 4]) for side, p in at if len(side) == 4]
        choices += [(side[q % len(side)],) for side, p in at for q in (p - 1, p + 1)]
    node, grid = mid_nodes_of(block).get(i), grid_of(block)
    if node and grid:
        choices += _along_grid(grid, i)
    if node:
        choices.append(_middle_of(node, nodes))
    return (*choices, (i - 1,)) if i else tuple(choices)


def terms_of(block_shape, nodes, scheme, i, known):
    """Nodes; `known` holds those that are, beside all before i."""
    for choice in _choices(block_shape, nodes, scheme, i):
        if all(j < i or j in known for j in choice):
            return choice
    return ()


def columns_of_terms(schema):
    """Which columns may be in terms: -1 is geometry, then static arrays by index."""
    room, may = 32 - 3, {-1}
    for i, array in schema.static_arrays():
        if array.components <= room:
            room -= array.components
            may.add(i)
    return may


class Component:
    """What is kept of one: states, as 64 bits, by slot and of the element before."""

    def __init__(self):
        self.states, self.last = {}, 0

    def values(self, domain, predictor, residuals, elements, references, back):
        """The bits of the values of elements: (slot, terms). `references`: bits of values, or none. `back`: of each
        element, the distance to the vertex that it copies, or 0."""
        here, values, residuals = ComponentGroup(self, domain), [], iter(residuals)
        change, copied = 0, []
        for e, (slot, terms) in enumerate(elements):
            if back[e]:
                values.append(values[e - back[e]])
                copied.append(copied[e - back[e]])
                here.keep(slot, *copied[e])
                continue
            r = unzigzag(next(residuals))
            if predictor == 0:
                p = here.zero
            elif predictor in (3, 4):
                p = here.of_reference(references[e])
                if predictor == 4:
                    r = change = change + r
            else:
                p = here.predicted(terms) if predictor == 2 and terms else here.last
            values.append(here.take(slot, p, r))
            copied.append((here.last, here.last_bits))
        self.last = here.last_bits
        return values

    def copy(self, source, elements):
        for slot, _ in elements:
            if slot is not None:
                self.states[slot] = source.states[slot]
        self.last = source.last


class ComponentGroup:
    """A component in the group at hand: what its states are there; with a table ranks."""

    def __init__(self, component, domain):
        self.domain, self.states, self.here = domain, component.states, {}
        self.binary = domain.kind in (FLOATS, NARROW)
        self.zero = 0.0 if self.binary and not domain.table else 0
        self.last_bits = component.last
        self.last = self._seen(component.last)

    def _seen(self, bits):
        """What 64 bits of an earlier group are here."""
        state = struct.unpack("<d", struct.pack("<Q", bits))[0] if self.binary else bits
        if not self.domain.table:
            return state
        return self._rank(self.domain.plain_index(state) if self.binary else signed64(state))

    def _rank(self, index):
        return bisect_left(self.domain.table, index)

    def of_reference(self, bits):
        domain = self.domain
        if domain.kind == INTEGERS:
            index = signed_of(domain, bits)
        elif self.binary:
            index = domain.plain_index(as_double(domain.type, bits))
        else:
            index = nearest(domain.from_value(as_double(domain.type, bits)))
        return self._rank(index) if domain.table else self._state(index)

    def _state(self, index):
        if not self.binary:
            return index
        state = self.domain.plain_state(index)
        return state if state == state else 0.0

    def predicted(self, terms):
        """`terms`: slots."""
        t = [self.here[slot] if slot in self.here else self._seen(self.states.get(slot, 0)) for slot in terms]
        if len(t) == 7:
            return t[0] + t[1] + t[2] - t[3] - t[4] - t[5] + t[6]
        if len(t) == 3:
            return t[0] + t[1] - t[2]
        if len(t) == 2:
            return (t[0] + t[1]) / 2 if isinstance(self.zero, float) else signed64(t[0] + t[1]) >> 1
        return t[0]

    def take(self, slot, p, r):
        domain = self.domain
        if domain.table:
            self.last = (p + r) & MASK64
            reject_unless(self.last < len(domain.table), "a rank that the table does not have")
            index = domain.table[self.last]
            value, state = domain.value(index), self._state(index)
        else:
            value, state = from_residual(domain, p, r)
            state = state if state == state else 0.0
            self.last = state
        bits = struct.unpack("<Q", struct.pack("<d", state))[0] if self.binary else state & MASK64
        self.keep(slot, self.last, bits)
        return value

    def keep(self, slot, last, bits):
        self.last, self.last_bits = last, bits
        if slot is not None:
            self.here[slot], self.states[slot] = last, bits


class Terms:
    """A column in codec 14."""

    def __init__(self, array):
        self.array = array
        self.components = [Component() for _ in range(array.components)]

    def decode(self, data, elements, decoded_bytes, references=None, of_vertices=False):
        """The bits of the values of these elements: (slot, terms), of what has no slot none. `references`: bits of
        the values that they may refer to, of all components of an element together."""
        array, cursor = self.array, Cursor(data)
        count = cursor.varint()
        reject_unless(0 < count <= decoded_bytes // array.element_bytes() and count == len(elements),
                      "values of another number of elements")
        heads, back = [], [0] * count
        head = cursor.u8()
        if head == COPIED_VERTICES:
            reject_unless(of_vertices, "copied vertices in a column without vertices")
            back = list_of_planes(cursor, count)
            reject_unless(all(by <= min(e, FARTHEST) for e, by in enumerate(back)), "a copy of no earlier vertex")
            head = cursor.u8()
        for c in range(array.components):
            head = head if c == 0 else cursor.u8()
            if head == COPY:
                source = cursor.varint()
                reject_unless(source < c, "a copy of no earlier component")
                heads.append(source)
                continue
            exponent, width = cursor.svarint(), cursor.u8()
            predictor, has_table = head >> 3 & 7, head >> 6 & 1
            reject_unless(head < 128 and predictor < 5, "a component of no such kind")
            reject_unless(predictor < 3 or references, "values that refer to nothing")
            domain = domain_of_differences(array, c, head & 7, exponent)
            reject_unless(width <= (8 if has_table else widest_residual(domain)), "residuals that are too wide")
            heads.append((domain, predictor, has_table, width))
        columns = []
        for c, head in enumerate(heads):
            if isinstance(head, int):
                columns.append(columns[head])
                self.components[c].copy(self.components[head], elements)
                continue
            domain, predictor, has_table, width = head
            domain.table = self._table(cursor, count) if has_table else None
            its = references[c :: array.components] if references else None
            residuals = numbers_of_planes(cursor, back.count(0), width)
            columns.append(self.components[c].values(domain, predictor, residuals, elements, its, back))
        cursor.end()
        return [value for values in zip(*columns) for value in values]

    @staticmethod
    def _table(cursor, most):
        count = cursor.varint()
        reject_unless(1 <= count <= most, "a table of no entries, or of more than elements")
        table, width = [cursor.svarint()], cursor.u8()
        reject_unless(width <= 8, "steps of more than eight bytes")
        for step in numbers_of_planes(cursor, count - 1, width):
            reject_unless(step > 0 and table[-1] + step < 2**63, "a table that does not ascend")
            table.append(table[-1] + step)
        return table
