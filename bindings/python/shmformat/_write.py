"""Writes meshes, and appends time steps to files."""
from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, BinaryIO, Union

import numpy as np

from ._library import DTYPES, NODE_SCHEMES, SHAPES, TYPES, Error, check, encoded, ffi, lib, raise_with, struct
from ._mesh import Block, Cells, Extra, Mesh, Set
from ._mesh import open as open_shm

_LEVELS = {"default": 0, "fast": 1, "best": 2}
_ORDERS = {"keep": 0, "stream": 1, "free": 2}

Target = Union[str, "os.PathLike[str]", BinaryIO]
Steps = Mapping[int, np.ndarray]
Values = Union[np.ndarray, Steps]


class _Writer:
    """A shmf_writer, together with the memory that it borrows from the caller until the file is complete."""

    def __init__(self, to: Target, options: Any, append: bool = False):
        self._raised: BaseException | None = None
        self._keep: list[Any] = []
        writer = ffi.new("shmf_writer**")
        if append:
            check(lib.shmf_writer_append, encoded(to), options, writer)
        elif isinstance(to, (str, os.PathLike)):
            check(lib.shmf_writer_path, encoded(to), options, writer)
        else:
            def taken(_: Any, data: Any, count: int) -> int:
                try:
                    left = memoryview(ffi.buffer(data, count)[:])
                    while left:  # write() of an unbuffered file may write only some of the bytes
                        taken_now = to.write(left)
                        left = left[len(left) if taken_now is None else taken_now:]
                    return 0
                except BaseException as raised:  # no exception may pass through C
                    self._raised = raised
                    return 1

            callback = ffi.callback("int(void*, const void*, uint64_t)", taken, error=1)
            self._keep.append(callback)
            check(lib.shmf_writer_sink, callback, ffi.NULL, options, writer)
        self._writer = ffi.gc(writer[0], lib.shmf_writer_free)

    def __call__(self, call: Any, *arguments: Any) -> None:
        try:
            check(call, self._writer, *arguments)
        except Error as why:
            raise_with(why, self._raised)

    def finish(self) -> int:
        """Completes the file, and returns its size in bytes."""
        size = ffi.new("uint64_t*")
        self(lib.shmf_writer_finish, size)
        return int(size[0])

    def close(self) -> None:
        """Frees the writer. Later calls raise Error."""
        if self._writer != ffi.NULL:
            ffi.release(self._writer)
        self._writer = ffi.NULL
        self._keep.clear()

    def kept(self, data: Any) -> Any:
        """Returns a C pointer to `data`, and keeps `data` alive as long as the writer exists."""
        if isinstance(data, str):
            data = encoded(data)
        if isinstance(data, bytes):
            pointer = ffi.new("char[]", data)
        elif data.size == 0:
            return ffi.NULL
        else:
            pointer = ffi.from_buffer(data.reshape(-1).view(np.uint8))
        self._keep.append((pointer, data))
        return pointer


def _plain(values: Any, dtype: Any = None) -> np.ndarray:
    """Converts values to a contiguous array in native byte order. Raises TypeError if .shm files do not support the
    type."""
    array = np.asarray(values, order="C")
    array = array.astype(array.dtype.newbyteorder("="), copy=False)
    if dtype is not None and array.dtype != dtype:
        own = array.astype(dtype)
        # A conversion between floating-point types may round values; any other conversion must not change them.
        if not (array.dtype.kind == "f" and own.dtype.kind == "f") and not np.array_equal(own, array):
            raise TypeError(f"values of type {array.dtype} cannot be stored as {own.dtype}")
        array = own
    if array.dtype not in TYPES:
        raise TypeError(f"values of type {array.dtype} are not supported")
    return array


def _numbers(values: Any) -> np.ndarray:
    array = _plain(values)
    if array.dtype.kind not in "iu":
        raise TypeError(f"vertex numbers must be integers, not {array.dtype}")
    return array if array.dtype.itemsize in (4, 8) else array.astype(np.int64)


def _target(what: int, values: np.ndarray, writer: _Writer, array: int = 0) -> Any:
    made = struct("target")
    made.what, made.type, made.array = what, TYPES[values.dtype], array
    made.data = ffi.cast("void*", writer.kept(values))
    made.bytes = values.nbytes
    return made


def _first_step(values: Values) -> np.ndarray:
    return next(iter(values.values())) if isinstance(values, Mapping) else values


def write(to: Target, points: Any, cells: Cells | Any, *, blocks: Sequence[Block] | None = None,
          point_data: Mapping[str, Values] | None = None, cell_data: Mapping[str, Values] | None = None,
          global_data: Mapping[str, Steps] | None = None, node_set_data: Mapping[str, Steps] | None = None,
          side_set_data: Mapping[str, Steps] | None = None, element_set_data: Mapping[str, Steps] | None = None,
          step_times: Sequence[float] | None = None, sets: Sequence[Set] = (), extras: Sequence[Extra] = (),
          order: str = "keep", level: str = "default", threads: int = 1, coordinate_error: float = 0,
          errors: Mapping[str, float] | None = None, relative_errors: Mapping[str, float] | None = None,
          fills: Mapping[str, Sequence[float]] | None = None, source_format: str = "", replace: bool = False) -> int:
    """Writes a mesh, and returns the size of the file in bytes.

    to: a path, or a file object open for writing. A file appears under its path only when it is complete. If the path
    exists already, the call fails unless `replace` is true.
    points: an array of shape (n, 3), of type float64 or float32. cells: an array of shape (n, 8) with the vertices of
    hexahedra, or Cells. The `types` of Cells are ignored, because `blocks` defines the shapes. point_data, cell_data:
    for each name, an array with one element per vertex or cell, or a mapping from time steps to such arrays.
    global_data: for each name, a mapping from time steps to arrays. node_set_data, side_set_data, element_set_data: for
    each name, a mapping from time steps to arrays with one element per member of all sets of this kind in `sets`. order:
    "keep", "stream" or "free". level: "fast", "default" or "best". threads: number of encoding threads; 0: one per
    core. coordinate_error: the largest allowed error of a coordinate; 0: lossless. errors: for each array name, the
    largest allowed error of its values. relative_errors: for each array name, the largest allowed error of a value
    divided by the value, at most 0.5. fills: for each array name, the fill values, which mark missing values. They are
    restored exactly under every bound.
    """
    xyz = _coordinates(points)
    options = _options(xyz, order, level, threads, coordinate_error)
    name = ffi.new("char[]", encoded(source_format))
    options.source_format, options.replace = name, replace
    writer = _Writer(to, options)
    try:
        arrays = [_target(lib.SHMF_POINTS, xyz, writer)] + _cell_targets(cells, blocks, writer)
        stepped: list[tuple[int, Mapping[int, np.ndarray]]] = []
        index = 0
        for location, data in ((lib.SHMF_POINT_DATA, point_data), (lib.SHMF_CELL_DATA, cell_data),
                               (lib.SHMF_GLOBAL_DATA, global_data), (lib.SHMF_NODE_SET_DATA, node_set_data),
                               (lib.SHMF_SIDE_SET_DATA, side_set_data),
                               (lib.SHMF_ELEMENT_SET_DATA, element_set_data)):
            for key, values in (data or {}).items():
                one = _plain(_first_step(values))
                if one.ndim not in (1, 2):
                    raise ValueError(f"'{key}' has {one.ndim} dimensions, not 1 or 2")
                _add_array(writer, key, location, one.dtype, one.shape[1] if one.ndim == 2 else 1,
                           isinstance(values, Mapping), len(one), (errors or {}).get(key, 0),
                           (relative_errors or {}).get(key, 0), (fills or {}).get(key, ()))
                if isinstance(values, Mapping):
                    stepped.append((index, values))
                else:
                    arrays.append(_target(lib.SHMF_VALUES, one, writer, index))
                index += 1
        _write_mesh(arrays, writer)
        for array, steps in stepped:
            _write_steps(array, steps, _plain(_first_step(steps)).dtype, writer)
        _write_times(step_times, writer)
        _write_sets(sets, writer)
        for extra in extras:
            _write_extra(extra, writer)
        return writer.finish()
    finally:
        writer.close()


ArrayType = Union[Any, "tuple[Any, int]"]


class Writer:
    """Writes a mesh, and then time steps one by one, as a solver computes them.

    path: the path of the file. points, cells, blocks, order, level, threads, coordinate_error, errors, source_format,
    replace: as in write(). point_data, cell_data, global_data: for each name of an array with time steps, its dtype, or
    a pair of its dtype and its number of components. live: true if readers may open the file while it is written; it
    appears with the first commit(). If false, it appears when close() succeeds.

    A Writer is a context manager. If its block ends with an exception, the file is not completed: a live file keeps
    what has been committed, any other file does not appear. A Writer must not be used by two threads at once.
    """

    def __init__(self, path: str | os.PathLike[str], points: Any, cells: Cells | Any, *,
                 blocks: Sequence[Block] | None = None, point_data: Mapping[str, ArrayType] | None = None,
                 cell_data: Mapping[str, ArrayType] | None = None, global_data: Mapping[str, ArrayType] | None = None,
                 live: bool = False, order: str = "keep", level: str = "default", threads: int = 1,
                 coordinate_error: float = 0, errors: Mapping[str, float] | None = None, source_format: str = "",
                 replace: bool = False):
        xyz = _coordinates(points)
        options = _options(xyz, order, level, threads, coordinate_error)
        name = ffi.new("char[]", encoded(source_format))
        options.source_format, options.replace, options.live = name, replace, live
        self._size: int | None = None
        self._times: list[float] = []
        self._arrays: list[dict[str, tuple[int, np.dtype]]] = []
        self._writer = _Writer(path, options)
        try:
            targets = [_target(lib.SHMF_POINTS, xyz, self._writer)] + _cell_targets(cells, blocks, self._writer)
            index = 0
            for location, data in ((lib.SHMF_POINT_DATA, point_data), (lib.SHMF_CELL_DATA, cell_data),
                                   (lib.SHMF_GLOBAL_DATA, global_data)):
                self._arrays.append({})
                for key, kind in (data or {}).items():
                    dtype, components = kind if isinstance(kind, tuple) else (kind, 1)
                    own = np.dtype(dtype)
                    if own not in TYPES:
                        raise TypeError(f"values of type {own} are not supported")
                    _add_array(self._writer, key, location, own, components, True, 1, (errors or {}).get(key, 0), 0, ())
                    self._arrays[-1][key] = (index, own)
                    index += 1
            _write_mesh(targets, self._writer)
        except BaseException:
            self._writer.close()
            raise

    @classmethod
    def reopen(cls, path: str | os.PathLike[str], *, level: str = "default") -> "Writer":
        """Continues a file after its last commit, in place, as a live file. A run that was killed continues in this
        way. Data that was not committed is removed. Vertices and cells are in the order in which a Mesh of this file
        returns them.
        """
        writer = cls.__new__(cls)
        writer._size = None
        options = struct("write_options")
        options.level, options.live = _LEVELS[level], True
        writer._writer = _Writer(path, options, append=True)
        try:
            with open_shm(path) as mesh:
                if not isinstance(mesh, Mesh):
                    raise ValueError(f"{path} is an archive of several meshes")
                writer._times = [float(time) for time in mesh.step_times]
                writer._arrays = [{name: (data._arrays[name], DTYPES[mesh._arrays[data._arrays[name]].type])
                                   for name in data if mesh._arrays[data._arrays[name]].per_step}
                                  for data in (mesh.point_data, mesh.cell_data, mesh.global_data)]
        except BaseException:
            writer._writer.close()
            raise
        return writer

    @property
    def step_times(self) -> list[float]:
        """The times of all steps so far."""
        return list(self._times)

    def write_step(self, time: float, *, point_data: Mapping[str, Any] | None = None,
                   cell_data: Mapping[str, Any] | None = None, global_data: Mapping[str, Any] | None = None) -> int:
        """Writes the next time step, and returns its number. Arrays without values have no values at this step."""
        step, own_time = len(self._times), float(time)
        pieces = []
        for arrays, data in zip(self._arrays, (point_data, cell_data, global_data)):
            for name, values in (data or {}).items():
                index, dtype = arrays[name]
                pieces.append((index, dtype, _plain(values, dtype)))
        for index, dtype, values in sorted(pieces, key=lambda piece: piece[0]):
            _write_steps(index, {step: values}, dtype, self._writer)
        self._times.append(own_time)
        return step

    def commit(self) -> None:
        """Makes all steps so far readable, whatever happens later. Raises Error if the file is not live."""
        if self._times:
            _write_times(self._times, self._writer)
        self._writer(lib.shmf_writer_commit)

    def close(self) -> int:
        """Completes the file, and returns its size in bytes. A later call returns the same size."""
        if self._size is None:
            try:
                if self._times:
                    _write_times(self._times, self._writer)
                self._size = self._writer.finish()
            finally:
                self._writer.close()
        return self._size

    def __enter__(self) -> "Writer":
        return self

    def __exit__(self, kind: Any, value: Any, trace: Any) -> None:
        if kind is None:
            self.close()
        else:
            self._writer.close()


def _coordinates(points: Any) -> np.ndarray:
    xyz = _plain(points)
    if xyz.dtype.kind != "f":
        xyz = xyz.astype(np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3:
        raise ValueError(f"points have the shape {xyz.shape}, not (n, 3)")
    return xyz


def _options(xyz: np.ndarray, order: str, level: str, threads: int, coordinate_error: float) -> Any:
    options = struct("write_options")
    options.order, options.level = _ORDERS[order], _LEVELS[level]
    options.threads = threads if threads else 2**32 - 1
    options.coordinate_error, options.coordinate_type = coordinate_error, TYPES[xyz.dtype]
    return options


def _add_array(writer: _Writer, name: str, location: int, dtype: np.dtype, components: int, per_step: bool,
               elements: int, error: float, relative_error: float, fills: Sequence[float]) -> None:
    made = struct("array")
    made.name, made.location, made.type = writer.kept(name), location, TYPES[dtype]
    made.components, made.per_step, made.elements = components, per_step, elements
    made.error, made.relative_error = error, relative_error
    fill_values = ffi.new("double[]", [float(value) for value in fills])
    made.fills, made.fill_count = fill_values, len(fill_values)
    writer(lib.shmf_writer_array, made)


def _write_mesh(targets: list[Any], writer: _Writer) -> None:
    listed = ffi.new("shmf_target[]", [target[0] for target in targets])
    writer(lib.shmf_writer_mesh, listed, len(targets))


def append(path: str | os.PathLike[str], *, point_data: Mapping[str, Mapping[int, np.ndarray]] | None = None,
           cell_data: Mapping[str, Mapping[int, np.ndarray]] | None = None,
           global_data: Mapping[str, Steps] | None = None, node_set_data: Mapping[str, Steps] | None = None,
           side_set_data: Mapping[str, Steps] | None = None, element_set_data: Mapping[str, Steps] | None = None,
           step_times: Sequence[float] | None = None, level: str = "default") -> int:
    """Adds time steps to a file, and returns its size in bytes. The old file remains until the new file is complete and
    replaces it.

    point_data, ..., element_set_data: for each name of an array in the file, a mapping from new time steps to values. Vertices and
    cells are in the order in which a Mesh of this file returns them. step_times: the times of all steps, including the
    existing steps.
    """
    wanted: list[tuple[int, np.dtype, Mapping[int, np.ndarray]]] = []
    with open_shm(path) as mesh:
        if not isinstance(mesh, Mesh):
            raise ValueError(f"{path} is an archive of several meshes")
        for data, values in ((mesh.point_data, point_data), (mesh.cell_data, cell_data), (mesh.global_data, global_data),
                             (mesh.node_set_data, node_set_data), (mesh.side_set_data, side_set_data),
                             (mesh.element_set_data, element_set_data)):
            for name, steps in (values or {}).items():
                index = data._arrays[name]
                wanted.append((index, DTYPES[mesh._arrays[index].type], steps))
    options = struct("write_options")
    options.level = _LEVELS[level]
    writer = _Writer(path, options, append=True)
    try:
        for index, dtype, steps in wanted:
            _write_steps(index, steps, dtype, writer)
        _write_times(step_times, writer)
        return writer.finish()
    finally:
        writer.close()


def _write_steps(array: int, steps: Mapping[int, np.ndarray], dtype: np.dtype, writer: _Writer) -> None:
    for step in sorted(steps):
        values = _plain(steps[step], dtype)
        data = ffi.from_buffer(values.reshape(-1).view(np.uint8)) if values.size else ffi.NULL
        writer(lib.shmf_writer_values, array, step, data, values.nbytes)


def _write_times(times: Sequence[float] | None, writer: _Writer) -> None:
    if times is not None:
        all_of = _plain(times, np.float64)
        writer(lib.shmf_writer_times, ffi.from_buffer("double[]", all_of), len(all_of))


def _cell_targets(cells: Cells | Any, blocks: Sequence[Block] | None, writer: _Writer) -> list[Any]:
    """Declares the blocks. Returns objects that receive the cells and pass them to shmf_writer_mesh()."""
    if isinstance(cells, Cells):
        corners = _numbers(cells.connectivity)
        more = [_target(lib.SHMF_CORNER_BEGIN, _numbers(cells.offsets), writer),
                _target(lib.SHMF_CELL_BLOCKS, _plain(cells.blocks, np.uint32), writer)]
        if blocks is None:
            raise ValueError("the blocks of the cells are missing")
    else:
        corners = _numbers(cells)
        more = []
        if corners.ndim != 2 or corners.shape[1] != 8:
            raise ValueError(f"hexahedra have the shape {corners.shape}, not (n, 8)")
        blocks = blocks or [Block(1, "", "hexahedron", 8, len(corners))]
    for block in blocks:
        made = struct("block")
        made.id, made.name = block.id, writer.kept(block.name)
        made.shape, made.nodes_per_cell = SHAPES.index(block.shape), block.nodes_per_cell
        made.node_scheme = NODE_SCHEMES.index(block.node_scheme)
        writer(lib.shmf_writer_block, made)
    return [_target(lib.SHMF_CORNERS, corners, writer)] + more


def _write_sets(sets: Sequence[Set], writer: _Writer) -> None:
    if not sets:
        return
    listed = ffi.new("shmf_set[]", len(sets))
    for made, own in zip(listed, sets):
        made.struct_size = ffi.sizeof("shmf_set")
        made.kind = ("node", "side", "element").index(own.kind)
        made.id, made.name, made.members = own.id, writer.kept(own.name), len(own.numbers)
        made.numbers = ffi.cast("uint64_t*", writer.kept(_plain(own.numbers, np.uint64)))
        if own.sides is not None:
            if len(own.sides) != len(own.numbers):
                raise ValueError("a side set must have one side per cell")
            made.sides = ffi.cast("int32_t*", writer.kept(_plain(own.sides, np.int32)))
        if own.blocks is not None:
            made.block_count = len(own.blocks)
            made.blocks = ffi.cast("uint32_t*", writer.kept(_plain(own.blocks, np.uint32)))
        if own.factors is not None:
            made.factor_count = len(own.factors)
            made.factors = ffi.cast("double*", writer.kept(_plain(own.factors, np.float64)))
    writer(lib.shmf_writer_sets, listed, len(sets))


def _write_extra(extra: Extra, writer: _Writer) -> None:
    values = _plain(extra.values)
    made = struct("extra")
    shape = ffi.new("uint64_t[]", list(values.shape) or [1])
    made.key, made.type = writer.kept(extra.key), TYPES[values.dtype]
    made.refers = ("nothing", "vertices", "cells").index(extra.refers)
    made.shape, made.dimensions = shape, values.ndim
    made.data, made.bytes = ffi.cast("void*", writer.kept(values)), values.nbytes
    writer(lib.shmf_writer_extra, made)
