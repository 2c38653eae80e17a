"""Reads meshes. An array is decoded when a program accesses it."""
from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, BinaryIO, Callable, Union

import numpy as np

from ._library import (DTYPES, HIGH_ORDER, KINDS, NODE_SCHEMES, SHAPES, TYPES, Error, cell_order, check, copied, encoded, ffi,
                       lib, raise_with, struct, text, vtk_type)

if TYPE_CHECKING:
    from ._remote import Remote

Source = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview, BinaryIO]


@dataclass(frozen=True)
class Block:
    """A set of cells of the same shape, e.g. an element block of Exodus or an entity of Gmsh."""
    id: int
    name: str
    shape: str  # Shape of the cells, e.g. "hexahedron".
    nodes_per_cell: int  # Number of nodes of each cell; 0: the number varies from cell to cell.
    cells: int
    # Meaning of the nodes that are not corners: "lagrange", nodes on the cell; "serendipity", nodes on its edges only
    # (cells of order 3 and higher); "bezier", control points.
    node_scheme: str = "lagrange"


def high_order_block(index: int, name: str, kind: int, nodes: int, cells: int) -> Block:
    """Returns the block for cells of the VTK type `kind`, Lagrange or Bezier cells with `nodes` nodes."""
    shape, scheme = HIGH_ORDER[kind]
    if vtk_type(shape, nodes, scheme) != kind:
        if (shape, nodes) not in KINDS or (scheme == "bezier" and cell_order(shape, nodes, "lagrange") != 1):
            raise ValueError(f"cells of VTK type {kind} with {nodes} nodes cannot be written")
        scheme = "lagrange"  # of order 1, or a Lagrange cell of order 2
    return Block(index, name, shape, nodes, cells, scheme)


@dataclass(frozen=True)
class Segment:
    """A run of cells that can be decoded independently."""
    first_cell: int
    cells: int
    first_vertex: int
    vertices: int
    bytes: int
    box: tuple[float, ...]  # Bounding box of the vertices: smallest x, y, z, then largest x, y, z.


@dataclass(frozen=True)
class Set:
    """A named set of vertices, sides or cells. `numbers` contains vertex numbers (node sets) or cell numbers (other
    sets) in the whole mesh."""
    kind: str  # Kind of the set: "node", "side" or "element".
    id: int
    name: str
    numbers: np.ndarray
    sides: np.ndarray | None = None  # For side sets: the side of each cell, numbered from 1 as in Exodus.
    blocks: np.ndarray | None = None  # For element sets: indices of blocks whose cells all belong to the set.
    factors: np.ndarray | None = None  # Distribution factors; None if all are 1.


@dataclass(frozen=True)
class Extra:
    """Values with a key. Extras store data that the mesh model does not cover."""
    key: str
    values: np.ndarray
    refers: str  # Meaning of the values: "vertices" (vertex numbers), "cells" (cell numbers) or "nothing" (neither).


@dataclass(frozen=True)
class Cells:
    """Cells in VTK's form: the vertices of cell i are connectivity[offsets[i]:offsets[i + 1]]."""
    offsets: np.ndarray
    connectivity: np.ndarray
    types: np.ndarray  # VTK cell type of each cell.
    blocks: np.ndarray  # Index of the block of each cell.

    def __len__(self) -> int:
        return len(self.types)


@dataclass
class Arrays:
    """The arrays that Mesh.read() returns."""
    points: np.ndarray | None = None
    cells: Cells | None = None
    point_data: dict[str, np.ndarray] = field(default_factory=dict)
    cell_data: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Boundary:
    """The boundary surface that Mesh.boundary() returns. The points of face i are connectivity[offsets[i]:offsets[i +
    1]], in counter-clockwise order when seen from outside. A face can also be a line (2 points) or a vertex (1
    point)."""
    points: np.ndarray  # Coordinates of the points that the faces use; shape (n, 3).
    offsets: np.ndarray
    connectivity: np.ndarray
    vertex_numbers: np.ndarray  # For each point: its vertex number in the whole file.
    cell_numbers: np.ndarray  # For each face: number of its cell in the whole file.
    blocks: np.ndarray  # For each face: index of the block of its cell.
    # For each face: the side of its cell, numbered from 1 as in Exodus; 0 if the face is the cell itself.
    sides: np.ndarray
    left_out: int  # Number of cells missing from the surface because the faces of their cell type are not known.
    point_data: dict[str, np.ndarray] = field(default_factory=dict)
    cell_data: dict[str, np.ndarray] = field(default_factory=dict)  # Values of cell arrays, one element per face.

    def __len__(self) -> int:
        return len(self.cell_numbers)


@dataclass(frozen=True)
class _Array:
    """The properties of an array, copied from a shmf_array."""
    name: str
    role: str
    location: int
    type: int
    components: int
    per_step: bool
    error: float
    relative_error: float
    fills: tuple[float, ...]
    elements: int
    blocks: list[int] | None  # blocks whose cells have values, or numbers of sets; None: all

    @staticmethod
    def of(info: Any) -> _Array:
        return _Array(text(info.name), text(info.role), info.location, info.type, info.components,
                      bool(info.per_step), info.error, info.relative_error,
                      tuple(info.fills[0:info.fill_count]) if info.fill_count else (), info.elements,
                      list(info.blocks[0:info.block_count]) if info.block_count else None)


class Steps(Mapping):
    """The values of one array at all its time steps, as a mapping: steps[4] decodes the values at step 4."""

    def __init__(self, mesh: Mesh, array: int):
        self._mesh, self._array = mesh, array
        self._steps = mesh._steps_of(array)

    def __getitem__(self, step: int) -> np.ndarray:
        if step not in self._steps:
            raise KeyError(step)
        return self._mesh._values(self._array, step)

    def __contains__(self, step: object) -> bool:
        return step in self._steps

    def __iter__(self) -> Iterator[int]:
        return iter(self._steps)

    def __len__(self) -> int:
        return len(self._steps)


class Data(Mapping):
    """The arrays of a mesh at one location (points, cells, the whole mesh, or sets of one kind), as a mapping from names
    to values. The values of a static array are an ndarray. The values of an array with time steps are a Steps object. If
    several arrays have the same name, only the first array is accessible."""

    def __init__(self, mesh: Mesh, location: int):
        self._mesh = mesh
        self._arrays: dict[str, int] = {}
        for index, array in enumerate(mesh._arrays):
            if array.location == location:
                self._arrays.setdefault(array.name, index)

    def __contains__(self, name: object) -> bool:
        return name in self._arrays

    def __getitem__(self, name: str) -> np.ndarray | Steps:
        index = self._arrays[name]
        if self._mesh._arrays[index].per_step:
            return Steps(self._mesh, index)
        return self._mesh._values(index, 0)

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def role(self, name: str) -> str:
        """Returns "" for an ordinary field. For an array with a special purpose in the source format, returns the name
        of this purpose, e.g. "exodus:node_num_map"."""
        return self._mesh._arrays[self._arrays[name]].role

    def error(self, name: str) -> float:
        """Returns the error bound: the largest possible difference between a value and the original value; 0 if
        lossless or if the bound is relative to each value."""
        return self._mesh._arrays[self._arrays[name]].error

    def relative_error(self, name: str) -> float:
        """Returns the error bound relative to each value: the largest possible difference between a value and the
        original value, divided by the magnitude of the original value; 0 if there is no such bound."""
        return self._mesh._arrays[self._arrays[name]].relative_error

    def fills(self, name: str) -> tuple[float, ...]:
        """Returns the fill values, which mark missing values of the array. They are restored exactly under every
        bound."""
        return self._mesh._arrays[self._arrays[name]].fills

    def on_sets(self, name: str) -> list[int] | None:
        """For data of sets: returns the numbers of the sets whose members have values, in order; None if all sets of
        this kind have values. The sets of each kind are numbered from 0, in the order of Mesh.sets."""
        return self._mesh._arrays[self._arrays[name]].blocks


class _Handle:
    """A shmf_file, together with the objects that must stay alive as long as the file is open."""

    def __init__(self, file: Any, *keep: Any):
        self.file = file
        self.keep = keep
        # The remote file from which the handle reads; closed together with the handle.
        self.remote: Remote | None = None
        self.error: BaseException | None = None  # The exception that a callback raised during the current call.
        self.origin = self  # The handle whose attribute `error` receives the exceptions of callbacks.
        self.selected: Any = None  # Identifies the Mesh whose cells are selected in the file.
        self._calls = 0

    def close(self) -> None:
        if self._calls > 0:
            raise ValueError("the mesh is being read")
        if self.file is not None:
            lib.shmf_close(self.file)
        if self.remote is not None:
            self.remote.close()
        self.file, self.keep, self.remote = None, (), None

    def __del__(self) -> None:
        self.close()

    def __call__(self, call: Any, *arguments: Any) -> None:
        if self.file is None:
            raise ValueError("the mesh is closed")
        self._calls += 1
        try:
            check(call, self.file, *arguments)
        except Error as why:
            raised, self.origin.error = self.origin.error, None
            raise_with(why, raised)
        finally:
            self._calls -= 1


def _options(wanted: Mapping[str, int | None]) -> Any:
    options = struct("open_options")
    for name, value in wanted.items():
        if value is not None:
            if name != "damaged" and value < 1:
                raise ValueError(f"{name} must be at least 1")
            setattr(options, name, value)
    return options


def _opened(source: Source, wanted: Mapping[str, int | None]) -> _Handle:
    file = ffi.new("shmf_file**")
    options = _options(wanted)
    if isinstance(source, str) and re.match(r"[a-z][a-z0-9+.-]+://", source):
        # imported only when needed, because importing _remote takes time and most files are local
        from ._remote import open_url

        remote = open_url(source)
        try:
            handle = _opened_ranges(remote.size, remote.read_into, remote, options, file, remote.tell)
        except BaseException:
            remote.close()
            raise
        handle.remote = remote
        return handle
    if isinstance(source, (str, os.PathLike)):
        check(lib.shmf_open_path, encoded(source), options, file)
        return _Handle(file[0])
    if isinstance(source, (bytes, bytearray, memoryview)):
        buffer = ffi.from_buffer(source)
        check(lib.shmf_open_memory, buffer, len(buffer), options, file)
        return _Handle(file[0], buffer)
    return _opened_object(source, options, file)


def _opened_object(source: BinaryIO, options: Any, file: Any) -> _Handle:
    """Opens a seekable file object, which the caller must keep open."""

    def read_into(offset: int, into: memoryview) -> None:
        source.seek(offset)
        while into:
            some = source.read(len(into))
            if not some:
                raise EOFError("the file is shorter than it was")
            into[:len(some)] = some
            into = into[len(some):]

    return _opened_ranges(source.seek(0, io.SEEK_END), read_into, source, options, file)


def _opened_ranges(size: int, read_into: Callable[[int, memoryview], None], source: Any, options: Any,
                   file: Any, tell: Callable[[Sequence[tuple[int, int]]], None] | None = None) -> _Handle:
    """Opens a file of `size` bytes. read_into(offset, memory) fills the memory with the bytes of the file from `offset`
    on. If read_into raises an exception, it becomes the cause of the Error. `tell`, unless None, is called with the
    ranges that will be read next, each as (first byte, end)."""
    handle = _Handle(None)

    def read_at(_: Any, offset: int, into: Any, count: int, why: Any, why_bytes: int) -> int:
        try:
            read_into(offset, memoryview(ffi.buffer(into, count)).cast("B"))
            return 0
        except BaseException as raised:  # no exception may pass through C
            handle.error = raised
            sentence = str(raised).encode("utf-8", "replace")[:why_bytes - 1] + b"\0"
            ffi.memmove(why, sentence, len(sentence))
            return 1

    own = struct("source")
    own.bytes = size
    own.read_at = callback = ffi.callback(
        "int(void*, uint64_t, void*, uint64_t, char*, size_t)", read_at, error=1)
    announce = None
    if tell is not None:
        def prefetch(_: Any, ranges: Any, count: int) -> None:
            try:
                tell([(one.offset, one.offset + one.bytes) for one in ranges[0:count]])
            except BaseException as raised:  # no exception may pass through C
                handle.error = raised

        announce = own.prefetch = ffi.callback("void(void*, const shmf_range*, size_t)", prefetch)
    try:
        check(lib.shmf_open_source, own, options, file)
    except Error as why:
        raise_with(why, handle.error)
    handle.file, handle.keep = file[0], (callback, announce, source)
    return handle


def open(source: Source, *, damaged: bool = False, max_cells: int | None = None,
         max_vertices: int | None = None) -> Mesh | Archive:
    """Opens a .shm file: a path, a URL, bytes, or a seekable file object.

    From a URL only the requested data is read, in byte ranges, which the server must support. Protocols other than
    http and https need the package fsspec.

    open() reads the end of the file, its index and its schema. An archive of several files is returned as an Archive.
    With damaged=True, the intact parts of a damaged file can be read; lost values are NaN, or 0 for integers. A file
    with more than max_cells cells or max_vertices vertices raises an Error "over limit". These two limits protect
    against small files that contain very many cells.
    """
    wanted = {"damaged": damaged, "max_cells": max_cells, "max_vertices": max_vertices}
    handle = _opened(source, wanted)
    if not lib.shmf_is_archive(handle.file):
        return Mesh(handle)
    return Archive(handle, lib.shmf_member_count(handle.file), wanted)


class Archive(Mapping):
    """An archive of several files, as a mapping: archive[name] opens the file with this name."""

    def __init__(self, handle: _Handle, members: int, wanted: Mapping[str, int | None]):
        self._handle, self._wanted = handle, wanted
        self._members = {text(lib.shmf_member_name(handle.file, m)): m for m in range(members)}

    def __getitem__(self, name: str) -> Mesh:
        file = ffi.new("shmf_file**")
        self._handle(lib.shmf_open_member, self._members[name], _options(self._wanted), file)
        member = _Handle(file[0], self._handle)
        member.origin = self._handle
        return Mesh(member)

    def __contains__(self, name: object) -> bool:
        return name in self._members

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def close(self) -> None:
        """Closes the archive. Meshes opened from the archive stay open."""
        self._handle = _Handle(None)


class Mesh:
    """A mesh in a file, or a selection of its cells. An array is decoded, into a NumPy array, when a program accesses
    it.

    Only one thread at a time may use a mesh. Meshes opened by separate calls to open() are independent. The result of
    select() uses the file of its mesh, so only one thread at a time may use either of the two.
    """

    def __init__(self, handle: _Handle, selection: Any = None, keep: Any = None):
        self._handle, self._selection, self._keep = handle, selection, keep
        self._points: np.ndarray | None = None
        self._cells: Cells | None = None
        self._info = struct("info")
        handle(lib.shmf_get_info, self._info)
        self._source_format = text(self._info.source_format)
        self._arrays = [_Array.of(self._told("array", lib.shmf_get_array, i)) for i in range(self._info.arrays)]
        self._counted: Any = None
        self._token = object()

    def __enter__(self) -> Mesh:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file. Arrays that have been read remain valid."""
        self._handle.close()

    def __repr__(self) -> str:
        piece = "some of " if self._selection else ""
        return f"<shmformat.Mesh: {piece}{self._info.vertices} vertices, {self._info.cells} cells>"

    def _told(self, kind: str, call: Any, index: int) -> Any:
        own = struct(kind)
        self._handle(call, index, own)
        return own

    # --- contents of the whole file

    @property
    def blocks(self) -> list[Block]:
        infos = (self._told("block", lib.shmf_get_block, i) for i in range(self._info.blocks))
        return [Block(b.id, text(b.name), SHAPES[b.shape], b.nodes_per_cell, b.cells, NODE_SCHEMES[b.node_scheme])
                for b in infos]

    @property
    def segments(self) -> list[Segment]:
        infos = (self._told("segment", lib.shmf_get_segment, i) for i in range(self._info.segments))
        return [Segment(s.first_cell, s.cells, s.first_vertex, s.vertices, s.bytes, tuple(s.box)) for s in infos]

    @property
    def step_count(self) -> int:
        return int(self._info.steps)

    @property
    def digest(self) -> str | None:
        """Digest of the mesh in the file, its values and step times: 16 hexadecimal digits. All files of a mesh with
        the same numbers, values and times have the same digest, however they are coded. None if the file has no
        digests."""
        return f"{self._info.digest:016x}" if self._info.has_digest else None

    @property
    def step_times(self) -> np.ndarray:
        """The time of each step; empty if the file has no times."""
        times, count = ffi.new("double**"), ffi.new("uint64_t*")
        self._handle(lib.shmf_get_times, ffi.cast("const double**", times), count)
        return copied(times[0], count[0], np.float64)

    @property
    def source_format(self) -> str:
        """Format from which the mesh was converted, e.g. "exodus", "vtk" or "gmsh"; "" if unknown."""
        return self._source_format

    @property
    def coordinate_error(self) -> float:
        """Error bound: largest possible difference between a coordinate and the original coordinate; 0 if lossless."""
        return float(self._info.coordinate_error)

    @property
    def point_data(self) -> Data:
        return Data(self, lib.SHMF_POINT_DATA)

    @property
    def cell_data(self) -> Data:
        """Cell arrays, with one element for every cell. If a cell has no value in an array, the element is NaN, or 0
        for integers."""
        return Data(self, lib.SHMF_CELL_DATA)

    @property
    def global_data(self) -> Data:
        """Arrays of the whole mesh, which have time steps: their values at a step have the shape (n,), usually (1,), or
        (n, components). A selection of cells has the values of the whole mesh."""
        return Data(self, lib.SHMF_GLOBAL_DATA)

    @property
    def node_set_data(self) -> Data:
        """Arrays of node sets, which have time steps. They have one element for each member, set after set; see
        Data.on_sets(). A selection of cells has the values of the whole mesh."""
        return Data(self, lib.SHMF_NODE_SET_DATA)

    @property
    def side_set_data(self) -> Data:
        """Arrays of side sets, as node_set_data."""
        return Data(self, lib.SHMF_SIDE_SET_DATA)

    @property
    def element_set_data(self) -> Data:
        """Arrays of element sets, as node_set_data."""
        return Data(self, lib.SHMF_ELEMENT_SET_DATA)

    @property
    def extras(self) -> list[Extra]:
        count = ffi.new("uint64_t*")
        self._handle(lib.shmf_extra_count, count)
        infos = (self._told("extra", lib.shmf_get_extra, i) for i in range(count[0]))
        return [self._extra(extra) for extra in infos]

    @staticmethod
    def _extra(extra: Any) -> Extra:
        dtype = DTYPES[extra.type]
        shape = [extra.shape[i] for i in range(extra.dimensions)]
        values = copied(extra.data, extra.bytes // dtype.itemsize, dtype).reshape(shape)
        return Extra(text(extra.key), values, ("nothing", "vertices", "cells")[extra.refers])

    @property
    def sets(self) -> list[Set]:
        count = ffi.new("uint64_t*")
        self._handle(lib.shmf_set_count, count)
        sets = []
        for i in range(count[0]):
            info = self._told("set", lib.shmf_get_set, i)
            sides = copied(info.sides, info.members, np.int32) if info.sides != ffi.NULL else None
            blocks = copied(info.blocks, info.block_count, np.uint32) if info.block_count else None
            factors = copied(info.factors, info.factor_count, np.float64) if info.factor_count else None
            sets.append(Set(("node", "side", "element")[info.kind], info.id, text(info.name),
                            copied(info.numbers, info.members, np.uint64), sides, blocks, factors))
        return sets

    # --- selections

    def select(self, *, cells: tuple[int, int] | None = None, numbers: Any = None,
               blocks: Sequence[int] | None = None, box: Sequence[float] | None = None) -> Mesh:
        """Returns a mesh that consists of the cells that meet all given conditions, and of the vertices of these cells.
        Its vertices and cells are renumbered from 0 without changing their order.

        cells: (first, end), selects the cell numbers first to end - 1. numbers: selects individual cell numbers.
        blocks: selects the cells of these blocks (indices into the list `blocks` of the mesh). box: smallest x, y, z,
        then largest x, y, z; selects cells with a vertex in this box. All conditions refer to the whole file, even if
        this mesh is a selection itself.
        """
        selection = struct("selection")
        keep = []
        if cells is not None:
            selection.first_cell, selection.end_cell = cells
            if tuple(cells) == (0, 0):
                blocks = ()  # selects no cells; in C, the range (0, 0) would select all cells
        if blocks is not None:
            listed = sorted(set(blocks))
            keep.append(ffi.new("uint32_t[]", listed or [0]))
            selection.blocks, selection.block_count = keep[-1], len(listed)
        if numbers is not None:
            ascending = np.unique(np.asarray(numbers, np.uint64))
            keep += [ascending, ffi.from_buffer("uint64_t[]", ascending) if len(ascending) else ffi.new("uint64_t[1]")]
            selection.numbers, selection.number_count = keep[-1], len(ascending)
        if box is not None:
            selection.has_box, selection.box = 1, list(box)
        return Mesh(self._handle, selection, keep)

    def _count(self) -> Any:
        """Returns the counts of this mesh. If another Mesh has selected other cells in the same shmf_file, selects the
        cells of this mesh again."""
        if self._counted is None or self._handle.selected is not self._token:
            counted = struct("counts")
            self._handle(lib.shmf_select, self._selection or ffi.NULL, ffi.NULL, counted)
            self._counted, self._handle.selected = counted, self._token
        return self._counted

    @property
    def vertex_count(self) -> int:
        return int(self._count().vertices)

    @property
    def cell_count(self) -> int:
        return int(self._count().cells)

    @property
    def vertex_numbers(self) -> np.ndarray:
        """For each vertex: its number in the whole file."""
        return self._read([(lib.SHMF_VERTEX_NUMBERS, np.empty(self.vertex_count, np.int64), 0, 0)])[0]

    @property
    def cell_numbers(self) -> np.ndarray:
        return self._read([(lib.SHMF_CELL_NUMBERS, np.empty(self.cell_count, np.int64), 0, 0)])[0]

    # --- arrays

    @property
    def points(self) -> np.ndarray:
        """Coordinates of all vertices, in the type of the file; shape (vertices, 3). They are read when this property
        is first used, and then kept."""
        if self._points is None:
            self._points = self.read(cells=False).points
        return self._points

    @property
    def cells(self) -> Cells:
        """All cells of the mesh. They are read when this property is first used, and then kept."""
        if self._cells is None:
            self._cells = self.read(points=False).cells
        return self._cells

    def read(self, *, points: bool = True, cells: bool = True, point_data: Sequence[str] = (),
             cell_data: Sequence[str] = (), step: int | None = None, out: Mapping[str, np.ndarray] | None = None,
             progress: Callable[[float], Any] | None = None, threads: int = 1) -> Arrays:
        """Reads several arrays in one pass over the file. This is faster than reading the arrays one after the other.

        step: the time step at which arrays with time steps are read. out: existing arrays into which the results are
        stored instead of new arrays, by name: "points", "offsets", "connectivity", "types", "blocks", or the name of a
        point or cell array. The arrays in `out` must be contiguous and have the right shape. The type of points may be
        float32 or float64. The type of offsets and connectivity may be any integer type of 32 or 64 bits. progress: a
        function that is called regularly with the completed fraction, 0 to 1. threads: number of decoding threads; 0:
        one per core.
        """
        counts = self._count()
        left = dict(out or {})
        index = np.int32 if max(counts.vertices, counts.corners) < 2**31 else np.int64
        wanted: list[tuple[int, np.ndarray, int, int]] = []

        def want(what: int, name: str, shape: tuple[int, ...], dtype: Any, array: int = 0, of_step: int = 0) -> np.ndarray:
            into = left.pop(name, None)
            if into is None:
                into = np.empty(shape, dtype)
            elif into.shape != shape:
                raise ValueError(f"out['{name}'] has the shape {into.shape}, not {shape}")
            wanted.append((what, into, array, of_step))
            return into

        result = Arrays()
        if points:
            result.points = want(lib.SHMF_POINTS, "points", (counts.vertices, 3), DTYPES[self._info.coordinate_type])
        if cells:
            result.cells = Cells(want(lib.SHMF_CORNER_BEGIN, "offsets", (counts.cells + 1,), index),
                                 want(lib.SHMF_CORNERS, "connectivity", (counts.corners,), index),
                                 want(lib.SHMF_CELL_TYPES, "types", (counts.cells,), np.uint8),
                                 want(lib.SHMF_CELL_BLOCKS, "blocks", (counts.cells,), np.uint32))
        for names, data, values in ((point_data, self.point_data, result.point_data),
                                    (cell_data, self.cell_data, result.cell_data)):
            for name in names:
                array = data._arrays[name]
                info = self._arrays[array]
                if info.per_step and step is None:
                    raise ValueError(f"'{name}' has time steps: choose one with step=...")
                values[name] = want(lib.SHMF_VALUES, name, self._shape(array), DTYPES[info.type], array,
                                    step if info.per_step else 0)
        if left:
            raise ValueError(f"out contains arrays that are not read: {', '.join(map(repr, left))}")
        self._read(wanted, progress, threads)
        return result

    def boundary(self, *, point_data: Sequence[str] = (), cell_data: Sequence[str] = (), step: int | None = None,
                 subdivide: bool = False, max_bytes: int = 0, progress: Callable[[float], Any] | None = None,
                 threads: int = 1) -> Boundary:
        """Returns the boundary surface of the mesh or selection: the sides that belong to exactly one volume cell, and
        all cells of lower dimension. Memory grows with the active surface (the vertices that later cells still use) and
        the result. For a selection, memory grows with the size of the selection instead.

        point_data, cell_data: names of the arrays whose values on the boundary are returned. step: the time step at
        which arrays with time steps are read. subdivide: divides the sides of cells of higher order into flat faces at
        their nodes, e.g. to draw curved cells. max_bytes: memory limit in bytes; 0: 4 GiB. progress, threads: the same
        as for read().
        """
        names = [(self.point_data, name) for name in point_data] + [(self.cell_data, name) for name in cell_data]
        arrays = [data._arrays[name] for data, name in names]
        for array in arrays:
            if self._arrays[array].per_step and step is None:
                raise ValueError(f"'{self._arrays[array].name}' has time steps: choose one with step=...")
        # if this mesh is the whole file and no other selection is active, all cells are selected already
        if self._selection is not None or self._handle.selected is not None:
            self._count()
        options, made, surface = struct("boundary_options"), ffi.new("shmf_boundary**"), struct("surface")
        listed = ffi.new("uint32_t[]", arrays or [0]), ffi.new("uint64_t[]", [step or 0] * max(len(arrays), 1))
        options.arrays, options.steps = listed
        options.array_count, options.max_bytes, options.subdivide = len(arrays), max_bytes, subdivide
        with _Run(progress, threads) as run:
            self._handle(lib.shmf_find_boundary, options, run.options, made)
        boundary = ffi.gc(made[0], lib.shmf_boundary_free)
        check(lib.shmf_get_surface, boundary, surface)
        index = np.int32 if max(surface.vertices, surface.corners) < 2**31 else np.int64
        result = Boundary(
            points=copied(surface.xyz, (surface.vertices, 3), DTYPES[surface.coordinate_type]),
            offsets=copied(surface.face_begin, surface.faces + 1, np.int64).astype(index, copy=False),
            connectivity=copied(surface.face_corners, surface.corners, np.uint32).astype(index),
            vertex_numbers=copied(surface.vertex_numbers, surface.vertices, np.int64),
            cell_numbers=copied(surface.cell_numbers, surface.faces, np.int64),
            blocks=copied(surface.cell_blocks, surface.faces, np.uint32),
            sides=copied(surface.sides, surface.faces, np.int32), left_out=int(surface.left_out))
        for position, ((_, name), array) in enumerate(zip(names, arrays)):
            info = self._arrays[array]
            count = surface.vertices if info.location == lib.SHMF_POINT_DATA else surface.faces
            shape = (count,) if info.components == 1 else (count, info.components)
            into = result.point_data if position < len(point_data) else result.cell_data
            into[name] = copied(surface.array_values[position], shape, DTYPES[info.type])
        return result

    def _shape(self, array: int) -> tuple[int, ...]:
        info, counts = self._arrays[array], self._count()
        elements = (counts.vertices if info.location == lib.SHMF_POINT_DATA
                    else counts.cells if info.location == lib.SHMF_CELL_DATA else info.elements)
        return (elements,) if info.components == 1 else (elements, info.components)

    def _steps_of(self, array: int) -> list[int]:
        steps, count = ffi.new("uint64_t**"), ffi.new("uint64_t*")
        self._handle(lib.shmf_get_steps, array, ffi.cast("const uint64_t**", steps), count)
        return [int(steps[0][i]) for i in range(count[0])]

    def _values(self, array: int, step: int) -> np.ndarray:
        into = np.empty(self._shape(array), DTYPES[self._arrays[array].type])
        return self._read([(lib.SHMF_VALUES, into, array, step)])[0]

    def _read(self, wanted: list[tuple[int, np.ndarray, int, int]],
              progress: Callable[[float], Any] | None = None, threads: int = 1) -> list[np.ndarray]:
        """Fills NumPy arrays with one call to shmf_read(). Each entry is a tuple: a shmf_what, the NumPy array, the
        index of the array in the file, and the time step."""
        self._count()
        targets = ffi.new("shmf_target[]", len(wanted))
        buffers = []
        for target, (what, into, array, step) in zip(targets, wanted):
            if not into.flags.c_contiguous or not into.flags.writeable or into.dtype not in TYPES:
                raise ValueError("arrays to be filled must be contiguous, writeable and numeric")
            buffers.append(ffi.from_buffer(into.reshape(-1).view(np.uint8)) if into.size else ffi.NULL)
            target.struct_size = ffi.sizeof("shmf_target")
            target.what, target.type, target.array, target.step = what, TYPES[into.dtype], array, step
            target.flags = lib.SHMF_FILL
            target.data, target.bytes = buffers[-1], into.nbytes
        with _Run(progress, threads) as run:
            self._handle(lib.shmf_read, targets, len(wanted), run.options)
        return [into for _, into, _, _ in wanted]

    def verify(self, progress: Callable[[float], Any] | None = None, threads: int = 1) -> None:
        """Decodes the whole file and discards the result. Raises an Error if any part of the file is invalid."""
        with _Run(progress, threads) as run:
            self._handle(lib.shmf_verify, run.options)


class _Run:
    """The shmf_run_options of a call that may take a long time. If `progress` raises an exception, the call ends, and
    the exception is raised again."""

    def __init__(self, progress: Callable[[float], Any] | None, threads: int):
        self._raised: BaseException | None = None
        self.options = struct("run_options")
        self.options.threads = threads if threads else 2**32 - 1  # SHMF_ALL_THREADS
        if progress is None:
            return

        def report(_: Any, done: float) -> int:
            try:
                progress(done)
                return 0
            except BaseException as raised:  # no exception may pass through C
                self._raised = raised
                return 1

        self._callback = ffi.callback("int(void*, double)", report, error=1)
        self.options.progress = self._callback

    def __enter__(self) -> _Run:
        return self

    def __exit__(self, kind: Any, *_: Any) -> None:
        if self._raised is not None and kind is Error:
            raise self._raised
