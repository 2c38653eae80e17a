"""Loads the C library with cffi. cffi parses the C header, so the package needs no compiler and works with every
Python version.

The environment variable SHMFORMAT_LIBRARY names the file of the library. If this variable is not set, the module loads
libshmformat_c.so.1 from its own folder. If that file does not exist, it loads the library that the system's loader
finds. The header is parsed when the package is built; in the source tree, it is parsed when this module is imported.
"""
from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

_HERE = Path(__file__).resolve().parent
_NAME = "libshmformat_c.so.1"


def _interface() -> Any:
    try:
        from ._table import ffi as parsed  # type: ignore  # written by setup.py
        return parsed
    except ImportError:
        pass
    from ._declarations import table_of
    for path in (_HERE / "shmformat.h", _HERE.parents[1] / "c" / "include" / "shmformat.h"):
        if path.exists():
            return table_of(path)
    raise ImportError("shmformat.h is neither next to the module nor in its source tree")


def _loaded() -> Any:
    named = os.environ.get("SHMFORMAT_LIBRARY")
    beside = _HERE / _NAME
    path = named or (str(beside) if beside.exists() else _NAME)
    try:
        return ffi.dlopen(path)
    except OSError as why:
        raise ImportError(f"{path} cannot be loaded: {why}. Set SHMFORMAT_LIBRARY to the path of the library.") from why


ffi = _interface()
lib = _loaded()


def library_version() -> str:
    return ffi.string(lib.shmf_version_string()).decode()


class Error(Exception):
    """The failure of a call to the library.

    code: "io", "truncated", "corrupt", "unsupported", "over limit", "misuse", "output", "no memory" or "cancelled".
    section: the part of the file that has the error, or "" if unknown.
    offset: byte offset of the error in the file, or None if unknown.
    detail: the cause in one sentence, without the file name, section and offset. str() returns the whole message.
    """

    def __init__(self, code: str, detail: str, section: str = "", offset: int | None = None, message: str = ""):
        super().__init__(message or detail)
        self.code = code
        self.detail = detail
        self.section = section
        self.offset = offset


def text(chars: Any) -> str:
    """Converts a C string to str. Names in files may contain bytes that are not valid UTF-8; such bytes are escaped."""
    return ffi.string(chars).decode("utf-8", "surrogateescape") if chars != ffi.NULL else ""


def encoded(name: str | os.PathLike[str]) -> bytes:
    chars = os.fsencode(name) if isinstance(name, os.PathLike) else name.encode("utf-8", "surrogateescape")
    if b"\0" in chars:
        raise ValueError(f"a name contains a zero byte: {name!r}")
    return chars


def raise_with(why: Error, raised: BaseException | None) -> NoReturn:
    """Raises `why`. If a callback raised the exception `raised`, it becomes the cause of `why`. An exception that ends
    the program, such as KeyboardInterrupt, is raised instead of `why`."""
    if raised is not None and not isinstance(raised, Exception):
        raise raised
    raise why from raised


def struct(name: str) -> Any:
    """Returns a new struct shmf_`name` of the C interface. Its struct_size is set, and all other members are 0."""
    made = ffi.new(f"shmf_{name}*")
    made.struct_size = ffi.sizeof(f"shmf_{name}")
    return made


def check(call: Any, *arguments: Any) -> None:
    """Calls a function of the C interface with these arguments and a shmf_error. Raises an exception if the function
    fails."""
    why = ffi.new("shmf_error*")
    status = call(*arguments, why)
    if status == lib.SHMF_OK:
        return
    if status == lib.SHMF_NO_MEMORY:
        raise MemoryError(text(why.message))
    offset = None if why.offset == 2**64 - 1 else int(why.offset)
    raise Error(text(lib.shmf_status_name(status)), text(why.detail), text(why.section), offset, text(why.message))


DTYPES = {lib.SHMF_INT8: np.dtype(np.int8), lib.SHMF_UINT8: np.dtype(np.uint8),
          lib.SHMF_INT16: np.dtype(np.int16), lib.SHMF_UINT16: np.dtype(np.uint16),
          lib.SHMF_INT32: np.dtype(np.int32), lib.SHMF_UINT32: np.dtype(np.uint32),
          lib.SHMF_INT64: np.dtype(np.int64), lib.SHMF_UINT64: np.dtype(np.uint64),
          lib.SHMF_FLOAT32: np.dtype(np.float32), lib.SHMF_FLOAT64: np.dtype(np.float64)}
TYPES = {dtype: number for number, dtype in DTYPES.items()}

SHAPES = ("other", "vertex", "line", "triangle", "quad", "polygon", "tetrahedron", "pyramid", "wedge",
          "hexahedron", "polyhedron", "faces")
NODE_SCHEMES = ("lagrange", "serendipity", "bezier")

# For each VTK cell type with a fixed number of nodes: shape and number of nodes.
KINDS = (("vertex", 1), ("line", 2), ("line", 3), ("line", 4), ("triangle", 3), ("triangle", 6), ("triangle", 7), ("quad", 4),
         ("quad", 8), ("quad", 9), ("tetrahedron", 4), ("tetrahedron", 10), ("pyramid", 5), ("pyramid", 13), ("pyramid", 19),
         ("wedge", 6), ("wedge", 15), ("wedge", 18), ("hexahedron", 8), ("hexahedron", 20), ("hexahedron", 24),
         ("hexahedron", 27))
POLYGON, CONVEX_POINT_SET, POLYHEDRON = 7, 41, 42  # VTK cell types whose number of nodes varies
# VTK cell types of Lagrange and Bezier cells: shape and node scheme. The number of nodes depends on the order.
HIGH_ORDER = {first + i: (shape, scheme) for first, scheme in ((68, "lagrange"), (75, "bezier"))
              for i, shape in enumerate(("line", "triangle", "quad", "tetrahedron", "hexahedron", "wedge"))}


def vtk_type(shape: str, nodes: int, scheme: str = "lagrange") -> int:
    return int(lib.shmf_vtk_cell_type(SHAPES.index(shape), nodes, NODE_SCHEMES.index(scheme)))


def cell_order(shape: str, nodes: int, scheme: str) -> int:
    return int(lib.shmf_cell_order(SHAPES.index(shape), nodes, NODE_SCHEMES.index(scheme)))


def node_places(shape: str, scheme: str, order: int) -> np.ndarray:
    """Returns the places of the nodes of a cell of an order from 1 to 10: an array of shape (n, 3), with the steps of each node
    along the axes of the cell. It is empty if no such cell exists."""
    places = np.zeros((int(lib.shmf_node_places(SHAPES.index(shape), NODE_SCHEMES.index(scheme), order, ffi.NULL)), 3), np.uint8)
    lib.shmf_node_places(SHAPES.index(shape), NODE_SCHEMES.index(scheme), order, ffi.from_buffer("uint8_t[]", places, True))
    return places


def copied(data: Any, shape: int | tuple[int, ...], dtype: Any) -> np.ndarray:
    """Copies values from memory of the library to a new NumPy array."""
    out = np.empty(shape, dtype)
    if out.size:
        ffi.memmove(ffi.from_buffer(out), data, out.nbytes)
    return out
