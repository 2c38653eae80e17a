"""Section 50: digests."""

from functools import cache

from .basics import HEXAHEDRON, MASK64, ShmError
from .schema import CELL, POINT

CELLS, COORDINATES, STEP_TIMES, FIRST_ARRAY = 0, 1, 2, 3  # topics
NEXT = 0x9E3779B97F4A7C15


def mix(key, word):
    x = (word ^ key) * 0xFF51AFD7ED558CCD & MASK64
    x = (x ^ x >> 32) * 0xC4CEB9FE1A85EC53 & MASK64
    return x ^ x >> 32


@cache
def seed(topic, step):
    return mix(mix(0, topic), step)


def first_key(topic, step, number):
    return seed(topic, step) + (number << 20) * NEXT


def of_words(topic, step, number, words):
    key = first_key(topic, step, number)
    return sum(mix(key + i * NEXT & MASK64, word) for i, word in enumerate(words))


def of_values(topic, step, numbers, values, components):
    return sum(of_words(topic, step, number, values[i * components : (i + 1) * components])
               for i, number in enumerate(numbers))


def of_cell(schema, cell):
    number, block, nodes, _ = cell
    words = [block | len(nodes) << 32, *nodes]
    info = schema.blocks[block]
    if schema.corner_order or info.shape != HEXAHEDRON or info.nodes_per_cell != 8:
        return of_words(CELLS, 0, number, words)
    key = first_key(CELLS, 0, number)
    return mix(key & MASK64, words[0]) + sum(mix(key + NEXT & MASK64, node) for node in nodes)


def of_tile(schema, tile):
    total = sum(of_cell(schema, cell) for cell in tile.cells)
    total += of_values(COORDINATES, 0, tile.vertex_numbers, tile.xyz, 3)
    for index, array in enumerate(schema.arrays):
        if array.per_step:
            continue
        numbers = tile.vertex_numbers
        if array.location == CELL:
            numbers = [cell[0] for cell in tile.cells if array.covers(cell[1])]
        total += of_values(FIRST_ARRAY + index, 0, numbers, tile.arrays.get(index, []), array.components)
    return total & MASK64


class Numbers:
    """The numbers of the vertices and cells of a group, for the digests of its step values."""

    def __init__(self, tiles):
        self.vertices = [number for tile in tiles for number in tile.vertex_numbers]
        self.cells = [cell[:2] for tile in tiles for cell in tile.cells]

    def of(self, array, count):
        if array.location == POINT:
            return self.vertices
        if array.location == CELL:
            return [number for number, block in self.cells if array.covers(block)]
        return range(count)


def expect(stated, found, what, chunk):
    if stated is not None and stated != found & MASK64:
        raise ShmError(f"{what} that do not match their digest", "digest", chunk.base())
