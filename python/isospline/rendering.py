"""Rendering of scenes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Literal

from . import _core
from .cameras import camera_for
from .image import Image
from .parameters import check_type
from .signatures import explained

if TYPE_CHECKING:
    from ._core import _Background, _Camera, _Layer, _Progress, _Shading


@explained
def render(
    scene: _core.Scene,
    camera: _Camera | None = None,
    *,
    size: tuple[int, int] = (640, 360),
    shading: _Shading | Mapping[Any, _Shading] | None = None,
    integrator: _core.PathTracer | None = None,
    background: _Background = None,
    samples: int = 1,
    layers: Iterable[_Layer] = (),
    ambient_occlusion_samples: int = 16,
    encoding: Literal["linear", "srgb8"] = "linear",
    progress: _Progress = None,
) -> Image:
    """Render a scene.

    The image is the same, bit for bit, for any number of threads. Ctrl-C stops the work.

    Parameters
    ----------
    scene : Scene
        Isosurfaces and meshes.
    camera : PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera or PanoramicCamera, optional
        Where from; by default ``camera_for(scene, size=size)``, which has all of the scene in view.
    size : (int, int)
        Width and height of the image in pixels.
    shading : Phong, Outline, AmbientOcclusion, or dict of geometry id or object to one of them, optional
        The illumination model, of the whole scene or of each geometry, or of all that show an isosurface or mesh; by
        default, and for geometries that a dict leaves out, ``Phong()``. Where its opacity is below 1, all that a ray
        meets, entering and leaving, is composited front to back by the over operator, up to the first surface that is
        opaque, in the exact order of `Scene.list_intersections`; shadows and ambient occlusion let through what
        opacities leave.
    integrator : PathTracer, optional
        Takes the place of the shading: light on all paths, by chance, with the variance of its noise in the image. All
        surfaces are opaque.
    background : str, float, (3,) float, (4,) float, optional
        Colour that shows where no surface is: a name, such as "white" or "#ff8000", or linear numbers, with an opacity
        if there are four; transparent by default.
    samples : int
        Rays of a pixel that its colour is the mean of, from 1 to 65536. They are spread evenly over the pixel, and over
        the camera's lens if it has one; with an even number or a lens, one more ray goes through the centre for
        layers that are of the centre.
    layers : sequence of str
        What the image holds beside its colour, by the names of the arrays of `Image`: "depth", "position", "normal",
        "albedo", "gradient_magnitude", "curvature", "ambient_occlusion", "geometry_ids", "primitive_ids" and, beside an
        integrator, "direct" and "variance". What is not named is neither computed nor stored: a picture of colour alone
        is the fastest.
    ambient_occlusion_samples : int
        Rays that the layer "ambient_occlusion" is the mean of at every pixel, from 1 to 65536.
    encoding : {"linear", "srgb8"}
        How the colour is stored: linear in float32, as `Image.color`, or in 8 bits as `Image.to_srgb` returns it, for
        viewers and videos, a quarter of the memory.
    progress : callable or True, optional
        Called with the finished fraction a few times a second; cancels the rendering by returning
        a false value other than None. True shows a bar.

    Returns
    -------
    Image

    Raises
    ------
    ValueError
        For a size, a background or a number of rays that makes no sense, for a name that is none of a layer, and for a
        geometry id of a shading or material that is not in the scene.
    Cancelled
        Where `progress` cancelled it.

    Examples
    --------
    >>> import numpy as np
    >>> import isospline
    >>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
    >>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
    >>> scene = isospline.Scene([isospline.Isosurface(volume, 6.0, inside="below")])
    >>> camera = isospline.camera_for(scene, view="front")
    >>> image = isospline.render(scene, camera, size=(64, 48), shading=isospline.Outline(2), layers=("depth",))
    >>> image.color.shape, image.depth.shape
    ((48, 64, 4), (48, 64))
    >>> isospline.render(scene, camera, size=(64, 48), encoding="srgb8").to_srgb().dtype
    dtype('uint8')
    """
    check_type(scene, "scene", _core.Scene, "a Scene")
    if camera is None:
        camera = camera_for(scene, size=size)
    if integrator is not None:
        if shading is not None:
            raise ValueError("shading: expected None beside an integrator, got " + type(shading).__name__)
        renderer = _core.ProgressiveRenderer(
            scene, camera, size=size, integrator=integrator, background=background, layers=layers,
            ambient_occlusion_samples=ambient_occlusion_samples, encoding=encoding,
        )  # fmt: skip
        renderer.step(samples, progress=progress)
        return Image(renderer.image())
    if shading is None:
        shading = _core.Phong()
    elif isinstance(shading, Mapping):
        shading = _by_geometry_id(scene, shading)
    return Image(
        _core.render(
            scene,
            camera,
            size=size,
            shading=shading,
            background=background,
            samples=samples,
            layers=layers,
            ambient_occlusion_samples=ambient_occlusion_samples,
            encoding=encoding,
            progress=progress,
        )  # fmt: skip
    )


def _by_geometry_id(scene: _core.Scene, of_objects: Mapping[Any, _Shading]) -> dict[int, _Shading]:
    """What a mapping from objects, or geometry ids, says of each geometry id."""
    of_ids = {key: value for key, value in of_objects.items() if not isinstance(key, (_core.Isosurface, _core.Mesh))}
    given = {id(key): value for key, value in of_objects.items() if isinstance(key, (_core.Isosurface, _core.Mesh))}
    if given:
        shown = {geometry_id: id(scene.object(geometry_id)) for geometry_id in scene.ids}
        if not given.keys() <= set(shown.values()):
            raise ValueError("shading: expected isosurfaces and meshes of the scene, got one that is not in it")
        of_ids = {key: given[each] for key, each in shown.items() if each in given} | of_ids
    return of_ids
