"""Compresses the Exodus files of the corpus, and reads their sets with VTK's own reader."""
import os
import subprocess
from pathlib import Path

from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkIOExodus import vtkExodusIIReader

MOST_BYTES = 1 << 20


def corpus():
    """Returns the folder in SHM_CORPUS, or None."""
    folder = os.environ.get("SHM_CORPUS", "")
    return Path(folder) if os.path.isdir(folder) else None


def exodus_files(shm, packed):
    """Compresses each Exodus file of the corpus to the path `packed` with the tool `shm`. Yields the path of
    the Exodus file."""
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    for source in sorted((corpus() / "exodus").iterdir()):
        if source.stat().st_size > MOST_BYTES:
            continue
        subprocess.run([shm, "compress", "--level", "fast", "-f", str(source), "-o", str(packed)], check=True,
                       stdout=subprocess.DEVNULL)
        yield source


class Exodus:
    """The contents of an Exodus file as VTK's reader returns them. `sets` maps the kind and number of each
    set to a grid, or to None if the set is empty."""

    def __init__(self, name):
        reader = vtkExodusIIReader()
        reader.SetFileName(name)
        reader.ApplyDisplacementsOff()
        reader.UpdateInformation()
        kinds = {"node": (reader.NODE_SET, "Node Sets"), "side": (reader.SIDE_SET, "Side Sets"),
                 "element": (reader.ELEM_SET, "Element Sets")}
        for number, _ in kinds.values():
            for i in range(reader.GetNumberOfObjects(number)):
                reader.SetObjectStatus(number, i, 1)
        reader.Update()
        out = reader.GetOutput()
        groups = {out.GetMetaData(i).Get(out.NAME()): out.GetBlock(i) for i in range(out.GetNumberOfBlocks())
                  if out.GetMetaData(i) is not None}
        self.sets = {(kind, reader.GetObjectId(number, i)): groups[group].GetBlock(i)
                     for kind, (number, group) in kinds.items() for i in range(reader.GetNumberOfObjects(number))}
        self._reader = reader  # owns them
