"""ParaView plugin for .shm files: a reader and a writer. ParaView chooses the reader by the extension of the file.

There are three ways to load the plugin: Tools > Manage Plugins > Load New; LoadPlugin() in a script; or the
environment variable PV_PLUGIN_PATH. The variable must name a folder that contains only a link to this file, since
ParaView runs every file in the folder. The package shmformat must be next to this file or be installed; it needs
NumPy and cffi in ParaView's Python.

Before version 5.11, ParaView imports inspect.getargspec() before it reads a plugin. Python 3.11 no longer has this
function. So with Python 3.11, as on Debian 12, ParaView loads no plugin that is written in Python. Importing this
module adds the function. That is too late for the three ways above, but it works in scripts and in the Python shell of
ParaView, if PYTHONPATH contains this folder:

    import shmformat_paraview
    shmformat_paraview.load()
"""
from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

if not hasattr(inspect, "getargspec"):  # ParaView uses only `args` of the result
    inspect.getargspec = inspect.getfullargspec

HERE = Path(__file__).resolve()
if str(HERE.parent) not in sys.path:
    sys.path.append(str(HERE.parent))

from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smdomain, smhint, smproperty, smproxy  # noqa: E402
from vtkmodules.vtkCommonCore import vtkDataArraySelection  # noqa: E402
from vtkmodules.vtkCommonDataModel import vtkDataObject  # noqa: E402
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline  # noqa: E402

import shmformat  # noqa: E402
import shmformat.vtk  # noqa: E402

paraview_plugin_name = "shmformat"
paraview_plugin_version = shmformat.__version__
_FILES = "Meshes in .shm files"


def load() -> None:
    """Loads this file as a ParaView plugin into the current process."""
    from paraview.simple import LoadPlugin
    LoadPlugin(str(HERE), remote=False)


@smproxy.reader(name="ShmReader", label="SHM Reader", extensions="shm", file_description=_FILES, support_reload=False)
class ShmReader(shmformat.vtk.Reader):
    """Reads a .shm file as a collection of blocks and sets, or as a single grid. By default, all blocks are switched
    on, and all sets are switched off."""

    def __init__(self) -> None:
        super().__init__(blocks=True)

    @smproperty.stringvector(name="FileName")
    @smdomain.filelist()
    @smhint.filechooser(extensions="shm", file_description=_FILES)
    def SetFileName(self, name: str) -> None:
        super().SetFileName(name)

    @smproperty.doublevector(name="TimestepValues", information_only="1", si_class="vtkSITimeStepsProperty")
    def GetTimestepValues(self) -> list[float] | None:
        return self._times() if self._name else None

    @smproperty.xml("""
        <IntVectorProperty name="OneGrid" label="One Grid" command="SetOneGrid" number_of_elements="1" default_values="0">
          <BooleanDomain name="bool"/>
          <Documentation>Reads all blocks as one unstructured grid, with the cell array "block", and no sets.</Documentation>
        </IntVectorProperty>""")
    def SetOneGrid(self, one: int) -> None:
        self.SetBlocks(not one)

    @smproperty.dataarrayselection(name="PointArrays")
    def GetPointDataArraySelection(self) -> vtkDataArraySelection:
        return super().GetPointDataArraySelection()

    @smproperty.dataarrayselection(name="CellArrays")
    def GetCellDataArraySelection(self) -> vtkDataArraySelection:
        return super().GetCellDataArraySelection()

    @smproperty.dataarrayselection(name="Blocks")
    def GetElementBlockSelection(self) -> vtkDataArraySelection:
        return super().GetElementBlockSelection()

    @smproperty.dataarrayselection(name="NodeSets")
    def GetNodeSetSelection(self) -> vtkDataArraySelection:
        return super().GetNodeSetSelection()

    @smproperty.dataarrayselection(name="SideSets")
    def GetSideSetSelection(self) -> vtkDataArraySelection:
        return super().GetSideSetSelection()

    @smproperty.dataarrayselection(name="ElementSets")
    def GetElementSetSelection(self) -> vtkDataArraySelection:
        return super().GetElementSetSelection()


@smproxy.writer(name="ShmWriter", label="SHM Writer", extensions="shm", file_description=_FILES, support_reload=False)
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkUnstructuredGrid", "vtkPartitionedDataSetCollection", "vtkPartitionedDataSet",
                              "vtkMultiBlockDataSet"], composite_data_supported=True)
class ShmWriter(VTKPythonAlgorithmBase):
    """Writes the input at its current time step, as one mesh. Fails if ParaView runs in several processes."""

    def __init__(self) -> None:
        super().__init__(nInputPorts=1, nOutputPorts=0, inputType="vtkDataObject")
        self._writer = shmformat.vtk.Writer()

    @smproperty.stringvector(name="FileName", panel_visibility="never")
    @smdomain.filelist()
    def SetFileName(self, name: str) -> None:
        if name != self._writer.GetFileName():
            self._writer.SetFileName(name)
            self.Modified()

    @smproperty.xml("""
        <StringVectorProperty name="Level" command="SetLevel" number_of_elements="1" default_values="default">
          <StringListDomain name="levels">
            <String value="fast"/> <String value="default"/> <String value="best"/>
          </StringListDomain>
          <Documentation>Amount of work spent on compression. All levels are lossless.</Documentation>
        </StringVectorProperty>""")
    def SetLevel(self, level: str) -> None:
        self._writer.level = level
        self.Modified()

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        information = inputs[0].GetInformationObject(0)
        if (information.Get(Pipeline.UPDATE_NUMBER_OF_PIECES()) or 1) > 1:
            raise ValueError(".shm files are written by a single process, but this process has only a piece of the mesh")
        self._writer.SetInputData(information.Get(vtkDataObject.DATA_OBJECT()))
        self._writer.Write()
        return 1

    def Write(self) -> None:
        """Writes the file. ParaView calls this function when the input and the file name are set."""
        self.Modified()
        self.Update()
