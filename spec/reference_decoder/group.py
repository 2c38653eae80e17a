"""Sections 6, 17 and 18: groups, segments, tiles."""

import math

from .basics import MASK64, SCALAR_BYTES, Cursor, ShmError, checksum, reject_unless
from .coders import RangeDecoder, Signed, signed
from .columns import COLUMNS, MIXED_COLUMNS, SHUFFLED_ZSTD, Column, columns_with_tables, shuffled_values
from .connectivity import MIXED, PAPER, PATTERNS, REPLAY, ROWS, SHIFTS, Connectivity
from .domains import as_double
from .neighbourhoods import Neighbourhood, Neighbourhoods
from .patterns import TERMS, Patterns, Terms, columns_of_terms
from .schema import CELL, KEEP, POINT
from .shifts import Differences, NeighboursByNumber, Shifts, columns_of_differences
from .special_values import APART, SpecialValues, has_special_values
from .vertex_numbers import Imports, VertexNumbers

PREDICTIVE, DIFFERENCES = 2, 12
CONNECTIVITY, CORNER_ORDER, CELL_NUMBERS, VERTEX_NUMBERS, GEOMETRY, ARRAY, IMPORTS = range(1, 8)
STREAM_NAMES = {CONNECTIVITY: b"connectivity", CORNER_ORDER: b"corner order", CELL_NUMBERS: b"cell numbers",
                VERTEX_NUMBERS: b"vertex numbers", GEOMETRY: b"geometry", IMPORTS: b"imports"}
MOST_CELLS = 2**20
TILE_CELLS, TILE_BYTES = 4096, 2**22

# Limits of this reader (section 26).
MOST_DECODED_BYTES, MOST_ACTIVE = 2**30, 2**27

# ---------------------------------------------------------------------------- 6 Group


class Stream:
    def __init__(self, kind, array, codec, data):
        self.kind, self.array, self.codec, self.data = kind, array, codec, data


class GroupHeader:
    def __init__(self, schema, chunk):
        payload, segment = chunk.payload, chunk.segment
        cursor = chunk.cursor("group header")
        self.first_cell, self.first_vertex, self.cells, self.vertices = (cursor.varint() for _ in range(4))
        self.imported_vertices, self.unused_vertices, self.max_active_vertices = (cursor.varint() for _ in range(3))
        self.decoded_bytes = cursor.varint()
        self.box = [cursor.short_number() if chunk.version else cursor.f64() for _ in range(6)]
        listed = cursor.list_of(lambda: self._stream(cursor, schema, chunk.version))
        sums_to = cursor.at
        if cursor.u32() != checksum(payload[:sums_to]):
            cursor.fail("a checksum that does not match")
        self.header_bytes = cursor.at
        self._check(cursor, segment)
        self.streams = {}
        before = (0, -1)
        for kind, array, codec, size, sum_ in listed:
            if (kind, array) <= before:
                cursor.fail("streams that do not ascend")
            before = kind, array
            if size > cursor.left():
                cursor.fail("a stream beyond the payload")
            data = cursor.take(size)
            if checksum(data) != sum_:
                cursor.fail("a stream whose checksum does not match")
            self.streams[kind if kind != ARRAY else (ARRAY, array)] = Stream(kind, array, codec, data)
        cursor.end()

    def _stream(self, cursor, schema, version):
        kind = cursor.u8()
        array = cursor.varint32() if kind == ARRAY else 0
        codec = cursor.u8()
        if version == 0:
            cursor.varint32()  # needs
        size, sum_ = cursor.varint(), cursor.u32()
        if kind == ARRAY and (array >= len(schema.arrays) or schema.arrays[array].per_step):
            cursor.fail("a stream of no static array")
        allowed = {CONNECTIVITY: (PAPER, ROWS, REPLAY, MIXED, SHIFTS, PATTERNS),
                   CORNER_ORDER: (PAPER, ROWS, REPLAY, MIXED), CELL_NUMBERS: (PAPER, ROWS, REPLAY, MIXED),
                   VERTEX_NUMBERS: (PREDICTIVE,), IMPORTS: (PREDICTIVE,),
                   GEOMETRY: (SHUFFLED_ZSTD, COLUMNS, MIXED_COLUMNS, DIFFERENCES, TERMS),
                   ARRAY: (SHUFFLED_ZSTD, COLUMNS, MIXED_COLUMNS, DIFFERENCES, TERMS)}
        if kind not in allowed:
            cursor.fail("a stream of no kind that is known")
        if codec - (APART if kind == ARRAY and has_special_values(codec) else 0) not in allowed[kind]:
            cursor.fail("unsupported: a codec that is not known, or not of this stream")
        return kind, array, codec, size, sum_

    def _check(self, cursor, segment):
        if self.cells > MOST_CELLS or self.unused_vertices > self.vertices:
            cursor.fail("more cells or unused vertices than there can be")
        if segment == 0 and self.imported_vertices:
            cursor.fail("imported vertices in segment 0")
        if self.decoded_bytes > MOST_DECODED_BYTES or self.max_active_vertices > MOST_ACTIVE:
            cursor.fail("over limit: a group of too many bytes or active vertices")

    def data(self, kind):
        """The bytes of a stream; none if it is not listed."""
        stream = self.streams.get(kind)
        return stream.data if stream else b""


# ---------------------------------------------------------------------------- Tiles


class Tile:
    """What a reader gives out at once."""

    def __init__(self, first_vertex, first_cell):
        self.first_vertex, self.first_cell = first_vertex, first_cell
        self.items, self.cell_items = [], []  # neighbourhoods of all vertices, and of cells
        self.vertex_numbers = []  # of own vertices
        self.cells = []  # (number, block, corners as stored, bits of last use)
        self.vertices_before_cell = []
        self.vertex_difference_numbers = []  # section 34, of all vertices
        self.vertex_terms = []  # section 44, of all vertices: slot, slots of the terms
        self.bytes = 0
        self.xyz, self.arrays = [], {}  # own vertices only

    def elements(self, array, steps=False):
        """The elements of an array, and what it skips; of step values imported vertices are skipped too."""
        if array.location == POINT:
            return ([item for item in self.items if not (steps and item.imported)],
                    [item for item in self.items if steps and item.imported])
        return ([item for item in self.cell_items if array.covers(item.block)],
                [item for item in self.cell_items if not array.covers(item.block)])

    def forget_values(self):
        """Step values need the neighbourhoods alone."""
        self.cells, self.vertex_numbers, self.xyz, self.arrays = [], [], [], {}

    def only_own(self, array, values):
        """Values of point arrays without those of imported vertices."""
        if array.location == CELL or not any(item.imported for item in self.items):
            return values
        n, own = array.components, []
        for e, item in enumerate(self.items):
            if not item.imported:
                own += values[e * n : e * n + n]
        return own


class Group:
    """What is kept of a group: tiles, for step values."""

    def __init__(self, segment, header, tiles):
        self.segment, self.header, self.tiles = segment, header, tiles
        stream = header.streams.get(CONNECTIVITY)
        self.patterned = stream is not None and stream.codec == PATTERNS

    def elements(self, array):
        """How many elements of a stepped array it has."""
        return sum(len(tile.elements(array, steps=True)[0]) for tile in self.tiles)


# ---------------------------------------------------------------------------- Segments


class Imported:
    """For who reads all segments: the numbers of vertices that are left alive where a segment ends."""

    def __init__(self):
        self.left_alive = set()

    def take(self, number, segment_has):
        reject_unless(number in self.left_alive, "an imported vertex that no earlier segment has left alive")
        reject_unless(number not in segment_has, "a vertex that is imported twice")
        segment_has.add(number)


class Segment:
    """The coder state of a segment: everything starts afresh with it."""

    def __init__(self, schema, number, first_vertex, first_cell, imported):
        self.begun = False  # whether there was a group
        self.schema, self.number, self.first_vertex, self.all_imported = schema, number, first_vertex, imported
        self.keep = schema.order == KEEP
        self.connectivity = Connectivity(schema)
        self.neighbourhoods = Neighbourhoods(schema, self.connectivity.surface)
        self.numbers, self.imports = VertexNumbers(), Imports()
        self.codec, self.shifts, self.patterns = None, None, None
        self.next_vertex, self.next_cell, self.next_number = first_vertex, first_cell, first_cell
        self.cell_number = Signed()
        self.imported = set()
        tables = columns_with_tables(schema)
        self.columns = {-1: Column(schema.coordinates(), True, schema.earlier_values, copies=True)}
        self.columns.update({i: Column(array, i in tables, schema.earlier_values, copies=True)
                             for i, array in schema.static_arrays()})
        self.differences = {i: Differences(self.columns[i].array) for i in columns_of_differences(schema)}
        self.terms = {i: Terms(self.columns[i].array) for i in columns_of_terms(schema)}
        self.cell_arrays = any(array.location == CELL for array in schema.arrays)
        self.vertex_bytes = 3 * SCALAR_BYTES[schema.coordinate_type]
        self.vertex_bytes += sum(a.element_bytes() for _, a in schema.static_arrays() if a.location == POINT)
        static_cells = [a for _, a in schema.static_arrays() if a.location == CELL]
        self.cell_bytes = [sum(a.element_bytes() for a in static_cells if a.covers(block))
                           for block in range(len(schema.blocks))]

    # ------------------------------------------------------------------ A group

    def decode(self, header):
        """The tiles of a group, with all values."""
        reject_unless(header.first_cell == self.next_cell and header.first_vertex == self.next_vertex,
                      "a group that does not begin where the one before ended")
        stream = header.streams.get(CONNECTIVITY)
        reject_unless(stream or header.cells == 0, "cells without a connectivity stream")
        if self.number == 0:
            reject_unless(IMPORTS not in header.streams, "imports in segment 0")
        if stream:
            reject_unless(self.codec in (None, stream.codec), "another codec than before in the segment")
            reject_unless(stream.codec not in (SHIFTS, PATTERNS) or self.codec == stream.codec or not self.begun,
                          "shifts or patterns that begin behind the first group of their segment")
            self.codec = stream.codec
        self.begun = True
        for kind in (CORNER_ORDER, CELL_NUMBERS):
            if kind in header.streams:
                reject_unless(stream, "a stream without connectivity before it")
                reject_unless(header.streams[kind].codec == self.codec, "streams of different codecs")
        self.header, self.tiles = header, []
        self.finite = [[], [], []]  # coordinates of all vertices, by axis
        self.vertices = self.own = self.imported_count = self.active = self.bytes = 0
        self._new_tile()
        if self.codec == SHIFTS:
            self._shifted_topology(header)
        elif self.codec == PATTERNS:
            self._patterned_topology(header)
        else:
            self._topology(header)
        reject_unless(self.active == header.max_active_vertices, "max_active_vertices is not as stated")
        reject_unless(self.bytes == header.decoded_bytes, "decoded_bytes are not as stated")
        reject_unless(self.imported_count == header.imported_vertices, "imported vertices are not as stated")
        self.tiles = [tile for tile in self.tiles if tile.items or tile.cells]
        for i, column in self.columns.items():
            self._values(i, column, header)
        reject_unless(self._box_fits(header.box), "a box that is not that of its vertices")
        return Group(self.number, header, self.tiles)

    def _box_fits(self, stated):
        """Stated is the box of the coordinates as they were before they were rounded."""
        quantization = self.schema.coordinates().quantization
        by = quantization.promise(self.schema.coordinate_type) if quantization.bits else 0
        found = [min(side, default=math.inf) for side in self.finite] + [max(side, default=-math.inf)
                                                                         for side in self.finite]
        return all(a == b or abs(a - b) <= by for a, b in zip(stated, found))

    def _new_tile(self):
        self.tile = Tile(self.next_vertex, self.next_cell)
        self.tiles.append(self.tile)

    def _add_bytes(self, count):
        self.bytes += count
        self.tile.bytes += count
        reject_unless(self.bytes <= self.header.decoded_bytes, "more bytes than decoded_bytes")

    def _see_active(self, live):
        self.active = max(self.active, live)
        reject_unless(live <= self.header.max_active_vertices, "more live vertices than max_active_vertices")

    def _add_vertex(self, item, number, imported):
        tile = self.tile
        tile.items.append(item)
        item.imported = imported
        if imported:
            self.imported_count += 1
            reject_unless(self.imported_count <= self.header.imported_vertices,
                          "more imported vertices than stated")
            self.all_imported.take(number, self.imported)
        else:
            self.own += 1
            self.next_vertex += 1
            reject_unless(self.own <= self.header.vertices, "more vertices than stated")
            tile.vertex_numbers.append(number)
        self._add_bytes(self.vertex_bytes)

    def _topology(self, header):
        connectivity = self.connectivity
        if self.codec is not None:
            connectivity.begin_group(self.codec, header.data(CONNECTIVITY), header.data(CORNER_ORDER))
            self.numbers.replay = connectivity.hexahedra if self.codec == REPLAY and self.keep else None
        self.numbers.begin_group(header.data(VERTEX_NUMBERS))
        self.imports.begin_group(header.data(IMPORTS))
        self.cell_numbers = RangeDecoder(header.data(CELL_NUMBERS))
        for _ in range(header.cells):
            if len(self.tile.cells) >= TILE_CELLS or self.tile.bytes >= TILE_BYTES:
                self._new_tile()
            self._cell()
        unused = header.vertices - self.own
        reject_unless(unused == header.unused_vertices, "unused_vertices are not as stated")
        while self.own < header.vertices:
            if self.tile.bytes >= TILE_BYTES:
                self._new_tile()
            vertex = connectivity.surface.add_vertex()
            self._see_active(connectivity.surface.live())
            if self.keep:
                self.numbers.of_unused(vertex)
            else:
                vertex.number = self.next_vertex
            self._add_vertex(self.neighbourhoods.of_unused(vertex), vertex.number, False)
            connectivity.finalize_vertex(vertex)

    def _cell(self):
        connectivity, neighbourhoods = self.connectivity, self.neighbourhoods
        cell = connectivity.cell()
        self._see_active(connectivity.surface.live())
        if self.keep:
            self.numbers.of_cell(cell)
        neighbourhoods.begin_cell()
        for p, item in zip(cell.new_positions, neighbourhoods.of_cell(cell)):
            vertex = cell.v[p]
            imported = bool(self.number and self.imports.flag(cell, p))
            vertex.import_state = 2 if imported else 1
            if not self.keep:
                vertex.number = self.numbers.of_imported(cell, p) if imported else self.next_vertex
                reject_unless(not imported or vertex.number < self.first_vertex, "an imported vertex of this segment")
            self._add_vertex(item, vertex.number, imported)
        item = neighbourhoods.of_the_cell(cell) if self.cell_arrays else Neighbourhood(0)
        self.tile.cell_items.append(item)
        neighbourhoods.end_cell(cell)
        number = self.next_number
        if self.keep and self.schema.delay > 0:
            number = (number + signed(self.cell_numbers, self.cell_number)) & MASK64
        self.next_number = (number + 1) & MASK64
        corners, last_use = [0] * cell.count, 0
        for i, vertex in enumerate(cell.v):
            corners[cell.stored_position(i)] = vertex.number
        for i in cell.last_use:
            last_use |= 1 << cell.stored_position(i)
            self._forget_number(cell.v[i].number)
        self._add_cell(number, cell.block_index, corners, last_use)
        connectivity.finalize(cell)

    def _forget_number(self, number):
        self.all_imported.left_alive.discard(number)

    def _add_cell(self, number, block, corners, last_use):
        tile = self.tile
        tile.vertices_before_cell.append(len(tile.vertex_numbers))
        tile.cells.append((number, block, corners, last_use))
        self.next_cell += 1
        self._add_bytes(8 * len(corners) + self.cell_bytes[block])

    def end(self):
        """What the segment leaves alive for later ones."""
        if self.shifts:
            self.all_imported.left_alive.update(vertex.given for vertex in self.shifts.live.values())
        elif self.patterns:
            self.all_imported.left_alive.update(vertex.number for vertex in self.patterns.live.values())
        else:
            live = self.connectivity.surface.by_id.values()
            self.all_imported.left_alive.update(vertex.number for vertex in live)

    # ------------------------------------------------------------------ A group of shifts

    def _shifted_topology(self, header):
        schema = self.schema
        if self.shifts is None:
            takes = schema.delay == 0 and all(1 <= block.nodes_per_cell <= 64 for block in schema.blocks)
            takes = takes and all(array.components <= 32 for _, array in schema.stepped_arrays())
            reject_unless(takes, "shifts in a schema that does not take them")
            self.shifts = Shifts(schema, self.number, self.first_vertex)
            self.neighbours = None
        shifts = self.shifts
        shifts.begin_group(header.data(CONNECTIVITY), header, 3 * header.decoded_bytes + 64 * header.cells)
        allowed = {CONNECTIVITY, GEOMETRY} | {(ARRAY, i) for i, _ in schema.static_arrays()}
        if not self.keep and self.number > 0:
            allowed.add(VERTEX_NUMBERS)
        reject_unless(set(header.streams) <= allowed, "a stream that segments with shifts do not have")
        bits = shifts.group_ring_bits
        reject_unless(bits or not schema.stepped_arrays(),
                      "shifts without neighbourhoods in a file with stepped arrays")
        if bits and (self.neighbours is None or self.neighbours.bits != bits):
            reject_unless(2**bits <= 4 * max(header.cells, 1), "a ring of more places than a group can fill")
            self.neighbours = NeighboursByNumber(schema, bits)
        neighbours = self.neighbours if bits else None
        self.numbers.begin_group(header.data(VERTEX_NUMBERS))
        for _ in range(header.cells):
            if len(self.tile.cells) >= TILE_CELLS or self.tile.bytes >= TILE_BYTES:
                self._new_tile()
            cell = shifts.cell(self._imported_by_shifts)
            self._see_active(len(shifts.live))
            for i, vertex in cell.new:
                item = neighbours.of_vertex(cell, i, vertex.number) if neighbours else Neighbourhood(0)
                self.tile.vertex_difference_numbers.append(vertex.number)
                self._add_vertex(item, vertex.given, vertex.imported)
            item = neighbours.of_cell(cell) if neighbours else Neighbourhood(0)
            item.block = cell.block_index
            self.tile.cell_items.append(item)
            corners = [shifts.live[number].given for number in cell.numbers]
            for vertex in shifts.finalize(cell):
                self._forget_number(vertex.given)
            self._add_cell(self.next_cell, cell.block_index, corners, cell.last_use)
        reject_unless(header.vertices - self.own == header.unused_vertices, "unused_vertices are not as stated")
        while self.own < header.vertices:
            if self.tile.bytes >= TILE_BYTES:
                self._new_tile()
            vertex = shifts.unused()
            self._see_active(len(shifts.live) + 1)
            item = neighbours.of_unused(vertex.number) if neighbours else Neighbourhood(0)
            self.tile.vertex_difference_numbers.append(vertex.number)
            self._add_vertex(item, vertex.number, False)
        reject_unless(shifts.definitions.left() == 0, "definitions that are left over")

    def _imported_by_shifts(self):
        number = self.numbers.of_imported_by_shifts()
        reject_unless(number < self.first_vertex, "an imported vertex of this segment")
        return number

    # ------------------------------------------------------------------ A group of patterns

    def _patterned_topology(self, header):
        schema = self.schema
        if self.patterns is None:
            takes = schema.delay == 0 and all(1 <= block.nodes_per_cell <= 64 for block in schema.blocks)
            reject_unless(takes, "patterns in a schema that does not take them")
            self.patterns = Patterns(schema, self.number, self.first_vertex)
        patterns, stream = self.patterns, header.streams.get(CONNECTIVITY)
        reject_unless(stream, "a group of patterns without connectivity")
        allowed = {CONNECTIVITY, GEOMETRY} | {(ARRAY, i) for i, _ in schema.static_arrays()}
        if not self.keep and self.number > 0:
            allowed.add(VERTEX_NUMBERS)
        reject_unless(set(header.streams) <= allowed, "a stream that segments with patterns do not have")
        patterns.begin_group(stream.data, header)
        self.numbers.begin_group(header.data(VERTEX_NUMBERS))
        for _ in range(header.cells):
            if len(self.tile.cells) >= TILE_CELLS or self.tile.bytes >= TILE_BYTES:
                self._new_tile()
            cell = patterns.cell(self._imported_by_shifts)
            self._see_active(len(patterns.live))
            for vertex, terms in cell.new:
                self.tile.vertex_terms.append((vertex.slot, terms))
                self._add_vertex(Neighbourhood(0), vertex.number, vertex.imported)
            item = Neighbourhood(0)
            item.block = cell.block_index
            self.tile.cell_items.append(item)
            corners = [vertex.number for vertex in cell.v]
            for vertex in patterns.finalize(cell):
                self._forget_number(vertex.number)
            self._add_cell(self.next_cell, cell.block_index, corners, cell.last_use)
        reject_unless(header.vertices - self.own == header.unused_vertices, "unused_vertices are not as stated")
        while self.own < header.vertices:
            if self.tile.bytes >= TILE_BYTES:
                self._new_tile()
            number = patterns.unused()
            self._see_active(len(patterns.live) + 1)
            self.tile.vertex_terms.append((None, ()))
            self._add_vertex(Neighbourhood(0), number, False)
        patterns.end_group()

    # ------------------------------------------------------------------ Values

    def _values(self, i, column, header):
        """Geometry (i = -1) or a static array."""
        array = column.array
        tiles = [tile.elements(array) for tile in self.tiles]
        elements = sum(len(tile[0]) for tile in tiles)
        stream = header.streams.get(GEOMETRY if i < 0 else (ARRAY, i))
        shifted, patterned = self.codec == SHIFTS, self.codec == PATTERNS
        if (shifted or patterned) and stream is None:
            reject_unless(elements == 0, "too few values")
            return
        codec, data = (stream.codec, stream.data) if stream else (COLUMNS, b"")
        special = None
        try:
            if has_special_values(codec):
                codec -= APART
                width = array.element_bytes() // array.components
                special = SpecialValues(array, data, header.decoded_bytes // width)
                data = special.rest
            self._check_codec(codec, i, column)
            if codec == DIFFERENCES:
                numbers = [n for tile in self.tiles for n in self._difference_numbers(tile, array)]
                found = self._deal_out(self.differences[i].decode(data, numbers, header.decoded_bytes), array, tiles)
            elif codec == TERMS:
                terms = [term for tile in self.tiles for term in self._terms(tile, array)]
                of_vertices = array.location == POINT
                values = self.terms[i].decode(data, terms, header.decoded_bytes, of_vertices=of_vertices)
                found = self._deal_out(values, array, tiles)
            elif codec == SHUFFLED_ZSTD:
                most = elements * array.element_bytes() if shifted or patterned else header.decoded_bytes
                found = self._deal_out(shuffled_values(data, array, elements, most), array, tiles)
                if i in self.differences and shifted:
                    self.differences[i].forget()
                elif not shifted and not patterned:
                    column.note(tiles, found)
            else:
                reject_unless(not shifted or self.shifts.group_ring_bits, "columns without neighbourhoods")
                found = column.decode(data, codec, tiles, header.decoded_bytes)
        except ShmError as error:
            name = "geometry" if i < 0 else self.schema.stream_name(i).decode(errors="replace")
            error.section = error.section or f"stream {name}"
            raise
        if special:
            restored = special.restore([value for values in found for value in values])
            found = self._deal_out(restored, array, tiles)
        for tile, values in zip(self.tiles, found):
            if i < 0:
                for c in range(3):
                    numbers = [as_double(array.type, bits) for bits in values[c::3]]
                    self.finite[c] += [number for number in numbers if math.isfinite(number)]
                tile.xyz = tile.only_own(array, values)
            else:
                tile.arrays[i] = tile.only_own(array, values)

    def _check_codec(self, codec, i, column):
        """Rejects a codec that is not for column i."""
        shifted, patterned = self.codec == SHIFTS, self.codec == PATTERNS
        reject_unless(codec != MIXED_COLUMNS or column.with_tables, "mixed columns of an array without tables")
        if codec == DIFFERENCES or (shifted and codec in (COLUMNS, MIXED_COLUMNS)):
            reject_unless(shifted and i in self.differences, "a codec that is not for this column")
        reject_unless(codec in (TERMS, SHUFFLED_ZSTD) if patterned else codec != TERMS,
                      "a codec that is not for this segment")
        reject_unless(codec != TERMS or i in self.terms, "terms of too many components")

    def _difference_numbers(self, tile, array):
        if array.location == POINT:
            return tile.vertex_difference_numbers
        return [tile.first_cell + k for k, cell in enumerate(tile.cells) if array.covers(cell[1])]

    @staticmethod
    def _terms(tile, array):
        if array.location == POINT:
            return tile.vertex_terms
        return [(None, ()) for cell in tile.cells if array.covers(cell[1])]

    @staticmethod
    def _deal_out(values, array, tiles):
        found, at = [], 0
        for elements, _ in tiles:
            found.append(values[at : at + len(elements) * array.components])
            at += len(elements) * array.components
        return found
