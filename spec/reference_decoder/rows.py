"""Sections 29 and 33: row hexahedra, with adaptive or with mixed bits."""

from .basics import reject, reject_unless
from .coders import Bits, Models, Number, Signed, choice, number, signed, tree
from .row_frame import ADJACENT_FACE, FACE_BITS, SIDE_AXIS, STORED, is_mirrored, side_along, stored_side
from .surface import CORNER_BITS, MOST_FACES, OPPOSITE_FACE, around

# ---------------------------------------------------------------------------- What is kept


def bits(x):
    return x.bit_length()


class Record:
    def __init__(self, sequence):
        self.sequence, self.successor, self.faces, self.orientation = sequence, None, [None] * 6, 0
        self.shared, self.introduced, self.finals, self.repeats = set(), set(), set(), set()
        self.guessed, self.there, self.slot, self.owned, self.at_hand = 0, True, None, 0, True

    def live(self, k):
        face = self.faces[k]
        return face if face is not None and face.active else None


class NoRecord(Record):
    """In place of the owner where there is none, and of last_cell before the first."""

    def __init__(self):
        super().__init__(0)
        self.there = False


class Candidate:
    def __init__(self, face, guessed):
        self.face, self.guessed, self.support = face, guessed, 0


CANDIDATE, PREVIOUS, CHAIN, AT_EDGE, RECENT, START = range(6)


def as_set(numbers):
    return sum(1 << k for k in numbers)


def above(edge, x):
    face, j = edge
    if face.quad[j] is x:
        return face.quad[j - 1], face.quad[(j + 2) & 3]
    return face.quad[(j + 2) & 3], face.quad[(j + 3) & 3]


def edge_beside(edge, x, other_end):
    """The edge of its face from the end x on, or from the other end."""
    face, j = edge
    return (face, (j - 1) & 3) if (face.quad[j] is x) != other_end else (face, (j + 1) & 3)


def top(edge):
    return edge[0], (edge[1] + 2) & 3


def mate(edge):
    return edge[0].mates[edge[1]]


class Rows:
    def __init__(self, schema, surface, others):
        self.surface, self.others, self.all_hexahedral = surface, others, schema.all_hexahedral()
        self.free_slots, self.slots, self.by_slot = [], 0, {}
        self.sequence, self.by_sequence = 0, {}
        self.owners, self.candidates = [], []
        self.last_cell = None
        self.hits = self.kinds = self.last_side = self.gate_side = self.gate_side_before = 0
        self.distances = [0] * 8
        self.last_reference = self.turn_hits = self.last_stored_face = 0
        self.last_finals = set()
        self.gates = 0
        self.hit, self.which, self.kind_models = Bits(), Bits(), Models(Bits)
        self.previous_side, self.recent_side = Bits(), Bits()
        self.chain_models, self.at_edge_models = Bits(), Bits()
        self.distance_again, self.distance_which, self.distance = Bits(), Bits(), Number()
        self.side_models, self.far_models, self.final = Bits(), Bits(), Bits()
        self.repeated, self.repeated_which = Bits(), Models(Bits)
        self.is_new_models, self.join_models, self.closes_models = Bits(), Bits(), Bits()
        self.from_last, self.reference_step, self.reference_age = Bits(), Signed(), Number()
        self.turn, self.stored_face, self.stored_place = Bits(), Models(Bits), Models(Bits)
        self.turned, self.mirrored = Bits(), Bits()

    def begin_group(self, source, orders):
        self.source, self.orders = source, orders

    # ------------------------------------------------------------------ A hexahedron

    def hexahedron(self, cell):
        self.cell, self.v = cell, [None] * 8  # by corner bits; None: not known
        self.shared, self.introduced = [None] * 6, set()
        self.list_candidates()
        self.last = self.last_cell or NoRecord()
        gate, kind = self.gate()
        self.kind, self.start = (kind, kind == START)
        self.gates = (8 * self.gates + kind) & (2**30 - 1)
        self.owner, self.gate_age, self.own = NoRecord(), 0, 0
        self.found = {}  # edges of the gate whose side is shared: the mate there
        if not self.start:
            self.owner, k = gate.owner, gate.side
            self.gate_age = self.age(gate)
            self.own = OPPOSITE_FACE[k]
            for i in range(4):
                self.v[FACE_BITS[k][i] ^ SIDE_AXIS[k]] = gate.quad[i]
            self.shared[self.own] = gate
            self.gate_side_before, self.gate_side = self.gate_side, k
            self.sides(gate)
            self.far_face(gate)
        for b in range(8):
            if self.v[b] is None:
                self.corner(b)
        self.hits = (2 * self.hits + (kind == CANDIDATE)) & 7
        self.unspoken()
        self.o = 0 if self.start else self.orientation()
        cell.stored_corner = [CORNER_BITS[STORED[self.o][CORNER_BITS[i]]] for i in range(8)]
        for i in range(8):
            cell.v[i] = self.v[CORNER_BITS[i]]

    def add_vertex(self, b):
        self.v[b] = self.surface.add_vertex()
        self.cell.new_positions.append(CORNER_BITS[b])
        self.introduced.add(b)

    def is_shared(self, face):
        return any(face is f for f in self.shared)

    def list_candidates(self):
        self.candidates = found = []
        for owner, side in self.owners:
            if not owner.there or owner.successor is None or not owner.successor.there:
                continue
            face = owner.successor.live(side)
            if face and all(face is not c.face for c in found):
                found.append(Candidate(face, owner.successor.guessed))
        for i, one in enumerate(found):
            for other in found[i + 1 :]:
                if any(m is not None and m[0] is other.face for m in one.face.mates):
                    one.support += 1
                    other.support += 1

    # Names of section 33.

    def fan_list(self, face):
        a, b, c, d = sorted(min(fan, 5) for fan in face.fans)
        return 512 * a + 64 * b + 8 * c + d

    def fans(self, face):
        return sum(min(fan, 5) for fan in face.fans)

    def crowd(self, face):
        return sum(len(vertex.places) for vertex in face.quad)

    def uses(self, face):
        return sum(vertex.uses for vertex in face.quad)

    def age(self, face):
        return bits(self.sequence - face.owner.sequence)

    def shared_set(self):
        return as_set(k for k in range(6) if self.shared[k])

    # ------------------------------------------------------------------ The gate

    def gate(self):
        """The face, and the kind."""
        source, last, n = self.source, self.last, len(self.candidates)
        gates = self.gates
        if n > 0:
            c, f = self.candidates[0], self.candidates[0].face
            support = min(c.support, 3)
            source.about(0, (n, gates & 4095), (n, support, c.guessed, self.fan_list(f)),
                         (n, support, as_set(last.shared), as_set(last.introduced)),
                         (n, support, c.guessed, self.age(f), f.side, self.gate_side),
                         (n, self.crowd(f), self.uses(f)))
            if source.bit(self.hit[min(n, 6), support, self.hits, c.guessed]):
                return self.which_candidate(n).face, CANDIDATE
        source.about(2, (gates & 7, as_set(last.shared), n),
                     (self.live_sides(self.last_cell), gates & 63, n), (gates & (2**20 - 1),))
        kind = tree(source, self.kind_models[self.kinds], 3)
        reject_unless(PREVIOUS <= kind <= START, "an unknown kind of gate")
        self.kinds = (8 * self.kinds + kind) & 63
        if kind == START:
            return None, kind
        if kind == PREVIOUS:
            reject_unless(self.last_cell, "a gate on a hexahedron before the first")
            return self.side_of_cell(3, self.last_cell, self.previous_side), kind
        if kind == RECENT:
            return self.recent(), kind
        found = self.chain() if kind == CHAIN else self.at_edges()
        reject_unless(found, "a gate of an empty list")
        source.about(4 if kind == CHAIN else 5, (len(found),), (as_set(last.shared),))
        models = self.chain_models if kind == CHAIN else self.at_edge_models
        return found[choice(source, models, 32, len(found))], kind

    def which_candidate(self, n):
        source = self.source
        for i in range(n - 1):
            c, following = self.candidates[i], self.candidates[i + 1]
            f, support = c.face, min(c.support, 3)
            again = (f.side == self.gate_side) + 2 * (f.side == self.gate_side_before)
            source.about(1, (self.fans(f), self.fans(following.face), self.age(f)),
                         (n - i, c.support, c.guessed, self.gates & 63, self.age(f)),
                         (n - i, i, c.support, c.guessed, self.fan_list(f)))
            if source.bit(self.which[min(n - i, 3), min(i, 3), support, again, c.guessed]):
                return c
        return self.candidates[n - 1]

    def live_sides(self, record):
        return as_set(k for k in range(6) if record.live(k)) if record else 0

    def side_of_cell(self, question, record, model):
        sides = [k for k in range(6) if record.live(k)]
        reject_unless(sides, "a gate on a hexahedron without faces")
        chosen = sides[-1]
        for at, k in enumerate(sides[:-1]):
            f = record.live(k)
            self.source.about(question, (k, self.live_sides(record), self.last_side), (k, self.fan_list(f)),
                              (k, len(sides) - at, self.crowd(f), self.uses(f)),
                              (k, self.gate_side, self.gate_side_before, self.last_side))
            if self.source.bit(model[self.last_side, k]):
                chosen = k
                break
        self.last_side = chosen
        return record.live(chosen)

    def recent(self):
        source, distances = self.source, self.distances
        clues = (self.gates & 4095,), (as_set(self.last.shared), bits(distances[0]))
        source.about(6, *clues)
        if source.bit(self.distance_again[0]):
            source.about(7, *clues)
            distances.insert(0, distances.pop(tree(source, self.distance_which, 3)))
        else:
            source.about(8, *clues)
            distances.insert(0, number(source, self.distance))
            distances.pop()
        record = self.by_sequence.get(self.sequence - distances[0])
        reject_unless(record and record.there, "a gate on a hexahedron that has gone")
        return self.side_of_cell(9, record, self.recent_side)

    def chain(self):
        found = []
        for owner, side in self.owners[:2]:
            if not owner.there:
                continue
            record = owner
            for _ in range(32):
                record = record.successor
                if record is None or not record.there:
                    break
                face = record.live(side)
                if face and all(face is not f for f in found) and all(face is not c.face for c in self.candidates):
                    found.append(face)
        return found

    def at_edges(self):
        found = []
        for k in (5, 4, 3, 2, 1, 0):
            face = self.last_cell.live(k) if self.last_cell else None
            for m in face.mates if face else ():
                if m is not None and m[0].owner is not self.last_cell and all(m[0] is not f for f in found):
                    found.append(m[0])
        return found

    # ------------------------------------------------------------------ Sides and far face

    EVIDENCE = ((0, 3, 5), (1, 4, 4), (2, 2, 2))

    def sides(self, gate):
        k, v, source = gate.side, self.v, self.source
        for i in sorted(range(4), key=lambda i: -gate.fans[i]):
            m = gate.mates[i]
            if m is None or self.is_shared(m[0]):
                continue
            a, b = FACE_BITS[k][i], FACE_BITS[k][(i + 1) & 3]
            p, q = above(m, gate.quad[i])
            if (v[a] and v[a] is not p) or (v[b] and v[b] is not q):
                continue
            score = [0, 0]
            for j, other_end in (((i - 1) & 3, True), ((i + 1) & 3, False)):
                if j in self.found:
                    across = mate(edge_beside(self.found[j], gate.quad[j], other_end))
                    score[0 if across is not None and across[0] is m[0] else 1] += 1
            evidence = self.EVIDENCE[score[0]][score[1]]
            s, fan = ADJACENT_FACE[k][i], min(gate.fans[i], 7)
            candidate = int(any(m[0] is c.face for c in self.candidates))
            x, y = gate.quad[i], gate.quad[(i + 1) & 3]
            fewer, more = sorted((len(x.places), len(y.places)))
            source.about(10, (fan, evidence, candidate, fewer, more),
                         (fan, evidence, candidate, x.uses, y.uses, self.kind),
                         (fan, evidence, candidate, as_set(self.found), self.age(m[0]), self.gate_age))
            if source.bit(self.side_models[fan, evidence, s in self.owner.shared, candidate, self.hits & 1]):
                self.shared[s] = m[0]
                self.found[i] = m
                v[a], v[b] = p, q

    def far_face(self, gate):
        k, v, source = gate.side, self.v, self.source
        if not self.found or all(v):
            return
        for i in range(4):
            if i not in self.found:
                continue
            upper = top(self.found[i])
            m = mate(upper)
            if m is None or self.is_shared(m[0]):
                continue
            c, d = FACE_BITS[k][(i + 3) & 3], FACE_BITS[k][(i + 2) & 3]
            p, q = above(m, v[FACE_BITS[k][i]])
            if (v[c] and v[c] is not p) or (v[d] and v[d] is not q):
                continue
            support = 0
            for edge in self.found.values():
                other = mate(top(edge))
                support += other is not None and other[0] is m[0]
            fan = upper[0].fans[upper[1]]
            source.about(11, (fan, self.crowd(m[0]), self.uses(m[0])), (self.age(m[0]), self.gate_age, self.kind))
            if source.bit(self.far_models[min(fan, 7), support, len(self.found), k in self.owner.shared]):
                self.shared[k] = m[0]
                v[c], v[d] = p, q
            return

    # ------------------------------------------------------------------ Corners

    def corner(self, b):
        v, source = self.v, self.source
        known = sum(vertex is not None for vertex in v)
        neighbours = sum(v[b ^ axis] is not None for axis in (1, 2, 4))
        shared, introduced = self.shared_set(), as_set(self.introduced)
        if known:
            source.about(12)
            if source.bit(self.repeated[b, neighbours, b in self.owner.repeats]):
                source.about(13)
                v[b] = v[tree(source, self.repeated_which[b], 3)]
                reject_unless(v[b], "a repeated corner that is not known")
                return
        if not self.all_hexahedral:
            w, score, others = self.closing_vertex(b)
            if w:
                source.about(25, (score, others, known), (score, len(w.places), w.uses, shared),
                             (b, score, introduced, as_set(self.last.introduced)))
                if source.bit(self.closes_models[min(score, 7), min(others, 2)]):
                    v[b] = w
                    return
        leads = self.leads(b)
        faces = [len(v[b ^ axis].places) for axis in (1, 2, 4) if v[b ^ axis]]
        source.about(14, (leads, neighbours, *(faces + [0, 0, 0])[:3]),
                     (leads, neighbours, b, introduced, as_set(self.last.introduced)),
                     (leads, neighbours, self.kind, self.gate_age, bin(shared).count("1")))
        if source.bit(self.is_new_models[not self.start, leads, neighbours, b in self.owner.introduced]):
            self.add_vertex(b)
            return
        for r, (w, score) in enumerate(self.joins(b)):
            source.about(15, (score, len(w.places), w.uses, int(r > 0)),
                         (score, bits(self.surface.next_id - w.id), int(r > 0)))
            if source.bit(self.join_models[min(r, 7), min(score, 7)]):
                v[b] = w
                return
        clues = (known + 1, self.kind), (shared,)
        source.about(16, *clues)
        if source.bit(self.from_last[0]):
            source.about(17, *clues)
            id_ = self.last_reference + signed(source, self.reference_step)
        else:
            source.about(18, *clues)
            id_ = self.surface.oldest_id() + number(source, self.reference_age)
        self.last_reference = id_
        v[b] = self.surface.with_id(id_)

    def is_corner(self, vertex):
        return any(vertex is w for w in self.v)

    def closing_vertex(self, b):
        """The vertex, its score, and how many others there are."""
        v, scores = self.v, {}
        for axis in (1, 2, 4):
            for other in (1, 2, 4):
                p, r = v[b ^ axis], v[b ^ axis ^ other]
                if other == axis or not p or not r:
                    continue
                across = v[b ^ other]
                for face in p.open_faces:
                    if len(face.cycle) != 4 or face.owner.hexahedral:
                        continue
                    at = next(i for i, u in enumerate(face.cycle) if u is p)
                    if across and face.cycle[(at + 2) & 3] is not across:
                        continue
                    after, before = face.cycle[(at + 1) & 3], face.cycle[at - 1]
                    for one, w in ((after, before), (before, after)):
                        if one is r:
                            scores[w] = scores.get(w, 0) + (3 if across else 2)
        found = [(w, score) for w, score in scores.items() if not self.is_corner(w)]
        if not found:
            return None, 0, 0
        w, score = max(found, key=lambda pair: pair[1])
        return w, score, len(found) - 1

    def places_with_corners(self, p):
        """Of each place of p: the face, around(1..3), and the corners of p, around(1) and around(3) in its owner."""
        for face, i in p.places:
            quad = FACE_BITS[face.side]
            yield (face, [around((face, i), n) for n in (1, 2, 3)],
                   quad[i], quad[(i + 1) & 3], quad[(i + 3) & 3])

    def leads(self, b):
        v, total, across_known = self.v, 0, 0
        for axis in (1, 2, 4):
            p = v[b ^ axis]
            if not p:
                continue
            d, leading = side_along(b ^ axis, b), False
            others = [v[b ^ other] for other in (1, 2, 4) if other != axis and v[b ^ other]]
            for face, (one, two, three), here, first, third in self.places_with_corners(p):
                for w, corner in ((one, first), (three, third)):
                    if side_along(here, corner) == d and not self.is_corner(w):
                        leading = True
                if any(two is other for other in others) and not self.is_shared(face):
                    across_known = 1
            total += 2 * leading
        return total + across_known

    def joins(self, b):
        v, scores = self.v, {}
        for axis in (1, 2, 4):
            p = v[b ^ axis]
            if not p:
                continue
            d = side_along(b ^ axis, b)
            for face, (one, two, three), here, first, third in self.places_with_corners(p):
                if self.is_shared(face):
                    continue
                for w, corner in ((one, first), (three, third)):
                    scores[w] = scores.get(w, 0) + (3 if side_along(here, corner) == d else 1)
                for other in (1, 2, 4):
                    if other != axis and v[b ^ other] is not None and two is v[b ^ other]:
                        scores[one] += 2
                        scores[three] += 2
        found = [(w, score) for w, score in scores.items() if not self.is_corner(w)]
        return sorted(found, key=lambda pair: -pair[1])[:24]

    # ------------------------------------------------------------------ Faces that nobody spoke of

    def unspoken(self):
        for k in range(6):
            if self.shared[k] is None and not any(b in self.introduced for b in FACE_BITS[k]):
                face = self.surface.find_face(*(self.v[b] for b in FACE_BITS[k]))
                if face and not self.is_shared(face):
                    self.shared[k] = face

    # ------------------------------------------------------------------ Orientation

    def orientation(self):
        owner, gate = self.owner, self.shared[self.own]
        if not self.cell.turned():
            self.source.about(23)
            return 6 if self.source.bit(self.mirrored[is_mirrored(owner.orientation)]) else 0
        source, votes = self.orders, {owner.orientation: 1}
        for k in range(6):
            if self.shared[k] and k != self.own:
                o = self.expected(k)
                if o is not None:
                    votes[o] = votes.get(o, 0) + 1
        voters = sum(votes.values())
        ranked = sorted(votes.items(), key=lambda pair: -pair[1])
        for i, (o, count) in enumerate(ranked[:3]):
            source.about(19, (i, o, self.last.orientation),
                         (i, count, voters, int(o == owner.orientation), self.gate_age),
                         (i, count, self.shared_set(), self.own), (i, o, owner.orientation),
                         (i, o, self.own, self.gates & 63))
            yes = source.bit(self.turn[i, min(count, 4), min(voters, 4), self.turn_hits])
            if i == 0:
                self.turn_hits = (2 * self.turn_hits + yes) & 7
            if yes:
                return o
        k = gate.side
        theirs = stored_side(owner.orientation, k)
        lowest = min(FACE_BITS[k], key=lambda b: STORED[owner.orientation][b])
        at = lowest ^ SIDE_AXIS[k]
        source.about(20, (theirs, self.kind), (owner.orientation, self.own))
        mine = tree(source, self.stored_face[theirs, self.last_stored_face], 3)
        reject_unless(mine <= 5, "an unknown stored face")
        self.last_stored_face = mine
        source.about(21, (owner.orientation, self.own, mine))
        place = tree(source, self.stored_place[theirs, mine], 2)
        source.about(22)
        turned = bool(source.bit(self.turned[0]))
        for o in range(48):
            if STORED[o][at] == FACE_BITS[mine][place] and stored_side(o, self.own) == mine and \
               (is_mirrored(o) != is_mirrored(owner.orientation)) == turned:
                return o
        return reject("an orientation that there is not")

    def expected(self, k):
        face = self.shared[k]
        record, s = face.owner, face.side
        here, there = [], []
        for i in (0, 1, 3):
            corner = next((b for b in FACE_BITS[k] if self.v[b] is face.quad[i]), None)
            if corner is None:
                return None
            here.append(corner)
            there.append(STORED[record.orientation][FACE_BITS[s][i] ^ SIDE_AXIS[s]])
        one, two = here[0] ^ here[1], here[0] ^ here[2]
        if one == two or one not in (1, 2, 4) or two not in (1, 2, 4):
            return None
        for o in range(48):
            if [STORED[o][corner] for corner in here] == there:
                return o
        return None

    # ------------------------------------------------------------------ Attach

    def attach(self, cell):
        v, surface = self.v, self.surface
        self.owners = sorted(((f.owner, f.side) for f in self.shared if f), key=lambda pair: pair[0].sequence)
        this = Record(self.sequence)
        if self.last_cell and self.last_cell.there:
            self.last_cell.successor = this
        this.slot = self.free_slots.pop() if self.free_slots else self.slots
        self.slots = max(self.slots, this.slot + 1)
        if this.slot in self.by_slot:
            gone = self.by_slot[this.slot]
            gone.there = False
            del self.by_sequence[gone.sequence]
        self.by_slot[this.slot] = self.by_sequence[this.sequence] = this
        self.sequence += 1
        self.last_cell = this
        this.orientation, this.introduced, this.guessed = self.o, self.introduced, int(self.kind == CANDIDATE)
        this.shared = {k for k in range(6) if self.shared[k]}
        this.repeats = {b for b in range(8) if any(v[b] is v[a] for a in range(b))}
        for k in range(6):
            if self.shared[k]:
                continue
            quad = [v[b] for b in FACE_BITS[k]]
            pairs = sum(quad[i] is quad[j] for i in range(4) for j in range(i))
            if pairs < 2 and all(len(vertex.places) < MOST_FACES for vertex in quad):
                this.faces[k] = surface.add_face(quad, None, this, k)
                this.owned += 1
        for p in range(6):
            for i in range(4):
                if ADJACENT_FACE[p][i] > p:
                    self.join_at(this, p, i)
        for face in self.shared:
            if face:
                surface.remove_face(face)
                self.face_removed(face)

    def edge_there(self, k, i):
        """The edge of the face shared on side k that edge i of the side is."""
        face, (a, b, c) = self.shared[k], (self.v[corner] for corner in FACE_BITS[k][:3])
        for j in range(4):
            if face.quad[j] is a and face.quad[(j + 2) & 3] is c:
                return (face, (j + i) & 3) if face.quad[(j + 1) & 3] is b else (face, (j + 3 - i) & 3)
        return face, 0

    def join_at(self, this, p, i):
        """Edge i of side p, where it meets another side of the hexahedron."""
        q, fan, ends, there = ADJACENT_FACE[p][i], 1, [], []
        corners = {FACE_BITS[p][i], FACE_BITS[p][(i + 1) & 3]}
        j = next(j for j in range(4) if {FACE_BITS[q][j], FACE_BITS[q][(j + 1) & 3]} == corners)
        for side, number_ in ((p, i), (q, j)):
            edge = None
            if self.shared[side]:
                edge = self.edge_there(side, number_)
                ends.append(mate(edge))
                fan += edge[0].fans[edge[1]]
            else:
                ends.append((this.faces[side], number_) if this.faces[side] else None)
            there.append(edge)
        if all(there) and ends[0] == there[1] and ends[1] == there[0]:
            return
        self.surface.join(ends[0], ends[1], fan)

    def face_removed(self, face):
        owner = face.owner
        owner.owned -= 1
        if owner.owned == 0 and not owner.at_hand:
            self.free_slots.append(owner.slot)

    def forget_vertex(self, vertex):
        pass

    # ------------------------------------------------------------------ Last use

    def last_uses(self, cell):
        source, surface, this = self.source, self.surface, self.last_cell
        self.list_candidates()
        finals = set()
        for i in range(8):
            b = CORNER_BITS[i]
            vertex = cell.v[i]
            if any(vertex is earlier for earlier in cell.v[:i]):
                continue
            wanted = sum(any(vertex is w for w in c.face.quad) for c in self.candidates)
            faces, uses = len(vertex.places), vertex.uses
            other = 0 if self.all_hexahedral else max(0, min(vertex.bare - faces, 3))
            so_far, before = as_set(finals), as_set(self.last_finals)
            if self.all_hexahedral:
                fans = [min(face.fans[at], 7) for face, at in vertex.places]
                unmated = sum(face.mates[at] is None for face, at in vertex.places)
                source.about(24, (faces, uses, min(sum(fans), 31), max(fans, default=0), min(unmated, 3), wanted),
                             (faces, uses, bits(surface.next_id - vertex.id), wanted),
                             (faces, uses, b, before, so_far, wanted))
            else:
                source.about(26, (vertex.bare, vertex.edges, faces), (faces, uses, vertex.bare, wanted),
                             (other, b, before, so_far, wanted))
            analogues = 2 * (b in self.owner.finals) + (b in self.last_finals)
            if source.bit(self.final[min(faces, 7), min(uses, 8), analogues, min(wanted, 2), other]):
                finals.add(b)
                cell.last_use.append(i)
        self.last_finals = this.finals = finals

    def end_cell(self):
        """Behind all that this hexahedron finalized."""
        this = self.last_cell
        this.at_hand = False
        if this.owned == 0:
            self.free_slots.append(this.slot)
