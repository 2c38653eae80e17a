"""Section 47: weighted values."""

from .basics import SCALAR_BYTES, Cursor, reject_unless, signed64
from .domains import INTEGERS, QUANTIZED, Domain, as_double
from .shifts import COPY, domain_of_differences

WEIGHTED = 16
TERMS, NEIGHBOURS = 16, 13
UNIT, MOST_WEIGHT = 4096, 65535
HISTORY, EARLIER, NEAR = 32, 7, 3
HISTORY_UNIT, MOST_HISTORY = 2**20, 2**26
MATCHED, LENGTHS = 65, 66
SOME_ZERO, ALL_ZERO, NEAR_MATCHED, CONTEXTS = 65, 130, 131, 132
SCALE_BITS, LOW = 12, 2**31
ZERO_SIZE, MATCHED_SIZE = "zero", "matched"
LATTICE = 0b1111111
FACES = ((0, 1), (0, 2), (1, 2))
NO_AXIS = 3


def is_finite(number):
    return -1.7976931348623157e308 <= number <= 1.7976931348623157e308


class Weights:
    def __init__(self, known, scale, terms):
        """`terms`: (term, weight) in ascending order."""
        self.base = next((k for k in range(TERMS) if known >> k & 1), None)
        self.scale, self.terms = scale, [(k, w) for k, w in terms if k != self.base and w]


def usual(known):
    weights = [0.0] * TERMS
    if known & LATTICE == LATTICE:
        weights[:7] = 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0
        return Weights(known, 1.0, enumerate(weights))
    rules = 0
    for i, (a, b) in enumerate(FACES):
        if known >> a & known >> b & known >> (3 + i) & 1:
            rules += 1
            weights[a] += 1
            weights[b] += 1
            weights[3 + i] -= 1
    if not rules:
        for k in range(3 if known & 7 else NEIGHBOURS):
            if known >> k & 1:
                rules += 1
                weights[k] = 1.0
    return Weights(known, 1.0, [(k, w / rules if rules > 1 else w) for k, w in enumerate(weights)])


class Space:
    """Converts between indices and states; the state of an index is a value."""

    def __init__(self, domain):
        self.domain, self.linear = domain, domain.is_linear()
        self.minimum, self.down = 0.0, 1.0
        if domain.kind == QUANTIZED and domain.spacing:
            pass  # the state of an index is the index
        elif domain.kind == QUANTIZED:
            self.minimum, self.down = domain.minimum, domain.step
        elif self.linear and domain.kind != INTEGERS:
            self.down = domain.number_of(1)
        self.up = 1 / self.down

    def index(self, p):
        return self.domain.plain_index((p - self.minimum) * self.up if self.linear else p)

    def state(self, index):
        return self.minimum + float(index) * self.down if self.linear else self.domain.plain_state(index)

    def scale(self, p):
        return self.domain.scale(p)

    def negated(self, index):
        return signed64(-index if self.linear else ~index)


class Lengths:
    """The coded lengths of residuals."""

    def __init__(self, cursor):
        self.tables, self.map = [], []
        count = cursor.varint()
        reject_unless(1 <= count <= CONTEXTS, "no tables, or too many")
        for t in range(count):
            end = len(self.map) + cursor.u8() if t + 1 < count else CONTEXTS
            reject_unless(len(self.map) < end <= CONTEXTS, "a table of no contexts")
            self.map += [t] * (end - len(self.map))
            low, high = cursor.u8(), cursor.u8()
            reject_unless(low <= high < LENGTHS, "a table of no lengths")
            table, first = [], 0  # (length, first, frequency)
            for length in range(low, high + 1):
                left = 2**SCALE_BITS - first
                frequency = cursor.varint() if length < high else left
                reject_unless(frequency <= left, "frequencies that are too large")
                table.append((length, first, frequency))
                first += frequency
            reject_unless(frequency > 0, "a last frequency of 0")
            self.tables.append(table)
        words = cursor.varint()
        self.state = int.from_bytes(cursor.take(8), "little")
        reject_unless(LOW <= self.state < 2**63, "a state that cannot be")
        reject_unless(words <= cursor.left() // 4, "more words than there are")
        self.words = Cursor(cursor.take(4 * words))

    def next(self, context):
        slot = self.state & (2**SCALE_BITS - 1)
        length, first, frequency = next(
            entry for entry in self.tables[self.map[context]] if entry[1] <= slot < entry[1] + entry[2])
        self.state = frequency * (self.state >> SCALE_BITS) + slot - first
        if self.state < LOW:
            self.state = self.state << 32 | self.words.u32()
        return length

    def end(self):
        reject_unless(self.state == LOW and not self.words.left(), "lengths that do not end as they must")


class LowBits:
    def __init__(self, data):
        self.bits, self.count = int.from_bytes(data, "little"), 8 * len(data)

    def get(self, count):
        reject_unless(count <= self.count, "too few low bits")
        value = self.bits & ((1 << count) - 1)
        self.bits >>= count
        self.count -= count
        return value

    def end(self):
        reject_unless(self.count < 8 and not self.bits, "low bits after the last value")


class Matches:
    def __init__(self, axis, count, space):
        self.axis, self.space, self.table = axis, space, {}
        self.bits = max(8, min((2 * count).bit_length(), 17))

    def find(self, item, slots):
        self.place = None
        if self.axis == NO_AXIS or not item.known >> self.axis & 1:
            return 0
        near = slots[item.at[self.axis]].index
        self.negative = near < 0
        key = self.space.negated(near) if self.negative else near
        self.place = (key * 0x9E3779B97F4A7C15 & (2**64 - 1)) >> (64 - self.bits)
        found = self.table.get(self.place, 0)
        return self.space.negated(found) if self.negative else found

    def note(self, index):
        if self.place is not None:
            self.table[self.place] = self.space.negated(index) if self.negative else index


class Slot:
    def __init__(self, state=0.0, third=0.0, index=0, size=0):
        self.state, self.third, self.index, self.size = state, third, index, size


class Slots(dict):
    def __missing__(self, key):
        return Slot()


class Weighted:
    """The data of an array that is kept from part to part: for a segment of a step."""

    def __init__(self, array):
        self.array, self.width = array, SCALAR_BYTES[array.type]
        self.slots = [Slots() for _ in range(array.components)]
        self.last = [Slot() for _ in range(array.components)]

    def decode(self, data, tiles, references, last=None):
        """`references`: the bits of the reference of each value. `last`: those of the step before, if the references
        are the trend."""
        cursor = Cursor(data)
        elements = [item for covered, _ in tiles for item in covered]
        reject_unless(cursor.varint() == len(elements), "values of another number of elements")
        keys, classes = {}, []  # number of each class; its known neighbours
        for item in elements:
            key = (item.kind, item.known)
            if key not in keys:
                keys[key] = len(classes)
                classes.append(item.known)
        self.numbers = [keys[item.kind, item.known] for item in elements]
        values = [0] * (len(elements) * self.array.components)
        for c in range(self.array.components):
            head = cursor.u8()
            if head == COPY:
                source = cursor.varint()
                reject_unless(source < c, "a copy of no earlier component")
                values[c :: self.array.components] = values[source :: self.array.components]
                self._copy(source, c, tiles)
                continue
            of_component = [bits and bits[c :: self.array.components] for bits in (references, last)]
            values[c :: self.array.components] = self._component(cursor, head, c, tiles, classes, *of_component)
        cursor.end()
        return values

    def _copy(self, source, c, tiles):
        for covered, skipped in tiles:
            for item in (*skipped, *covered):
                self.slots[c][item.slot] = self.slots[source][item.slot]
        self.last[c] = self.last[source]

    def _component(self, cursor, head, c, tiles, classes, references, last):
        count = len(self.numbers)
        reject_unless(head < 2 * HISTORY, "a head that cannot be")
        axis = head >> 3 & 3
        domain = domain_of_differences(self.array, c, head & 7, cursor.svarint())
        space = Space(domain)
        references = self._states(references, domain)
        if head & HISTORY:
            reject_unless(references is not None, "a history without references")
            references = self._history(cursor, tiles, references, self._states(last, domain))
        exceptions = self._exceptions(cursor, count)
        weights = self._weights(cursor, classes, references is not None)
        lengths = Lengths(cursor)
        low_bits = LowBits(cursor.take(cursor.varint()))
        matches = Matches(axis, count, space)
        slots, values, e = self.slots[c], [], 0
        for covered, skipped in tiles:
            for item in skipped:
                slots[item.slot] = self.last[c]
            for item in covered:
                reference = 0.0 if references is None else references[e]
                prediction = reference + self._predict(weights[self.numbers[e]], item, slots, self.last[c])
                predicted, scale = space.index(prediction), space.scale(prediction)
                match, size = matches.find(item, slots), ZERO_SIZE
                if e in exceptions:
                    index = predicted
                else:
                    length = lengths.next(self._context(item, slots, self.last[c], scale))
                    if length == MATCHED:
                        reject_unless(axis != NO_AXIS, "a matched value without axis")
                        index, size = match, MATCHED_SIZE
                    else:
                        residual = 0
                        if length:
                            low = low_bits.get(length)
                            residual = 1 << (length - 1) | low >> 1
                            residual = -residual if low & 1 else residual
                            size = length + scale
                        index = signed64(predicted + residual)
                matches.note(index)
                values.append(exceptions[e] if e in exceptions else domain.value(index))
                self.last[c] = self._slot(item, slots, space.state(index) - reference, index, size)
                slots[item.slot] = self.last[c]
                e += 1
        lengths.end()
        low_bits.end()
        return values

    def _states(self, values, domain):
        """Values of another step, as numbers; `values` may be None."""
        if values is None:
            return None
        states = [as_double(self.array.type, bits) for bits in values]
        states = [state if is_finite(state) else 0.0 for state in states]
        if domain.kind == QUANTIZED and domain.spacing:
            return [domain.from_value(state) for state in states]
        return states

    @staticmethod
    def _history(cursor, tiles, references, last):
        """Predictions from the values around each element at earlier steps."""
        neighbours, of_slot = [], {}
        for covered, skipped in tiles:
            for item in skipped:
                of_slot.pop(item.slot, None)
            for item in covered:
                e = len(neighbours)
                found = [of_slot.get(item.at[k]) if item.known >> k & 1 else None for k in range(EARLIER)]
                neighbours.append(found + [None] * NEAR)
                for k in range(NEAR):
                    if found[k] is not None:
                        neighbours[found[k]][EARLIER + k] = e
                of_slot[item.slot] = e

        def around(values, e):
            return [0.0 if n is None else values[n] - values[e] for n in neighbours[e]]

        from_, changes = (references, None) if last is None else (last, [x - y for x, y in zip(references, last)])
        weights = []
        for _ in range(EARLIER + NEAR if changes is None else 2 * (EARLIER + NEAR) + 1):
            number = cursor.svarint()
            reject_unless(abs(number) <= MOST_HISTORY, "a weight that is too large")
            weights.append(number / HISTORY_UNIT)
        predicted = []
        for e, start in enumerate(from_):
            terms = around(from_, e) + ([] if changes is None else [changes[e], *around(changes, e)])
            total = start
            for weight, term in zip(weights, terms):
                total += weight * term
            predicted.append(total if is_finite(total) else start)
        return predicted

    def _exceptions(self, cursor, count):
        exceptions, position = {}, 0
        for _ in range(cursor.varint()):
            position += cursor.varint()
            reject_unless(position < count, "an exception after the last element")
            exceptions[position] = int.from_bytes(cursor.take(self.width), "little")
            position += 1
        return exceptions

    @staticmethod
    def _weights(cursor, classes, has_references):
        head = cursor.varint()
        zero = [Weights(known, 0.0, ()) for known in classes]
        common = [usual(known) for known in classes]
        weights, others = (zero, common) if head & 1 else (common, zero)
        weights = list(weights)

        def weight():
            number = cursor.svarint()
            reject_unless(abs(number) <= MOST_WEIGHT, "a weight that is too large")
            return number / UNIT

        n = 0
        for _ in range(head >> 1):
            entry = cursor.varint()
            n += entry >> 1
            reject_unless(n < len(classes), "weights of no class")
            if entry & 1:
                scale = weight() if has_references else 1.0
                base = weights[n].base
                weights[n] = Weights(classes[n], scale, [(k, weight()) for k in range(TERMS)
                                                         if classes[n] >> k & 1 and k != base])
            else:
                weights[n] = others[n]
            n += 1
        return weights

    @staticmethod
    def _predict(weights, item, slots, last):
        base = last.state if weights.base is None else slots[item.at[weights.base]].state
        total = weights.scale * base
        for k, weight in weights.terms:
            if k < NEIGHBOURS:
                total += weight * (slots[item.at[k]].state - base)
            else:
                total += weight * slots[item.at[k - NEIGHBOURS]].third
        return total

    @staticmethod
    def _context(item, slots, last, scale):
        sizes = [slots[item.at[a]].size for a in range(3) if item.known >> a & 1] or [last.size]
        if MATCHED_SIZE in sizes:
            return NEAR_MATCHED
        numbers = [size for size in sizes if size != ZERO_SIZE]
        if not numbers:
            return ALL_ZERO
        level = max(0, min(sum(numbers) // len(numbers) - scale, 64))
        return level + (SOME_ZERO if len(numbers) < len(sizes) else 0)

    @staticmethod
    def _slot(item, slots, state, index, size):
        third = 0.0
        if item.known & LATTICE == LATTICE:
            s = [slots[item.at[k]].state for k in range(7)]
            third = state - (((s[0] + s[1] + s[2]) - (s[3] + s[4] + s[5])) + s[6])
        return Slot(state, third, index, size)
