"""Sections 36 and 48: mid nodes, and grids of nodes. Their numbers are in vertex_numbers.py."""

from functools import lru_cache

from .basics import HEXAHEDRON, LINE, MASK64, PYRAMID, QUAD, SERENDIPITY, TETRAHEDRON, TRIANGLE, WEDGE
from .coders import Bits, Models
from .schema import order_of
from .surface import CORNER_BITS

EDGE, FACE, BODY = range(3)


class MidNode:
    """What a mid node is in the middle of, by corners as stored, and what is parallel to it."""

    def __init__(self, kind, corners=()):
        self.kind, self.corners = kind, corners
        self.parallel = []  # (position of a node, corner that is beside the first corner there)
        self.edges = []  # of a face: the nodes of its edges
        self.sides = []  # of an edge: corners of the sides of the solid that it lies in
        self.steps, self.order = (1, 1), 2  # along the edge, or along both axes of the face
        self.continues = False  # a grid: whether the node before lies on the same edge or face, or inside too


def _words(text):
    return [tuple(int(corner) for corner in word) for word in text.split()]


_HEXAHEDRON_EDGES = _words("01 12 23 30 45 56 67 74 04 15 26 37")
_HEXAHEDRON_FACES = _words("0473 1265 0154 3762 0321 4567")
_BODY = [()]


def _hexahedron(nodes):
    if nodes == 9:
        return 8, _BODY
    if nodes < 20:
        return 8, []
    faces = {24: _HEXAHEDRON_FACES[:4], 26: _HEXAHEDRON_FACES, 27: _HEXAHEDRON_FACES + _BODY, 21: _BODY}
    return 8, _HEXAHEDRON_EDGES + faces.get(nodes, [])


_MID = {
    (LINE, 3): (2, _words("01")),
    (TRIANGLE, 6): (3, _words("01 12 20")),
    (TRIANGLE, 7): (3, _words("01 12 20") + _BODY),
    (QUAD, 8): (4, _words("01 12 23 30")),
    (QUAD, 9): (4, _words("01 12 23 30 0123")),
    (TETRAHEDRON, 10): (4, _words("01 12 20 03 13 23")),
    (PYRAMID, 13): (5, _words("01 12 23 30 04 14 24 34")),
    (PYRAMID, 14): (5, _words("01 12 23 30 04 14 24 34 0321")),
    (WEDGE, 15): (6, _words("01 12 20 34 45 53 03 14 25")),
    (WEDGE, 18): (6, _words("01 12 20 34 45 53 03 14 25 0143 1254 2035")),
}
_SIDES = {
    WEDGE: _words("0143 1254 2035 021 345"),
    PYRAMID: _words("0321 014 124 234 304"),
    TETRAHEDRON: _words("013 123 203 021"),
    HEXAHEDRON: _HEXAHEDRON_FACES,
}


def _next_to(side, a, b):
    """Whether a and b stand side by side around it."""
    return a in side and b in side and (side.index(a) - side.index(b)) % len(side) in (1, len(side) - 1)


def _other_neighbour(side, a, b):
    """The corner that the side joins to a, and that is not b."""
    n, at = len(side), side.index(a)
    before, after = side[at - 1], side[(at + 1) % n]
    return after if before == b else before


@lru_cache(maxsize=None)
def _table(shape, nodes):
    first, corners = _hexahedron(nodes) if shape == HEXAHEDRON else _MID.get((shape, nodes), (0, []))
    kinds = {0: BODY, 2: EDGE, 4: FACE}
    mid = {first + i: MidNode(kinds[len(c)], c) for i, c in enumerate(corners)}
    at = {frozenset(node.corners): position for position, node in mid.items() if node.corners}
    sides = _SIDES.get(shape, [])
    for node in mid.values():
        if node.kind == EDGE:
            a, b = node.corners
            node.sides = [side for side in sides if _next_to(side, a, b)]
            for side in [(0, 1, 2, 3)] if shape == QUAD else sides:
                if len(side) == 4 and _next_to(side, a, b):
                    beside = _other_neighbour(side, a, b)
                    position = at[frozenset((beside, _other_neighbour(side, b, a)))]
                    if all(position != known for known, _ in node.parallel):
                        node.parallel.append((position, beside))
            if shape == HEXAHEDRON:  # the edge opposite in the cell
                flip = 7 ^ CORNER_BITS[a] ^ CORNER_BITS[b]
                opposite = [CORNER_BITS[CORNER_BITS[corner] ^ flip] for corner in (a, b)]
                node.parallel.append((at[frozenset(opposite)], opposite[0]))
        elif node.kind == FACE:
            c = node.corners
            node.edges = [at[frozenset((c[i], c[(i + 1) % 4]))] for i in range(4)]
            if shape == HEXAHEDRON:  # the face behind it
                index = _HEXAHEDRON_FACES.index(c) ^ 1
                behind = _HEXAHEDRON_FACES[index]
                node.parallel.append((at[frozenset(behind)], behind[0]))
    return mid


# Section 49: corners (1 for p), edges, quadrilaterals and triangles of each shape; a face is the corner where its steps
# begin, and the ends of its two axes.
_FRAMES = {
    LINE: ("000 100", "01", "", ""),
    TRIANGLE: ("000 100 010", "01 12 20", "", "012"),
    QUAD: ("000 100 110 010", "01 12 32 03", "013", ""),
    TETRAHEDRON: ("000 100 010 001", "01 12 20 03 13 23", "", "013 231 032 021"),
    PYRAMID: ("000 100 110 010 001", "01 12 32 03 04 14 24 34", "013", "014 124 234 304"),
    WEDGE: ("000 100 010 001 101 011", "01 12 20 34 45 53 03 14 25", "013 124 205", "012 345"),
    HEXAHEDRON: ("000 100 110 010 001 101 111 011", "01 12 32 03 45 56 76 47 04 15 26 37", "034 125 014 327 013 457", ""),
}


def _sum(*parts):
    """The sum of (factor, place)."""
    return tuple(sum(factor * place[a] for factor, place in parts) for a in range(3))


class Grid:
    """Sections 48 and 49: the nodes of a cell of order 3 to 10."""

    def __init__(self, shape, order, is_serendipity):
        self.shape, self.order = shape, order
        corners, edges, quads, triangles = map(_words, _FRAMES[shape])
        self.corner = corners  # of order 1
        self.places, self.mid = [], {}  # by position
        self._add_cell(edges, quads, triangles, order, 0, is_serendipity)
        self.at = {place: position for position, place in enumerate(self.places)}
        for position in range(len(corners), len(self.places)):
            self.mid[position] = node = self._node(self.places[position], edges, quads, triangles)
            before = self.mid.get(position - 1)
            node.continues = before is not None and (node.kind, node.corners) == (before.kind, before.corners)

    def _along(self, order, inside, a, b, d, u, v):
        """The place u steps from corner a towards b, and v steps towards d."""
        at, one = self.corner, (1, 1, 1)
        return _sum((inside, one), (order - u - v, at[a]), (u, at[b]), (v, at[d]))

    def _add_cell(self, edges, quads, triangles, order, inside, is_serendipity):
        corners = range(len(self.corner))
        self.places += [self._along(order, inside, c, c, c, 0, 0) for c in (corners if order else [0])]
        if not order:
            return
        steps = range(1, order)
        self.places += [self._along(order, inside, a, b, a, u, 0) for a, b in edges for u in steps]
        if is_serendipity:
            return
        quad_nodes = [self._along(order, inside, *face, u, v) for face in quads for v in steps for u in steps]
        if self.shape == WEDGE:
            rows = [[self._along(order, inside, *face, u, v) for v in steps for u in range(1, order - v)]
                    for face in triangles]
            self.places += [*rows[0], *rows[1], *quad_nodes, *((x, y, z) for z in steps for x, y, _ in rows[0])]
            return
        self.places += quad_nodes
        for face in triangles:
            self.places += [self._along(order, inside, *face, u, v) for u, v in _inside_triangle(order)]
        if self.shape == HEXAHEDRON:
            self.places += [(x, y, z) for z in steps for y in steps for x in steps]
        smaller = order - {TETRAHEDRON: 4, PYRAMID: 3}.get(self.shape, order + 1)
        if smaller >= 0:
            self._add_cell(edges, quads, triangles, smaller, inside + 1, False)

    def _node(self, place, edges, quads, triangles):
        steps = range(1, self.order)
        for a, b in edges:
            for u in steps:
                if self._along(self.order, 0, a, b, a, u, 0) == place:
                    node = MidNode(EDGE, (a, b))
                    node.steps, node.order = (u,), self.order
                    node.sides = [side for side in _SIDES.get(self.shape, []) if _next_to(side, a, b)]
                    return node
        for face in quads + triangles:
            for u in steps:
                for v in steps:
                    if self._along(self.order, 0, *face, u, v) == place:
                        a, b, d = face
                        opposite = self.at.get(self._along(self.order, 0, a, b, d, self.order, self.order))
                        node = MidNode(FACE, (a, b, opposite, d) if face in quads else face)
                        node.steps, node.order = (u, v), self.order
                        return node
        node = MidNode(BODY)
        node.order = self.order
        return node

    def in_rows(self, reversed_axes):
        """All positions in the order of coding."""
        turn = lambda place: [self.order - x if a in reversed_axes else x for a, x in enumerate(place)]
        first = len(self.corner)
        return [*range(first), *sorted(range(first, len(self.places)), key=lambda p: turn(self.places[p])[::-1])]

    def back(self, position, reversed_axes, steps):
        """The position that lies `steps` back from this one along the rows, or None."""
        place = tuple(x + s if a in reversed_axes else x - s
                      for a, (x, s) in enumerate(zip(self.places[position], steps)))
        return self.at.get(place)

    def along_edge(self, position, reversed_axes):
        """Of a node of an edge: its steps, the positions back along the edge, nearest first, and the end ahead."""
        node = self.mid[position]
        first, second = node.corners
        axis = max(a for a in range(3) if self.corner[first][a] != self.corner[second][a])
        steps = node.steps[0]
        if (self.corner[first][axis] < self.corner[second][axis]) == (axis in reversed_axes):
            first, second, steps = second, first, self.order - steps
        behind = [self.at[self._along(self.order, 0, first, second, first, s, 0)] for s in range(steps - 1, -1, -1)]
        return steps, behind, second


def _inside_triangle(order):
    """The steps of the nodes inside a triangle of an order, which is not that of a wedge."""
    if order < 3:
        return []
    p = order - 3
    if p == 0:
        return [(1, 1)]
    edges = [(u, 0) for u in range(1, p)] + [(p - u, u) for u in range(1, p)] + [(0, p - u) for u in range(1, p)]
    return [(u + 1, v + 1) for u, v in [(0, 0), (p, 0), (0, p), *edges, *_inside_triangle(p)]]


_grid = lru_cache(maxsize=None)(Grid)


def grid_of(block):
    """Of a block whose cells have their nodes on a grid, else None."""
    order = order_of(block)
    return _grid(block.shape, order, block.scheme == SERENDIPITY) if order else None


def mid_nodes_of(block):
    if block.shape == HEXAHEDRON and block.nodes_per_cell < 8:
        return {}
    grid = grid_of(block)
    if grid:
        return grid.mid
    return _table(block.shape, block.nodes_per_cell)


def mix(id_):
    x = ((id_ + 1) * 0x9E3779B97F4A7C15) & MASK64
    return x ^ (x >> 29)


class MidNodes:
    """Which vertex a mid node is, and when it ends."""

    def __init__(self, surface):
        self.surface = surface
        self.middle = {}
        self.missed, self.ended = [0] * 3, Models(int)
        self.expected_models, self.body_ends, self.ends_with_corner = Bits(), Bits(), Bits()
        self.face_ends, self.edge_ends = Bits(), Bits()

    def _place(self, cell, i):
        """The two vertices that define the edge or face of mid node i, and which place on it this is. Then the third
        vertex that defines a triangle."""
        node = cell.mid[i]
        corners = [cell.v[cell.position_stored(c)] for c in node.corners]
        order = node.order
        if len(corners) == 2:
            a, b = corners
            step = order - node.steps[0] if b.id < a.id else node.steps[0]
            return a, b, step - 1
        if len(corners) == 3:  # of a triangle: its corners by id, and the steps towards each
            u, v = node.steps
            towards = sorted(zip(corners, (order - u - v, u, v)), key=lambda one: one[0].id)
            (a, _), (middle, s), (b, t) = towards
            return a, b, s - 1 + (order - 1) * (t - 1), middle
        least = min(range(4), key=lambda k: corners[k].id)
        first = order - node.steps[0] if least in (1, 2) else node.steps[0]
        second = order - node.steps[1] if least in (2, 3) else node.steps[1]
        after, before = corners[(least + 1) % 4], corners[least - 1]
        along_first, along_second = (after, before) if least % 2 == 0 else (before, after)
        older = after if after.id <= before.id else before
        if older is not along_first or (along_first is along_second and least % 2):
            first, second = second, first
        return corners[least], corners[least ^ 2], first - 1 + (order - 1) * (second - 1)

    @staticmethod
    def _key(kind, a, b, index, middle=None):
        """What stands for a place in `middle`; None if there is none."""
        if middle is None:
            return kind, frozenset((a.id, b.id)), index
        return None if max(v.slot for v in (a, b, middle)) >= 1 << 21 else (kind, (a.id, middle.id, b.id), index)

    def as_expected(self, source, cell, i):
        kind = cell.mid[i].kind
        expected = None
        if kind != BODY:
            a, b, index, *_ = place = self._place(cell, i)
            expected = self.middle.get(self._key(kind, *place))
            if expected is None and a is b:
                expected = a
        hit = source.bit(self.expected_models[kind, expected is not None, self.missed[kind]])
        self.missed[kind] = 1 - hit
        if hit:
            cell.v[i] = expected or self.surface.add_vertex()
            if expected is None:
                cell.new_positions.append(i)
        return hit

    def note(self, cell, i):
        node, vertex = cell.mid[i], cell.v[i]
        if node.kind == BODY:
            return
        a, b, *_ = place = self._place(cell, i)
        if vertex is a and vertex is b:
            return
        place = self._key(node.kind, *place)
        if place is not None and vertex.place != place:
            if place in self.middle:
                self.forget_vertex(self.middle[place])
            self.forget_vertex(vertex)
            self.middle[place], vertex.place = vertex, place
        for side in node.sides:
            vertex.open ^= sum(mix(cell.v[cell.position_stored(c)].id) for c in side) & MASK64

    def forget_vertex(self, vertex):
        """It leaves its place, if it has one."""
        if vertex.place is not None:
            del self.middle[vertex.place]
        vertex.place, vertex.open = None, 0

    def ends(self, source, cell, i):
        node, vertex = cell.mid[i], cell.v[i]
        if node.kind == BODY:
            last = source.bit(self.body_ends[0])
        elif any(cell.position_stored(c) in cell.last_use for c in node.corners):
            last = source.bit(self.ends_with_corner[node.kind])
        elif node.kind == FACE:
            last = source.bit(self.face_ends[min(vertex.uses, 2), self.ended[i]])
        else:
            last = source.bit(self.edge_ends[vertex.open == 0, min(vertex.uses, 7), self.ended[i]])
        self.ended[i] = last
        return last
