"""Section 7: step values."""

import math
from dataclasses import dataclass

from .basics import FLOAT32, MASK32, MASK64, SCALAR_BYTES, Cursor, ShmError, reject_unless
from .bundles import BUNDLE, MOST_PAIRS, read_bundle, values_at
from .columns import COLUMNS, MIXED_COLUMNS, SHUFFLED_ZSTD, WITH_TABLES, Column, shuffled_values
from .domains import as_double, as_float32, bits_of
from .patterns import TERMS, Terms
from .special_values import APART, SpecialValues, has_special_values, without_special
from .weighted import WEIGHTED, Weighted

IN_COLUMNS = 256  # components at most
MOST_PARTS = 64  # in a chunk


def trend(type_, r1, r2):
    """r1 + (r1 - r2) in the array's own type."""
    if type_ < FLOAT32:
        return (2 * r1 - r2) & ((1 << 8 * SCALAR_BYTES[type_]) - 1)
    one, two = as_double(type_, r1), as_double(type_, r2)
    if type_ == FLOAT32:
        result = as_float32(one + as_float32(one - two))
    else:
        result = one + (one - two)
    return bits_of(type_, result) if math.isfinite(result) else r1


class StepOfArray:
    def __init__(self, step):
        self.step, self.values = step, {}  # by group
        self.reference = None  # of all its parts


@dataclass
class Part:
    """What the values of an array at a step in a group are, and the bytes that they are coded in."""
    array: int = 0
    step: int = 0
    reference_step: int = 0
    reference: int = 0  # 0 nothing, 1 the step before, 2 the trend, 3 the base
    group: int = 0
    count: int = 0
    codec: int = 0
    arrays: int = 1  # of a bundle
    steps: int = 1
    bytes: int = 0  # of version 1
    data: bytes = b""


def read_parts(chunk):
    cursor = chunk.cursor("step values")
    if chunk.version == 0:
        return [_only_part(cursor)]
    if chunk.version == 2:
        return _parts_of_bundle(cursor)
    parts = []
    cursor.list_of(lambda: parts.append(_head(cursor, parts[-1] if parts else Part())))
    if not 1 <= len(parts) <= MOST_PARTS:
        cursor.fail("step values of no parts, or of too many")
    for part in parts:
        part.data = cursor.take(part.bytes)
    cursor.end()
    return parts


def _only_part(cursor):
    part = Part()
    part.array, part.step, part.reference_step = cursor.varint32(), cursor.varint(), cursor.varint()
    trend_, part.group, part.count = cursor.u8(), cursor.varint32(), cursor.varint()
    part.codec, part.data = cursor.u8(), cursor.rest()
    refers = part.reference_step != part.step
    if trend_ > refers:
        cursor.fail("a trend without reference")
    part.reference = refers + trend_
    if part.codec == BUNDLE:
        cursor.fail("a bundle in a chunk of version 0")
    return part


def _head(cursor, before):
    part = Part()
    part.array = (before.array + cursor.svarint()) & MASK32
    part.step = (before.step + cursor.svarint()) & MASK64
    part.group = (before.group + cursor.svarint()) & MASK32
    part.count = cursor.varint()
    reference = cursor.varint()  # 0, or 3 (d - 1) and the kind
    part.reference_step = part.step - (reference + 2) // 3
    part.reference = reference and (reference - 1) % 3 + 1
    if part.reference_step < 0:
        cursor.fail("a reference to a step before the first")
    part.codec, part.bytes = cursor.u8(), cursor.varint()
    if part.codec == BUNDLE:
        cursor.fail("a bundle in a chunk of version 1")
    return part


def _parts_of_bundle(cursor):
    """The first part has all bytes."""
    group, step, steps = cursor.varint32(), cursor.varint32(), cursor.varint()
    if not 1 <= steps <= MOST_PAIRS or step + steps > 2**32:
        cursor.fail("a bundle of no steps, or of too many")
    parts, array, pairs = [], 0, 0
    for _ in range(cursor.varint()):
        array += cursor.varint32()
        part = Part(array, step, step, 0, group, 0, BUNDLE, cursor.varint32(), steps)
        part.count = cursor.varint()
        array += part.arrays
        pairs += part.arrays * steps
        if not part.arrays or not part.count or pairs > MOST_PAIRS or array > MASK32 or len(parts) == MOST_PARTS:
            cursor.fail("a bundle of no arrays or elements, or of too many")
        parts.append(part)
    if not parts:
        cursor.fail("a bundle of no arrays")
    parts[0].data = cursor.rest()
    return parts


def shares_of_bundle(parts):
    """Array and bytes that count for it, of each array."""
    arrays = [part.array + a for part in parts for a in range(part.arrays)]
    size = len(parts[0].data)
    return [(array, size // len(arrays) + (n < size % len(arrays))) for n, array in enumerate(arrays)]


class StepPiece:
    def __init__(self, array, step, first, values, group):
        self.array, self.step, self.first, self.values, self.group = array, step, first, values, group


class StepValues:
    """The values of all stepped arrays, part by part."""

    def __init__(self, schema, groups):
        self.schema, self.groups = schema, groups
        self.counts = {i: self._counts(a) for i, a in schema.stepped_arrays()}
        self.steps = {i: [] for i in self.counts}  # of each array, the last three
        self.bases = {}  # of each array, the last complete step that refers to no other
        self.open = None  # array whose step is not complete
        self.column = None
        self.may_refer = schema.step_references

    def _counts(self, array):
        """The number of elements of an array in each group."""
        if array.on_mesh():
            return [group.elements(array) for group in self.groups]
        return [array.elements if g == 0 else 0 for g in range(len(self.groups))]

    def complete(self):
        return self.open is None

    def _next_group(self, index, after):
        return next((g for g in range(after, len(self.groups)) if self.counts[index][g]), None)

    def decode(self, part, base):
        """`base`: where the payload that the part stands in begins in the file."""
        index, step, group, count = part.array, part.step, part.group, part.count
        try:
            reject_unless(index in self.counts, "step values of no stepped array")
            reject_unless(count > 0 and step <= MASK32, "step values that cannot be")
            array = self.schema.arrays[index]
            self._begin(index, step, group, count)
            this = self.steps[index][-1]
            reference = part.reference
            self._check_reference(index, this, reference, part.reference_step)
            references, last = self._references(index, array, group, reference)
            codec, data, special = part.codec, part.data, None
            if has_special_values(codec):
                special = SpecialValues(array, data, count * array.components, references)
                codec, data, references = codec - APART, special.rest, special.references
                last = last and without_special(array, last)
            values = self._values(array, this, reference, references, last, group, count, codec, data)
            if special:
                values = special.restore(values)
        except ShmError as error:
            error.section = error.section or "step values"
            error.offset = base if error.offset is None else error.offset
            raise
        this.values[group] = values
        if self._next_group(index, group + 1) is None:
            self.open = None
        first = sum(self.counts[index][:group])
        return StepPiece(index, step, first, values, group)

    def decode_bundle(self, parts, base):
        """Yields the pieces of a bundle."""
        arrays = [(part, part.array + a) for part in parts for a in range(part.arrays)]
        try:
            for _, index in arrays:
                reject_unless(index in self.counts, "step values of no stepped array")
            of_schema = [(self.schema.arrays[index], part.count) for part, index in arrays]
            columns = read_bundle(parts[0].data, of_schema, parts[0].steps)
            for s in range(parts[0].steps):
                for (part, index), its in zip(arrays, columns):
                    self._begin(index, part.step + s, part.group, part.count)
                    reject_unless(part.count == sum(self.counts[index]), "a bundle of a part of an array")
                    values = values_at(its, s, part.count)
                    self.steps[index][-1].reference = 0
                    self.steps[index][-1].values[part.group] = values
                    self.open = None
                    yield StepPiece(index, part.step + s, 0, values, part.group)
        except ShmError as error:
            error.section = error.section or "step values"
            error.offset = base if error.offset is None else error.offset
            raise

    def _begin(self, index, step, group, count):
        steps = self.steps[index]
        if self.open is None:
            reject_unless(not steps or step > steps[-1].step, "steps that do not ascend")
            expected = self._next_group(index, 0)
            if steps and steps[-1].reference == 0:
                self.bases[index] = steps[-1]
            steps.append(StepOfArray(step))
            del steps[:-3]
            self.open, self.column = index, None
        else:
            reject_unless(self.open == index and steps[-1].step == step, "a step before the last one is complete")
            expected = self._next_group(index, self.group + 1)
        reject_unless(group == expected and count == self.counts[index][group],
                      "step values of another group, or of another number of elements, than is next")
        if self.column is None or self.groups[group].segment != self.groups[self.group].segment:
            array = self.schema.arrays[index]
            if array.components <= IN_COLUMNS:
                self.column = Column(array, array.components <= WITH_TABLES, self.schema.earlier_values)
                self.weighted = Weighted(array)
            self.column_reference = self.weighted_reference = None
        self.group = group

    def _check_reference(self, index, this, reference, reference_step):
        reject_unless(this.reference in (None, reference), "a reference unlike that of the part before")
        this.reference = reference
        if not reference:
            return
        reject_unless(reference <= self.may_refer, "a reference to more than there may be")
        if reference == 3:
            reject_unless(index in self.bases and reference_step == self.bases[index].step,
                          "a reference to a step that is not the base")
            return
        steps = self.steps[index]
        reject_unless(len(steps) > 1 and reference_step == steps[-2].step,
                      "a reference to another step than the one before")
        reject_unless(reference == 1 or (len(steps) > 2 and steps[-2].reference in (1, 2)),
                      "a trend behind a key step")

    def _values(self, array, this, reference, references, last, group, count, codec, data):
        if array.components > IN_COLUMNS:
            reject_unless(codec == SHUFFLED_ZSTD and reference == 0,
                          "columns, or a reference, of too many components")
            return shuffled_values(data, array, count)
        if codec == TERMS:
            elements = [(None, ())] * count
            return Terms(array).decode(data, elements, count * array.element_bytes(), references)
        if self.groups[group].patterned or not array.on_mesh():
            reject_unless(codec == SHUFFLED_ZSTD, "columns without neighbourhoods")
            return shuffled_values(data, array, count)
        tiles = [tile.elements(array, steps=True) for tile in self.groups[group].tiles]
        if codec == WEIGHTED:
            reject_unless(self.weighted_reference in (None, reference), "a reference unlike that of the part before")
            self.weighted_reference = reference
            return self.weighted.decode(data, tiles, references, last)
        reject_unless(self.column_reference in (None, reference), "a reference unlike that of the part before")
        self.column_reference = reference
        self.column.referring = reference > 0
        if codec == SHUFFLED_ZSTD:
            values = shuffled_values(data, array, count)
            found, at = [], 0
            for elements, _ in tiles:
                found.append(values[at : at + len(elements) * array.components])
                at += len(elements) * array.components
            self.column.note(tiles, found)
            return values
        reject_unless(codec == COLUMNS or (codec == MIXED_COLUMNS and array.components <= WITH_TABLES),
                      "a codec that is not for this array")
        found = self.column.decode(data, codec, tiles, count * array.element_bytes(), references)
        return [value for tile in found for value in tile]

    def _references(self, index, array, group, reference):
        """The reference of each value; and the values of the step before, if the references are the trend."""
        if not reference:
            return None, None
        if reference == 3:
            return self.bases[index].values[group], None
        steps = self.steps[index]
        last = steps[-2].values[group]
        if reference == 1:
            return last, None
        return [trend(array.type, r1, r2) for r1, r2 in zip(last, steps[-3].values[group])], last
