"""Passes the declarations of the C interface to cffi. They are parsed once, when the package is built.

This module writes a table of all types. Calls that name a type, such as ffi.new("shmf_error*"), look it up in this
table. Without the table, cffi would parse each name when it is first used, which takes 1 ms of the 10 ms that a
program needs to read a small mesh.
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
    """Returns the text of the header without comments and preprocessor lines."""
    text = re.sub(r"/\*.*?\*/", " ", header.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"^#ifdef __cplusplus$.*?^#endif$", "", text, flags=re.S | re.M)
    return re.sub(r"^\s*#.*$", "", text, flags=re.M).replace("SHMF_API", "")


def write_table(header: Path, module: Path) -> None:
    """Writes a Python module that defines `ffi`, with the declarations of the header."""
    parser = cffi.FFI()
    parser.cdef(declarations(header))
    parser.set_source(f"shmformat.{module.stem}", None)
    with contextlib.redirect_stdout(io.StringIO()):  # discards the output of cffi, which prints the file name
        parser.emit_python_code(str(module))


def table_of(header: Path) -> Any:
    """Returns the `ffi` object that a module written by write_table() defines. The module is written to a
    temporary folder, and deleted."""
    names: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        module = Path(folder) / "_table.py"
        write_table(header, module)
        exec(compile(module.read_text(encoding="utf-8"), "_table", "exec"), names)
    return names["ffi"]
