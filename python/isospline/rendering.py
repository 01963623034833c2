"""Rendering of scenes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Literal

from . import _core
from .annotations import Annotation, annotated, check_annotations
from .cameras import camera_for
from .image import Image
from .parameters import check_type
from .progress import as_callable
from .signatures import explained
from .studio import Studio, render_in_studio

if TYPE_CHECKING:
    from ._core import _Background, _Camera, _Layer, _Progress, _Shading


@explained
def render(
    scene: _core.Scene | _core.Isosurface | _core.Mesh,
    camera: _Camera | None = None,
    *,
    size: tuple[int, int] = (640, 360),
    crop: tuple[int, int, int, int] | None = None,
    shading: _Shading | Mapping[Any, _Shading] | None = None,
    lighting: Studio | None = None,
    integrator: _core.PathTracer | None = None,
    background: _Background = None,
    samples: int = 1,
    layers: Iterable[_Layer] = (),
    ambient_occlusion_samples: int = 16,
    encoding: Literal["linear", "srgb8"] = "linear",
    annotate: Iterable[Annotation] = (),
    unit: str | None = None,
    progress: _Progress = None,
) -> Image:
    """Render a scene.

    The image is the same, bit for bit, for any number of threads. Ctrl-C stops the work.

    Parameters
    ----------
    scene : Scene, Isosurface or Mesh
        What to show; a single object becomes ``Scene([surface])``.
    camera : PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera or PanoramicCamera, optional
        The camera; by default ``camera_for(scene, size=size)``, which shows the whole scene.
    size : (int, int)
        Width and height of the picture in pixels.
    crop : (int, int, int, int), optional
        First column and row, width and height of the part of the picture to render; by default the whole picture. The
        image has the crop's size, and its pixels are those of the whole picture, bit for bit. In OpenEXR files, the
        crop is the data window.
    shading : Phong, Outline, AmbientOcclusion, or dict of geometry id or object to one of them, optional
        The illumination model of the whole scene, or of geometry ids or objects; by default, and for geometries that a
        dict leaves out, ``Phong()``. If opacities are below 1, all crossings of a ray, entering and leaving, are
        composited front to back by the over operator, in the exact order of `Scene.list_intersections`, up to the first
        opaque surface. Shadows and ambient occlusion are attenuated by opacities.
    lighting : Studio, optional
        Light that replaces the lights of `Phong` shadings: soft shadows on a ground, and tone mapping. It is the
        default of the command line.
    integrator : PathTracer, optional
        Replaces the shading: Monte Carlo path tracing, with the variance of its noise as a layer. All surfaces are
        opaque.
    background : str, float, (3,) float, (4,) float, optional
        Colour of the background: a name, such as "white" or "#ff8000", or linear numbers from 0 to 1, with an opacity
        if there are four; transparent by default.
    samples : int
        Rays per pixel, from 1 to 65536; the colour is their mean. They are evenly spread over the pixel, and over the
        camera's lens if it has one. With an even number or a lens, one more ray goes through the centre, for the
        layers.
    layers : sequence of str
        Further arrays of the `Image`, by name: "depth", "position", "normal", "albedo", "gradient_magnitude",
        "curvature", "ambient_occlusion", "geometry_ids", "primitive_ids" and, with an integrator, "direct" and
        "variance". Only named layers are computed and stored: a picture without layers is the fastest.
    ambient_occlusion_samples : int
        Rays per pixel for the layer "ambient_occlusion", from 1 to 65536.
    encoding : {"linear", "srgb8"}
        How the colour is stored: linear in float32, as `Image.color`, or in 8 bits, as the result of `Image.to_srgb`,
        for viewers and videos. 8 bits need a quarter of the memory.
    annotate : sequence of {"scale_bar", "colorbar"}
        What to draw into the colour: a scale bar, whose length in a perspective is valid at the camera's target; a
        colour bar for each colour rule with a map. Not allowed with a crop.
    unit : str, optional
        Unit of world coordinates, for the scale bar, such as "mm"; by default that of the scene's volumes, if all have
        the same.
    progress : callable or True, optional
        Called with the finished fraction a few times a second; cancels the rendering by returning
        a false value other than None. True shows a bar.

    Returns
    -------
    Image

    Raises
    ------
    ValueError
        For an invalid size, background or number of rays, for an unknown name of a layer, and for a geometry id of a
        shading or material that is not in the scene.
    Cancelled
        If `progress` cancelled it.

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
    if isinstance(scene, (_core.Isosurface, _core.Mesh)):
        scene = _core.Scene([scene])
    check_type(scene, "scene", _core.Scene, "a Scene")
    if isinstance(shading, Mapping):
        shading = _by_geometry_id(scene, shading)
    look = shading if integrator is None else integrator
    marks = check_annotations(annotate, camera, look, unit)
    if marks and crop is not None:
        raise ValueError(f"annotate: expected nothing with a crop, got {', '.join(marks)}")
    if camera is None:
        camera = camera_for(scene, size=size)
    unit = unit_of(scene) if unit is None else unit
    options: dict[str, Any] = {"size": size, "crop": crop, "samples": samples, "layers": layers}
    options["ambient_occlusion_samples"] = ambient_occlusion_samples
    if lighting is not None:
        check_type(lighting, "lighting", Studio, "a Studio")
        if integrator is not None:
            raise ValueError("lighting: expected None with an integrator, got Studio")
        if encoding != "linear":
            raise ValueError(f"encoding: expected 'linear' with lighting, got {encoding!r}")
        progress = as_callable(progress)
        image = render_in_studio(scene, camera, lighting, shading, background, progress, **options)
        return annotated(image, marks, camera, scene, look, unit)
    if integrator is not None:
        if shading is not None:
            raise ValueError("shading: expected None with an integrator, got " + type(shading).__name__)
        renderer = _core.ProgressiveRenderer(
            scene,
            camera,
            size=size,
            crop=crop,
            integrator=integrator,
            background=background,
            layers=layers,
            ambient_occlusion_samples=ambient_occlusion_samples,
            encoding=encoding,
        )
        renderer.step(samples, progress=progress)
        return annotated(Image(renderer.image()), marks, camera, scene, look, unit)
    if shading is None:
        shading = _core.Phong()
    options.update(background=background, encoding=encoding, progress=progress)
    image = Image(_core.render(scene, camera, shading=shading, **options))
    return annotated(image, marks, camera, scene, look, unit)


def _by_geometry_id(scene: _core.Scene, of_objects: Mapping[Any, _Shading]) -> dict[int, _Shading]:
    """The values for geometry ids of a mapping from objects or geometry ids."""
    of_ids = {key: value for key, value in of_objects.items() if not isinstance(key, (_core.Isosurface, _core.Mesh))}
    given = {id(key): value for key, value in of_objects.items() if isinstance(key, (_core.Isosurface, _core.Mesh))}
    if given:
        shown = {geometry_id: id(item) for geometry_id, item, *_ in scene._placed_objects()}
        if not given.keys() <= set(shown.values()):
            raise ValueError("shading: expected isosurfaces and meshes of the scene, got one that is not in it")
        of_ids = {key: given[each] for key, each in shown.items() if each in given} | of_ids
    return of_ids


def unit_of(scene: _core.Scene) -> str:
    """The unit of world coordinates: that of the volumes of a scene; empty if they differ, or do not tell it."""
    units = {item.volume.unit for _, item, *_ in scene._placed_objects() if isinstance(item, _core.Isosurface)}
    return units.pop() if len(units) == 1 else ""
