"""Section 37: corners of cells that are no hexahedra, and open faces."""

from collections import OrderedDict

from .basics import HEXAHEDRON, LINE, POLYGON, PYRAMID, QUAD, TETRAHEDRON, TRIANGLE, WEDGE, reject_unless
from .coders import Bit, Bits, Mixer, Mixing, Models, Number, Signed, clue, mix_hash, number, signed
from .surface import FACE_CORNERS, MOST_FACES

MASK32 = 2**32 - 1
_CORNERS = {LINE: 2, TRIANGLE: 3, QUAD: 4, TETRAHEDRON: 4, PYRAMID: 5, WEDGE: 6}
_SIDES = {
    LINE: ((0, 1),),
    TRIANGLE: ((0, 1, 2), (0, 1), (1, 2), (2, 0)),
    QUAD: ((0, 1, 2, 3), (0, 1), (1, 2), (2, 3), (3, 0)),
    TETRAHEDRON: ((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
    PYRAMID: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    WEDGE: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    HEXAHEDRON: FACE_CORNERS,
}


def corners_of(block, count):
    """How many corners a cell of so many nodes has."""
    if block.shape == HEXAHEDRON:
        return 8 if block.hexahedral() else 0
    if block.shape == POLYGON:
        return min(count, 32) if count >= 3 else 0
    c = _CORNERS.get(block.shape, 0)
    return c if count >= c else 0


def plain_shape(shape, corners):
    """A polygon of three or four corners is a triangle or quad."""
    return {3: TRIANGLE, 4: QUAD}.get(corners, POLYGON) if shape == POLYGON else shape


def sides_of(shape, corners):
    shape = plain_shape(shape, corners)
    if shape == POLYGON:
        return [(i, (i + 1) % corners) for i in range(corners)]
    return _SIDES.get(shape, ())


def ordered_corners(cell):
    """The corners in the order that sides speak of: of hexahedra as stored."""
    if not cell.hexahedral:
        return cell.v[: cell.corners]
    if not cell.turned():
        return cell.v[:8]
    return [cell.v[cell.position_stored(c)] for c in range(8)]


class OpenFace:
    __slots__ = ("cycle", "owner", "flat", "covered")

    def __init__(self, cycle, owner, flat):
        self.cycle, self.owner, self.flat, self.covered = cycle, owner, flat, False


class CellOfFaces:
    """A cell that is remembered while it owns an open face."""

    __slots__ = ("number", "slots", "owned", "hexahedral")

    def __init__(self, number_, slots, hexahedral):
        self.number, self.slots, self.owned, self.hexahedral = number_, slots, 0, hexahedral


class ShapeModels:
    def __init__(self):
        self.is_new, self.among, self.which, self.last = Bits(), Bits(), Bits(), Bits()
        self.lead, self.repeated, self.repeat, self.step = Bits(), Bit(), Number(), Models(Signed)
        self.before, self.finals = [0] * 6, 0


class BlockState:
    def __init__(self):
        self.ids, self.step = Models(int), 0
        self.guesses, self.behind = [], [None] * 8


class Candidate:
    __slots__ = ("vertex", "guesses", "shared", "ways", "beside", "shift", "place", "model", "chance")

    def __init__(self, vertex):
        self.vertex, self.place = vertex, 8
        self.guesses = self.shared = self.ways = self.beside = self.shift = 0


class OtherCells:
    def __init__(self, schema, surface):
        self.surface = surface
        self.kept = not schema.all_hexahedral()
        self.cells = 0  # of all shapes, in this segment
        self.remembered, self.resting = {}, OrderedDict()
        self.last_cell = []
        self.shapes, self.blocks = Models(ShapeModels), Models(BlockState)
        self.mixing = Mixing()

    def begin_group(self, source):
        self.source, self.mixer = source, Mixer(self.mixing, source)

    # ------------------------------------------------------------------ Open faces

    def find(self, cycle):
        n = len(cycle)
        for face in cycle[0].open_faces:
            if len(face.cycle) != n:
                continue
            at = next(i for i, vertex in enumerate(face.cycle) if vertex is cycle[0])
            if all(face.cycle[(at + k) % n] is cycle[k] for k in range(n)) or \
               all(face.cycle[at - k] is cycle[k] for k in range(n)):
                return face
        return None

    def add(self, face):
        for vertex in face.cycle:
            vertex.open_faces.insert(0, face)
            if len(face.cycle) == 2:
                vertex.edges += 1
            else:
                vertex.faces_of_cells += 1
                vertex.bare += 1
        face.owner.owned += 1

    def remove(self, face):
        for vertex in face.cycle:
            vertex.open_faces.remove(face)
            if len(face.cycle) == 2:
                vertex.edges -= 1
            else:
                vertex.faces_of_cells -= 1
                vertex.bare -= not face.covered
        owner = face.owner
        owner.owned -= 1
        if owner.owned == 0 and owner.number in self.remembered:
            self.resting[owner.number] = owner

    def update_open_faces(self, cell):
        """After the nodes of a cell, before it finalizes vertices."""
        number_ = self.cells
        self.cells += 1
        if not self.kept or cell.corners == 0:
            return
        if len(self.resting) > 256:
            oldest, _ = self.resting.popitem(last=False)
            del self.remembered[oldest]
        v = ordered_corners(cell)
        this = CellOfFaces(number_, [vertex.slot for vertex in v[:8]], cell.hexahedral)
        flat_shape = plain_shape(cell.shape, cell.corners) in (TRIANGLE, QUAD)
        for k, side in enumerate(sides_of(cell.shape, cell.corners)):
            cycle = [v[i] for i in side]
            if len({vertex.id for vertex in cycle}) < len(cycle):
                continue
            face = self.find(cycle)
            if face and k < 8:
                cell.behind[k] = face.owner.number
            if cell.shape == LINE:
                continue
            itself = flat_shape and k == 0
            if not face:
                if all(vertex.faces_of_cells + vertex.edges < MOST_FACES for vertex in cycle):
                    self.add(OpenFace(cycle, this, itself))
            elif not itself:
                self.remove(face)
            elif not face.flat and not face.covered:
                face.covered = True
                for vertex in cycle:
                    vertex.bare -= 1
        self.remembered[number_] = this
        if this.owned == 0:
            self.resting[number_] = this
        self.last_cell = this.slots
        if not cell.hexahedral:
            self.make_guesses(cell)

    def forget_vertex(self, vertex):
        while vertex.open_faces:
            self.remove(vertex.open_faces[0])

    # ------------------------------------------------------------------ Guesses

    def make_guesses(self, cell):
        state = self.blocks[cell.block_index]
        state.guesses = []
        for k, n in enumerate(cell.behind):
            if n is None or n not in self.remembered:
                continue
            slots = self.remembered[n].slots
            place = []
            for vertex in cell.v[: min(cell.corners, 8)]:
                same = [j for j, slot in enumerate(slots) if slot == vertex.slot]
                place.append(same[-1] if same else None)
            numbers = [n + 1]
            if state.behind[k] is not None:
                numbers.append(2 * n - state.behind[k])
            for m in numbers:
                if all(m != guess[0] for guess in state.guesses):
                    state.guesses.append((m, place))
        state.behind = cell.behind

    # ------------------------------------------------------------------ Corners

    def corners(self, cell):
        c = cell.corners
        if c == 0:
            return
        shape, state = self.shapes[cell.shape], self.blocks[cell.block_index]
        source, mixer, v, s = self.source, self.mixer, cell.v, cell.shape
        self.sides = sides_of(cell.shape, c)
        self.owners = []
        gates = outcomes = 0
        shift = state.step
        before = shape.before
        two = mix_hash(before[0], before[1])
        six = 0
        for k in range(6):
            six = mix_hash(six, before[k])
        for i in range(c):
            q = min(i, 7)
            expected = state.ids[i] + shift
            candidates, lead, lead_bit = self.candidates(cell, shape, state, i, expected)
            first = candidates[0].chance >> 12 if candidates else 16
            clues = ((s, i, gates, max((w.shared for w in candidates), default=0),
                      max((w.guesses for w in candidates), default=0)),
                     (s, i, outcomes), (s, i, outcomes, before[0]), (s, i, outcomes, six),
                     (s, i, first, len(candidates), gates))
            mixer.about(0, *clues)
            is_new = mixer.bit(shape.is_new[q, min(gates, 2)])
            among = False
            if is_new:
                v[i] = self.surface.add_vertex()
                cell.new_positions.append(i)
                outcome = 1
            elif candidates:
                mixer.about(1, *clues)
                among = mixer.bit(shape.among[q, min(gates, 2)])
            if among:
                w = self.which(candidates, s, i, outcomes, before, two, six)
                v[i] = w.vertex
                outcome = 4 + (w.place if w.place < 8 else 8 + min(w.shared, 2))
            elif not is_new:
                if i > 0 and source.bit(shape.repeated):
                    back = number(source, shape.repeat)
                    reject_unless(back < i, "a repeated corner of no position")
                    v[i] = v[i - 1 - back]
                    outcome = 2
                else:
                    v[i] = self.surface.with_id(expected + signed(source, shape.step[i > 0]))
                    outcome = 3
            if lead:
                lead_bit.update(lead.vertex is v[i])
            outcomes = mix_hash(outcomes, outcome + 1)
            shift = v[i].id - state.ids[i]
            if i == 0:
                state.step = shift
            state.ids[i] = v[i].id
            for side in self.sides:
                if max(side) == i:
                    face = self.find([v[p] for p in side])
                    if face:
                        gates = min(gates + 1, 3)
                        self.owners.append(face.owner)
        shape.before = [outcomes] + before[:5]
        self.outcomes = outcomes

    def which(self, candidates, s, i, outcomes, before, two, six):
        for r, w in enumerate(candidates[:-1]):
            why = clue((w.guesses, w.shared, w.ways, w.shift, w.place))
            vertex = w.vertex
            self.mixer.about(
                2, (s, i, why, r), (s, i, w.guesses, w.shared, min(w.beside, 5), w.ways, r),
                (s, i, outcomes, before[0], why),
                (s, i, w.shared, min(w.beside, 3), min(vertex.bare, 7), min(vertex.edges, 3), min(vertex.uses, 31)),
                (s, i, outcomes, two, six, why))
            if self.mixer.bit(w.model):
                return w
        return candidates[-1]

    # ------------------------------------------------------------------ Candidates

    def candidates(self, cell, shape, state, i, expected):
        q, v = min(i, 7), cell.v
        found = OrderedDict()
        taken = {vertex.id for vertex in v[:i]}

        def add(vertex):
            """The candidate, if it is one."""
            if vertex.id not in found and vertex.id not in taken and len(found) < 24:
                found[vertex.id] = Candidate(vertex)
            return found.get(vertex.id)

        def beside(vertex):
            w = add(vertex)
            if w:
                w.beside = min(w.beside + 1, 15)

        if i < 8:
            for m, place in state.guesses:
                other = self.remembered.get(m)
                if other and i < len(place) and place[i] is not None and place[i] < len(other.slots):
                    vertex = self.surface.by_slot.get(other.slots[place[i]])
                    w = add(vertex) if vertex else None
                    if w:
                        w.guesses = min(w.guesses + 1, 2)
        vertex = self.surface.by_id.get(expected)
        w = add(vertex) if vertex else None
        if w:
            w.shift = 1
        lead, lead_bit = None, None
        if found:
            lead = max(found.values(), key=lambda w: 2 * w.guesses + w.shift)  # the first of several
            lead_bit = shape.lead[q, 2 * lead.guesses + lead.shift]
        for k, slot in enumerate(self.last_cell):
            vertex = self.surface.by_slot.get(slot)
            w = add(vertex) if vertex else None
            if w and w.place == 8:
                w.place = k
        if not (lead and lead_bit.probability_of_one() > 64512):
            if i == 0:
                for slot in self.last_cell:
                    vertex = self.surface.by_slot.get(slot)
                    for face in vertex.open_faces if vertex else ():
                        for u in face.cycle:
                            beside(u)
            else:
                for side in self.sides:
                    known = sum(p < i for p in side)
                    if i in side and known >= 1 and (known > 1 or len(side) == 2):
                        self.shared(side, side.index(i), i, v, known, add)
                for a in sorted(self.neighbours(i)):
                    if a < i:
                        for face in v[a].open_faces:
                            at = next(k for k, u in enumerate(face.cycle) if u is v[a])
                            beside(face.cycle[(at + 1) % len(face.cycle)])
                            beside(face.cycle[at - 1])
        for w in found.values():
            w.model = shape.which[q, min(w.guesses, 2), w.shift, min(w.shared, 3), w.place, w.beside > 0]
            w.chance = w.model.probability_of_one()
        return sorted(found.values(), key=lambda w: -w.chance), lead, lead_bit

    def neighbours(self, i):
        """The positions next to i in a side."""
        found = set()
        for side in self.sides:
            if i in side:
                at = side.index(i)
                found |= {side[at - 1], side[(at + 1) % len(side)]}
        return found

    def shared(self, side, p, i, v, known, add):
        n = len(side)
        a = next(k for k in range(n) if side[k] < i)
        start = v[side[a]]
        for face in list(start.open_faces):
            if len(face.cycle) != n or any(face.owner is owner for owner in self.owners):
                continue
            at = next(k for k, u in enumerate(face.cycle) if u is start)
            for way in (1, 2):
                def node(k):
                    return face.cycle[(at - (k - a) if way == 1 else at + (k - a)) % n]
                if all(node(k) is v[side[k]] for k in range(n) if side[k] < i):
                    w = add(node(p))
                    if w:
                        w.shared = min(w.shared + known, 7)
                        w.ways |= way
                    if n == 2:
                        break

    # ------------------------------------------------------------------ Last use

    def last_uses(self, cell):
        if cell.corners == 0:
            return
        shape, v, s, mixer = self.shapes[cell.shape], cell.v, cell.shape, self.mixer
        finals = 1
        before = shape.before  # with this cell's outcomes in front
        for i in range(cell.corners):
            vertex = v[i]
            if any(vertex is earlier for earlier in v[:i]):
                continue
            b, e, q = min(vertex.bare, 7), min(vertex.edges, 3), min(i, 7)
            mixer.about(3, (s, b, min(vertex.faces_of_cells, 15), e), (s, b, e, i, finals),
                        (s, b, e, min(vertex.uses, 63)), (s, i, finals, shape.finals, int(b == 0)),
                        (s, i, self.outcomes, before[1], finals))
            last = mixer.bit(shape.last[q, b])
            finals = (2 * finals + last) & MASK32
            if last:
                cell.last_use.append(i)
        shape.finals = finals
