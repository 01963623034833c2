"""Ray traced isosurfaces in a Plotter of PyVista."""

from __future__ import annotations

import numpy as np

from ..base.mistakes import sentence
from ..cameras import OrthographicCamera, ProjectionPlaneCamera
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
        # The Plotter fits its camera to actors, and scales them: add an invisible one in place of the scene.
        self._box = pyvista.Actor(pyvista.DataSetMapper(pyvista.Box()))
        self._box.prop.opacity = 0
        self._fit()
        plotter.add_actor(self._box, reset_camera=None, pickable=False, render=False)
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

    def _fit(self):
        """Give the invisible actor the scene's bounds, or none if there are no surfaces."""
        import pyvista

        bounds = self.scene.bounds
        self._box.use_bounds = bool(np.isfinite(bounds).all())
        if self._box.use_bounds:
            self._box.mapper.dataset = pyvista.Box(bounds.T.ravel())

    def _camera(self, to_clip, size):
        """The camera of a matrix from the scene to VTK's clip space."""
        theirs = self._renderer.GetActiveCamera()
        is_parallel = not to_clip[3, :3].any()
        rows = to_clip[[0, 1, 2 if is_parallel else 3]]
        inverse = np.linalg.inv(rows[:, :3])
        right, up, forward = inverse.T
        origin = -inverse @ rows[:, 3]  # where all rows are 0: the eye, or the middle of the near plane
        if not is_parallel:
            right, up, forward = theirs.GetDistance() * inverse.T  # to the plane through the focal point
            return ProjectionPlaneCamera(origin, center=origin + forward, right=2 * right, down=-2 * up)
        near, far = theirs.GetClippingRange()
        eye = origin - near / (far - near) * forward
        camera = OrthographicCamera(eye, eye + forward, up, height=2 * float(np.linalg.norm(up)))
        wanted, found = to_clip[:2, :3] * ((0.5,), (-0.5,)), camera.world_to_ndc(size)[:2, :3]
        if np.abs(found - wanted).max() > 1e-6 * np.abs(wanted).max():
            expected = "a parallel projection without shear and with equal scales"
            raise ValueError(f"plotter: expected {expected}, got a sheared, stretched or mirrored one")
        return camera

    def _draw(self, *_):
        from vtkmodules.util.numpy_support import numpy_to_vtk

        self._fit()
        (left, bottom), (width, height) = self._renderer.GetOrigin(), self._renderer.GetSize()
        matrix = self._renderer.GetActiveCamera().GetCompositeProjectionTransformMatrix(width / height, 0, 1)
        to_clip = np.reshape(matrix.GetData(), (4, 4)) @ np.reshape(self._box.GetMatrix().GetData(), (4, 4))
        background = np.rint(255 * np.array(self._renderer.GetBackground())).astype(int)
        image = render(
            self.scene,
            self._camera(to_clip, (width, height)),
            size=(width, height),
            background="#{:02x}{:02x}{:02x}".format(*background),
            layers=("position", "mask"),
            **self._options,
        )
        clip = image.position @ to_clip[2:, :3].T + to_clip[2:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):  # pixels without a hit have no position
            depth = np.where(image.mask, clip[..., 0] / clip[..., 1], 1.0).clip(0, 1).astype(np.float32)
        colors = image.to_srgb()
        alpha = np.full((height, width, 1), 255, np.uint8)
        colors = np.concatenate([colors[..., :3], alpha], axis=-1)[::-1].reshape(-1, 4)  # VTK's rows run upwards
        place = left, bottom, left + width - 1, bottom + height - 1
        self._window.SetRGBACharPixelData(*place, numpy_to_vtk(colors, deep=True), 0, 0)
        self._window.SetZbufferData(*place, numpy_to_vtk(depth[::-1].ravel(), deep=True))


def add_to_plotter(plotter, scene, **options):
    """Show ray traced isosurfaces in a PyVista Plotter, together with its actors.

    Parameters
    ----------
    plotter : pyvista.Plotter
        A Plotter with one view. Its anti-aliasing is switched off. Depth peeling must be off.
    scene : Scene, Isosurface or Mesh
        In the Plotter's world. ``plotter.set_scale`` stretches it, with the light that it has before.
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
        For a Plotter with several views. When the Plotter renders, VTK prints this error for a parallel projection with
        shear or unequal scales, and draws no surfaces; in a perspective they are drawn.

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
