"""Ray traced isosurfaces in a Plotter of PyVista."""

from __future__ import annotations

import numpy as np

from ..base.mistakes import sentence
from ..cameras import OrthographicCamera, PerspectiveCamera
from .rendering import render
from .scenes import as_scene


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
            return OrthographicCamera.from_pyvista(place, camera.GetParallelScale())
        return PerspectiveCamera.from_pyvista(place, camera.GetViewAngle())

    def _draw(self, *_):
        from vtkmodules.util.numpy_support import numpy_to_vtk

        width, height = self._window.GetSize()
        background = np.rint(255 * np.array(self._renderer.GetBackground())).astype(int)
        image = render(
            self.scene,
            self._camera(),
            size=(width, height),
            background="#{:02x}{:02x}{:02x}".format(*background),
            layers=("position", "mask"),
            **self._options,
        )
        matrix = self._renderer.GetActiveCamera().GetCompositeProjectionTransformMatrix(width / height, 0, 1)
        to_clip = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])
        clip = image.position @ to_clip[2:, :3].T + to_clip[2:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):  # pixels without a hit have no position
            depth = np.where(image.mask, clip[..., 0] / clip[..., 1], 1.0).clip(0, 1).astype(np.float32)
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
        Options of `render` that the Plotter does not determine, such as ``color=``, ``samples=`` and ``light=``, by
        default ``Phong()``.

    Returns
    -------
    PlotterPicture

    Raises
    ------
    TypeError
        For what is not a Plotter.
    ValueError
        For a Plotter with several views.

    Examples
    --------
    >>> import isospline, pyvista
    >>> field = isospline.volumes.torus()
    >>> volume = field.volume(32)
    >>> plotter = pyvista.Plotter(off_screen=True, window_size=(64, 48))
    >>> actor = plotter.add_mesh(pyvista.Sphere(radius=0.3))
    >>> picture = isospline.add_to_plotter(plotter, isospline.Isosurface(volume, field.level))
    >>> plotter.screenshot(return_img=True).shape
    (48, 64, 3)
    """
    if not hasattr(plotter, "renderers"):
        raise TypeError(sentence("plotter", "a Plotter of PyVista", plotter))
    if len(plotter.renderers) != 1:
        raise ValueError(f"plotter: expected one with a single view, got {len(plotter.renderers)} views")
    return PlotterPicture(plotter, as_scene(scene), {"light": "phong", **options})
