"""Section 22: which earlier elements the values of a vertex or a cell are predicted from."""

from .basics import LINE, POLYGON, PYRAMID, QUAD, TETRAHEDRON, TRIANGLE, WEDGE
from .mid_nodes import BODY, EDGE
from .other_cells import plain_shape, sides_of
from .surface import CORNER_BITS

LATTICE, MIDPOINT, OF_OTHER, CENTRE, LAYERED, FLAT, SIMPLEX, BESIDE, GRID = range(9)

# Places in Neighbourhood.at, and bits of `known`.
NEAR, DIAGONAL, OPPOSITE, BEYOND, FARTHER, THIRD = 0, 3, 6, 7, 10, 13
OTHERS = ((1, 2), (0, 2), (0, 1))


class Neighbourhood:
    """Of one element: its slot, or place, and those of its neighbours."""

    __slots__ = ("slot", "kind", "corner", "known", "at", "imported", "block")

    def __init__(self, slot, kind=OF_OTHER, corner=0):
        self.slot, self.kind, self.corner = slot, kind, corner
        self.known, self.at = 0, [0] * 13
        self.imported = False  # of a vertex
        self.block = 0  # of a cell

    def set(self, place, slot):
        self.at[place] = slot
        self.known |= 1 << place

    def has(self, place):
        return self.known >> place & 1

    def is_full(self):
        """Whether the neighbours that `third` of others asks for are known."""
        wanted = {FLAT: 0b1011, SIMPLEX: 0b1000000}.get(self.kind, 0b1111111)
        return self.known & wanted == wanted

    def thirds(self, full):
        for a in range(3):
            if self.has(NEAR + a) and full.get(self.at[NEAR + a]):
                self.known |= 1 << (THIRD + a)


class Remembered:
    """A cell in its place: of a hexahedron the slots of its corners by bits, of others by position."""

    __slots__ = ("number", "place", "there", "slots", "full", "behind", "shape", "sides", "hexahedron")

    def __init__(self, number, place):
        self.number, self.place, self.there = number, place, True
        self.full, self.behind, self.sides, self.hexahedron = False, [None] * 6, [None] * 6, False


class Neighbourhoods:
    def __init__(self, schema, surface):
        self.surface, self.mixed = surface, not schema.all_hexahedral()
        self.cells = 0  # coded before the one at hand
        self.introduced, self.full, self.uses = {}, {}, {}
        self.room = self.place = 0
        self.places, self.by_number = {}, {}
        self.last = None  # the cell before this one, if it was to be remembered
        self.around_of = self.around = None  # of a polyhedron

    # ------------------------------------------------------------------ What is kept

    def begin_cell(self):
        if self.place == self.room:
            if self.room == 0 or self.room < min(max(2 * self.surface.live(), 2**14), 2**18):
                self.room = max(64, 2 * self.room)
            else:
                self.place = 0
        gone = self.places.pop(self.place, None)
        if gone:
            gone.there = False
            gone.behind = gone.sides = ()  # what it refers to may be forgotten
            del self.by_number[gone.number]
        self.this = Remembered(self.cells, self.place)
        self.place += 1

    def end_cell(self, cell):
        """Before it finalizes vertices."""
        this = self.this
        self.cells += 1
        self.last = None
        if not cell.hexahedral and not (self.mixed and (cell.corners or cell.by_faces)):
            return
        self.places[this.place] = self.by_number[this.number] = self.last = this
        this.shape, this.hexahedron = plain_shape(cell.shape, cell.corners), cell.hexahedral
        if cell.hexahedral:
            this.slots = [vertex.slot for vertex in self.v]
            for b in range(8):
                uses = self.uses[this.slots[b]]
                uses[1 if uses[0] is not None else 0] = (this, b)
        else:
            this.slots = [vertex.slot for vertex in cell.v[: min(cell.corners, 8)]]
        if self.mixed and cell.corners:
            this.sides = [self.behind_side(cell, k) for k in range(6)]

    def behind_side(self, cell, k):
        """The remembered cell behind side k, by section 37."""
        number = cell.behind[k]
        return self.by_number.get(number) if number is not None else None

    def _begin_vertex(self, vertex):
        self.introduced[vertex.slot] = self.cells
        self.full[vertex.slot] = False
        self.uses[vertex.slot] = [None, None]

    # ------------------------------------------------------------------ Of a vertex

    def of_cell(self, cell):
        """The neighbourhoods of a cell's new vertices, in order of introduction."""
        if cell.hexahedral:
            self.v = [None] * 8
            for i in range(8):
                self.v[cell.bits(i)] = cell.v[i]
        to_come = {cell.v[p].id for p in cell.new_positions}
        found = []
        for p in cell.new_positions:
            vertex = cell.v[p]
            self._begin_vertex(vertex)
            known = lambda other: other.id not in to_come
            if cell.hexahedral and p < 8:
                item = self._lattice(cell, p, known)
            elif cell.by_faces:
                item = self._polyhedron(cell, p, known)
            elif not cell.hexahedral and p < cell.corners:
                item = self._other_corner(cell, p, known)
            elif cell.grid and p in cell.mid:
                item = self._grid(cell, p)
            elif p in cell.mid and (cell.mid[p].kind != BODY or cell.count == 27):
                item = self._mid(cell, p, known)
            else:
                item = Neighbourhood(vertex.slot)
                if 0 < p <= 64 and known(cell.v[p - 1]):
                    item.set(NEAR, cell.v[p - 1].slot)
            to_come.discard(vertex.id)
            found.append(item)
        return found

    def of_unused(self, vertex):
        self._begin_vertex(vertex)
        return Neighbourhood(vertex.slot)

    def _lattice(self, cell, p, known):
        b, v = cell.bits(p), self.v
        item = Neighbourhood(v[b].slot, LATTICE, b)
        for place, d in ((0, 1), (1, 2), (2, 4), (3, 3), (4, 5), (5, 6), (6, 7)):
            if known(v[b ^ d]):
                item.set(place, v[b ^ d].slot)
        item.thirds(self.full)
        self.full[item.slot] = item.is_full()
        for a in range(3):
            self._look_beyond(item, a)
        return item

    def _grid(self, cell, p):
        """Section 48: of a node of a grid, the nodes before it along the rows."""
        grid, reversed_axes = cell.grid, cell.reversed_axes()
        place = grid.places[p]
        corner = sum(1 << a for a in range(3) if place[a] == (0 if a in reversed_axes else grid.order))
        item = Neighbourhood(cell.v[p].slot, GRID, corner)
        steps = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1),
                 (2, 0, 0), (0, 2, 0), (0, 0, 2), (3, 0, 0), (0, 3, 0), (0, 0, 3)]
        found = [grid.back(p, reversed_axes, step) for step in steps]
        if cell.mid[p].kind == EDGE and sum(near is not None for near in found[:3]) < 2:
            step, behind, end = grid.along_edge(p, reversed_axes)
            found = [None] * 13
            for place, node in zip((NEAR, BEYOND, FARTHER), behind):
                found[place] = node
            found[DIAGONAL] = end
            item.corner = min(grid.order - step, 7)
        for place, node in enumerate(found):
            if node is not None:
                item.set(place, cell.v[cell.position_stored(node)].slot)
        item.thirds(self.full)
        self.full[item.slot] = item.is_full()
        return item

    def _look_beyond(self, item, a):
        d, e = ((0, 1), (0, 2), (1, 2))[a]
        if not (item.has(NEAR + a) and item.has(DIAGONAL + d) and item.has(DIAGONAL + e) and item.has(OPPOSITE)):
            return
        at = item.at
        found = self.across(at[NEAR + a], at[DIAGONAL + d], at[DIAGONAL + e], at[OPPOSITE])
        if not found:
            return
        h, c, axis = found
        c ^= 1 << axis
        w = h.slots[c]
        if self.introduced[w] > h.number:
            return
        item.set(BEYOND + a, w)
        i, j = OTHERS[axis]
        y, z = h.slots[c ^ 1 << i], h.slots[c ^ 1 << j]
        if self.introduced[y] > h.number or self.introduced[z] > h.number:
            return
        found = self.behind(w, y, z, h)
        if not found:
            return
        g, c, axis = found
        w = g.slots[c ^ 1 << axis]
        if self.introduced[w] <= g.number and w != at[NEAR + a]:
            item.set(FARTHER + a, w)

    def behind(self, x, y, z, except_=None):
        """A hexahedron in which y and z stand beside x."""
        for use in self.uses[x]:
            if use is None or not use[0].there or use[0] is except_:
                continue
            h, c = use
            for axis in range(3):
                i, j = OTHERS[axis]
                one, two = h.slots[c ^ 1 << i], h.slots[c ^ 1 << j]
                if ((one == y and two == z) or (one == z and two == y)) and \
                   self.introduced[y] <= h.number and self.introduced[z] <= h.number:
                    return h, c, axis
        return None

    def across(self, x, y, z, o):
        """The hexahedron behind the face x y o z: it, x's corner, the axis across."""
        found = self.behind(x, y, z)
        if found:
            return found
        for s in (y, z):
            found = self.behind(s, x, o)
            if found:
                h, c, axis = found
                i = next(i for i in OTHERS[axis] if h.slots[c ^ 1 << i] == x)
                return h, c ^ 1 << i, axis
        found = self.behind(o, y, z)
        if found:
            h, c, axis = found
            c ^= 7 ^ 1 << axis
            if h.slots[c] == x:
                return h, c, axis
        return None

    # ------------------------------------------------------------------ Of a vertex of a polyhedron

    @staticmethod
    def _corners_of_faces(cell):
        """Vertex -> its places in the faces: before, after, and across in faces of four."""
        around, begin, v = {}, 0, cell.v
        while begin < len(v):
            end = next(i for i in range(begin + 1, len(v)) if v[i] is v[begin])
            face, n = v[begin:end], end - begin
            for i, vertex in enumerate(face):
                across = face[(i + 2) % 4] if n == 4 else None
                places = around.setdefault(vertex.id, [])
                if len(places) < 32:
                    places.append((face[i - 1], face[(i + 1) % n], across))
            begin = end + 1
        return around

    def _polyhedron(self, cell, p, known):
        if self.around_of is not cell:
            self.around_of, self.around = cell, self._corners_of_faces(cell)
        self_, item, near = cell.v[p], Neighbourhood(cell.v[p].slot, LATTICE), []
        faces = self.around[self_.id]
        for before, after, _ in faces:
            for vertex in (before, after):
                if len(near) < 3 and known(vertex) and all(vertex is not other for other in near):
                    item.set(NEAR + len(near), vertex.slot)
                    near.append(vertex)
        item.thirds(self.full)
        diagonal = [None] * 3
        for i, (a, b) in enumerate(((0, 1), (0, 2), (1, 2))):
            if b < len(near):
                for before, after, across in faces:
                    if {before.id, after.id} == {near[a].id, near[b].id} and across and known(across):
                        diagonal[i] = across
                        item.set(DIAGONAL + i, across.slot)
                        break
        if diagonal[0] and diagonal[1]:
            taken = {vertex.id for vertex in near + [self_]}
            beside = {vertex.id for entry in self.around[diagonal[1].id] for vertex in entry[:2]}
            for before, after, _ in self.around[diagonal[0].id]:
                found = next((w for w in (before, after) if w.id not in taken and known(w) and w.id in beside), None)
                if found:
                    item.set(OPPOSITE, found.slot)
                    break
        self.full[item.slot] = item.is_full()
        return item

    # ------------------------------------------------------------------ Of a corner of another cell

    @staticmethod
    def _corner_table(shape, c, p):
        """kind, near, diagonal, across: sides as sets of positions, and the side around."""
        if shape == LINE:
            return SIMPLEX, [1 - p], [], [], None
        if shape == TRIANGLE:
            return SIMPLEX, [(p + 2) % 3, (p + 1) % 3], [], [], {0, 1, 2} - {p}
        if shape == TETRAHEDRON:
            return SIMPLEX, [(p + n) % 4 for n in (3, 2, 1)], [], [], {0, 1, 2, 3} - {p}
        if shape == POLYGON:
            return SIMPLEX, [n for n in (p - 1, p - 2, p - 3) if n >= 0], [], [], None
        if shape == PYRAMID and p == 4:
            return SIMPLEX, [0, 2], [1, 3], [], {0, 1, 2, 3}
        if shape in (QUAD, PYRAMID):
            n1, n2, n3 = (p + 1) % 4, (p + 2) % 4, (p + 3) % 4
            apex = {4} if shape == PYRAMID else set()
            return FLAT, [n3, n1] + list(apex), [n2], [{n2, n3} | apex, {n1, n2} | apex], None
        i, e = p % 3, p - p % 3
        other = 3 - e
        one, two = (i + 1) % 3, (i + 2) % 3
        return (LAYERED, [other + i, e + one, e + two], [other + one, other + two],
                [{other, other + 1, other + 2}], {e + one, e + two, other + one, other + two})

    def _other_corner(self, cell, p, known):
        v, shape = cell.v, plain_shape(cell.shape, cell.corners)
        kind, near, diagonal, across, around = self._corner_table(shape, cell.corners, p)
        item = Neighbourhood(v[p].slot, kind, min(p, 7))
        if kind == SIMPLEX:
            near = [n for n in near if known(v[n])]
        for a, n in enumerate(near):
            if known(v[n]):
                item.set(NEAR + a, v[n].slot)
        for i, n in enumerate(diagonal):
            if known(v[n]):
                item.set(DIAGONAL + i, v[n].slot)
        item.thirds(self.full)
        at = item.at
        if shape == LINE:
            h = self.last
            if h and h.there and h.shape == LINE and item.has(NEAR):
                w = self.far(h, at[NEAR], {at[NEAR]})
                if w is not None:
                    item.set(BEYOND, w)
        for a, side in enumerate(across):
            if not item.has(NEAR + a):
                continue
            h = self._behind_positions(cell, side)
            if not h:
                continue
            slots = {v[n].slot for n in side}
            w = self.far(h, at[NEAR + a], slots)
            if w is None:
                continue
            item.set(BEYOND + a, w)
            g, far_side = self.onward(h, slots, len(side))
            x = self.far(g, w, far_side) if g else None
            if x is not None and x != at[NEAR + a]:
                item.set(FARTHER + a, x)
        h = self._behind_positions(cell, around) if around else None
        if h:
            self._look_around(cell, item, h, {v[n].slot for n in around})
        self.full[item.slot] = item.is_full()
        return item

    def _look_around(self, cell, item, h, side):
        at = item.at
        w = {a: self.far(h, at[NEAR + a], side)
             for a in ((1, 2) if item.kind == LAYERED else (0, 1, 2)) if item.has(NEAR + a)}
        first = next((x for x in w.values() if x is not None), None)
        if first is None:
            return
        if any(x != first for x in w.values()):
            for a, x in w.items():
                if x is not None:
                    item.set(BEYOND + a, x)
        elif item.kind == LAYERED:
            item.set(DIAGONAL + 2, first)
            if item.has(DIAGONAL):
                x = self.far(h, at[DIAGONAL], side)
                if x is not None:
                    item.set(OPPOSITE, x)
        else:
            item.set(OPPOSITE, first)
            if not (item.has(DIAGONAL) and item.has(DIAGONAL + 1)):
                item.set(DIAGONAL, first)
                if item.has(NEAR + 2):
                    item.set(DIAGONAL + 1, first)
                    item.set(DIAGONAL + 2, first)

    def _behind_positions(self, cell, positions):
        for k, side in enumerate(sides_of(cell.shape, cell.corners)):
            if set(side) == positions:
                return self.behind_side(cell, k)
        return None

    @staticmethod
    def _joined(h, j):
        shape = h.shape
        if h.hexahedron:
            return [j ^ 1, j ^ 2, j ^ 4]
        if shape == LINE:
            return [1 - j]
        if shape == TRIANGLE:
            return [(j + 2) % 3, (j + 1) % 3]
        if shape == TETRAHEDRON:
            return [(j + n) % 4 for n in (3, 2, 1)]
        if shape == QUAD:
            return [(j + 3) % 4, (j + 1) % 4]
        if shape == PYRAMID:
            return [0, 1, 2, 3] if j == 4 else [(j + 3) % 4, (j + 1) % 4, 4]
        if shape == WEDGE:
            i, e = j % 3, j - j % 3
            return [3 - e + i, e + (i + 1) % 3, e + (i + 2) % 3]
        return []

    def far(self, h, x, side):
        """The corner of h that an edge leads to from x, out of the side."""
        if x not in h.slots:
            return None
        for k in self._joined(h, h.slots.index(x)):
            w = h.slots[k]
            if w not in side:
                return w if self.introduced[w] <= h.number else None
        return None

    def onward(self, h, side, corners):
        """The cell behind the other end of h, and the side there; `corners` of `side`, a set of slots."""
        far_side = {self.far(h, x, side) for x in side}
        if None in far_side:
            return None, far_side
        if h.hexahedron:
            slots = [h.slots[CORNER_BITS[i]] for i in range(8)]
        else:
            slots = h.slots
        for k, positions in enumerate(sides_of(h.shape, len(slots))[:6]):
            if len(positions) == corners and all(slots[i] in far_side for i in positions):
                g = h.sides[k]
                return (g if g and g.there else None), far_side
        return None, far_side

    # ------------------------------------------------------------------ Mid nodes (section 36)

    def _mid(self, cell, p, known):
        node, v = cell.mid[p], cell.v
        item = Neighbourhood(v[p].slot, MIDPOINT if node.kind == EDGE else CENTRE, 1 if node.kind == BODY else 0)
        corner = lambda c: v[cell.position_stored(c)].slot
        for k, (position, _) in enumerate(node.parallel):
            if known(v[position]):
                item.set(NEAR + k, v[position].slot)
                item.known |= 1 << (THIRD + k)
        if node.kind == EDGE:
            item.set(DIAGONAL, corner(node.corners[0]))
            item.set(DIAGONAL + 1, corner(node.corners[1]))
            return item
        if node.kind == BODY:
            edges, corners = [v[i].slot for i in (22, 21, 23, 20)], [v[i].slot for i in (16, 17, 18, 19)]
        else:
            edges, corners = [v[i].slot for i in node.edges], [corner(c) for c in node.corners]
        for place, slot in zip((DIAGONAL, DIAGONAL + 1, DIAGONAL + 2, OPPOSITE), edges):
            item.set(place, slot)
        for place, slot in zip((BEYOND, BEYOND + 1, BEYOND + 2, FARTHER), corners):
            item.set(place, slot)
        return item

    # ------------------------------------------------------------------ Of a cell

    def of_the_cell(self, cell):
        """After those of its vertices."""
        item = Neighbourhood(self.this.place)
        if cell.hexahedral:
            self._of_hexahedron(item)
        elif cell.by_faces:
            item.kind = BESIDE
            beside = [h for h in map(self.by_number.get, cell.behind) if h]
            for place, h in zip((NEAR, NEAR + 1, NEAR + 2, OPPOSITE), beside):
                item.set(place, h.place)
        elif cell.corners:
            self._beside(cell, item)
        item.block = cell.block_index
        return item

    def _beside(self, cell, item):
        item.kind = BESIDE
        sides = list(enumerate(sides_of(cell.shape, cell.corners)[:6]))
        if plain_shape(cell.shape, cell.corners) in (TRIANGLE, QUAD):
            sides = sides[1:] + sides[:1]
        a = 0
        for k, side in sides:
            h = self.behind_side(cell, k)
            if not h:
                continue
            if a == 3:
                item.set(OPPOSITE, h.place)
                return
            item.set(NEAR + a, h.place)
            g, _ = self.onward(h, {cell.v[i].slot for i in side}, len(side))
            if g:
                item.set(BEYOND + a, g.place)
            a += 1

    def _of_hexahedron(self, item):
        item.kind = LATTICE
        v, this = [vertex.slot for vertex in self.v], self.this

        def side_far(found):
            h, c, axis = found
            return h, 2 * axis if c >> axis & 1 else 2 * axis + 1

        def behind_of(h, k):
            found = h.behind[k]
            return found[0] if found and found[0].there else None

        def common(h, g):
            for k in range(6):
                x = behind_of(h, k)
                if x and any(behind_of(g, other) is x for other in range(6)):
                    return x
            return None

        for a in range(3):
            i, j = OTHERS[a]
            for up in range(2):
                at = up << a
                this.behind[2 * a + up] = self.across(v[at | 1 << i | 1 << j], v[at | 1 << i], v[at | 1 << j], v[at])
        near = [None] * 3
        for a in range(3):
            found = this.behind[2 * a] or this.behind[2 * a + 1]
            if not found:
                continue
            h, k = side_far(found)
            near[a] = h
            item.set(NEAR + a, h.place)
            if h.full:
                item.known |= 1 << (THIRD + a)
            beyond = behind_of(h, k)
            if not beyond:
                continue
            item.set(BEYOND + a, beyond.place)
            _, k = side_far(h.behind[k])
            farther = behind_of(beyond, k)
            if farther and farther is not h:
                item.set(FARTHER + a, farther.place)
        diagonal = [None] * 3
        for i, (a, b) in enumerate(((0, 1), (0, 2), (1, 2))):
            if near[a] and near[b]:
                diagonal[i] = common(near[a], near[b])
                if diagonal[i]:
                    item.set(DIAGONAL + i, diagonal[i].place)
        if all(diagonal):
            x = common(diagonal[0], diagonal[1])
            if x and any(behind_of(diagonal[2], k) is x for k in range(6)):
                item.set(OPPOSITE, x.place)
        this.full = item.is_full()
