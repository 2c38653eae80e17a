"""Unstructured grids of the corpus, as VTK's own reader has them and as .shm files."""
import os
import subprocess
from pathlib import Path

from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkIOLegacy import vtkUnstructuredGridReader

MOST_BYTES_OF_SOURCES = 3 << 20  # larger ones are read by the tests of the tool


def corpus():
    """The folder that SHM_CORPUS names, or nothing."""
    folder = os.environ.get("SHM_CORPUS", "")
    return Path(folder) if os.path.isdir(folder) else None


def unstructured_grids(shm, packed):
    """(path, what VTK reads) of each legacy VTK file; meanwhile `packed` is what the tool `shm` makes of it."""
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    for source in sorted(corpus().rglob("*.vtk")):
        with source.open("rb") as file:
            head = file.read(1 << 12)
        if source.stat().st_size > MOST_BYTES_OF_SOURCES or b"UNSTRUCTURED_GRID" not in head:
            continue
        subprocess.run([shm, "compress", "--level", "fast", "-f", str(source), "-o", str(packed)], check=True,
                       stdout=subprocess.DEVNULL)
        reader = vtkUnstructuredGridReader()
        reader.SetFileName(str(source))
        for all_of in ("Scalars", "Vectors", "Normals", "Tensors", "TCoords", "Fields", "ColorScalars"):
            getattr(reader, f"ReadAll{all_of}On")()
        reader.Update()
        yield source, reader.GetOutput()
