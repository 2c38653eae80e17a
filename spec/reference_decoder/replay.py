"""Section 31: replay hexahedra."""

from .basics import MASK64, reject_unless
from .coders import Bits, Models, Number, Signed, number, signed, tree
from .schema import KEEP


class Past:
    """What is kept of a hexahedron."""

    __slots__ = ("number", "next", "marks", "strays", "guessed", "beside")


class Replay:
    def __init__(self, schema, surface):
        self.surface, self.keep = surface, schema.order == KEEP
        self.by_number = {}  # order keep: live vertices
        self.ring, self.count, self.kept, self.room = {}, 0, 0, 0
        self.distances = [1, 0, 0, 0, 0, 0]
        self.largest = MASK64
        self.marks_shift = self.hits = self.last_place = self.last_kind = 0
        self.top = [0] * 8
        self.following, self.may_follow = False, schema.earlier_values
        self.last_stray = self.stray_step = 0
        self.followers = [0] * 4096
        self.hit, self.place, self.distance, self.old_shift = Bits(), Models(Bits), Signed(), Bits()
        self.beside, self.as_guessed, self.same = Models(Bits), Bits(), Bits()
        self.kind, self.previous, self.earlier = Models(Bits), Models(Bits), Models(Bits)
        self.age, self.step = Models(Number), Models(Signed)
        self.marks_as_guessed, self.mark = Bits(), Bits()

    def begin_group(self, source, orders):
        self.source = source

    def past(self, n):
        return self.ring[self.count - n]

    def reaches(self, d):
        return 0 < d < self.kept

    def beside_of(self, d):
        return self.past(d).beside if self.reaches(d) else 1

    def note_number(self, vertex):
        """Order keep: a vertex that a cell has introduced has its number by now."""
        self.by_number.setdefault(vertex.number, vertex)
        self.counts_as_largest(vertex.number)

    def counts_as_largest(self, n):
        if n >= (self.largest + 1) & MASK64:
            self.largest = n

    def guess(self, d, over, by):
        """Eight numbers, and marks."""
        if self.kept == 0:
            return [0] * 8, 0
        if not self.reaches(d) or over + by > self.kept:
            return list(self.past(1).number), self.past(1).marks
        model, one, other = self.past(d), self.past(by), self.past(over + by)
        numbers = [(model.number[c] + one.number[c] - other.number[c]) & MASK64 for c in range(8)]
        n = self.largest
        for c in range(8):
            if model.next >> c & 1:
                n = (n + 1) & MASK64
                numbers[c] = n
        marks = model.marks
        if self.marks_shift:
            marks ^= one.marks ^ other.marks
        return numbers, marks

    def hexahedron(self, cell):
        source, distances = self.source, self.distances
        self.cell, self.strays = cell, 0
        if not self.keep:
            self.largest = (self.surface.next_id - 1) & MASK64
        by = self.beside_of(distances[0])
        guessed = int(self.reaches(distances[0]) and self.past(distances[0]).guessed)
        h = source.bit(self.hit[guessed, self.hits])
        self.hits = (2 * self.hits + h) & 7
        if h:
            numbers, marks = self.guess(distances[0], distances[0], by)
            following = self.resolve(numbers)
        else:
            p = tree(source, self.place[self.last_place], 3)
            if p == 7 and self.may_follow and not self.following:
                self.following = True
                p = tree(source, self.place[self.last_place], 3)
            reject_unless(p < 7, "an unknown place of a distance")
            self.last_place = p
            b = tree(source, self.beside[p], 3)
            before = distances[0]
            d = before + signed(source, self.distance) if p == 6 else distances[p]
            if b == 0:
                by = self.beside_of(d)
            elif b == 1:
                by = 1
            else:
                by = distances[b - 2]
                reject_unless(self.reaches(by), "a hexahedron beside that is not kept")
            over = d
            if p != 0:
                reject_unless(self.reaches(d), "a hexahedron that is not kept")
                if source.bit(self.old_shift[0]):
                    over = before
                    reject_unless(self.reaches(before), "a hexahedron that is not kept")
                distances.pop(min(p, 5))
                distances.insert(0, d)
            numbers, guessed_marks = self.guess(distances[0], over, by)
            if not source.bit(self.as_guessed[p]):
                self.corners(numbers)
            following = self.resolve(numbers)
            if source.bit(self.marks_as_guessed[0]):
                marks = guessed_marks
            else:
                marks = 0
                for c in range(8):
                    marks |= source.bit(self.mark[c, guessed_marks >> c & 1]) << c
        self.marks = marks
        self.remember(numbers, following, marks, h, by)

    def likely(self):
        return self.past(self.distances[0]).strays if self.reaches(self.distances[0]) else 0

    def place_of_follower(self, c):
        factor = 0x9E3779B97F4A7C15
        return (((self.stray_step * factor & MASK64) ^ c) * factor & MASK64) >> 52

    def corners(self, number_):
        source = self.source
        n = state = shift = 0
        previous = self.past(1).number if self.kept else [0] * 8
        likely = self.likely() if self.following else 0
        for c in range(8):
            if source.bit(self.same[likely >> c & 1, c, state]):
                state = 1 if n > 0 else 0
                continue
            k = tree(source, self.kind[c, self.last_kind], 3)
            reject_unless(k < 7, "an unknown kind of corner")
            self.last_kind = k
            old = number_[c]
            if k == 0 and n == 0 and self.following:
                new = self.last_stray + self.followers[self.place_of_follower(c)]
            elif k == 0:
                new = old + shift
            elif k == 1:
                new = self.largest + 1
            elif k == 2:
                new = self.top[c] + 1
            elif k == 3:
                new = previous[tree(source, self.previous[c], 3)]
            elif k == 4:
                a = number(source, self.age[c])
                reject_unless(a < 256 and a + 2 <= self.kept, "a corner of a hexahedron that is not kept")
                new = self.past(a + 2).number[tree(source, self.earlier[c], 3)]
            elif k == 5:
                new = previous[c] + signed(source, self.step[2])
            else:
                new = old + shift + signed(source, self.step[1 if n > 0 else 0])
            number_[c] = new = new & MASK64
            shift = new - old
            self.top[c] = max(self.top[c], new)
            n += 1
            state = 2
            self.strays |= 1 << c

    def resolve(self, numbers):
        following = 0
        for c in range(8):
            n = numbers[c]
            vertex = self.by_number.get(n) if self.keep else self.surface.by_id.get(n)
            if vertex is None:
                reject_unless(self.keep or n == self.surface.next_id, "a corner that is neither alive nor next")
                vertex = self.surface.add_vertex()
                self.cell.new_positions.append(c)
                if n == (self.largest + 1) & MASK64:
                    following |= 1 << c
                if self.keep:
                    vertex.number = n
                    self.by_number[n] = vertex
                self.counts_as_largest(n)
            self.cell.v[c] = vertex
        return following

    def remember(self, numbers, following, marks, h, by):
        d = self.distances[0]
        if self.reaches(d) and d + by <= self.kept:
            plain = self.past(d).marks
            moved = plain ^ self.past(by).marks ^ self.past(d + by).marks
            if plain != moved and marks in (plain, moved):
                self.marks_shift = int(marks == moved)
        strays = self.strays or self.likely()
        if self.following:
            for c in range(8):
                if strays >> c & 1:
                    step = (numbers[c] - self.last_stray) & MASK64
                    self.followers[self.place_of_follower(c)] = step
                    self.last_stray, self.stray_step = numbers[c], step
        if self.kept == self.room:
            if self.room == 0:
                self.room = 64
            elif self.room < min(max(4 * self.surface.live(), 2**14), 2**18):
                self.room *= 2
        past = self.ring[self.count] = Past()
        past.number, past.next, past.marks, past.guessed, past.beside = numbers, following, marks, h, by
        past.strays = strays
        self.count += 1
        if self.kept < self.room:
            self.kept += 1
        else:
            del self.ring[self.count - 1 - self.room]

    def attach(self, cell):
        """Nothing is put on the active surface."""

    def last_uses(self, cell):
        for c in range(8):
            if self.marks >> c & 1 and all(cell.v[c] is not earlier for earlier in cell.v[:c]):
                cell.last_use.append(c)

    def face_removed(self, face):
        pass

    def forget_vertex(self, vertex):
        if self.by_number.get(vertex.number) is vertex:
            del self.by_number[vertex.number]
