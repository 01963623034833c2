"""PyVista's ImageData and PolyData, which extend VTK's, and pictures in its Plotter."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..rendering import render
from ..scenes import as_scene
from . import vtk
from .checks import library_of


def volume_from_pyvista(cls, image_data, scalars=None, **options):
    """Model an array of PyVista's ImageData, at the positions ``points``, or ``cell_centers()`` for cell data.

    Parameters
    ----------
    image_data : pyvista.ImageData
        With any offset, spacing, origin and direction matrix.
    scalars : str, optional
        Name of the array; by default ``image_data.active_scalars_name``.
    **options
        Options of `Volume`, except the place: ``degree=3``.

    Returns
    -------
    Volume

    Raises
    ------
    TypeError, ValueError, ImportError
        As in `Volume.from_vtk`.

    Examples
    --------
    >>> import pyvista, isospline
    >>> image = pyvista.ImageData(dimensions=(5, 4, 3), spacing=(0.5, 0.5, 2))
    >>> image["density"] = range(60)
    >>> float(isospline.Volume.from_pyvista(image).sample([0.5, 0, 2]).round(3))
    21.0
    """
    if scalars is None:
        scalars = getattr(image_data, "active_scalars_name", None)
    return vtk.volume_from_vtk(cls, image_data, scalars, **options)


def volume_to_pyvista(self):
    """Convert to PyVista's ImageData: the values at the samples, as the point data "values".

    Of a `Volume`, these are the values of its model. They equal the samples if it interpolates them.

    Returns
    -------
    pyvista.ImageData

    Raises
    ------
    ImportError
        If PyVista is not installed: ``pip install isospline[interop]``.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> grid = field.volume(8).to_pyvista()
    >>> grid.dimensions, round(grid.spacing[0], 3)
    ((8, 8, 8), 0.25)
    """
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


def _samples(volume):
    """The values of a volume at its samples, [z, y, x]."""
    if not isinstance(volume, _core.Volume):
        return np.asarray(volume)
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


def mesh_from_pyvista(cls, mesh, **options):
    """Convert a surface of PyVista.

    VTK cuts polygons and strips into triangles, in the order of the cells; triangles are not changed. Lines and single
    points are left out. Normals, colours and values of points are kept, as in `Mesh.from_vtk`.

    Parameters
    ----------
    mesh : pyvista.PolyData, UnstructuredGrid or StructuredGrid
        For grids, their faces are used or, if they have none, the surface of their solid cells.
    **options
        Options of `Mesh`.

    Returns
    -------
    Mesh

    Raises
    ------
    TypeError, ValueError, ImportError
        As in `Mesh.from_vtk`.

    Examples
    --------
    >>> import pyvista, isospline
    >>> isospline.Mesh.from_pyvista(pyvista.Cube()).faces.shape
    (12, 3)
    """
    return vtk.mesh_from_vtk(cls, mesh, **options)


class PlotterPicture:
    """Ray traced isosurfaces in a PyVista Plotter: the result of `add_to_plotter`.

    Each time the Plotter renders, a picture from its camera is drawn below its actors, with the depth of each pixel, so
    that actors and surfaces occlude each other.

    Attributes
    ----------
    scene : Scene
        The rendered scene. After a change of it, call ``plotter.render()``.
    """

    def __init__(self, plotter, scene, options):
        import pyvista

        self.scene = scene
        self._window, self._renderer, self._options = plotter.render_window, plotter.renderer, options
        # The Plotter fits its camera to actors: add an invisible one of the scene's size.
        lower, upper = scene.bounds
        box = pyvista.Box(np.column_stack([lower, upper]).ravel())
        self._box = plotter.add_mesh(box, opacity=0, pickable=False, render=False)
        plotter.disable_anti_aliasing()  # its samples would have their own depths
        for preserve in (self._renderer.SetPreserveColorBuffer, self._renderer.SetPreserveDepthBuffer):
            preserve(True)
        self._tag = self._renderer.AddObserver("StartEvent", self._draw)

    def remove(self):
        """Remove the picture from the Plotter."""
        self._renderer.RemoveObserver(self._tag)
        self._renderer.SetPreserveColorBuffer(False)
        self._renderer.SetPreserveDepthBuffer(False)
        self._renderer.RemoveActor(self._box)

    def _camera(self):
        camera = self._renderer.GetActiveCamera()
        place = camera.GetPosition(), camera.GetFocalPoint(), camera.GetViewUp()
        if camera.GetParallelProjection():
            return _core.OrthographicCamera.from_pyvista(place, camera.GetParallelScale())
        return _core.PerspectiveCamera.from_pyvista(place, camera.GetViewAngle())

    def _draw(self, *_):
        from vtkmodules.util.numpy_support import numpy_to_vtk

        width, height = self._window.GetSize()
        background = np.rint(255 * np.array(self._renderer.GetBackground())).astype(int)
        image = render(
            self.scene,
            self._camera(),
            size=(width, height),
            background="#{:02x}{:02x}{:02x}".format(*background),
            layers=("position",),
            **self._options,
        )
        matrix = self._renderer.GetActiveCamera().GetCompositeProjectionTransformMatrix(width / height, 0, 1)
        to_clip = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])
        clip = image.position @ to_clip[2:, :3].T + to_clip[2:, 3]
        depth = np.nan_to_num(clip[..., 0] / clip[..., 1], nan=1.0).clip(0, 1).astype(np.float32)
        colors = image.to_srgb()
        alpha = np.full((height, width, 1), 255, np.uint8)
        colors = np.concatenate([colors[..., :3], alpha], axis=-1)[::-1].reshape(-1, 4)  # VTK's rows run upwards
        place = 0, 0, width - 1, height - 1
        self._window.SetRGBACharPixelData(*place, numpy_to_vtk(colors, deep=True), 0, 0)
        self._window.SetZbufferData(*place, numpy_to_vtk(depth[::-1].ravel(), deep=True))


def add_to_plotter(plotter, scene, **options):
    """Show ray traced isosurfaces in a PyVista Plotter, together with its actors.

    Parameters
    ----------
    plotter : pyvista.Plotter
        A Plotter with one view. Its anti-aliasing is switched off. Depth peeling must be off.
    scene : Scene, Isosurface or Mesh
        In the Plotter's world.
    **options
        Options of `render`: ``light=``, ``color=``, ``samples=``.

    Returns
    -------
    PlotterPicture

    Raises
    ------
    ValueError
        For a Plotter with several views.

    Examples
    --------
    >>> import isospline, pyvista
    >>> from isospline.interop.pyvista import add_to_plotter
    >>> field = isospline.volumes.torus()
    >>> volume = field.volume(32)
    >>> plotter = pyvista.Plotter(off_screen=True, window_size=(64, 48))
    >>> actor = plotter.add_mesh(pyvista.Sphere(radius=0.3))
    >>> picture = add_to_plotter(plotter, isospline.Isosurface(volume, field.level))
    >>> plotter.screenshot(return_img=True).shape
    (48, 64, 3)
    """
    if len(plotter.renderers) != 1:
        raise ValueError(f"plotter: expected one with a single view, got {len(plotter.renderers)} views")
    return PlotterPicture(plotter, as_scene(scene), options)
