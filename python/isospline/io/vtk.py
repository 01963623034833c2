"""VTK's image data, legacy .vtk and XML .vti, read by VTK in a process of its own."""

from __future__ import annotations

import contextlib
import os
import re
from typing import Any

import numpy as np

from .checks import check_components, check_samples, utf8
from .volume_data import VolumeData, read_isolated

#: The modules that are needed, imported once by the server of processes.
LIBRARIES = "vtkmodules.vtkIOLegacy vtkmodules.vtkIOXML vtkmodules.util.numpy_support"


def read_legacy(path, name=None):
    """Read a legacy file of structured points."""
    return read_isolated("isospline.io.vtk:load", path, LIBRARIES, name=name, legacy=True)


def read_xml(path, name=None):
    """Read a .vti file."""
    return read_isolated("isospline.io.vtk:load", path, LIBRARIES, name=name, legacy=False)


def load(path, name, legacy):
    """Read a file in this process."""
    from vtkmodules.vtkIOLegacy import vtkStructuredPointsReader
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    reader: Any = vtkStructuredPointsReader() if legacy else vtkXMLImageDataReader()
    if legacy:
        reader.ReadAllScalarsOn()
    else:
        check_end(path)
    with messages() as text:
        reader.SetFileName(utf8(path))
        reader.UpdateInformation()
        check_messages(text())
        _check_memory(reader.GetOutputInformation(0))
        reader.Update()
        check_messages(text())
    return vars(to_volume_data(reader.GetOutput(), name))


def check_end(path):
    """Check that an XML file is complete: VTK accepts a file without its last line."""
    with open(path, "rb") as file:
        file.seek(-min(os.path.getsize(path), 256), os.SEEK_END)
        if b"</VTKFile>" not in file.read():
            raise ValueError("expected </VTKFile> at the end: the file is truncated, or not a VTK file")


def to_volume_data(image, name=None, of_cells=None):
    """The place of image data, and the samples of the array with this name, or of the active or only one.

    `of_cells` tells whether an array of cells or of points is meant, if both have the name.
    """
    array, of_cells = _choose(image, name, of_cells)
    check_components(array.GetNumberOfComponents())

    extent = np.reshape(image.GetExtent(), (3, 2))
    size = extent[:, 1] - extent[:, 0] + (0 if of_cells else 1)
    check_samples(tuple(size[::-1].tolist()), "u1", mapped=True)
    data = numbers_of(array)
    if data.size != np.prod(size):
        raise ValueError(f"expected {np.prod(size)} samples, got {data.size}")
    spacing = np.array(image.GetSpacing())
    matrix = image.GetDirectionMatrix()
    direction = np.array([[matrix.GetElement(row, column) for column in range(3)] for row in range(3)])
    # The sample of a cell is in its middle.
    first = extent[:, 0] + (0.5 if of_cells else 0.0)
    origin = np.array(image.GetOrigin()) + direction @ (spacing * first)
    return VolumeData(
        data.reshape(size[::-1]),
        tuple(np.abs(spacing).tolist()),
        tuple(origin.tolist()),
        direction * np.where(spacing < 0, -1.0, 1.0),
    )


def numbers_of(array):
    """The numbers of a VTK array, also of one that computes them or has its components apart."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkDataArray

    if not array.HasStandardMemoryLayout():
        stored = vtkDataArray.CreateDataArray(array.GetDataType())
        stored.DeepCopy(array)
        array = stored
    return vtk_to_numpy(array)


def _check_memory(information):
    """Check the header's shape and type of the samples before they are read."""
    from vtkmodules.vtkCommonCore import vtkDataArray
    from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkDataSetAttributes
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    extent = information.Get(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT())
    if extent is None:
        return
    scalars = vtkDataObject.GetActiveFieldInformation(information, 0, vtkDataSetAttributes.SCALARS)
    item_size = vtkDataArray.GetDataTypeSize(scalars.Get(vtkDataObject.FIELD_ARRAY_TYPE())) if scalars else 1
    size = [int(last) - int(first) + 1 for first, last in zip(extent[0::2], extent[1::2])]
    check_samples(size[::-1], f"u{max(item_size, 1)}")  # a byte for each bit, whose size VTK gives as 0


def _choose(image, name, wanted):
    """The array with this name, otherwise the active scalars, otherwise the only array; and whether it is of cells."""
    found: dict[str, Any] = {}
    for attributes, of_cells in ((image.GetPointData(), False), (image.GetCellData(), True)):
        every = (attributes.GetArray(index) for index in range(attributes.GetNumberOfArrays()))
        arrays = {array.GetName(): (array, of_cells) for array in every if array is not None}
        if name is not None and name in arrays and wanted in (None, of_cells):  # arrays without a name have None
            return arrays[name]
        if name is None and attributes.GetScalars() is not None:
            return attributes.GetScalars(), of_cells
        found.update(arrays)
    if name is None and len(found) == 1:
        return next(iter(found.values()))
    names = ", ".join(map(str, found)) or "none"
    expected = "expected one array of samples, or its name" if name is None else f"expected an array named {name}"
    raise ValueError(f"{expected}, got {names}")


@contextlib.contextmanager
def messages():
    """Collect VTK's output: some errors are reported only there."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    window, previous = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    vtkOutputWindow.SetInstance(window)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield window.GetOutput
    finally:
        vtkLogger.SetStderrVerbosity(verbosity)
        vtkOutputWindow.SetInstance(previous)


def check_messages(text):
    """Raise the first of VTK's errors and warnings."""
    lines = [line for line in text.splitlines() if line.strip()]
    texts = [line for line in lines if not re.match(r"(ERROR|Generic Warning|Warning): In ", line)]
    if lines:
        raise ValueError(re.sub(r"^vtk\w+ \(\w+\): ", "", (texts or lines)[0].strip()))
