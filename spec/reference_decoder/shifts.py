"""Sections 34, 35 and 39: shifts, values as differences, neighbourhoods by number."""

from .basics import HEXAHEDRON, MASK64, QUAD, SCALAR_BYTES, Cursor, reject_unless, unzigzag, zstd_frame
from .domains import DIGITS, FLOATS, INTEGERS, NARROW, Domain, as_double, from_ordered
from .neighbourhoods import BEYOND, FARTHER, FLAT, LATTICE, NEAR, Neighbourhood
from .schema import KEEP
from .surface import CORNER_BITS

COPY = 7  # in place of the head of a component: it is a copy of an earlier component

# ---------------------------------------------------------------------------- 34 Shifts


class Shift:
    __slots__ = ("block", "by", "introduced", "imports", "last_use")


class ShiftedCell:
    """What a group learns of a cell."""

    __slots__ = ("block_index", "count", "numbers", "introduced", "imported", "last_use", "new")


class ShiftedVertex:
    __slots__ = ("number", "given", "imported")

    def __init__(self, number, imported):
        self.number, self.imported = number, imported
        self.given = number  # to readers


class Shifts:
    """What a segment with shifts keeps."""

    def __init__(self, schema, segment, first_vertex):
        self.schema, self.segment, self.first_vertex = schema, segment, first_vertex
        self.keep = schema.order == KEEP
        self.last = [[0] * block.nodes_per_cell for block in schema.blocks]
        self.table, self.next, self.last_unused = [None] * 255, 0, 0
        self.live, self.own, self.imported = {}, 0, 0
        self.neighbours = None
        self.ring_bits = 0

    def begin_group(self, data, header, unpacked_most):
        cursor = Cursor(data)
        self.group_ring_bits = cursor.u8()
        reject_unless(self.group_ring_bits <= 18, "a ring of more than 2^18 places")
        size = cursor.varint()
        reject_unless(size <= unpacked_most, "definitions of more bytes than a group can have")
        frame = zstd_frame(cursor.rest(), size + header.cells)
        self.definitions, self.symbols = Cursor(frame[:size]), frame[size:]
        self.at = 0

    def _definition(self):
        cursor, shift = self.definitions, Shift()
        shift.block = cursor.varint()
        reject_unless(shift.block < len(self.schema.blocks), "a cell of no block")
        nodes = self.schema.blocks[shift.block].nodes_per_cell
        shift.by = [cursor.svarint() for _ in range(nodes)]
        shift.introduced = cursor.varint()
        shift.imports = cursor.varint() if self.segment else 0
        shift.last_use = cursor.varint()
        reject_unless((shift.introduced | shift.last_use) >> nodes == 0, "a shift of nodes that there are not")
        reject_unless(shift.imports & ~shift.introduced == 0, "an import that is not introduced")
        self.table[self.next] = shift
        self.next = (self.next + 1) % 255
        return shift

    def cell(self, imported_number):
        """`imported_number()`: the stream number of an imported vertex."""
        symbol = self.symbols[self.at]
        self.at += 1
        shift = self._definition() if symbol == 255 else self.table[symbol]
        reject_unless(shift, "a shift that there is not")
        cell = ShiftedCell()
        cell.block_index, last = shift.block, self.last[shift.block]
        cell.count = len(last)
        for i, by in enumerate(shift.by):
            last[i] = (last[i] + by) & MASK64
        cell.numbers, cell.introduced, cell.last_use = list(last), shift.introduced, shift.last_use
        cell.new = []
        for i, number in enumerate(cell.numbers):
            if not shift.introduced >> i & 1:
                continue
            imported = shift.imports >> i & 1
            reject_unless(number not in self.live, "a vertex of a number that is alive")
            if not self.keep:
                reject_unless(number == self._next_number(imported), "a vertex that is not the next one")
            vertex = self.live[number] = ShiftedVertex(number, bool(imported))
            if imported:
                self.imported += 1
                if not self.keep:
                    vertex.given = imported_number()
            else:
                self.own += 1
            cell.new.append((i, vertex))
        for number in cell.numbers:
            reject_unless(number in self.live, "a node that is not alive")
        return cell

    def _next_number(self, imported):
        if imported:
            return 2**63 + self.imported
        number = self.first_vertex + self.own
        reject_unless(number < 2**63, "a stream number of 2^63 or more")
        return number

    def finalize(self, cell):
        """The vertices that die."""
        gone = []
        for i, number in enumerate(cell.numbers):
            if cell.last_use >> i & 1 and number in self.live:
                gone.append(self.live.pop(number))
        return gone

    def unused(self):
        if self.keep:
            number = self.last_unused = (self.last_unused + self.definitions.svarint()) & MASK64
        else:
            number = self._next_number(False)
        reject_unless(number not in self.live, "a vertex of a number that is alive")
        self.own += 1
        return ShiftedVertex(number, False)


# ---------------------------------------------------------------------------- 39 Neighbourhoods by number


def axes_of(block):
    if block.shape == HEXAHEDRON and block.nodes_per_cell >= 8:
        return 3
    return 2 if block.shape == QUAD and block.nodes_per_cell >= 4 else 0


class Ring:
    """The elements of one kind, by place."""

    def __init__(self, bits):
        self.mask = 2**bits - 1
        self.known, self.full = {}, {}

    def place(self, number):
        return number & self.mask

    def remembered(self, number):
        return self.known.get(number & self.mask) == number & MASK64

    def remember(self, item, number):
        self.known[item.slot], self.full[item.slot] = number & MASK64, item.is_full()


class NeighboursByNumber:
    def __init__(self, schema, bits):
        self.schema, self.bits = schema, bits
        self.vertices, self.cells = Ring(bits), Ring(bits)
        self.last_cell = None

    def of_vertex(self, cell, p, n):
        ring, d = self.vertices, axes_of(self.schema.blocks[cell.block_index])
        item = Neighbourhood(ring.place(n))
        if d > 0 and p < 2**d:
            b = CORNER_BITS[p]
            item.kind, item.corner = (FLAT if d == 2 else LATTICE), b
            for i, x in enumerate((1, 2, 4, 3, 5, 6, 7)):
                if x >= 2**d:
                    continue
                q = CORNER_BITS[b ^ x]
                if cell.introduced >> q & 1 and q >= p:
                    continue
                m = cell.numbers[q]
                item.set(i, ring.place(m))
                if i < d:
                    s = n - m
                    if ring.remembered(m - s):
                        item.set(BEYOND + i, ring.place(m - s))
                        if ring.remembered(m - 2 * s):
                            item.set(FARTHER + i, ring.place(m - 2 * s))
            item.thirds(ring.full)
        elif p > 0:
            item.set(NEAR, ring.place(cell.numbers[p - 1]))
        ring.remember(item, n)
        return item

    def of_unused(self, n):
        item = Neighbourhood(self.vertices.place(n))
        self.vertices.remember(item, n)
        return item

    def of_cell(self, cell):
        ring, d = self.cells, axes_of(self.schema.blocks[cell.block_index])
        t = 2**d - 1
        number = lambda bits: cell.numbers[CORNER_BITS[bits]]
        n = number(t) if d else cell.numbers[0]
        item = Neighbourhood(ring.place(n))
        if d > 0:
            item.kind = FLAT if d == 2 else LATTICE
            for i, x in enumerate((1, 2, 4, 3, 5, 6, 7)):
                if x >= 2**d:
                    continue
                m = number(t ^ x)
                s = m - n
                if not ring.remembered(m) and i < d:
                    s = -s
                    m = n + s
                if not ring.remembered(m):
                    continue
                item.set(i, ring.place(m))
                if i < d and ring.remembered(n + 2 * s):
                    item.set(BEYOND + i, ring.place(n + 2 * s))
                    if ring.remembered(n + 3 * s):
                        item.set(FARTHER + i, ring.place(n + 3 * s))
        elif self.last_cell is not None:
            item.set(NEAR, self.last_cell)
        item.thirds(ring.full)
        self.last_cell = item.slot
        item.block = cell.block_index
        ring.remember(item, n)
        return item


# ---------------------------------------------------------------------------- 35 Values as differences


def columns_of_differences(schema):
    """Which columns may be in differences: -1 is geometry, then static arrays by index."""
    room, may = 32 - 4, {-1}
    for i, array in schema.static_arrays():
        if array.components < room:
            room -= array.components + 1
            may.add(i)
    return may


def taps_of(factors):
    """(count, back), the farthest one first."""
    polynomial = {0: 1}
    for lag, order in factors:
        for _ in range(order):
            product = dict(polynomial)
            for back, count in polynomial.items():
                product[back + lag] = product.get(back + lag, 0) - count
            polynomial = product
    return sorted(((-count, back) for back, count in polynomial.items() if back and count), key=lambda tap: -tap[1])


def domain_of_differences(array, component, kind, exponent):
    """Rejects one that is not for such an array."""
    domain = Domain(array.type, array.quantization, component)
    floats = kind == FLOATS and domain.floating and exponent == 0  # also of quantized arrays
    good = floats or (kind < 7 and kind != DIGITS and domain.may_be(kind, exponent))
    reject_unless(good, "a domain that is not for such an array")
    domain.kind, domain.exponent = kind, exponent
    domain.choose()
    return domain


def widest_residual(domain):
    """In bytes."""
    own = SCALAR_BYTES[domain.type]
    return {FLOATS: own, INTEGERS: own, NARROW: 4}.get(domain.kind, 8)


def from_residual(domain, p, r):
    """The bits of the value, and what is kept of it."""
    if domain.kind in (FLOATS, NARROW):
        width = domain.own_width
        d = domain.plain_index(p) + r
        kept = as_double(domain.own_type, from_ordered(d, width))
        return domain.value(d), kept
    index = signed_of(domain, p + r)
    return domain.value(index), index


def signed_of(domain, number):
    """What the integer type of the values holds of a whole number; in other domains 64 bits, signed."""
    width = domain.width if domain.kind == INTEGERS else 64
    index = number & ((1 << width) - 1)
    if not (domain.kind == INTEGERS and domain.type in (2, 4, 6, 8)) and index >> (width - 1):
        index -= 1 << width
    return index


class Differences:
    """A column in codec 12."""

    def __init__(self, array):
        self.array = array
        self.domains = None

    def forget(self):
        """The group at hand is in shuffled_zstd."""
        self.domains = None

    def decode(self, data, numbers, decoded_bytes):
        """The bits of the values of the elements that have these numbers."""
        array, cursor = self.array, Cursor(data)
        count = cursor.varint()
        reject_unless(0 < count <= decoded_bytes // array.element_bytes() and count == len(numbers),
                      "differences of another number of elements")
        factors = []
        factor_count = cursor.u8()
        reject_unless(factor_count <= 3, "more than three factors")
        for _ in range(factor_count):
            lag, order = cursor.varint32(), cursor.u8()
            reject_unless(lag > 0 and 1 <= order <= 3, "a factor that cannot be")
            factors.append((lag, order))
        domains, widths, sources = [], [], []
        for c in range(array.components):
            kind = cursor.u8()
            if kind == COPY:
                source = cursor.varint()
                reject_unless(source < c, "a copy of no earlier component")
                domains.append(domains[source])
                widths.append(0)
                sources.append(source)
                continue
            sources.append(None)
            exponent, width = cursor.svarint(), cursor.u8()
            domain = domain_of_differences(array, c, kind, exponent)
            reject_unless(width <= widest_residual(domain), "residuals that are too wide")
            domains.append(domain)
            widths.append(width)
        kinds = {-1 if domain.is_linear() else domain.kind for domain in domains}
        reject_unless(len(kinds) == 1, "domains that do not go together")
        planes = zstd_frame(cursor.rest(), count * sum(widths))
        self._begin(domains, count)
        return self._values(planes, widths, sources, numbers, taps_of(factors))

    def _begin(self, domains, count):
        same = self.domains and all((a.kind, a.exponent) == (b.kind, b.exponent)
                                    for a, b in zip(self.domains, domains))
        self.domains = domains
        if same:
            return
        self.places = 1
        while 2 * self.places <= min(2**17, 64 * count):
            self.places *= 2
        self.known = {}
        self.ring = [{} for _ in domains]
        zero = 0 if domains[0].is_linear() else 0.0
        self.last = [zero] * len(domains)

    def _values(self, planes, widths, sources, numbers, taps):
        domains, elements = self.domains, len(numbers)
        components, at = len(domains), 0
        residuals = []
        for width in widths:
            z = [0] * elements
            for byte in range(width):
                plane = planes[at : at + elements]
                at += elements
                z = [value | b << 8 * byte for value, b in zip(z, plane)]
            residuals.append(z)
        linear, mask = domains[0].is_linear(), self.places - 1
        zero = 0 if linear else 0.0
        values = []
        for e, n in enumerate(numbers):
            far = (n - taps[0][1]) & MASK64 if taps else None
            if taps and self.known.get(far & mask) == far:
                guesses = []
                for ring in self.ring:
                    p = zero
                    for count, back in taps:
                        p = p + count * ring.get((n - back) & mask, zero)
                    guesses.append(p)
            else:
                guesses = self.last
            last, own = [], []
            for c in range(components):
                if sources[c] is None:
                    value, kept = from_residual(domains[c], guesses[c], unzigzag(residuals[c][e]))
                else:
                    value, kept = own[sources[c]], last[sources[c]]
                self.ring[c][n & mask] = kept
                last.append(kept)
                own.append(value)
            values += own
            self.last = last
            self.known[n & mask] = n
        return values
