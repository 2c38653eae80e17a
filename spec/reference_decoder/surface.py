"""Sections 15 and 16: the hexahedron, and the active surface."""

from collections import deque

from .basics import reject

# ---------------------------------------------------------------------------- 15 Hexahedron

CORNER_BITS = (0, 1, 3, 2, 4, 5, 7, 6)
FACE_CORNERS = ((0, 3, 2, 1), (0, 4, 7, 3), (0, 1, 5, 4), (1, 2, 6, 5), (3, 7, 6, 2), (4, 5, 6, 7))
OPPOSITE_FACE = (5, 3, 4, 1, 2, 0)
EDGE_CORNERS = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
AS_STORED = list(range(8))


def odd(bits):
    return bits.bit_count() & 1 == 1


def _rotations():
    rotations = []
    for origin in range(8):
        for a in range(3):
            for b in range(3):
                if b == a:
                    continue
                c = 3 - a - b
                if ((b + 3 - a) % 3 == 2) != odd(origin):
                    continue  # a reflection
                turned = []
                for bits in CORNER_BITS:
                    x, y, z = bits & 1, bits >> 1 & 1, bits >> 2
                    turned.append(CORNER_BITS[origin ^ x << a ^ y << b ^ z << c])
                rotations.append(turned)
    return rotations


ROTATIONS = _rotations()

# ---------------------------------------------------------------------------- 16 Active surface

MOST_FACES = 128


class Vertex:
    __slots__ = ("slot", "id", "uses", "places", "alive", "number", "import_state", "open_faces", "faces_of_cells",
                 "edges", "bare", "place", "open")

    def __init__(self, slot, id_):
        self.slot, self.id, self.uses, self.alive = slot, id_, 0, True
        self.places = []  # in its active faces, newest first
        self.number = None  # of section 11
        self.import_state = 0  # section 18: 0 not known, 1 own, 2 imported
        self.open_faces = []  # section 37, newest first
        self.faces_of_cells = self.edges = self.bare = 0  # section 37
        self.place, self.open = None, 0  # section 36


class Face:
    __slots__ = ("quad", "owner_corner", "owner", "side", "mates", "fans", "active")

    def __init__(self, quad, owner_corner, owner, side):
        self.quad, self.owner_corner, self.owner, self.side = quad, owner_corner, owner, side
        self.mates, self.fans = [None] * 4, [0] * 4
        self.active = True


def around(at, n):
    face, position = at
    return face.quad[(position + n) & 3]


class ActiveSurface:
    def __init__(self):
        self.by_id, self.by_slot = {}, {}  # live vertices
        self.next_id = self._oldest = 0
        self.slots, self.free_slots = 0, deque()

    def live(self):
        return len(self.by_id)

    def add_vertex(self):
        if len(self.free_slots) > len(self.by_id) + 256:
            slot = self.free_slots.popleft()
        else:
            slot = self.slots
            self.slots += 1
        vertex = Vertex(slot, self.next_id)
        self.by_id[self.next_id] = self.by_slot[slot] = vertex
        self.next_id += 1
        return vertex

    def add_face(self, quad, owner_corner, owner, side):
        face = Face(quad, owner_corner, owner, side)
        for position, vertex in enumerate(quad):
            vertex.places.insert(0, (face, position))
        return face

    def remove_face(self, face):
        for vertex in set(face.quad):
            vertex.places = [at for at in vertex.places if at[0] is not face]
        for mate in face.mates:
            if mate is not None and (back := mate[0].mates[mate[1]]) is not None and back[0] is face:
                mate[0].mates[mate[1]] = None
        face.active = False

    def join(self, e, g, n):
        """e and g are edges, (face, number), or None."""
        n = min(n, 255)
        for edge, other in ((e, g), (g, e)):
            if edge is not None:
                edge[0].mates[edge[1]] = other
                edge[0].fans[edge[1]] = n

    def finalize(self, vertex, removed=lambda face: None):
        while vertex.places:
            face = vertex.places[0][0]
            self.remove_face(face)
            removed(face)
        vertex.alive = False
        del self.by_id[vertex.id], self.by_slot[vertex.slot]
        self.free_slots.append(vertex.slot)

    def find_face(self, a, b, c, d):
        for at in a.places:
            if around(at, 2) is c:
                one, three = around(at, 1), around(at, 3)
                if (one is b and three is d) or (one is d and three is b):
                    return at[0]
        return None

    def find_path(self, a, b, c):
        for at in b.places:
            one, three = around(at, 1), around(at, 3)
            if (one is a and three is c) or (one is c and three is a):
                return at
        return None

    def oldest_id(self):
        while self._oldest < self.next_id and self._oldest not in self.by_id:
            self._oldest += 1
        return self._oldest

    def with_id(self, id_):
        vertex = self.by_id.get(id_)
        if vertex is None:
            reject("a reference to a vertex that is not alive")
        return vertex
