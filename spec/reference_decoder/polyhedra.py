"""Section 42: polyhedra told by their faces."""

from .basics import reject_unless
from .coders import Bit, Bits, Mixer, Mixing, Models, Signed, clue, mix_hash, signed

MASK32 = 2**32 - 1
MOST_FACES, MOST_EDGES, MOST_CELLS, MOST_NODES = 64, 32, 255, 65536
END, CLOSE, NEW, AMONG, WHICH, LAST = range(6)
CLOSED, INTRODUCED, MISSED, TAKEN = 1, 2, 3, 4


class Around:
    """What is open at a live vertex: faces, newest first, and edges: id -> [vertex, cells]."""

    def __init__(self):
        self.faces, self.edges = [], {}


class OpenFace(list):
    """The vertices around it, and the number of the cell that has it."""


class Candidate:
    __slots__ = ("vertex", "open", "inside", "edge", "shift", "ours", "place", "model", "chance")

    def __init__(self, vertex, ours, place):
        self.vertex, self.ours, self.place = vertex, ours, place
        self.open = self.inside = self.edge = self.shift = 0

    def why(self):
        return clue((self.open, self.inside, self.edge, self.shift, self.ours))


class BlockState:
    def __init__(self):
        self.ids, self.step = [], 0


def beginning(at, n):
    return 3 if at == 0 else 2 if at == n - 1 else 1


class Polyhedra:
    def __init__(self, surface):
        self.surface, self.around = surface, Models(Around)  # by id of the vertex
        self.mixing, self.blocks = Mixing(), Models(BlockState)
        self.by_faces, self.end, self.close, self.is_new, self.among = Bit(), Bits(), Bits(), Bits(), Bits()
        self.which, self.last, self.step = Bits(), Bits(), Models(Signed)
        self.before = self.last_finals = 0
        self.last_outcomes = []

    def begin_group(self, source):
        self.source, self.mixer = source, Mixer(self.mixing, source)

    # ------------------------------------------------------------------ What is open

    def find(self, cycle):
        n = len(cycle)
        for face in self.around[cycle[0].id].faces:
            if len(face) != n:
                continue
            at = next(i for i, vertex in enumerate(face) if vertex is cycle[0])
            if all(face[(at + k) % n] is cycle[k] for k in range(n)) or all(face[at - k] is cycle[k] for k in range(n)):
                return face
        return None

    def add_face(self, cycle):
        if all(len(self.around[vertex.id].faces) < MOST_FACES for vertex in cycle):
            for vertex in cycle:
                self.around[vertex.id].faces.insert(0, cycle)

    def remove_face(self, face):
        for vertex in face:
            faces = self.around[vertex.id].faces
            del faces[next(i for i, other in enumerate(faces) if other is face)]

    def add_edge(self, a, b):
        at_a, at_b = self.around[a.id].edges, self.around[b.id].edges
        if b.id in at_a:
            at_a[b.id][1] = at_b[a.id][1] = min(at_a[b.id][1] + 1, MOST_CELLS)
        elif len(at_a) < MOST_EDGES and len(at_b) < MOST_EDGES:
            at_a[b.id], at_b[a.id] = [b, 1], [a, 1]

    def forget_vertex(self, vertex):
        if vertex.id not in self.around:
            return
        while self.around[vertex.id].faces:
            self.remove_face(self.around[vertex.id].faces[0])
        for other, _ in self.around[vertex.id].edges.values():
            del self.around[other.id].edges[vertex.id]
        del self.around[vertex.id]

    # ------------------------------------------------------------------ A cell

    def code(self, cell, number):
        """Whether the cell is told by its faces: its nodes, if it is. Its number in the segment."""
        cell.by_faces = self.source.bit(self.by_faces)
        if not cell.by_faces:
            return False
        self.cell, self.state = cell, self.blocks[cell.block_index]
        self.v = cell.v = []
        self.shift = self.state.step
        self.vertices = {}  # of the cell: id -> [vertex, its edges: id -> [vertex, times]], in order of their first use
        self.faces = self.open_edges = self.last_size = self.outcomes = 0
        self.face_before, self.cell_outcomes, self.edges, new_faces, behind = [], [], [], [], []
        while True:
            path = self.face()
            open_face = self.find(path)
            if open_face:
                behind.append(open_face.cell)
                self.remove_face(open_face)
            else:
                new_faces.append(path)
            for i, vertex in enumerate(path):
                self.note_edge(vertex, path[(i + 1) % len(path)])
            self.last_size, self.face_before = min(len(path), 15), path
            self.faces += 1
            if self.ends():
                break
        for path in new_faces:
            face = OpenFace(path)
            face.cell = number
            self.add_face(face)
        cell.behind = (behind + [None] * 8)[:8]
        for a, b in self.edges:
            self.add_edge(a, b)
        self.before, self.last_outcomes = self.outcomes, self.cell_outcomes
        self.state.ids = [vertex.id for vertex in self.v]
        cell.count = len(self.v)
        return True

    def last_outcome(self):
        return self.last_outcomes[len(self.v)] if len(self.v) < len(self.last_outcomes) else 0

    def note(self, outcome):
        self.outcomes = mix_hash(self.outcomes, outcome)
        self.cell_outcomes.append(outcome)

    def times(self, a, b):
        """How often the cell has the edge, 2: twice or more."""
        edge = self.vertices[a.id][1].get(b.id) if a.id in self.vertices else None
        return edge[1] if edge else 0

    def note_edge(self, a, b):
        at_a, at_b = self.vertices[a.id][1], self.vertices[b.id][1]
        if b.id in at_a:
            if at_a[b.id][1] == 1:
                self.open_edges -= 1
            at_a[b.id][1] = at_b[a.id][1] = 2
        elif len(at_a) < MOST_EDGES and len(at_b) < MOST_EDGES:
            at_a[b.id], at_b[a.id] = [b, 1], [a, 1]
            self.open_edges += 1
            self.edges.append((a, b))

    def ends(self):
        closed = int(self.open_edges == 0)
        self.mixer.about(END, (closed, self.faces), (closed, self.outcomes), (closed, self.last_outcome()),
                         (closed, min(self.open_edges, 15), self.last_size))
        return self.mixer.bit(self.end[closed, min(self.faces, 15)])

    # ------------------------------------------------------------------ A face

    def face(self):
        self.path, self.matches = [], []
        while True:
            reject_unless(len(self.v) < MOST_NODES, "a cell of too many nodes")
            if len(self.path) >= 3 and self.closes():
                break
            self.node()
        self.v.append(self.path[0])
        self.note(CLOSED)
        return self.path

    def closes(self):
        n, first, last = len(self.path), self.path[0], self.path[-1]
        match = 2 if any(len(face) == n for face, _, _ in self.matches) else 1 if self.matches else 0
        inside = self.times(last, first)
        edge = 1 if inside == 1 else 2 if inside == 0 and first.id in self.around[last.id].edges else 0
        i = min(n, 15)
        self.mixer.about(CLOSE, (match, edge, i, min(self.open_edges, 7)),
                         (len(self.v), self.outcomes, match), (len(self.v), self.outcomes, self.before, match),
                         (match, edge, i, self.last_size), (match, edge, i, self.last_outcome(), self.faces))
        return self.mixer.bit(self.close[match, edge, i])

    def node(self):
        q, ids, mixer, path = len(self.v), self.state.ids, self.mixer, self.path
        self.expected = ids[q] + self.shift if q < len(ids) else self.v[q - 1].id if q > 0 else 0
        candidates = self.candidates()
        i = min(len(path), 2)
        best = candidates[0] if candidates else None
        why = best.why() if best else clue((0, 0, 0, 0, 0))
        chance = best.chance >> 12 if best else 16
        kind = 0 if not best else 1 if best.open > 0 else 2 if best.inside == 1 else 3
        clues = ((i, why, chance), (q, self.outcomes), (q, self.outcomes, self.before), (i, self.last_outcome(), why),
                 (min(len(path), 15), chance, min(len(self.matches), 3), min(self.open_edges, 15), len(candidates)))
        mixer.about(NEW, *clues)
        among = False
        if mixer.bit(self.is_new[i, kind]):
            vertex = self.surface.add_vertex()
            self.cell.new_positions.append(q)
            outcome = INTRODUCED
        else:
            if candidates:
                mixer.about(AMONG, *clues)
                among = mixer.bit(self.among[i, kind])
            if among:
                w = self.choose(candidates, q, i)
                vertex = w.vertex
                outcome = TAKEN + w.open + 4 * min(w.inside, 1) + 8 * w.place
            else:
                vertex = self.surface.with_id(self.expected + signed(self.source, self.step[q > 0]))
                reject_unless(all(vertex is not other for other in path), "a face with a node twice")
                outcome = MISSED
        if q < len(ids):
            self.shift = vertex.id - ids[q]
        if q == 0:
            self.state.step = self.shift
        self.v.append(vertex)
        self.note(outcome)
        self.take(vertex)

    def choose(self, candidates, q, i):
        for r, w in enumerate(candidates[:-1]):
            why = w.why()
            self.mixer.about(WHICH, (i, why, r), (i, why, w.place, int(self.faces == 0)), (q, self.outcomes, why),
                             (i, why, w.place, self.last_size, len(self.path)),
                             (q, self.last_outcome(), why, self.before))
            if self.mixer.bit(w.model):
                return w
        return candidates[-1]

    def take(self, vertex):
        self.vertices.setdefault(vertex.id, [vertex, {}])
        i = len(self.path)
        self.path.append(vertex)
        if i == 0:
            for face in self.around[vertex.id].faces:
                at = next(k for k, u in enumerate(face) if u is vertex)
                self.matches += [(face, at, -1), (face, at, 1)]
        else:
            self.matches = [match for match in self.matches if self.node_of(match, i) is vertex]

    @staticmethod
    def node_of(match, i):
        face, at, way = match
        return face[(at + way * i) % len(face)] if i < len(face) else None

    # ------------------------------------------------------------------ Candidates

    def candidates(self):
        found, path = {}, self.path
        taken = {vertex.id for vertex in path}

        def add(vertex):
            if vertex is None:
                return None
            if vertex.id not in found and vertex.id not in taken and len(found) < 24:
                place = next((min(k + 1, 7) for k, u in enumerate(self.face_before) if u is vertex), 0)
                found[vertex.id] = Candidate(vertex, int(vertex.id in self.vertices), place)
            return found.get(vertex.id)

        def add_expected():
            w = add(self.surface.by_id.get(self.expected))
            if w:
                w.shift = 1

        looked = list(self.vertices.values())[:64]
        if path:
            for match in self.matches:
                w = add(self.node_of(match, len(path)))
                if w:
                    w.open = max(w.open, beginning(match[1], len(match[0])))
            inside = self.vertices[path[-1].id][1]
            for to, times in inside.values():
                w = add(to) if times == 1 else None
                if w:
                    w.inside = 1
            for to, cells in self.around[path[-1].id].edges.values():
                w = add(to)
                if w:
                    w.edge = min(cells, 3)
            add_expected()
            for to, times in inside.values():
                if times > 1 and to.id in found:
                    found[to.id].inside = 2
        elif self.faces > 0:
            for vertex, edges in looked:
                open_edges = sum(times == 1 for _, times in edges.values())
                w = add(vertex) if open_edges else None
                if w:
                    faces = self.around[vertex.id].faces
                    w.inside, w.edge = min(open_edges, 2), min(len(faces), 3)
                    for face in faces[:16]:
                        n, at = len(face), next(k for k, u in enumerate(face) if u is vertex)
                        if self.times(vertex, face[(at + 1) % n]) == 1 or self.times(vertex, face[at - 1]) == 1:
                            w.open = max(w.open, beginning(at, n))
            add_expected()
            for vertex, _ in looked:
                for to, _ in self.around[vertex.id].edges.values():
                    if to.id not in self.vertices:
                        add(to)
        else:
            add_expected()
            for id_ in self.state.ids[:64]:
                vertex = self.surface.by_id.get(id_)
                w = add(vertex)
                if w:
                    faces = self.around[vertex.id].faces
                    w.edge, w.inside = min(len(faces), 3), int(any(face[0] is vertex for face in faces))
        for w in found.values():
            w.model = self.which[min(len(path), 2), w.open, w.inside, w.edge, w.shift, w.ours]
            w.chance = w.model.probability_of_one()
        return sorted(found.values(), key=lambda w: -w.chance)

    # ------------------------------------------------------------------ Last use

    def last_uses(self, cell):
        finals = 1
        for i, vertex in enumerate(cell.v[:64]):
            if any(vertex is earlier for earlier in cell.v[:i]):
                continue
            around = self.around[vertex.id]
            faces, edges, uses = min(len(around.faces), 7), min(len(around.edges), 7), min(vertex.uses, 63)
            self.mixer.about(LAST, (faces, edges), (faces, edges, uses), (i, faces, finals),
                             (i, faces, edges, self.last_finals), (faces, uses, self.outcomes))
            last = self.mixer.bit(self.last[faces, edges])
            finals = (2 * finals + last) & MASK32
            if last:
                cell.last_use.append(i)
        self.last_finals = finals
