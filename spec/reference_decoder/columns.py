"""Sections 24 and 25: value columns, mixed columns; and what section 7 adds to them, references."""

import math
import struct
from bisect import bisect_left

from .basics import FLOAT32, MASK64, SCALAR_BYTES, Cursor, reject_unless, signed64, zstd_frame
from .coders import Bit, Bits, Compact, Mixer, Mixing, Models, Near, SignedCompact, SignedResidual, SplitDecoder
from .coders import near, signed, tree
from .domains import Domain, as_double
from .neighbourhoods import (BESIDE, BEYOND, CENTRE, DIAGONAL, FARTHER, FLAT, MIDPOINT, NEAR, OPPOSITE, SIMPLEX,
                             THIRD)

SHUFFLED_ZSTD, COLUMNS, MIXED_COLUMNS = 4, 9, 10
WITH_TABLES = 16  # components at most
MOST_CLASSES = 65535
MOST_IN_LIST = 32768
FARTHEST_COPY = 65536
PARTNER = 29  # a mode
_LATTICE_BITS = 0b1111111
_FACES = ((0, 1), (0, 2), (1, 2))  # axes of diagonal i


def columns_with_tables(schema):
    """Which static arrays have matches and mixed bits; geometry always has."""
    room, have = 64 - 3, set()
    for i, array in schema.static_arrays():
        if array.components <= WITH_TABLES and array.components <= room:
            room -= array.components
            have.add(i)
    return have


class ComponentModels(Models):
    """The models of a component: single bits by name, and those below."""

    def __init__(self):
        super().__init__(Bit)
        self.kind, self.known_entry, self.same_step = Bits(), Bits(), Bits()
        self.exponent, self.first_entry = SignedCompact(), SignedCompact()
        self.entries, self.step, self.skipped = Compact(), Compact(), Compact()
        self.mode, self.second_mode, self.weight = Bits(), Bits(), SignedCompact()
        self.takes_second, self.escape, self.negative = Bits(), Bits(), Bits()
        self.residual = Models(Near)
        self.is_recalled, self.rank, self.missed = Bits(), Models(Near), Near()
        self.mixed_residual = Models(SignedResidual)


class Class:
    """The choices of a class."""

    __slots__ = ("input", "mode", "second_mode", "weights")

    def __init__(self, like=None):
        self.input, self.mode, self.second_mode, self.weights = 0, 0, None, [0] * 13
        if like:
            self.input, self.mode, self.second_mode = like.input, like.mode, like.second_mode
            self.weights = list(like.weights)


class ValueList:
    """Magnitudes so far, ascending, each with a value."""

    def __init__(self):
        self.magnitudes, self.values = [], {}

    def add(self, magnitude, value):
        if magnitude not in self.values:
            if len(self.magnitudes) == MOST_IN_LIST:
                self.magnitudes, self.values = [], {}
            self.magnitudes.insert(self.rank(magnitude), magnitude)
        self.values[magnitude] = value

    def rank(self, magnitude):
        return bisect_left(self.magnitudes, magnitude) if magnitude == magnitude else len(self.magnitudes)

    def nearest(self, magnitude):
        """None where there is none; how near is a difference of bits."""
        at = self.rank(magnitude)
        around = self.magnitudes[max(at - 1, 0) : at + 1]
        return min(around, key=lambda m: abs(double_bits(m) - double_bits(magnitude)), default=None)


class Source:
    def __init__(self):
        self.here = self.there = None
        self.direction, self.trust = 1, 0


class Recalled(ValueList):
    """The list of recalled values: with the number of the last element of each, and the sources of classes."""

    def __init__(self):
        super().__init__()
        self.number, self.sources = [], {}

    def next_of(self, source):
        n = len(self.number)
        i = source.there + source.direction * (n - source.here)
        return self.number[i] if 0 <= i < n and n - i <= MOST_IN_LIST else None

    def start(self, class_, v):
        """A rank, and whether it is by a source."""
        source = self.sources.get(class_)
        if source and source.trust >= 2:
            following = self.next_of(source)
            if following is not None:
                return self.rank(following), 1
        return self.rank(abs(v)), 0

    def take(self, class_, k):
        magnitude = self.magnitudes[k]
        j, n = self.values[magnitude], len(self.number)
        source = self.sources.get(class_)
        if source:
            source.trust = min(source.trust + 1, 3) if self.next_of(source) == magnitude else max(source.trust - 1, 0)
            if abs(j - source.there) == n - source.here:
                source.direction = 1 if j - source.there == n - source.here else -1
        else:
            source = self.sources[class_] = Source()
        source.here, source.there = n, j

    def note(self, magnitude):
        self.add(magnitude, len(self.number))
        self.number.append(magnitude)


class ClassCopies:
    """Of a class how far back its copies stood, and how its last element was told."""

    __slots__ = ("last", "before_last", "told")

    def __init__(self):
        self.last = self.before_last = self.told = 0


class Copies:
    """Which elements are as an earlier one, since copies began."""

    def __init__(self, components):
        self.classes, self.told, self.count, self.following = Models(ClassCopies), 0, 0, 0
        self.again, self.copied, self.before, self.other = Bits(), Bits(), Bits(), SignedCompact()
        self.values = [[] for _ in range(components)]  # the bits of all elements

    def decode(self, source, number):
        """How far back the one stands that the next element is as; 0: its values are coded."""
        it = self.classes[number]
        model = it.told, self.told
        back = 0
        if it.last and source.bit(self.again[model]):
            back, told = it.last, 1
        elif source.bit(self.copied[model]):
            if it.before_last and source.bit(self.before[model]):
                back, told = it.before_last, 2
            else:
                back, told = self.count - signed64(self.following + signed(source, self.other)), 3
            reject_unless(0 < back <= min(FARTHEST_COPY, self.count), "a copy of no element")
            it.last, it.before_last = back, it.last
        else:
            told = 0
        it.told = self.told = told
        if back:
            self.following = self.count - back + 1
        self.count += 1
        return back


class Component:
    """What a column keeps of one component."""

    def __init__(self, domain):
        self.domain, self.models = domain, ComponentModels()
        self.state, self.third, self.size, self.second = {}, {}, {}, {}  # by slot
        self.reference_state, self.reference_third = {}, {}  # with references
        self.last = self.before_last = self.last_reference = self.before_last_reference = 0.0
        self.last_size = self.last_escape = self.last_negative = 0
        self.recalled, self.last_recalled, self.rank_length, self.missed_length = {}, 0, [0, 0], 0
        self.values_so_far, self.references_so_far = Recalled(), ValueList()
        self.classes, self.families = {}, {}
        self.matches, self.match_bits, self.values = [{}, {}, {}], 0, 0
        self.mixing = Mixing()

    def translate(self, old, new):
        """Section 23: the domain is another."""
        def translated(s):
            t = new.from_value(old.as_value(s))
            return t if math.isfinite(t) else 0.0
        for states in (self.state, self.reference_state):
            for slot in states:
                states[slot] = translated(states[slot])
        self.last, self.before_last = translated(self.last), translated(self.before_last)
        self.last_reference = translated(self.last_reference)
        self.before_last_reference = translated(self.before_last_reference)
        self.third.clear()
        self.reference_third.clear()

    def skip(self, slot):
        self.state[slot], self.third[slot] = self.last, 0.0
        self.size[slot] = self.second[slot] = self.recalled[slot] = 0
        self.reference_state[slot], self.reference_third[slot] = self.last_reference, 0.0


# ---------------------------------------------------------------------------- Predictors


def mean(values):
    total = 0.0
    for value in values:
        total += value
    return total / len(values) if len(values) in (2, 3) else total


class Around:
    """The states around one element, None where not known; and what mode makes of them."""

    __slots__ = ("kind", "x", "t", "last", "before_last", "_lattice", "all_lattice")

    def __init__(self, item, known, states, thirds, last, before_last):
        at = item.at
        self.kind, self.last, self.before_last = item.kind, last, before_last
        self.x = [states.get(at[i], 0.0) if known >> i & 1 else None for i in range(13)]
        self.t = [thirds.get(at[a], 0.0) if known >> (THIRD + a) & 1 else None for a in range(3)]
        self.all_lattice = known & _LATTICE_BITS == _LATTICE_BITS
        self._lattice = None

    @staticmethod
    def _less(values, others):
        return [None if a is None else a - b for a, b in zip(values, others)]

    def minus(self, reference):
        """The same of the differences from those of the reference."""
        other = Around.__new__(Around)
        other.kind, other.all_lattice, other._lattice = self.kind, self.all_lattice, None
        other.x, other.t = self._less(self.x, reference.x), self._less(self.t, reference.t)
        other.last, other.before_last = self.last - reference.last, self.before_last - reference.before_last
        return other

    def lines(self):
        return [2.0 * self.x[a] - self.x[BEYOND + a] for a in range(3)
                if self.x[a] is not None and self.x[BEYOND + a] is not None]

    def face(self, i):
        x, (a, b) = self.x, _FACES[i]
        if x[a] is None or x[b] is None or x[DIAGONAL + i] is None:
            return None
        return (x[a] + x[b]) - x[DIAGONAL + i]

    def faces(self):
        return [f for f in (self.face(0), self.face(1), self.face(2)) if f is not None]

    def nears(self):
        return [n for n in self.x[:3] if n is not None]

    def lattice(self):
        if self._lattice is None:
            self._lattice = self._find_lattice()
        return self._lattice

    def _find_lattice(self):
        x, kind = self.x, self.kind
        if kind == MIDPOINT:
            return (x[3] + x[4]) * 0.5
        if kind == CENTRE:
            return ((x[3] + x[5]) + (x[4] + x[6])) * 0.5 - ((x[7] + x[9]) + (x[8] + x[10])) * 0.25
        if kind in (SIMPLEX, BESIDE):
            nears = self.nears()
            m = mean(nears) if nears else self.last
            if kind == BESIDE:
                return m
            if x[OPPOSITE] is not None:
                return m + (m - x[OPPOSITE]) * 0.5
            beyond = [b for b in x[BEYOND:FARTHER] if b is not None]
            return m + (m - mean(beyond)) * 0.5 if beyond else m
        if self.all_lattice:
            return ((x[0] + x[1] + x[2]) - (x[3] + x[4] + x[5])) + x[6]
        faces = self.faces()
        if faces:
            return mean(faces)
        lines = self.lines()
        if lines:
            return mean(lines)
        nears = self.nears()
        return nears[0] if nears else self.last

    def predict(self, mode, weights, others):
        """`others`: what modes 22 to 26 give."""
        x, t = self.x, self.t
        if mode == 0:
            return self.lattice()
        if mode <= 3:
            return x[mode - 1] if x[mode - 1] is not None else self.lattice()
        if mode <= 9:
            a = (mode - 4) % 3
            n, b, f = x[NEAR + a], x[BEYOND + a], x[FARTHER + a]
            if n is None or b is None:
                return self.lattice()
            return 3.0 * (n - b) + f if mode >= 7 and f is not None else 2.0 * n - b
        if mode <= 12:
            face = self.face(mode - 10)
            return face if face is not None else self.lattice()
        if mode <= 15:
            third = t[mode - 13]
            return self.lattice() + third if third is not None else self.lattice()
        if mode == 16:
            return self.lattice() + mean([third for third in t if third is not None])
        if mode == 17:
            nears = self.nears()
            return mean(nears) if nears else self.last
        if mode == 18:
            lines = self.lines()
            return mean(lines) if lines else self.lattice()
        if mode == 19:
            if self.kind in (MIDPOINT, CENTRE):
                if None in t:
                    return self.lattice()
                return self.lattice() + ((t[0] + t[1]) - t[2])
            faces = self.faces()
            return mean(faces) if faces else self.lattice()
        if mode == 20:
            return self.last
        if mode == 21:
            return 2.0 * self.last - self.before_last
        if mode <= 26 or mode == PARTNER:
            return others(mode)
        if mode == 27:
            return self._fitted(weights)
        return 0.0

    def _fitted(self, weights):
        base, x = self.lattice(), self.x
        total = 0.0
        for i, weight in enumerate(weights):
            if weight == 0:
                continue
            if i < 3:
                y = self.t[i] if self.t[i] is not None else 0.0
            else:
                place = (BEYOND, DIAGONAL, NEAR, OPPOSITE)[i // 3 - 1] + i % 3
                y = x[place] - base if x[place] is not None else 0.0
                if i == 12 and self.all_lattice:
                    y = 0.0
            total += (weight / 36864.0) * y
        return base + total


def double_bits(x):
    return struct.unpack("<Q", struct.pack("<d", x))[0]


def size_class(m):
    return m if m <= 12 else min(12 + (m - 9) // 4, 26)


def towards(w):
    w = signed64(w)
    return 2 * abs(w).bit_length() + (w < 0)


class Column:
    """One column, as long as it goes on: for a segment, or for the chunks of a step."""

    def __init__(self, array, with_tables, earlier_values, referring=False, copies=False):
        self.array, self.with_tables, self.referring = array, with_tables, referring
        self.may_copy = with_tables and earlier_values and copies and array.components > 1 \
            and array.quantization.bits == 0
        self.copies_model, self.copies = Bit(), None
        self.earlier_values = with_tables and earlier_values  # may be recalled, and have partners
        self.last_mode = PARTNER if self.earlier_values else PARTNER - 1
        self.type, self.width = array.type, SCALAR_BYTES[array.type]
        self.reach_models, self.matches_model = Bits(), Bit()
        self.sources_model, self.source_models = Bit(), Bits()
        self.components = [Component(Domain(array.type, array.quantization, c)) for c in range(array.components)]
        self.keys, self.families = {}, []  # the number of each key; of each number the family

    # ------------------------------------------------------------------ A group

    def decode(self, data, codec, tiles, decoded_bytes, references=None):
        """The bits of all values, element by element, for each tile. A tile is a pair of lists of neighbourhoods:
        elements, and what is skipped. `references`: the bits of each value's, in the order of the group."""
        self.source, self.mixed = SplitDecoder(data), codec == MIXED_COLUMNS
        self.reach = min(tree(self.source, self.reach_models, 2), 2)
        self.matching = bool(self.source.bit(self.matches_model)) and self.with_tables
        copying = self.may_copy and self.source.bit(self.copies_model)
        self.copies = (self.copies or Copies(len(self.components))) if copying else None
        self._read_sources()
        most_entries = decoded_bytes // self.array.element_bytes()
        domains = []
        for component in self.components:
            component.domain.read(self.source, component.models, domains, most_entries, self.earlier_values,
                                  component.translate)
            domains.append(component.domain)
        found, first = [], 0
        for elements, skipped in tiles:
            found.append(self._tile(elements, skipped, references, first))
            first += len(elements)
        return found

    def _read_sources(self):
        """The component whose values modes 25 and 26 take."""
        count = len(self.components)
        self.sources = [c - 1 for c in range(count)]
        if self.earlier_values and count >= 4 and self.source.bit(self.sources_model):
            for c in range(2, count):
                self.sources[c] = tree(self.source, self.source_models, 4)
                reject_unless(self.sources[c] < c, "a source that is no earlier component")

    def _tile(self, elements, skipped, references, first):
        count = len(self.components)
        for item in skipped:
            for component in self.components:
                component.skip(item.slot)
        values = [0] * (len(elements) * count)
        numbers = [self._number(item) for item in elements]
        backs = [self.copies.decode(self.source, number) if self.copies else 0 for number in numbers]
        self.before = []  # of each component: (value, size) of each element of this tile
        for c, component in enumerate(self.components):
            self.c, self.component = c, component
            self.families_before = dict(component.families)
            self.decoded = set()
            if self.matching:
                component.values += len(elements)
                n = max(8, min((8 * component.values).bit_length(), 15))
                if n != component.match_bits:
                    component.match_bits, component.matches = n, [{}, {}, {}]
            mixer = Mixer(component.mixing, self.source)
            kept = []
            for e, item in enumerate(elements):
                reference = references[(first + e) * count + c] if references is not None else None
                if backs[e]:
                    value = self._copy(item, numbers[e], e, self.copies.values[c][-backs[e]], kept)
                else:
                    value = self._element(item, numbers[e], e, reference, mixer, kept)
                values[e * count + c] = value
                if self.copies:
                    self.copies.values[c].append(value)
            self.before.append(kept)
        return values

    # ------------------------------------------------------------------ Classes

    def _known(self, item):
        """What is known of an element that counts."""
        known = item.known
        if item.kind not in (MIDPOINT, CENTRE):
            if self.reach < 2:
                known &= ~0b1110000000000
            if self.reach < 1:
                known &= ~0b0001110000000
        return known

    def _number(self, item):
        """Of the class of an element."""
        known = self._known(item)
        key = (item.kind, item.corner, known & 0b1110001111111111)
        number = self.keys.get(key)
        if number is None:
            number = self.keys[key] = min(len(self.keys), MOST_CLASSES - 1)
            if number == len(self.families):
                self.families.append((item.kind, item.corner, known & _LATTICE_BITS))
        return number

    def _class_as_it_is(self, key):
        classes = self.component.classes
        if key not in classes:
            classes[key] = Class(self.families_before.get(self.families[key]))
        return classes[key]

    def _class(self, key):
        """`key`: the number of the class."""
        component, models, source = self.component, self.component.models, self.source
        family = self.families[key]
        chosen = self._class_as_it_is(key)
        if key in self.decoded:
            return chosen
        self.decoded.add(key)
        if self.referring and not source.bit(models["same_input"]):
            chosen.input = 1 - chosen.input
        if not source.bit(models["same_mode"]):
            chosen.mode = min(tree(source, models.mode, 5), self.last_mode)
        if not source.bit(models["same_second"]):
            second = tree(source, models.second_mode, 5)
            chosen.second_mode = second if second <= self.last_mode else None
        if 27 in (chosen.mode, chosen.second_mode) and not source.bit(models["same_weights"]):
            if source.bit(models["family_weights"]):
                like = component.families.get(family)
                chosen.weights = list(like.weights) if like else [0] * 13
            else:
                for i in range(13):
                    weight = signed64(chosen.weights[i] + signed(source, models.weight))
                    chosen.weights[i] = max(-589823, min(589823, weight))
        component.families[family] = Class(chosen)
        return chosen

    # ------------------------------------------------------------------ Matches

    def _match_places(self, item, known, around, e):
        """Of each match: the place in its table, and whether the sign of its key is -."""
        keys = [around.nears(), [around.last, around.before_last], []]
        for back in (1, 2):
            if self.c >= back:
                keys[2].append(self.before[self.c - back][e][0])
        found = []
        for key in keys:
            total = 0
            for x in key:
                h = ((((double_bits(x) & (2**63 - 1)) + 2**11) >> 12) * 0x9E3779B97F4A7C15) & MASK64
                total += (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9
            place = ((total * 0xBF58476D1CE4E5B9) & MASK64) >> (64 - self.component.match_bits)
            found.append((place, bool(key) and key[0] < 0))
        return found

    # ------------------------------------------------------------------ An element

    def _element(self, item, number, e, reference, mixer, kept):
        component, source, c = self.component, self.source, self.c
        domain, models, slot = component.domain, component.models, item.slot
        known = self._known(item)
        chosen = self._class(number)

        around = Around(item, known, component.state, component.third, component.last, component.before_last)
        then, of_reference = 0.0, None
        if self.referring:
            then = domain.from_value(as_double(self.type, reference))
            if not math.isfinite(then):
                then = component.last_reference
            of_reference = Around(item, known, component.reference_state, component.reference_third,
                                  component.last_reference, component.before_last_reference)
        x = as_double(self.type, reference) if self.referring else math.nan
        may_have_partner = domain.partners and math.isfinite(x)
        partner = self._partner(x) if may_have_partner else None
        mode, second_mode = chosen.mode, chosen.second_mode
        if partner is None:
            second_mode = None if second_mode == PARTNER else second_mode
            if mode == PARTNER:
                mode, second_mode = second_mode or 0, None
        differs = chosen.input == 1
        used = around.minus(of_reference) if differs else around
        places = self._match_places(item, known, around, e) if self.matching else None

        def others(mode):
            if mode == PARTNER:
                return partner[0] - partner[1] if differs else partner[0]
            if not self.matching or (mode >= 25 and c == 0):
                p = 0.0
            elif mode <= 24:
                place, negative = places[mode - 22]
                value, was_negative = component.matches[mode - 22].get(place, (0.0, False))
                p = domain.from_value(value if negative == was_negative else -value)
            else:
                p = domain.from_value(self.before[self.sources[c]][e][0])
            if differs:
                p -= then
            return -p if mode == 26 else p

        def predict(mode):
            p = used.predict(mode, chosen.weights, others)
            return then + p if differs else p

        def substitute():
            s = domain.state(domain.index(around.lattice()))
            return s if math.isfinite(s) else 0.0

        size = second = escape = recalled = 0
        if domain.escapes:
            escape = component.last_escape = source.bit(models.escape[component.last_escape])
        if escape:
            if self.referring and source.bit(models["same_escape"]):
                value = reference
            else:
                value = source.raw(8 * self.width)
            state = substitute()
        else:
            near_slots = [item.at[a] for a in range(3) if known >> a & 1]
            p = predict(mode)
            index, not_taken = domain.index(p), second_mode
            if second_mode is not None:
                q = predict(second_mode)
                if domain.index(q) != index:
                    seconds = sum(component.second.get(s, 0) for s in near_slots)
                    second = source.bit(models.takes_second[number, seconds])
                    if second:
                        p, index, not_taken = q, domain.index(q), mode
            r, m = 0, 0
            scale = domain.scale(p)
            relative = lambda s: 0 if s == 0 else max(1, min(s - scale, 64))
            sizes = [relative(component.size.get(s, 0)) for s in near_slots]
            m = (sum(sizes) + len(sizes) // 2) // len(sizes) if sizes else \
                relative(component.last_size)
            other = 0 if c == 0 else 1 if self.before[c - 1][e][1] == 0 else 2
            context = size_class(m), other, second
            may_recall = domain.recalls and not domain.table
            if may_recall and component.values_so_far.magnitudes:
                near_ones = sum(component.recalled.get(s, 0) for s in near_slots)
                start, by_source = component.values_so_far.start(number, domain.as_value(p))
                recalled = source.bit(models.is_recalled[by_source, component.last_recalled, near_ones])
                component.last_recalled = recalled
            if recalled:
                r = signed64(self._recalled_index(start, by_source, number, domain.as_value(p) < 0) - index)
            elif self.mixed:
                self._about(mixer, item, known, number, e, index, second, relative, used, predict, not_taken)
                r = signed(mixer, models.mixed_residual[context])
            else:
                r = self._residual(models.residual[context], m)
            index = signed64(index + r)
            if r:
                size = abs(r).bit_length() + scale
            d = index
            if domain.table:
                reject_unless(0 <= index < len(domain.table), "a rank beyond its table")
                d = domain.table[index]
            value = None
            if domain.negative_zero and d == 0:
                component.last_negative = source.bit(models.negative[component.last_negative])
                if component.last_negative:
                    value = domain.minus_zero()
            if value is None:
                value = domain.value(d)
            state = domain.state(index)
            if not math.isfinite(state):
                state = substitute()
            if may_recall:
                component.values_so_far.note(abs(domain.as_value(state)))

        has_third = self._has_third(item, known)
        component.state[slot] = state
        component.third[slot] = state - around.lattice() if has_third else 0.0
        component.size[slot], component.second[slot], component.recalled[slot] = size, second, recalled
        component.last_size = size
        component.before_last, component.last = component.last, state
        if self.referring:
            component.reference_state[slot] = then
            component.reference_third[slot] = then - of_reference.lattice() if has_third else 0.0
            component.before_last_reference, component.last_reference = component.last_reference, then
        stood = domain.as_value(state)
        if may_have_partner:
            component.references_so_far.add(abs(x), -stood if x < 0 else stood)
        if places:
            for table, (place, negative) in zip(component.matches, places):
                table[place] = (stood, negative)
        kept.append((stood, size))
        return value

    @staticmethod
    def _has_third(item, known):
        wanted = {FLAT: 0b1011, SIMPLEX: 0b1000000}.get(item.kind, _LATTICE_BITS)
        return item.kind in (MIDPOINT, CENTRE) or known & wanted == wanted

    def _copy(self, item, number, e, value, kept):
        """An element that is as an earlier one: nothing of it is coded."""
        component, domain, slot = self.component, self.component.domain, item.slot
        self._class_as_it_is(number)
        known = self._known(item)
        around = Around(item, known, component.state, component.third, component.last, component.before_last)
        places = self._match_places(item, known, around, e) if self.matching else []
        state = domain.from_value(as_double(self.type, value))
        if not math.isfinite(state):
            state = domain.state(domain.index(around.lattice()))
        if not math.isfinite(state):
            state = 0.0
        component.state[slot] = state
        component.third[slot] = state - around.lattice() if self._has_third(item, known) else 0.0
        component.size[slot], component.second[slot], component.recalled[slot] = component.last_size, 0, 0
        component.before_last, component.last = component.last, state
        stood = domain.as_value(state)
        for table, (place, negative) in zip(component.matches, places):
            table[place] = (stood, negative)
        kept.append((stood, component.last_size))
        return value

    def _partner(self, x):
        """P and T of an element that refers to x; None: it has no partner."""
        references, domain = self.component.references_so_far, self.component.domain
        near_one = references.nearest(abs(x))
        most = 2 ** (37 if self.type == FLOAT32 else 24)
        if near_one is None or abs(double_bits(near_one) - double_bits(abs(x))) > most:
            return None
        found = []
        for value in (references.values[near_one], near_one):
            state = domain.from_value(-value if x < 0 else value)
            found.append(state if math.isfinite(state) else 0.0)
        return found

    def _recalled_index(self, start, by_source, class_, negative):
        component, models, domain = self.component, self.component.models, self.component.domain
        so_far = component.values_so_far
        by, component.rank_length[by_source] = self._signed_length(models.rank[by_source],
                                                                   component.rank_length[by_source])
        rank = signed64(start + by)
        reject_unless(0 <= rank < len(so_far.magnitudes), "a value recalled that is none")
        so_far.take(class_, rank)
        magnitude = so_far.magnitudes[rank]
        base = domain.index(domain.from_value(-magnitude if negative else magnitude))
        missed, component.missed_length = self._signed_length(models.missed, component.missed_length)
        return signed64(base + missed)

    def _signed_length(self, model, length):
        number = self._residual(model, length)
        return number, 64 if number == -(2**63) else abs(number).bit_length()

    def _residual(self, model, m):
        k = near(self.source, model, m)
        if k == 0:
            return 0
        x = self.source.raw(k)
        half = 1 << (k - 1)
        size = half + x % half
        return signed64(-size if x & half else size)

    # ------------------------------------------------------------------ 25 Mixed columns

    def _about(self, mixer, item, known, class_, e, index, second, relative, used, predict, not_taken):
        component, c, domain = self.component, self.c, self.component.domain
        near_ = [relative(component.size.get(item.at[a], 0)) + 1 if known >> a & 1 else 0 for a in range(3)]
        before = relative(self.before[c - 1][e][1]) + 1 if c >= 1 else 0
        first = relative(self.before[c - 2][e][1]) + 1 if c >= 2 else 0
        last = relative(component.last_size)
        deviations = [towards(domain.index(predict(mode)) - index)
                      for mode in (0, 17 if not_taken is None else not_taken, 18)]
        mixer.about(0, (near_[0] + near_[1] + near_[2], before, second), tuple(near_), (class_, last, second),
                    (deviations[0], deviations[1]), (before, first, deviations[2]))

    # ------------------------------------------------------------------ Values in shuffled_zstd

    def note(self, tiles, values):
        self.copies = None
        """What a column keeps of a group in another codec; `values`: of each tile."""
        count = len(self.components)
        for (elements, skipped), bits in zip(tiles, values):
            for c, component in enumerate(self.components):
                domain, at = component.domain, c
                for item in skipped:
                    component.skip(item.slot)
                for item in elements:
                    component.skip(item.slot)
                    s = domain.from_value(as_double(self.type, bits[at]))
                    at += count
                    if math.isfinite(s):
                        component.state[item.slot] = s
                    component.reference_state[item.slot] = component.state[item.slot]
                    component.before_last, component.last = component.last, component.state[item.slot]
                    component.before_last_reference, component.last_reference = component.last_reference, component.last
                    component.last_size = 0


def shuffled_values(data, array, elements, most_bytes=None):
    """Codec 4: the bits of all scalars, in order. Of groups there may be more than `elements`, up to `most_bytes`."""
    cursor = Cursor(data)
    size, width = cursor.varint(), SCALAR_BYTES[array.type]
    least = elements * array.element_bytes()
    reject_unless(size % array.element_bytes() == 0 and size >= least, "values of another size than there are elements")
    reject_unless(size <= (least if most_bytes is None else most_bytes), "more values than there are elements")
    planes = zstd_frame(cursor.rest(), size)
    count = size // width
    values = [0] * (elements * array.components)
    for byte in range(width):
        plane = planes[byte * count : byte * count + len(values)]
        if byte == 0:
            values = list(plane)
        else:
            shift = 8 * byte
            values = [value | b << shift for value, b in zip(values, plane)]
    return values
