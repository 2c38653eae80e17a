"""Section 45: bundles."""

import math

from .basics import SCALAR_BYTES, Cursor, reject_unless, signed64, unzigzag
from .domains import BINARY, DECIMAL, FLOATS, NARROW, as_double, bits_of
from .patterns import plane
from .shifts import domain_of_differences, signed_of, widest_residual

BUNDLE = 15
MOST_COLUMNS = MOST_VALUES = MOST_PAIRS = 2**15
MOST_HEAD_BYTES = 24  # of a column
ZERO, CONSTANT, COPY, CODED = range(4)
FULL, FIXED, UNIFORM = range(3)
WORDS, NOTHING, STEP, STEPS, ELEMENT, BOTH = range(6)


def times(type_, bits, factor):
    value = as_double(type_, bits)
    return bits if value != value else bits_of(type_, value * factor)


class BundleColumn:
    """The values of one component of an array."""

    def __init__(self, array, component, elements):
        self.array, self.component, self.elements = array, component, elements
        self.form, self.shape, self.predictor = ZERO, FULL, WORDS
        self.steps = self.stored = 0  # numbers of steps and elements whose values are stored
        self.base = 0
        self.values = [0]  # bits of the stored values, element after element

    def at(self, step, element):
        if self.form in (ZERO, CONSTANT):
            return self.values[0]
        element = 0 if self.shape == UNIFORM else element
        return self.values[element * self.steps + (0 if self.shape == FIXED else step)]

    def read_method(self, method, steps):
        self.form, self.shape, self.predictor = method & 3, method >> 2 & 3, method >> 4
        self.scaled = self.form == COPY and self.shape == 1 and self.array.is_float()
        reject_unless(self.form == CODED or method < 4 + 4 * self.scaled, "a column of no such form")
        reject_unless(self.shape <= UNIFORM and self.predictor <= BOTH, "a column of no such shape or predictor")
        self.steps = 1 if self.shape == FIXED else steps
        self.stored = 1 if self.shape == UNIFORM else self.elements

    def read_details(self, cursor, before):
        """`before`: the columns before this one."""
        width = SCALAR_BYTES[self.array.type]
        if self.form == CONSTANT:
            self.values = [int.from_bytes(cursor.take(width), "little")]
        elif self.form == COPY:
            distance = cursor.varint()
            reject_unless(1 <= distance <= len(before), "a copy of no column")
            source = before[-distance]
            reject_unless(source.form == CODED and source.elements == self.elements
                          and SCALAR_BYTES[source.array.type] == width, "a copy of a column that is unlike it")
            reject_unless(not self.scaled or source.array.type == self.array.type, "a multiple of another type")
            self.source = source
            self.factor = cursor.f64() if self.scaled else None
            reject_unless(self.factor is None or math.isfinite(self.factor), "a factor that is not finite")
        elif self.form == CODED and self.predictor != WORDS:
            kind = cursor.u8()
            exponent = cursor.svarint() if kind in (BINARY, DECIMAL) else 0
            self.domain = domain_of_differences(self.array, self.component, kind, exponent)
            self.width = cursor.u8()
            reject_unless(self.width <= widest_residual(self.domain), "residuals that are too wide")
            if self.predictor != NOTHING:
                self.base = cursor.svarint()

    def count(self):
        return self.steps * self.stored

    def decode(self, residuals):
        """Sets `values` from residuals."""
        domain, steps = self.domain, self.steps
        indices, self.values = [], []
        for i, z in enumerate(residuals):
            p = self._predicted(indices, i % steps, i // steps)
            if domain.kind in (FLOATS, NARROW):
                index = _wrapped(p + unzigzag(z), domain.own_width)
            else:
                index = signed_of(domain, p + unzigzag(z))
            indices.append(index)
            self.values.append(domain.value(index))

    def _predicted(self, indices, s, e):
        """The index that is predicted for step s, element e."""
        def x(step, element):
            return indices[element * self.steps + step]

        if self.predictor == NOTHING:
            return 0
        if s == 0 and e == 0:
            return self.base
        if s == 0 or (e > 0 and self.predictor == ELEMENT):
            return x(s, e - 1)
        if self.predictor == BOTH and e > 0:
            return self._sum(x(s - 1, e), x(s, e - 1), x(s - 1, e - 1))
        if self.predictor == STEPS and s > 1:
            return self._sum(x(s - 1, e), x(s - 1, e), x(s - 2, e))
        return x(s - 1, e)

    def _sum(self, a, b, less):
        domain = self.domain
        if domain.kind not in (FLOATS, NARROW):
            return signed64(a + b - less)
        a, b, less = (state if state == state else 0.0 for state in map(domain.plain_state, (a, b, less)))
        return domain.plain_index((a + b) - less)


def _wrapped(number, width):
    number &= (1 << width) - 1
    return number - (1 << width) if number >> (width - 1) else number


def read_bundle(data, arrays, steps):
    """The columns of each array. `arrays`: an array of the schema and its number of elements."""
    reject_unless(sum(array.components for array, _ in arrays) <= MOST_COLUMNS, "a bundle of too many columns")
    columns = [BundleColumn(array, c, elements) for array, elements in arrays for c in range(array.components)]
    cursor = Cursor(data)
    head_bytes = cursor.varint()
    reject_unless(len(columns) <= head_bytes <= MOST_HEAD_BYTES * len(columns), "a head of a wrong size")
    head = Cursor(plane(cursor, head_bytes))
    for column, method in zip(columns, head.take(len(columns))):
        column.read_method(method, steps)
    for c, column in enumerate(columns):
        column.read_details(head, columns[:c])
    head.end()
    coded = [column for column in columns if column.form == CODED]
    reject_unless(sum(column.count() for column in coded) <= MOST_VALUES, "a bundle of too many values")
    predicted = [column for column in coded if column.predictor != WORDS]
    residuals = {id(column): [0] * column.count() for column in predicted}
    for b in range(8):
        those = [column for column in predicted if column.width > b]
        if not those:
            continue
        bytes_ = iter(plane(cursor, sum(column.count() for column in those)))
        for column in those:
            its = residuals[id(column)]
            residuals[id(column)] = [number | next(bytes_) << 8 * b for number in its]
    words = [column for column in coded if column.predictor == WORDS]
    if words:
        stored = Cursor(plane(cursor, sum(column.count() * SCALAR_BYTES[column.array.type] for column in words)))
        for column in words:
            width = SCALAR_BYTES[column.array.type]
            column.values = [int.from_bytes(stored.take(width), "little") for _ in range(column.count())]
    cursor.end()
    for column in predicted:
        column.decode(residuals[id(column)])
    for column in columns:
        if column.form == COPY:
            source = column.source
            column.shape, column.steps, column.values = source.shape, source.steps, source.values
            if column.factor is not None:
                column.values = [times(column.array.type, bits, column.factor) for bits in column.values]
    result, at = [], 0
    for array, _ in arrays:
        result.append(columns[at : at + array.components])
        at += array.components
    return result


def values_at(columns, step, elements):
    """The bits of the values of an array, the components of an element one after the other."""
    return [column.at(step, e) for e in range(elements) for column in columns]
