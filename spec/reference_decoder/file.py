"""Sections 2, 8 to 10, 17 and 38: the container, step times, extras, index, trailer, archives."""

import math
import struct
from dataclasses import dataclass
from itertools import accumulate, islice

from . import digest
from .basics import MASK32, MASK64, SCALAR_BYTES, Cursor, ShmError, checksum, packed_blob, reject_unless, unzigzag
from .group import STREAM_NAMES, GroupHeader, Imported, Segment
from .schema import read_schema
from .bundles import BUNDLE, MOST_PAIRS
from .steps import StepValues, read_parts, shares_of_bundle

# ---------------------------------------------------------------------------- 2 Container

SIGNATURE = b"\x89SHM\r\n\x1a\n"
SHORT_MARK, LONG_MARK, TRAILER_MARK = b"SHMc", b"SHMC", b"SHME"
SCHEMA, GROUP, STEP_VALUES, STEP_TIMES, EXTRA, INDEX, MEMBERS = 1, 2, 3, 4, 5, 6, 9
ARCHIVE = 4  # of needed_features
WITH_VERSION_1 = GROUP, STEP_VALUES, STEP_TIMES, EXTRA, INDEX
WITH_DIGEST = GROUP, STEP_VALUES, STEP_TIMES, INDEX
MOST_SEGMENTS, MOST_STEPS, MOST_PAYLOAD = 2**20, 2**20, 2**30


@dataclass
class Chunk:
    kind: int
    version: int  # without 4, which a digest adds
    segment: int
    optional: bool
    known: bool
    offset: int
    header_bytes: int
    payload: bytes
    digest: int = None

    def cursor(self, section):
        """A cursor after the digest."""
        cursor = Cursor(self.payload, self.base(), section)
        if self.digest is not None:
            cursor.take(8)
        return cursor

    def base(self):
        """Where the payload begins in the file."""
        return self.offset + self.header_bytes

    def bytes(self):
        return self.header_bytes + len(self.payload)

    def end(self):
        return self.offset + self.bytes()


@dataclass
class StepTimes:
    """The times of the steps from `first` on."""

    first: int
    times: list


def times_of(cursor, version):
    count = cursor.left() // 8
    if version == 0:
        return [cursor.f64() for _ in range(count)]
    planes, times = cursor.take(8 * count), []
    for i in range(count):
        p = 0.0
        if i == 1:
            p = times[0]
        elif i > 1:
            p = times[i - 1] + (times[i - 1] - times[i - 2])
        p = struct.unpack("<Q", struct.pack("<d", p))[0] if math.isfinite(p) else 0
        bits = p + unzigzag(int.from_bytes(planes[i::count], "little")) & MASK64
        times.append(struct.unpack("<d", struct.pack("<Q", bits))[0])
    return times


@dataclass
class Extra:
    key: bytes
    type: int
    refers: int
    shape: list
    data: bytes


@dataclass
class Totals:
    vertices: int = 0
    cells: int = 0
    hexahedra: int = 0
    max_active_vertices: int = 0
    steps: int = 0
    segments: int = 0
    imported_vertices: int = 0
    block_cells: list = None
    trailing_bytes: int = 0
    digest: int = 0


def read_file_start(data):
    """The needed features; data begins with a file."""
    if len(data) < 16:
        raise ShmError("truncated", "file start", len(data))
    if data[:8] != SIGNATURE:
        raise ShmError("another signature: this is no .shm file", "file start", 0)
    major, minor, features = struct.unpack("<HHI", data[8:16])
    if major != 0 or minor not in (1, 9, 10):
        raise ShmError(f"unsupported: version {major}.{minor}", "file start", 8)
    if features & ~ARCHIVE:
        raise ShmError(f"unsupported: needed features {features:#x}", "file start", 12)
    return features


def read_header(data, at, sequence):
    """Size of the header, kind, version, optional, segment, size and checksum of the payload."""
    size_of_header = 32 if data[at : at + 4] == LONG_MARK else 22
    if len(data) - at < size_of_header:
        raise ShmError("truncated", "chunk header", at)
    header = data[at : at + size_of_header]
    if size_of_header == 32:
        _, kind, version, flags, _, number, segment, size, sum_, own_sum = struct.unpack("<4sBBBBIIQII", header)
    else:
        mark, what, number, segment, sum_, own_sum = struct.unpack("<4sIIHII", header)
        kind, version, flags, size = what & 15, what >> 4 & 7, what >> 7 & 1, what >> 8
        if mark != SHORT_MARK:
            raise ShmError("no chunk", "chunk header", at)
    if own_sum != checksum(header[:-4]):
        raise ShmError("a checksum that does not match", "chunk header", at)
    if number != sequence & MASK32:
        raise ShmError("a chunk out of sequence", "chunk header", at)
    return size_of_header, kind, version, flags, segment, size, sum_


def read_chunk(data, at, sequence):
    size_of_header, kind, version, flags, segment, size, sum_ = read_header(data, at, sequence)
    if size > MOST_PAYLOAD:
        raise ShmError("over limit: a payload of more than 2^30 bytes", "chunk header", at)
    at += size_of_header
    if len(data) - at < size:
        raise ShmError("truncated", "payload of a chunk", len(data))
    payload = data[at : at + size]
    if sum_ != checksum(payload):
        raise ShmError("a checksum that does not match", "payload of a chunk", at)
    newest, its_digest = 2 if kind == STEP_VALUES else kind in WITH_VERSION_1, None
    if version > 4 and kind in WITH_DIGEST:
        if size < 8:
            raise ShmError("a payload that is shorter than its digest", "digest", at)
        version, its_digest = version - 4, int.from_bytes(payload[:8], "little")
    known = SCHEMA <= kind <= INDEX and version <= newest and (segment == 0 or kind == GROUP)
    return Chunk(kind, version, segment, bool(flags & 1), known, at - size_of_header, size_of_header, payload,
                 its_digest)


def read_trailer(data, at, expected):
    """`expected`: the offset of the chunk that the trailer points to."""
    if len(data) - at < 16:
        raise ShmError("truncated", "trailer", len(data))
    offset, sum_, mark = struct.unpack("<QI4s", data[at : at + 16])
    if mark != TRAILER_MARK or sum_ != checksum(data[at : at + 8]) or offset != expected:
        raise ShmError("another mark, checksum or offset", "trailer", at)


def follows(data, at, sequence):
    """True if the header of the chunk with this sequence stands here."""
    try:
        read_header(data, at, sequence)
    except ShmError:
        return False
    return True


# ---------------------------------------------------------------------------- 17 Decoding a file


class File:
    """Decodes one mesh. `items` yields tiles, StepPiece, StepTimes and Extra in the order of the file, Totals last."""

    def __init__(self, data):
        self.data = data
        reject_unless(read_file_start(data) == 0, "this is an archive")
        chunk = read_chunk(data, 16, 0)
        if chunk.kind != SCHEMA or not chunk.known:
            raise ShmError("the first chunk is no schema", "chunk header", 16)
        self.schema_payload = chunk.payload
        self.schema = read_schema(chunk.payload, chunk.base(), data[8:16])
        self.schema.earlier_values = data[10] >= 10  # the minor version
        self.entries = [(chunk.kind, 16, chunk.bytes(), None)]  # what each chunk is, in the order of the file
        self.totals = Totals(block_cells=[0] * len(self.schema.blocks))
        self.groups, self.segment, self.imported = [], None, Imported()
        self.step_values, self.step_times = None, []
        self.pairs = 0  # of an array and a step, in all bundles so far
        self.step_bytes = 0  # of all chunks of step values so far
        self.stream_bytes = {}
        self.indexes, self.followed = {}, {}  # by offset: number of entries before, and of indexes to follow

    def items(self):
        at, sequence = self.entries[0][1] + self.entries[0][2], 1
        while True:
            chunk = read_chunk(self.data, at, sequence)
            at, sequence = chunk.end(), sequence + 1
            self.listed = None  # of a group or step values, what the index has besides
            if not chunk.known:
                if not chunk.optional:
                    raise ShmError(f"unsupported: chunk of kind {chunk.kind}", "chunk header", chunk.offset)
            elif chunk.kind == SCHEMA:
                if chunk.payload != self.schema_payload:
                    raise ShmError("a later schema that differs from the first", "schema", chunk.offset)
            elif chunk.kind == GROUP:
                yield from self._group(chunk)
            elif chunk.kind == STEP_VALUES:
                yield from self._step_values(chunk)
            elif chunk.kind == STEP_TIMES:
                yield self._step_times(chunk)
            elif chunk.kind == EXTRA:
                yield from self._extras(chunk) if chunk.version else [self._extra(chunk)]
            else:
                self._index(chunk)
                at = self._end_of_index(chunk)
                self.indexes[chunk.offset] = len(self.entries)
                if chunk.version == 0 or not follows(self.data, at, sequence):
                    if chunk.version:
                        self._expect_no_later_index(chunk)
                    self.totals.trailing_bytes = len(self.data) - at
                    yield self.totals
                    return
            self.entries.append((chunk.kind, chunk.offset, chunk.bytes(), self.listed))

    def _expect_no_later_index(self, chunk):
        """The trailer at the end of the file shows whether chunks after this index are damaged."""
        data = self.data
        if len(data) - chunk.end() >= 16 and data[-4:] == TRAILER_MARK:
            later, sum_ = struct.unpack("<QI", data[-16:-4])
            if later > chunk.offset and sum_ == checksum(data[-16:-8]):
                raise ShmError("no chunk, but the file has a later index", "chunk header", chunk.end())

    def _end_of_index(self, chunk):
        """Where the file ends if no other chunk follows."""
        if chunk.version:
            if len(chunk.payload) < 16:
                raise ShmError("an index without a trailer", "trailer", chunk.base())
            read_trailer(self.data, chunk.end() - 16, chunk.offset)
            return chunk.end()
        read_trailer(self.data, chunk.end(), chunk.offset)
        return chunk.end() + 16

    def _count_bytes(self, name, count):
        self.stream_bytes[name] = self.stream_bytes.get(name, 0) + count

    def _group(self, chunk):
        totals = self.totals
        if self.step_values is not None or self.indexes:
            raise ShmError("a group after step values or an index", "group", chunk.offset)
        number = chunk.segment
        if number != totals.segments - 1:
            if number != totals.segments or number >= MOST_SEGMENTS:
                raise ShmError("a segment that is not the next one", "chunk header", chunk.offset)
            if self.segment:
                self.segment.end()
            self.segment = Segment(self.schema, number, totals.vertices, totals.cells, self.imported)
            totals.segments += 1
        header = GroupHeader(self.schema, chunk)
        try:
            group = self.segment.decode(header)
        except ShmError as error:
            error.section = error.section or "group"
            error.offset = chunk.base() if error.offset is None else error.offset
            raise
        self.listed = [number, header.first_cell, header.cells, header.first_vertex, header.vertices, header.box,
                       header.header_bytes]
        totals.vertices += header.vertices
        totals.imported_vertices += header.imported_vertices
        totals.max_active_vertices = max(totals.max_active_vertices, header.max_active_vertices)
        for tile in group.tiles:
            for cell in tile.cells:
                totals.cells += 1
                totals.block_cells[cell[1]] += 1
                totals.hexahedra += self.schema.blocks[cell[1]].hexahedral()
        for key, stream in header.streams.items():
            name = STREAM_NAMES[key] if key in STREAM_NAMES else self.schema.stream_name(stream.array)
            self._count_bytes(name, len(stream.data))
        yield from group.tiles
        group.numbers = digest.Numbers(group.tiles)
        found = sum(digest.of_tile(self.schema, tile) for tile in group.tiles)
        self._expect_digest(chunk, found, "vertices, cells or values")
        self.groups.append(group)
        for tile in group.tiles:
            tile.forget_values()

    def _expect_digest(self, chunk, found, what):
        digest.expect(chunk.digest, found, what, chunk)
        self.totals.digest = self.totals.digest + (chunk.digest or 0) & MASK64

    # ------------------------------------------------------------------ 7 Step values

    def _step_values(self, chunk):
        found = 0
        for piece in self._pieces(chunk):
            found += self._digest_of(piece)
            yield piece
        self._expect_digest(chunk, found, "step values")

    def _digest_of(self, piece):
        array = self.schema.arrays[piece.array]
        numbers = self.groups[piece.group].numbers.of(array, len(piece.values) // array.components)
        return digest.of_values(digest.FIRST_ARRAY + piece.array, piece.step, numbers, piece.values,
                                array.components)

    def _pieces(self, chunk):
        if self.step_values is None:
            self.step_values = StepValues(self.schema, self.groups)
        self.listed = []
        parts = read_parts(chunk)
        if parts[0].codec == BUNDLE:
            yield from self._bundle(chunk, parts)
            self.step_bytes += chunk.bytes()
            return
        self.step_bytes += chunk.bytes()
        for part in parts:
            piece = self.step_values.decode(part, chunk.base())
            if piece.step >= MOST_STEPS:
                raise ShmError("over limit: a step of 2^20 or more", "step values", chunk.offset)
            self.totals.steps = max(self.totals.steps, piece.step + 1)
            self._count_bytes(self.schema.stream_name(piece.array), len(part.data))
            self.listed.append([part.array, part.step, piece.first, part.count, part.group, part.reference, part.codec,
                                1, 1])
            yield piece

    def _bundle(self, chunk, parts):
        self.pairs += sum(part.arrays * part.steps for part in parts)
        if self.pairs > 2**18 + self.step_bytes:
            raise ShmError("bundles of too many arrays and steps", "step values", chunk.offset)
        for part in parts:
            self.listed.append([part.array, part.step, 0, part.count, part.group, 0, part.codec, part.arrays,
                                part.steps])
        if parts[0].step + parts[0].steps > MOST_STEPS:
            raise ShmError("over limit: a step of 2^20 or more", "step values", chunk.offset)
        for piece in self.step_values.decode_bundle(parts, chunk.base()):
            self.totals.steps = max(self.totals.steps, piece.step + 1)
            yield piece
        for array, size in shares_of_bundle(parts):
            self._count_bytes(self.schema.stream_name(array), size)

    # ------------------------------------------------------------------ 8 Step times

    def _blob(self, chunk, section, cursor=None):
        cursor = cursor or chunk.cursor(section)
        try:
            bounded = self.data[10] >= 10 and (chunk.kind != EXTRA or chunk.version > 0)
            blob = packed_blob(cursor, bounded)
        except ShmError as error:
            error.section, error.offset = section, chunk.base()
            raise
        self._count_bytes(b"extras", len(chunk.payload))
        return Cursor(blob, chunk.base(), section + " (unpacked)")

    def _step_times(self, chunk):
        cursor, first = chunk.cursor("step times"), len(self.step_times)
        if (cursor.varint() if chunk.version else 0) != first:
            cursor.fail("times that do not follow those before")
        cursor = self._blob(chunk, "step times", cursor)
        if cursor.left() % 8:
            cursor.fail("bytes that are no multiple of 8")
        if first + cursor.left() // 8 > MOST_STEPS:
            cursor.fail("over limit: more than 2^20 step times")
        times = times_of(cursor, chunk.version)
        found = sum(digest.of_words(digest.STEP_TIMES, 0, step, struct.unpack("<Q", struct.pack("<d", time)))
                    for step, time in enumerate(times, first))
        self._expect_digest(chunk, found, "step times")
        self.step_times += times
        self.totals.steps = max(self.totals.steps, len(self.step_times))
        return StepTimes(first, times)

    # ------------------------------------------------------------------ 9 Extras

    def _extra(self, chunk):
        cursor = self._blob(chunk, "extra")
        extra = self._name_of_extra(cursor)
        count = self._shape_of_extra(extra, cursor)
        extra.data = cursor.rest()
        if len(extra.data) != count * SCALAR_BYTES[extra.type]:
            cursor.fail("data that is not the product of its shape")
        return extra

    @staticmethod
    def _name_of_extra(cursor):
        extra = Extra(cursor.text(), cursor.u8(), cursor.u8(), [], b"")
        if not 1 <= extra.type <= 10 or extra.refers > 2 or (extra.refers and extra.type not in (5, 7)):
            cursor.fail("an unknown type or refers")
        return extra

    @staticmethod
    def _shape_of_extra(extra, cursor):
        extra.shape = cursor.list_of(cursor.varint)
        count = 1
        for side in extra.shape:
            count *= side
            if count >= 2**61:
                cursor.fail("more values than a file can hold")
        return count

    def _extras(self, chunk):
        """Version 1: what all of them are, then the values of each."""
        cursor = self._blob(chunk, "extra")
        entries = cursor.varint()
        if entries > 65536:
            cursor.fail("more than 65536 extras in a chunk")
        heads = []
        for _ in range(entries):
            extra = self._name_of_extra(cursor)
            distance = cursor.varint()
            count = self._shape_of_extra(extra, cursor)
            if len(extra.shape) > 255 or distance > (65535 if 3 <= extra.type <= 8 else 0):
                cursor.fail("a distance or shape that cannot be")
            heads.append((extra, distance, count))
        for extra, distance, count in heads:
            width = SCALAR_BYTES[extra.type]
            if distance == 0:
                extra.data = bytes(cursor.take(count * width))
                continue
            if count > cursor.left():
                cursor.fail("bytes are missing")
            values = []
            for i in range(count):
                before = values[i - distance] if i >= distance else 0
                values.append((before + cursor.svarint()) % 256**width)
            extra.data = b"".join(value.to_bytes(width, "little") for value in values)
        cursor.end()
        return [extra for extra, _, _ in heads]

    # ------------------------------------------------------------------ 10 Index and trailer

    def _index(self, chunk):
        cursor, totals = chunk.cursor("index"), self.totals
        if chunk.digest not in (None, totals.digest):
            cursor.fail("a digest that is not the sum of those of the chunks")
        if self.step_values and not self.step_values.complete():
            cursor.fail("a stepped array whose last step is not complete")
        found = [("previous_index", 0), ("vertices", totals.vertices), ("cells", totals.cells),
                 ("hexahedra", totals.hexahedra), ("max_active_vertices", totals.max_active_vertices),
                 ("steps", totals.steps), ("segments", totals.segments),
                 ("imported_vertices", totals.imported_vertices)]
        if chunk.version:
            stated = Cursor(cursor.take(cursor.left() - 16), chunk.base(), "index")  # without the trailer
            cursor = Cursor(packed_blob(stated), chunk.base(), "index (unpacked)")
            previous_index, found = cursor.varint(), found[1:]
        for name, value in found:
            if cursor.varint() != value:
                cursor.fail(f"{name} not as found")
        if cursor.list_of(cursor.varint) != totals.block_cells:
            cursor.fail("block_cells not as found")
        if chunk.version:
            self._index_columns(cursor, previous_index)
            return
        streams = cursor.list_of(lambda: (cursor.text(), cursor.varint()))
        if streams != sorted(self.stream_bytes.items()):
            cursor.fail("streams not as found")
        cursor.list_of(lambda: (cursor.varint32(), cursor.list_of(lambda: (cursor.f64(), cursor.f64()))))  # ranges
        entries = cursor.list_of(lambda: self._entry(cursor))
        cursor.end()
        self._expect_entries(cursor, entries, self.entries)

    @staticmethod
    def _expect_entries(cursor, entries, all_found):
        if len(entries) != len(all_found):
            cursor.fail("more or fewer entries than chunks")
        for number, (stated, found) in enumerate(zip(entries, all_found)):
            # What a chunk holds that this reader does not know, it cannot say.
            if stated[:3] != found[:3] or (found[3] is not None and stated[3] != found[3]):
                cursor.fail(f"entry {number} is not of the chunk at byte {found[1]}")

    def _listed_from(self, cursor, previous_index):
        """The chunks that an index lists: all, or those from an earlier index on."""
        offset = self.entries[-1][1] + self.entries[-1][2]  # of this index
        self.followed[offset] = 1
        if previous_index == 0:
            return self.entries
        if previous_index not in self.indexes:
            cursor.fail("a previous_index where no index begins")
        self.followed[offset] += self.followed[previous_index]
        if self.followed[offset] > 64:
            cursor.fail("more than 64 indexes to follow")
        return self.entries[self.indexes[previous_index]:]

    def _index_columns(self, cursor, previous_index):
        """Version 1, behind block_cells."""
        count, found = cursor.varint(), self._listed_from(cursor, previous_index)
        if count != len(found):
            cursor.fail("more or fewer entries than chunks")
        kinds = [cursor.u8() for _ in range(count)]
        offset, entries = found[0][1], []
        for kind in kinds:
            size = cursor.varint()
            entries.append([kind, offset, size, None])
            offset += size
        groups = kinds.count(GROUP)
        segments = self._differences(cursor, groups, MASK32)
        cells, vertices, header_bytes = ([cursor.varint() for _ in range(groups)] for _ in range(3))
        boxes = [[cursor.short_number() for _ in range(6)] for _ in range(groups)]
        before_cells, before_vertices = [0, *accumulate(cells)], [0, *accumulate(vertices)]
        of_group = zip(segments, before_cells, cells, before_vertices, vertices, boxes, header_bytes)
        parts = [cursor.varint() for _ in range(kinds.count(STEP_VALUES))]
        arrays, in_groups = (self._differences(cursor, sum(parts), MASK32) for _ in range(2))
        steps = self._differences(cursor, sum(parts), MASK64)
        counts = [cursor.varint() for _ in range(sum(parts))]
        references, codecs = ([cursor.u8() for _ in range(sum(parts))] for _ in range(2))
        covered = [(cursor.varint32(), cursor.varint()) if codec == BUNDLE else (1, 1) for codec in codecs]
        if any(not 1 <= a * s <= MOST_PAIRS for a, s in covered):
            cursor.fail("a bundle of no arrays or steps, or of too many")
        cursor.end()
        firsts = []
        for i, count in enumerate(counts):
            goes_on = i > 0 and (arrays[i], steps[i]) == (arrays[i - 1], steps[i - 1])
            firsts.append(firsts[-1] + counts[i - 1] if goes_on else 0)
        of_part = zip(arrays, steps, firsts, counts, in_groups, references, codecs, *zip(*covered))
        of_chunk = iter(parts)
        for entry in entries:
            if entry[0] == GROUP:
                entry[3] = list(next(of_group))
            elif entry[0] == STEP_VALUES:
                entry[3] = [list(part) for part in islice(of_part, next(of_chunk))]
        self._expect_entries(cursor, [tuple(entry) for entry in entries], found)

    @staticmethod
    def _differences(cursor, count, mask):
        values = (cursor.svarint() for _ in range(count))
        return list(accumulate(values, lambda a, b: (a + b) & mask, initial=0))[1:]

    @staticmethod
    def _entry(cursor):
        entry = cursor.u8(), cursor.varint(), cursor.varint()
        listed = None
        if entry[0] == GROUP:
            listed = [cursor.varint32(), *(cursor.varint() for _ in range(4))]
            listed += [[cursor.f64() for _ in range(6)], cursor.varint()]
        elif entry[0] == STEP_VALUES:
            part = [cursor.varint32(), *(cursor.varint() for _ in range(3))]
            listed = [[*part, cursor.varint32(), cursor.u8(), cursor.u8(), 1, 1]]
        return *entry, listed


# ---------------------------------------------------------------------------- 38 Archive


def _good_name(name):
    if not 1 <= len(name) <= 255 or name in (b".", b".."):
        return False
    return all(byte >= 32 and byte != 127 and byte not in b"/\\" for byte in name)


def read_archive(data):
    """(name, bytes) of the members."""
    if len(data) < 64:
        raise ShmError("truncated", "archive", len(data))
    at = struct.unpack("<Q", data[-16:-8])[0]
    if at > len(data) - 48:
        raise ShmError("an offset beyond the file", "trailer", len(data) - 16)
    read_trailer(data, len(data) - 16, at)
    chunk = read_chunk(data, at, 0)
    if chunk.kind != MEMBERS or chunk.segment:
        raise ShmError("no members chunk where the trailer points to", "members", at)
    read_trailer(data, chunk.end(), at)  # the same again, where there is parity between (section 40)
    cursor = Cursor(chunk.payload, chunk.base(), "members")
    if cursor.take(8) != data[8:16]:
        cursor.fail("not the version and features of the file start")
    members, names, first = [], set(), 16
    for name, size in cursor.list_of(lambda: (cursor.text(), cursor.varint())):
        if not _good_name(name) or name in names:
            cursor.fail("a name that names no file, or stands twice")
        names.add(name)
        if size > at - first:
            cursor.fail("a member beyond the members chunk")
        members.append((name, data[first : first + size]))
        first += size
    cursor.end()
    if first != at:
        cursor.fail("members that do not end where the members chunk begins")
    return members


def is_archive(data):
    return read_file_start(data) == ARCHIVE
