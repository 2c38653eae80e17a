"""Reads files with the native library, and describes the data as lines of text. web_read.mjs creates the same
lines with the web package.

Needs the environment variable SHMFORMAT_LIBRARY, and bindings/python on the Python path.
"""
import hashlib
import json
import subprocess
import time
from pathlib import Path

import numpy as np

import shmformat
from shmformat._library import DTYPES, SHAPES, check, copied, ffi, lib, struct, text

HERE = Path(__file__).resolve().parent
LOCATIONS = ("point", "cell", "global", "node_set", "side_set", "element_set")
TYPES = {number: dtype.name for number, dtype in DTYPES.items()}


def name_of(chars):
    """Decodes a name as the web package does for web pages, even if the name is not valid UTF-8."""
    return text(chars).encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def hashed(values):
    values = np.ascontiguousarray(values)
    return f"{values.dtype.name} {values.size} {hashlib.sha256(values.tobytes()).hexdigest()}"


def doubles(*numbers):
    return hashed(np.array(numbers, np.float64))


def wide(numbers):
    return hashed(np.asarray(numbers).astype(np.uint64))


class Native:
    """Reads a file with the same sequence of calls as web_read.mjs."""

    def __init__(self, content, bare):
        self.lines, self.seconds, self.bare = [], 0.0, bare
        self.content = ffi.from_buffer(content) if content else ffi.new("char[1]")
        self.file = ffi.new("shmf_file**")
        self.options = struct("open_options")
        if not self.attempt("open", lambda: check(lib.shmf_open_memory, self.content, len(content), self.options,
                                                  self.file)):
            return
        opened = self.file[0]
        if not lib.shmf_is_archive(opened):
            self.read_file(opened)
            return
        for member in range(lib.shmf_member_count(opened)):
            self.lines.append(["member", name_of(lib.shmf_member_name(opened, member))])
            if self.attempt("open", lambda m=member: check(lib.shmf_open_member, opened, m, self.options, self.file)):
                self.read_file(self.file[0])
        lib.shmf_close(opened)

    def attempt(self, what, call):
        before = time.process_time()
        try:
            call()
        except (shmformat.Error, MemoryError) as error:
            status = "no memory" if isinstance(error, MemoryError) else error.code
            self.lines.append([what, f"! {status}: {error}"])
            return False
        finally:
            self.seconds += time.process_time() - before
        return True

    def told(self, kind, call, *arguments):
        own = struct(kind)
        check(call, self.mesh, *arguments, own)
        return own

    def listed(self, call, dtype, c_type, *arguments):
        numbers, count = ffi.new(f"{c_type}**"), ffi.new("uint64_t*")
        check(call, self.mesh, *arguments, ffi.cast(f"const {c_type}**", numbers), count)
        return copied(numbers[0], count[0], dtype)

    def put(self, what, *words):
        if not self.bare:
            self.lines.append([what, " ".join(map(str, words))])

    def read_file(self, mesh):
        self.mesh = mesh
        self.read_mesh()
        lib.shmf_close(mesh)

    def read_mesh(self):
        self.described = []
        if self.attempt("open", self.describe):
            self.lines += [] if self.bare else self.described
            self.read_all()

    def describe(self):
        """Stores the lines that describe the file in `self.described`. The caller prints them only if the whole
        file can be described, because the web package reports nothing about a file that it cannot describe
        completely."""
        def put(what, *words):
            self.described.append([what, " ".join(map(str, words))])

        self.info = info = self.told("info", lib.shmf_get_info)
        self.arrays = []
        put("mesh", info.vertices, info.cells, info.hexahedra, info.steps, info.file_bytes, info.segments,
            TYPES[info.coordinate_type], ("keep", "stream", "free")[info.order], name_of(info.source_format),
            doubles(info.coordinate_error), f"{info.digest:016x}" if info.has_digest else "null")
        for i in range(info.blocks):
            block = self.told("block", lib.shmf_get_block, i)
            put("block", block.id, SHAPES[block.shape], block.nodes_per_cell, block.cells, name_of(block.name))
        for i in range(info.arrays):
            array = self.told("array", lib.shmf_get_array, i)
            steps = self.listed(lib.shmf_get_steps, np.uint64, "uint64_t", i).tolist() if array.per_step else None
            self.arrays.append((array.location, array.type, steps, name_of(array.name)))
            blocks = "all" if array.blocks == ffi.NULL else ",".join(str(array.blocks[b])
                                                                     for b in range(array.block_count))
            put("array", LOCATIONS[array.location], TYPES[array.type], array.components, array.elements, blocks,
                doubles(array.error), "none" if steps is None else ",".join(map(str, steps)), name_of(array.role),
                name_of(array.name))
        put("times", doubles(*self.listed(lib.shmf_get_times, np.float64, "double")))

    def read_all(self):
        still = [(i, 0) for i, array in enumerate(self.arrays) if array[2] is None]
        self.read("read", "all", still, mesh=True)
        for i, array in enumerate(self.arrays):
            for step in array[2] or ():
                self.read("step", "step", [(i, step)])
        if self.bare:
            return
        piece = struct("selection")
        piece.first_cell = self.info.cells // 3
        piece.end_cell = min(piece.first_cell + 20, self.info.cells)
        self.read("piece", "piece", still, mesh=True, numbers=True, selection=piece)
        self.attempt("boundary", lambda: self.put_boundary([i for i, _ in still]))
        for i in range(self.info.segments):
            s = self.told("segment", lib.shmf_get_segment, i)
            self.put("segment", s.first_cell, s.cells, s.first_vertex, s.vertices, s.bytes, doubles(*s.box))
        self.attempt("sets", self.put_sets)
        self.attempt("extras", self.put_extras)
        if self.attempt("verify", lambda: check(lib.shmf_verify, self.mesh, ffi.NULL)):
            self.put("verify", "good")

    def read(self, what, prefix, arrays, mesh=False, numbers=False, selection=ffi.NULL):
        counts = struct("counts")
        wanted = []  # (label, what, type, array, step)
        if mesh:
            wanted += [("points", lib.SHMF_POINTS, self.info.coordinate_type, 0, 0),
                       ("connectivity", lib.SHMF_CORNERS, lib.SHMF_UINT32, 0, 0),
                       ("offsets", lib.SHMF_CORNER_BEGIN, lib.SHMF_UINT32, 0, 0),
                       ("types", lib.SHMF_CELL_TYPES, lib.SHMF_UINT8, 0, 0),
                       ("blocks", lib.SHMF_CELL_BLOCKS, lib.SHMF_UINT32, 0, 0)]
        if numbers:
            wanted += [("vertex numbers", lib.SHMF_VERTEX_NUMBERS, lib.SHMF_UINT64, 0, 0),
                       ("cell numbers", lib.SHMF_CELL_NUMBERS, lib.SHMF_UINT64, 0, 0)]
        for i, step in arrays:
            location, kind, steps, name = self.arrays[i]
            wanted.append((f"{LOCATIONS[location]} {name} {'static' if steps is None else step}", lib.SHMF_VALUES, kind,
                           i, step))
        values = []

        def call():
            check(lib.shmf_select, self.mesh, selection, ffi.NULL, counts)
            targets = ffi.new("shmf_target[]", len(wanted))
            for target, (_, kind, dtype, array, step) in zip(targets, wanted):
                target.struct_size = ffi.sizeof("shmf_target")
                target.what, target.type, target.array, target.step = kind, dtype, array, step
                target.flags = lib.SHMF_FILL
            check(lib.shmf_read, self.mesh, targets, len(wanted), ffi.NULL)
            for target in targets:
                values.append(np.empty(target.used // DTYPES[target.type].itemsize, DTYPES[target.type]))
                target.data, target.bytes = ffi.from_buffer(values[-1]) if values[-1].size else ffi.NULL, target.used
            check(lib.shmf_read, self.mesh, targets, len(wanted), ffi.NULL)

        if not self.attempt(what, call) or self.bare:
            return
        self.put(f"{prefix} counts", counts.vertices, counts.cells)
        for (label, *_), got in zip(wanted, values):
            numbers = label in ("connectivity", "offsets", "vertex numbers", "cell numbers")
            self.put(f"{prefix} {label}", wide(got) if numbers else hashed(got))

    def put_boundary(self, arrays):
        made, options, surface = ffi.new("shmf_boundary**"), struct("boundary_options"), struct("surface")
        listed = ffi.new("uint32_t[]", arrays or [0])
        options.arrays, options.array_count = listed, len(arrays)
        check(lib.shmf_select, self.mesh, ffi.NULL, ffi.NULL, ffi.NULL)
        check(lib.shmf_find_boundary, self.mesh, options, ffi.NULL, made)
        boundary = ffi.gc(made[0], lib.shmf_boundary_free)
        check(lib.shmf_get_surface, boundary, surface)
        s = surface

        def values(at):
            dtype = DTYPES[self.arrays[arrays[at]][1]]
            return hashed(copied(s.array_values[at], s.array_bytes[at] // dtype.itemsize, dtype))

        self.put("boundary", s.vertices, s.faces, s.left_out,
                 hashed(copied(s.xyz, 3 * s.vertices, DTYPES[s.coordinate_type])),
                 wide(copied(s.face_corners, s.corners, np.uint32)), wide(copied(s.face_begin, s.faces + 1, np.uint64)),
                 wide(copied(s.vertex_numbers, s.vertices, np.uint64)), wide(copied(s.cell_numbers, s.faces, np.uint64)),
                 hashed(copied(s.cell_blocks, s.faces, np.uint32)), hashed(copied(s.sides, s.faces, np.uint32)),
                 *map(values, range(len(arrays))))

    def put_sets(self):
        count = ffi.new("uint64_t*")
        check(lib.shmf_set_count, self.mesh, count)

        def some(data, length, dtype):
            return hashed(copied(data, length, dtype)) if data != ffi.NULL else "none"

        for i in range(count[0]):
            s = self.told("set", lib.shmf_get_set, i)
            self.put("set", ("node", "side", "element")[s.kind], s.id, wide(copied(s.numbers, s.members, np.uint64)),
                     some(s.sides, s.members, np.int32),
                     some(s.blocks if s.block_count else ffi.NULL, s.block_count, np.uint32),
                     some(s.factors if s.factor_count else ffi.NULL, s.factor_count, np.float64), name_of(s.name))

    def put_extras(self):
        count = ffi.new("uint64_t*")
        check(lib.shmf_extra_count, self.mesh, count)
        for i in range(count[0]):
            e = self.told("extra", lib.shmf_get_extra, i)
            dtype = DTYPES[e.type]
            self.put("extra", name_of(e.key), ("nothing", "vertices", "cells")[e.refers],
                     ",".join(str(e.shape[d]) for d in range(e.dimensions)),
                     hashed(copied(e.data, e.bytes // dtype.itemsize, dtype)))


def changed(path, flips=(), cut=None):
    content = bytearray(Path(path).read_bytes())
    for byte, bit in flips:
        content[byte] ^= 1 << bit
    return bytes(content[:cut])


def native(path, flips=(), cut=None, bare=False):
    """Returns (lines, processor seconds of the calls)."""
    done = Native(changed(path, flips, cut), bare)
    return done.lines, done.seconds


class Web:
    """Reads files with the web package, in a Node.js process that runs web_read.mjs."""

    def __init__(self, node, package):
        self.process = subprocess.Popen([node, str(HERE / "web_read.mjs"), str(package)], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.wait(60)
        self.process.stdout.close()

    def __call__(self, path, flips=(), cut=None, bare=False):
        request = {"path": str(path), "flips": [list(flip) for flip in flips], "cut": cut, "bare": bare}
        print(json.dumps(request), file=self.process.stdin, flush=True)
        line = self.process.stdout.readline()
        if not line:
            raise AssertionError(f"{path}: the process of Node.js ended")
        told = json.loads(line)
        return told["lines"], told["seconds"]


def difference(native_lines, web_lines):
    """Returns the first pair of lines that differ, or None if all lines are equal."""
    for ours, theirs in zip(native_lines, web_lines):
        if ours != theirs:
            return ours, theirs
    if len(native_lines) != len(web_lines):
        longer = max(native_lines, web_lines, key=len)
        return "only one has", longer[min(len(native_lines), len(web_lines))]
    return None
