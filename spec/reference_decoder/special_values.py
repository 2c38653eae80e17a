"""Section 46: special values, which are coded apart from the other values of an array."""

from .basics import FLOAT32, Cursor, packed_blob, reject_unless

APART = 128  # is added to the codec of a stream or part


def has_special_values(codec):
    return APART <= codec < 192


def is_special(array):
    """A function that returns whether the bits of a value are those of a special value."""
    exponent = 0x7F800000 if array.type == FLOAT32 else 0x7FF0000000000000
    fills = array.fill_bits()
    return lambda bits: bits & exponent == exponent or bits in fills


def without_special(array, values):
    """The values of whole elements, with every special value replaced."""
    special, values = is_special(array), list(values)
    for c in range(array.components):
        own = values[c :: array.components]
        last = next((bits for bits in own if not special(bits)), 0)
        for i, bits in enumerate(own):
            last = last if special(bits) else bits
            values[i * array.components + c] = last
    return values


class SpecialValues:
    """What is coded apart in a stream of `array`, or in a part whose reference is `references`."""

    def __init__(self, array, data, scalars, references=None):
        width = array.element_bytes() // array.components
        reject_unless(array.is_float(), "special values of integers")
        outer = Cursor(data)
        head = Cursor(outer.take(outer.varint()))
        most = min(4096 + 4 * scalars, 256 * head.left())
        blob = packed_blob(head)
        head.end()
        reject_unless(len(blob) <= most, "too many bytes of special values")
        self.rest, self.references = outer.rest(), references
        cursor = Cursor(blob)
        different = cursor.u8()
        if references is not None:
            self.references = without_special(array, references)
        if different == 0:
            cursor.end()
            special = is_special(array)
            reject_unless(references is not None, "special values of no reference")
            self.special = {i: bits for i, bits in enumerate(references) if special(bits)}
            reject_unless(self.special, "a reference without special values")
            return
        known = [int.from_bytes(cursor.take(width), "little") for _ in range(different)]
        runs, gap_bytes, length_bytes = cursor.varint(), cursor.varint(), cursor.varint()
        gaps, lengths = Cursor(cursor.take(gap_bytes)), Cursor(cursor.take(length_bytes))
        indices = cursor.take(runs) if different > 1 else bytes(runs)
        cursor.end()
        reject_unless(runs > 0, "no special values")
        self.special, at = {}, 0
        for index in indices:
            at += gaps.varint()
            length = lengths.varint()
            reject_unless(index < different and 0 < length and at + length <= scalars, "a run that cannot be")
            self.special.update((i, known[index]) for i in range(at, at + length))
            at += length
        gaps.end()
        lengths.end()

    def restore(self, values):
        """Puts the special values into the list of all values of the group or part."""
        reject_unless(max(self.special) < len(values), "special values of no elements")
        for i, bits in self.special.items():
            values[i] = bits
        return values
