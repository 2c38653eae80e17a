"""The declarations of the C interface for cffi, parsed once when the package is built.

Types named in calls, such as ffi.new("shmf_error*"), are looked up in a table made by this module. cffi's own FFI
objects would parse each such name on first use. That costs a millisecond of the ten that a program needs to read a
small mesh.
"""
from __future__ import annotations

import contextlib
import io
import re
import tempfile
from pathlib import Path
from typing import Any

import cffi


def declarations(header: Path) -> str:
    """Returns the header without preprocessor lines."""
    text = re.sub(r"/\*.*?\*/", " ", header.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"^#ifdef __cplusplus$.*?^#endif$", "", text, flags=re.S | re.M)
    return re.sub(r"^\s*#.*$", "", text, flags=re.M).replace("SHMF_API", "")


def write_table(header: Path, module: Path) -> None:
    """Writes a Python module that defines `ffi`, with the declarations of the header."""
    parser = cffi.FFI()
    parser.cdef(declarations(header))
    parser.set_source(f"shmformat.{module.stem}", None)
    with contextlib.redirect_stdout(io.StringIO()):  # cffi prints the file name
        parser.emit_python_code(str(module))


def table_of(header: Path) -> Any:
    """Returns the `ffi` object that the module of write_table() would define. The module itself is not kept."""
    names: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        module = Path(folder) / "_table.py"
        write_table(header, module)
        exec(compile(module.read_text(encoding="utf-8"), "_table", "exec"), names)
    return names["ffi"]
