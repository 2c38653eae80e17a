"""Section 30: vertex numbers; of imported vertices as section 18 has it, of mid nodes as section 36 has it."""

from .basics import MASK64, signed64, towards_zero
from .coders import Bits, Models, RangeDecoder, Signed, signed
from .mid_nodes import BODY, EDGE
from .surface import CORNER_BITS, EDGE_CORNERS

LAST, COPY, PARALLELOGRAM, LORENZO = range(4)


def at(p, d):
    """The position of the corner that lies at d from that at position p."""
    return CORNER_BITS[CORNER_BITS[p] ^ d]


def stencil(cell, known, p):
    """A kind, and the positions that the number is predicted from."""
    if cell.hexahedral and p < 8:
        if all(at(p, d) in known for d in range(1, 8)):
            return LORENZO, [at(p, d) for d in (1, 2, 4, 3, 5, 6, 7)]
        for d in (3, 5, 6):
            a = d & -d
            b = d ^ a
            if at(p, a) in known and at(p, b) in known and at(p, d) in known:
                return PARALLELOGRAM, [at(p, a), at(p, b), at(p, d)]
        for d in (1, 2, 4):
            if at(p, d) in known:
                return COPY, [at(p, d)]
        return LAST, []
    if p == 0 or p > 64 or p - 1 not in known:
        return LAST, []
    return COPY, [p - 1]


def expected_of(kind, a):
    """From the numbers of the stencil."""
    if kind == COPY:
        return a[0]
    if kind == PARALLELOGRAM:
        return (a[0] + a[1] - a[2]) & MASK64
    return (a[0] + a[1] + a[2] - a[3] - a[4] - a[5] + a[6]) & MASK64


class MidNodeNumbers:
    """What is kept to expect the numbers of mid nodes."""

    def __init__(self):
        self.step, self.missed = Models(int), Models(int)  # of (position, rule)
        self.introduced, self.last_of, self.history = Models(int), [0] * 3, 0

    def expectations(self, cell, p, known, following):
        """(rule, base, expected) of each rule that is asked."""
        node = cell.mid[p]
        number = lambda position: cell.v[position].number
        corner = lambda stored: number(cell.position_stored(stored))
        if node.kind == BODY:
            first = number(16) if cell.count == 27 else corner(0)
            other = number(22) if cell.count == 27 else corner(0)
        else:
            first = corner(node.corners[0])
            other = corner(node.corners[1]) if node.kind == EDGE or not node.edges else number(node.edges[0])
        if node.continues and cell.v[p - 1].number is not None:
            other = number(p - 1)
        parallel = [(position, beside) for position, beside in node.parallel if position in known]
        step = lambda rule: self.step[p, rule]
        rules = [(0, following, following), (1, self.last_of[node.kind], self.last_of[node.kind] + 1)]
        if parallel:
            base = number(parallel[0][0])
            rules.append((2, base, base + first - corner(parallel[0][1])))
            rules.append((3, base, base + step(3)))
        if len(parallel) >= 3:
            base = number(parallel[0][0])
            rules.append((4, base, base + number(parallel[1][0]) - number(parallel[2][0])))
        rules += [(5, first, first + step(5)), (6, other, other + step(6))]
        rules.append((7, self.introduced[p], self.introduced[p] + step(7)))
        if node.kind == EDGE:
            rules.append((8, first, first + towards_zero(signed64(other - first), 2)))
        return [(rule, base, expected & MASK64) for rule, base, expected in rules]

    def near_and_second(self, p, rules):
        missed = lambda r: self.missed[p, r[0]]
        near = min(rules, key=missed)[2]
        others = [r for r in rules if r[2] != near]
        return near, min(others, key=missed)[2] if others else near

    def learn(self, cell, p, rules, number):
        for rule, base, expected in rules:
            missed = self.missed[p, rule]
            self.missed[p, rule] = missed - missed // 8 + 32 * abs(signed64(number - expected)).bit_length()
            self.step[p, rule] = signed64(number - base)
        self.introduced[p] = self.last_of[cell.mid[p].kind] = number


class VertexNumbers:
    """Numbers of order keep, and of imported vertices in the other orders."""

    def __init__(self, replay=None):
        """`replay`: the hexahedra of that codec, which code numbers themselves."""
        self.replay = replay
        self.last = self.largest = MASK64
        self.strides = [1] * 6
        self.history, self.miss = 0, [0] * 6
        self.mid = MidNodeNumbers()
        self.guess, self.missed_as_before, self.residual = Bits(), Bits(), Models(Signed)
        self.import_number, self.last_imported = Models(Signed), 0

    def begin_group(self, data):
        self.source = RangeDecoder(data)

    def count(self, number):
        self.last = number
        if number >= (self.largest + 1) & MASK64:
            self.largest = number

    def of_cell(self, cell):
        """Order keep: the numbers of a cell's new vertices."""
        new = cell.new_positions
        if self.replay and cell.hexahedral:
            for p in sorted(p for p in new if p < 8):
                self.count(cell.v[p].number)
            new = [p for p in new if p >= 8]
        to_come = {cell.v[p].id for p in new}
        known = {p for p in range(min(cell.count, 64)) if cell.v[p].id not in to_come}
        for p in sorted(new, key=cell.stored_position):
            vertex = cell.v[p]
            vertex.number = self._number(cell, p, known)
            known |= {q for q in range(min(cell.count, 64)) if cell.v[q] is vertex}
            self.count(vertex.number)
            if self.replay:
                self.replay.note_number(vertex)

    def of_unused(self, vertex):
        following = (self.last + 1) & MASK64
        number, g = self._decode(following, following, following, 0, self.history)
        self.history = (4 * self.history + g) & 63
        vertex.number = number
        self.count(number)

    def _number(self, cell, p, known):
        following = (self.last + 1) & MASK64
        if p in cell.mid:
            rules = self.mid.expectations(cell, p, known, following)
            near, second = self.mid.near_and_second(p, rules)
            number, g = self._decode(near, second, following, 3 + cell.mid[p].kind, self.mid.history)
            self.mid.history = (8 * self.mid.history + g) & 63
            self.mid.learn(cell, p, rules, number)
            return number
        kind, positions = stencil(cell, known, p)
        numbers = [cell.v[q].number for q in positions]
        near = following if kind == LAST else expected_of(kind, numbers)
        d = None
        if kind == COPY and cell.hexahedral and p < 8:
            b = CORNER_BITS[p]
            for axis in range(3):
                if cell.v[CORNER_BITS[b ^ 1 << axis]] is cell.v[positions[0]]:
                    d = 2 * axis + (b >> axis & 1)
                    near = (near + self.strides[d]) & MASK64
                    break
        class_ = {LORENZO: 2, PARALLELOGRAM: 1}.get(kind, 0)
        number, g = self._decode(near, near, following, class_, self.history)
        self.history = (4 * self.history + g) & 63
        if d is not None:
            self.strides[d] = signed64(number - numbers[0])
            self.strides[d ^ 1] = -self.strides[d]
        return number

    def _decode(self, near, second, following, class_, history):
        bit = self.source.bit
        above = (self.largest + 1) & MASK64
        if bit(self.guess[class_, history, 0]):
            return near, 0
        if following != near and bit(self.guess[class_, history, 1]):
            return following, 1
        if above not in (near, following) and bit(self.guess[class_, history, 2]):
            return above, 2
        if second not in (near, following, above) and bit(self.guess[class_, history, 3]):
            return second, 4
        if not bit(self.missed_as_before[class_, history & 3]):
            self.miss[class_] = signed(self.source, self.residual[class_])
        return (near + self.miss[class_]) & MASK64, 3

    def of_imported(self, cell, p):
        """Section 18, not in order keep: the stream number of an imported vertex."""
        vertex = cell.v[p]
        known = {q for q in range(min(cell.count, 64)) if cell.v[q].import_state == 2 and cell.v[q] is not vertex}
        kind, positions = stencil(cell, known, p)
        if kind == LAST:
            return self._imported(LAST, self.last_imported)
        return self._imported(kind, expected_of(kind, [cell.v[q].number for q in positions]))

    def of_imported_by_shifts(self):
        """Section 34: always with kind last."""
        return self._imported(LAST, self.last_imported)

    def _imported(self, kind, expected):
        number = (expected + signed(self.source, self.import_number[kind])) & MASK64
        self.last_imported = number
        return number


class Imports:
    """Section 18: which vertices are imported."""

    def __init__(self):
        self.at_corner, self.at_edge, self.at_node = Bits(), Bits(), Bits()

    def begin_group(self, data):
        self.source = RangeDecoder(data)

    def flag(self, cell, p):
        state = lambda position: cell.v[position].import_state
        if cell.hexahedral and p < 8:
            model = self.at_corner[p, 9 * state(at(p, 1)) + 3 * state(at(p, 2)) + state(at(p, 4))]
        elif cell.hexahedral and p < 20 and cell.count >= 20 and not cell.grid:
            a, b = (cell.position_stored(corner) for corner in EDGE_CORNERS[p - 8])
            model = self.at_edge[3 * state(a) + state(b)]
        else:
            among = 0
            for vertex in cell.v[:64]:
                among |= vertex.import_state
            model = self.at_node[min(p, 31), among]
        return self.source.bit(model)
