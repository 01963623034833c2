"""PyVista's ImageData and PolyData, which extend VTK's."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.handed import handed
from ..io.volume_data import VolumeData
from . import vtk
from .checks import library_of


def volume_from_pyvista(cls, image_data, scalars=None, **options):
    """See `Volume.from_pyvista`."""
    of_cells = None
    if scalars is None:
        scalars = getattr(image_data, "active_scalars_name", None)
        if scalars is not None:
            of_cells = image_data.active_scalars_info.association.name == "CELL"
    return vtk.volume_of_array(cls, image_data, scalars, of_cells, options)


@handed
def volume_to_pyvista(self):
    """See `Volume.to_pyvista`."""
    with library_of(f"{type(self).__name__}.to_pyvista"):
        import pyvista
    samples = _samples(self)
    grid = pyvista.ImageData(
        dimensions=samples.shape[::-1],
        spacing=tuple(map(float, self.spacing)),
        origin=tuple(map(float, self.origin)),
        direction_matrix=np.array(self.direction),
    )
    grid.point_data["values"] = samples.ravel()
    return grid


def _samples(volume: Any) -> Any:
    """The values of a volume at its samples, [z, y, x]."""
    if isinstance(volume, VolumeData):
        samples = np.asarray(volume)
        # A copy: PyVista swaps the bytes of a given array, and shares its memory. VTK has no half floats.
        native = samples.dtype.newbyteorder("=")
        return np.array(samples, np.float32 if native == np.float16 else native, order="C")
    shape = volume.shape[::-1] if volume.axes == "zyx" else volume.shape
    values = np.empty(shape[::-1])
    x, y = np.meshgrid(np.arange(shape[0]), np.arange(shape[1]))
    for z, slice_ in enumerate(values):
        index = np.stack([x, y, np.full(x.shape, z)], axis=-1)
        slice_[...] = volume.sample(index @ volume.affine[:3, :3].T + volume.affine[:3, 3])
    return values


class _FromMesh:
    """The type that PyVista's `wrap` finds for a mesh or a surface of isospline."""

    def __new__(cls, mesh):
        return mesh.to_pyvista()


def class_name(self):
    """The name by which `pyvista.wrap` finds the conversion, so that ``plotter.add_mesh`` accepts the object."""
    import pyvista

    name = f"isospline.{type(self).__name__}"
    known: Any = pyvista._wrappers
    known.setdefault(name, _FromMesh)
    return name
