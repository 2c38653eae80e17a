"""What the C interface declares, as cffi takes it: parsed once, when the package is made.

Types that are named in calls (ffi.new("shmf_error*")) are then found in a table. cffi's own objects of this kind
would parse each such name the first time, a millisecond of a program that reads a small mesh in ten.
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
    """The header without what is the preprocessor's."""
    text = re.sub(r"/\*.*?\*/", " ", header.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"^#ifdef __cplusplus$.*?^#endif$", "", text, flags=re.S | re.M)
    return re.sub(r"^\s*#.*$", "", text, flags=re.M).replace("SHMF_API", "")


def write_table(header: Path, module: Path) -> None:
    """Writes a module with `ffi`."""
    parser = cffi.FFI()
    parser.cdef(declarations(header))
    parser.set_source(f"shmformat.{module.stem}", None)
    with contextlib.redirect_stdout(io.StringIO()):  # which it tells that it writes
        parser.emit_python_code(str(module))


def table_of(header: Path) -> Any:
    """The `ffi` of such a module, where there is none."""
    names: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        module = Path(folder) / "_table.py"
        write_table(header, module)
        exec(compile(module.read_text(encoding="utf-8"), "_table", "exec"), names)
    return names["ffi"]
