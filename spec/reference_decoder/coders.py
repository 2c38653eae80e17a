"""Sections 12 to 14 and 32: range coder, adaptive bits, models, mixing.

Models are made at their first use, since most never are: `Bits()[index]` is an adaptive bit, in its first
state. Decisions come from a *source*: a RangeDecoder, or a Mixer over one, which has the same methods.
"""

from bisect import bisect_right

from .basics import MASK32, MASK64, signed64

# ---------------------------------------------------------------------------- 13 Adaptive bit

RATE = [131072 // (2 * n + 3) for n in range(161)]


class Bit:
    """An adaptive bit; of a mixed bit (section 32) its history too."""

    __slots__ = ("p", "count", "history")

    def __init__(self):
        self.p, self.count, self.history = 2**21, 0, 1

    def probability_of_one(self):
        return max(1, self.p >> 6)

    def update(self, value, limit=160):
        target = 2**22 - 1 if value else 0
        self.p += ((target - self.p) * RATE[self.count]) >> 16
        if self.count < limit:
            self.count += 1


class Models(dict):
    """Models with an index: each is made, in its first state, at its first use."""

    def __init__(self, make):
        self.make = make

    def __missing__(self, index):
        model = self[index] = self.make()
        return model


def Bits():
    return Models(Bit)


# ---------------------------------------------------------------------------- 12 Range coder


class RangeDecoder:
    """Reads the decisions of one bitstream."""

    __slots__ = ("data", "at", "range", "code")

    def __init__(self, data):
        self.data, self.at = data, 0
        self.range, self.code = MASK32, 0
        for _ in range(4):
            self.code = self.code << 8 | self.next_byte()

    def next_byte(self):
        at = self.at
        self.at = at + 1
        return self.data[at] if at < len(self.data) else 0

    def normalize(self):
        while self.range < 2**24:
            self.range <<= 8
            self.code = (self.code << 8 | self.next_byte()) & MASK32

    def decide(self, odds):
        """A decision that is 1 with `odds` of 65536."""
        bound = (self.range >> 16) * odds
        if self.code < bound:
            value, self.range = 1, bound
        else:
            value = 0
            self.code -= bound
            self.range -= bound
        if self.range < 2**24:
            self.normalize()
        return value

    def bit(self, model):
        value = self.decide(model.p >> 6 or 1)
        model.update(value)
        return value

    def raw(self, count):
        value = 0
        while count > 16:
            count -= 16
            value = value << 16 | self.raw_part(16)
        return value << count | self.raw_part(count) if count else value

    def raw_part(self, count):
        self.range >>= count
        value = min(self.code // self.range, 2**count - 1)
        self.code = (self.code - value * self.range) & MASK32
        self.normalize()
        return value

    def about(self, question, *clues):
        """Only a Mixer wants to know."""


class SplitDecoder(RangeDecoder):
    """A split stream: decisions, then plain bits."""

    __slots__ = ("plain", "plain_at")

    def __init__(self, data):
        n, at = self._size(data)
        super().__init__(data[at : at + n])
        self.plain, self.plain_at = data[at + n :], 0

    @staticmethod
    def _size(data):
        n = 0
        for place, byte in enumerate(data[:10]):
            n |= (byte & 127) << (7 * place)
            if byte < 128:
                return (n, place + 1) if n <= MASK64 else (0, len(data))
        return 0, len(data)  # no good varint: zeros without end

    def raw(self, count):
        first, end = self.plain_at >> 3, (self.plain_at + count + 7) >> 3
        value = int.from_bytes(self.plain[first:end], "little") >> (self.plain_at & 7)
        self.plain_at += count
        return value & ((1 << count) - 1)


# ---------------------------------------------------------------------------- 14 Models


def tree(source, model, bits):
    node = 1
    for _ in range(bits):
        node = 2 * node + source.bit(model[node])
    return node - 2**bits


class Number:
    """A number model; a residual and a compact model differ in how the low bits are coded."""

    __slots__ = ("zero", "length", "first", "rest")

    def __init__(self):
        self.zero, self.length, self.first, self.rest = Bit(), Bits(), Bits(), Bits()

    def low_bits(self, source, k, left, result):
        while left > 0:
            left -= 1
            result = 2 * result + source.bit(self.rest[k - 1, left])
        return result


class Compact(Number):
    __slots__ = ()

    def low_bits(self, source, k, left, result):
        while left > 0:
            left -= 1
            result = 2 * result + source.bit(self.rest[left])
        return result


class Residual(Number):
    __slots__ = ()

    def low_bits(self, source, k, left, result):
        return result << left | source.raw(left)


def number(source, model):
    if source.bit(model.zero):
        return 0
    k = tree(source, model.length, 6) + 1
    result, left, node = 1, k - 1, 1
    for _ in range(2):
        if left > 0:
            left -= 1
            one = source.bit(model.first[k - 1, node])
            node = 2 * node + one
            result = 2 * result + one
    return model.low_bits(source, k, left, result)


class Signed:
    """A signed model over a model of its magnitude."""

    __slots__ = ("magnitude", "negative")

    def __init__(self, magnitude=Number):
        self.magnitude, self.negative = magnitude(), Bits()


def SignedCompact():
    return Signed(Compact)


def SignedResidual():
    return Signed(Residual)


def signed(source, model):
    size = number(source, model.magnitude)
    if size == 0:
        return 0
    if source.bit(model.negative[size.bit_length()]):
        return signed64(-size)
    return signed64(size)


class Near:
    __slots__ = ("same", "above", "higher", "lower")

    def __init__(self):
        self.same, self.above, self.higher, self.lower = Bit(), Bit(), Bits(), Bits()


def near(source, model, guess):
    if source.bit(model.same):
        return guess
    up = guess == 0 or (guess < 64 and source.bit(model.above))
    most = 64 - guess if up else guess
    ways = model.higher if up else model.lower
    by = 1
    while by < most and source.bit(ways[min(by - 1, 15)]):
        by += 1
    return guess + by if up else guess - by


def choice(source, model, n, count):
    """A choice model of n: `model` holds n adaptive bits."""
    for i in range(count - 1):
        if source.bit(model[min(i, n - 1)]):
            return i
    return count - 1


# ---------------------------------------------------------------------------- 32 Mixing


def mix_hash(h, x):
    y = ((h ^ x) * 0x9E3779B1) & MASK32
    return y ^ (y >> 15)


def clue(numbers):
    h = 0
    for x in numbers:
        h = mix_hash(h, (x + 1) & MASK32)
    return h


def _squash_table():
    table, e = [], 2**40
    for _ in range(2840):
        table.append(min(65535, (2**56 + ((2**40 + e) >> 1)) // (2**40 + e)))
        e = (16711808 * e) >> 24
    return table


SQUASH = _squash_table()
_stretched = {}


def squash(x):
    return SQUASH[x] if x >= 0 else 65536 - SQUASH[-x]


def stretch(p):
    x = _stretched.get(p)
    if x is None:
        q = min(p, 65536 - p)
        if q >= 2048:
            q &= ~15
        x = bisect_right(SQUASH, 65536 - q) - 1
        if p < 32768:
            x = -x
        _stretched[p] = x
    return x


class Mixing:
    """The tables of a mixer, which live as long as a segment."""

    def __init__(self):
        self.by_history = Bits()
        self.by_clue, self.check = Bits(), {}
        self.weights = Models(lambda: [[40960, 24576, 0, 24576, 24576, 24576, 24576, 24576], 0])

    def find(self, h):
        at, c = h >> 16, h & 255
        check = self.check
        if check.get(at, 0) == c:
            return self.by_clue[at]
        if check.get(at ^ 1, 0) == c:
            return self.by_clue[at ^ 1]
        if self.by_clue[at ^ 1].count < self.by_clue[at].count:
            at ^= 1
        check[at] = c
        bit = self.by_clue[at]
        bit.p, bit.count = 2**21, 0  # in place: a clue before this one may have found it
        return bit


class Mixer:
    """A source whose bits are mixed bits of the range decoder below."""

    __slots__ = ("tables", "below", "question", "clues", "path", "depth")

    def __init__(self, tables, below):
        self.tables, self.below = tables, below
        self.question, self.clues, self.path, self.depth = 0, (), 1, 0

    def about(self, question, *clues):
        self.question = question
        self.clues = [mix_hash(5 * question + i + 1, clue(c)) for i, c in enumerate(clues)]
        self.path, self.depth = 1, 0

    def raw(self, count):
        return self.below.raw(count)

    def bit(self, model):
        tables = self.tables
        by_history = tables.by_history[self.question, model.history]
        inputs = [stretch(model.p >> 6 or 1), stretch(by_history.p >> 6 or 1), 256]
        found = []
        for c in self.clues:  # in order: a later one may make afresh what this one has found
            found.append(tables.find(mix_hash(c, self.path)))
            inputs.append(stretch(found[-1].p >> 6 or 1))
        entry = tables.weights[self.question, min(self.depth, 3)]
        weights, n = entry
        total = 0
        for w, x in zip(weights, inputs):
            total += w * x
        p = squash(max(-2839, min(2839, total >> 16)))
        value = self.below.decide(p)
        step = ((65535 if value else 0) - p) * max(12, 2048 // (n + 16))
        entry[1] = min(n + 1, 159)
        for i, x in enumerate(inputs):
            weights[i] = max(-(2**20), min(2**20, weights[i] + ((x * step + 2**17) >> 18)))
        model.update(value)
        by_history.update(value)
        for bit in found:
            bit.update(value, 30)
        history = 2 * model.history + value
        model.history = history if history < 128 else (history & 63) + 64
        self.path = (2 * self.path + value) & MASK32
        self.depth += 1
        return value
