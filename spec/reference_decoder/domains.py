"""Section 23: value domains."""

import ctypes
import math
import struct
from bisect import bisect_left

from .basics import FLOAT32, FLOAT64, MASK32, MASK64, SCALAR_BYTES, SCALAR_CODES, reject_unless, signed64
from .coders import number, signed, tree
from .schema import RELATIVE

FLOATS, NARROW, BINARY, DECIMAL, DIGITS, INTEGERS, QUANTIZED = range(7)
MORE = 7  # the kind stands behind what else there is
_EXPONENTS = {FLOATS: (0, 0), NARROW: (0, 0), BINARY: (-971, 1074), DECIMAL: (-22, 22), DIGITS: (1, 15),
              INTEGERS: (0, 0), QUANTIZED: (0, 0)}
TEN = [float(10**k) for k in range(23)]  # all exact


def as_float32(x):
    return ctypes.c_float(x).value


def bits_of(type_, x):
    """The bits of a floating-point type that x is rounded to."""
    if type_ == FLOAT64:
        return struct.unpack("<Q", struct.pack("<d", x))[0]
    return struct.unpack("<I", struct.pack("<f", as_float32(x)))[0]


def as_double(type_, bits):
    """A stored number as binary64."""
    width = SCALAR_BYTES[type_]
    return float(struct.unpack("<" + SCALAR_CODES[type_], bits.to_bytes(width, "little"))[0])


def ordered(bits, width):
    sign = 1 << (width - 1)
    return bits if not bits & sign else -1 - (bits ^ sign)


def from_ordered(d, width):
    sign = 1 << (width - 1)
    d &= 2 * sign - 1
    return d if not d & sign else sign | (~d & (sign - 1))


def nearest(p):
    if p != p:
        return 0
    if p <= -(2.0**53):
        return -(2**53)
    if p >= 2.0**53:
        return 2**53
    low = math.floor(p)
    return low + (p - low >= 0.5)


def divided(a, b):
    """As IEEE 754 has it, by 0 too; b is not below 0."""
    if b:
        return a / b
    return math.nan if a == 0 or a != a else math.copysign(math.inf, a)


class Domain:
    """What numbers one component is made of."""

    def __init__(self, type_, quantization, component):
        self.type, self.width = type_, 8 * SCALAR_BYTES[type_]
        self.floating, self.quantized = type_ in (FLOAT32, FLOAT64), quantization.bits != 0
        self.spacing = quantization.spacing if quantization.bits == RELATIVE else 0  # of positions
        if self.quantized and not self.spacing:
            self.minimum, self.step = quantization.minimum[component], quantization.step()
        self.exponent, self.negative_zero, self.escapes, self.table = 0, 0, 1, None
        self.recalls = self.partners = 0  # section 24
        self.kind = QUANTIZED if self.quantized else FLOATS if self.floating else INTEGERS
        self.choose()

    def may_be(self, kind, exponent):
        if kind == QUANTIZED:
            good = self.quantized
        elif kind == INTEGERS:
            good = not self.floating
        else:
            good = kind < INTEGERS and self.floating and not self.quantized
            good = good and (kind != NARROW or self.type == FLOAT64)
        return good and _EXPONENTS[kind][0] <= exponent <= _EXPONENTS[kind][1]

    def choose(self):
        """Takes note that kind, exponent or table are others."""
        self.own_type = FLOAT32 if self.kind == NARROW else self.type  # of kinds 0 and 1
        self.own_width = 8 * SCALAR_BYTES[self.own_type]
        if self.kind == BINARY:
            self.unit = math.ldexp(1.0, -self.exponent)
        if self.kind == DIGITS:
            self.low, self.high = 10 ** (self.exponent - 1), 10**self.exponent
            self.span = 9 * self.low

    def is_linear(self):
        return self.kind in (BINARY, DECIMAL, INTEGERS, QUANTIZED)

    # ------------------------------------------------------------------ index, state, scale

    def plain_index(self, p):
        """The index that a predicted state stands for, whatever the table."""
        if self.kind in (FLOATS, NARROW):
            return ordered(bits_of(self.own_type, p if p == p else 0.0), self.own_width)
        return self._place(p) if self.kind == DIGITS else nearest(p)

    def plain_state(self, d):
        if self.kind in (FLOATS, NARROW):
            return as_double(self.own_type, from_ordered(d, self.own_width))
        return self._digits(d) if self.kind == DIGITS else float(d)

    def index(self, p):
        d = self.plain_index(p)
        table = self.table
        if not table:
            return d
        r = bisect_left(table, d)
        if r == len(table) or (r > 0 and d - table[r - 1] <= table[r] - d):
            r -= 1
        return r

    def state(self, index):
        if self.table:
            index = self.table[max(0, min(index, len(self.table) - 1))]
        return self.plain_state(index)

    def scale(self, p):
        if self.kind in (FLOATS, NARROW) and not self.table:
            return struct.unpack("<Q", struct.pack("<d", p))[0] >> 52 & 2047
        return 0

    # ------------------------------------------------------------------ values

    def number_of(self, d):
        """The value of index d, as binary64, of kinds 2, 3, 5 and 6: not rounded to the stored type."""
        d = float(d)
        if self.kind == BINARY:
            return d * self.unit
        if self.kind == DECIMAL:
            return d / TEN[self.exponent] if self.exponent >= 0 else d * TEN[-self.exponent]
        if self.kind == QUANTIZED:
            return as_double(self.type, self._spaced(int(d))) if self.spacing else self.minimum + d * self.step
        return d

    def _spaced(self, d):
        """The bits of the value of index d, for a relative bound."""
        sign = self.minus_zero()
        return abs(d) * self.spacing & (sign - 1) | (sign if d < 0 else 0)

    def value(self, d):
        """The bits of the value of index d."""
        if self.kind == INTEGERS:
            return d & ((1 << self.width) - 1)
        if self.kind == FLOATS:
            return from_ordered(d, self.width)
        if self.kind == QUANTIZED and self.spacing:
            return self._spaced(d)
        return bits_of(self.type, self.plain_state(d) if self.kind in (NARROW, DIGITS) else self.number_of(d))

    def minus_zero(self):
        return 0x80000000 if self.type == FLOAT32 else 2**63 & ((1 << self.width) - 1)

    def as_value(self, s):
        return s if self.kind in (FLOATS, NARROW, DIGITS) else self.number_of(nearest(s))

    def from_value(self, x):
        kind = self.kind
        if kind == BINARY:
            return float(nearest(x / self.unit))
        if kind == DECIMAL:
            return float(nearest(x * TEN[self.exponent] if self.exponent >= 0 else x / TEN[-self.exponent]))
        if kind == QUANTIZED and self.spacing:
            if x != x:
                return 0.0
            sign, bits = self.minus_zero(), bits_of(self.type, x)
            size = float(((bits & (sign - 1)) + self.spacing // 2) // self.spacing)
            return -size if bits & sign else size
        if kind == QUANTIZED:
            return float(nearest(divided(x - self.minimum, self.step)))
        return x

    # ------------------------------------------------------------------ Digits

    def _place(self, p):
        if p != p:
            return 0
        size, m = abs(p), 0.0
        for k in range(-22, 23):
            m = size / TEN[k] if k >= 0 else size * TEN[-k]
            if m < self.high - 0.5:
                break
        if m < self.low - 0.5:
            return 0
        if not m < self.high - 0.5:
            m = self.high - 1.0
        whole = max(self.low, min(nearest(m), self.high - 1))
        place = (k + 22) * self.span + whole - self.low + 1
        return -place if p < 0 else place

    def _digits(self, d):
        if d == 0:
            return 0.0
        place = min(abs(d), 45 * self.span) - 1
        k = place // self.span - 22
        m = float(self.low + place % self.span)
        x = m * TEN[k] if k >= 0 else m / TEN[-k]
        return -x if d < 0 else x

    # ------------------------------------------------------------------ The domain of a group

    def read(self, source, models, before, most_entries, earlier_values, translate):
        """`before`: the domains of the components before; `earlier_values`: may be recalled, and have partners;
        translate(old, new) when the domain becomes another."""
        old_table = self.table or []
        if not source.bit(models["same_domain"]):
            kind = tree(source, models.kind, 3)
            self.recalls = self.partners = 0
            if kind == MORE and earlier_values:
                self.recalls, self.partners = source.bit(models["recalls_flag"]), source.bit(models["partners_flag"])
                kind = tree(source, models.kind, 3)
            exponent = signed(source, models.exponent) & MASK32
            exponent -= (exponent >> 31) << 32
            self.negative_zero = source.bit(models["negative_zero_flag"])
            self.escapes = source.bit(models["escapes_flag"])
            reject_unless(self.may_be(kind, exponent), "a domain that is not for such an array")
            if (kind, exponent) != (self.kind, self.exponent):
                old = Domain.__new__(Domain)
                old.__dict__.update(self.__dict__)
                self.kind, self.exponent = kind, exponent
                self.choose()
                translate(old, self)
        self.table = None
        if source.bit(models["table_flag"]):
            self.table = self._read_table(source, models, before, most_entries, old_table)

    def _opposite(self, e):
        return -1 - e if self.kind in (FLOATS, NARROW) else signed64(-e)

    def _read_table(self, source, models, before, most_entries, old_table):
        known = set(old_table)
        for domain in before:
            if (domain.kind, domain.exponent) == (self.kind, self.exponent):
                known |= set(domain.table or ())
        known = sorted(known | {self._opposite(e) for e in known})
        count = (number(source, models.entries) + 1) & MASK64
        reject_unless(count <= most_entries, "a table of more entries than the group has elements")
        mirrors, steps, history = not known, [0], 0
        table, at = [], 0  # known loses what is before `at`
        for i in range(count):
            if mirrors and i > 0 and table[-1] >= 0:
                known, at, mirrors = sorted({o for e in table if (o := self._opposite(e)) > 0}), 0, False
            while i > 0 and at < len(known) and known[at] <= table[-1]:
                at += 1
            is_known = 0
            if at < len(known):
                is_known = source.bit(models.known_entry[history])
                history = (2 * history + is_known) & 7
            if is_known:
                k = number(source, models.skipped)
                reject_unless(k < len(known) - at, "an entry of a table that is not known")
                table.append(known[at + k])
            elif i == 0:
                table.append(signed(source, models.first_entry))
            else:
                p = next((p for p in range(len(steps)) if source.bit(models.same_step[p])), None)
                if p is None:
                    p = min(len(steps), 3)
                    steps[p:] = [number(source, models.step)]
                steps.insert(0, steps.pop(p))
                entry = signed64(table[-1] + steps[0] + 1)
                reject_unless(entry > table[-1], "a table that does not ascend")
                table.append(entry)
        return table or None
