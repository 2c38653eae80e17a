"""Lets PyVista read and write .shm files. The entry points `pyvista.readers` and `pyvista.writers` refer to this
module.

On systems without PyVista, such as Debian 12, the tests cover only the underlying module shmformat.vtk.
"""
from __future__ import annotations

import os
from typing import Any

from . import vtk


def read(filename: str | os.PathLike[str], **_: Any) -> Any:
    """Returns a pyvista.UnstructuredGrid."""
    import pyvista
    reader = vtk.Reader()
    reader.SetFileName(os.fspath(filename))
    reader.Update()
    return pyvista.wrap(reader.GetOutput())


def write(dataset: Any, filename: str | os.PathLike[str], **_: Any) -> None:
    writer = vtk.Writer()
    writer.SetFileName(os.fspath(filename))
    writer.SetInputData(dataset)
    writer.Write()
