"""Rendering of scenes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal

from .. import _core
from ..base.progress import as_callable
from ..base.signatures import explained
from ..base.views import SIZE
from ..scene import Scene
from .annotations import Annotation
from .cameras import camera_for, check_camera
from .defaults import background_of, marks_of, samples_of
from .files import in_detail
from .image import Image
from .layers import compiled, names_of
from .lights import Light, in_environment, resolve
from .marks import Marks
from .scenes import as_scene
from .studio import Studio, render_in_studio, upward_for

if TYPE_CHECKING:
    from ..base.types import Background, Color, Layer, Progress
    from ..cameras.camera import _Camera


@explained
def render(
    scene: Any,
    camera: _Camera | None = None,
    *,
    level: float | None = None,
    light: Light = None,
    environment: Any = None,
    color: Color | None = None,
    opacity: float | None = None,
    size: tuple[int, int] = SIZE,
    crop: tuple[int, int, int, int] | None = None,
    background: Background = None,
    samples: int | None = None,
    layers: Iterable[Layer] = (),
    ambient_occlusion_samples: int = 16,
    encoding: Literal["linear", "srgb8"] = "linear",
    annotate: bool | Annotation | Iterable[Annotation] | None = None,
    unit: str | None = None,
    legend: bool = False,
    progress: Progress = None,
) -> Image:
    """Render a scene.

    The image is the same, bit for bit, for any number of threads. Ctrl-C stops the work.

    Parameters
    ----------
    scene : Scene, Isosurface, Mesh, sequence of them, Volume, VolumeData, (nz, ny, nx) array, str or path-like
        What to show. Of a volume, it is the isosurface at `level`, closed at the border. A file is read by
        `read_volume`, `Labels.read` if it is a label map, or `read_mesh`; of the folder of a store, the scale is shown
        whose voxels are about pixels.
    camera : PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera or PanoramicCamera, optional
        The camera; by default ``camera_for(scene, size=size)``, which shows the whole scene, or one that leaves space
        for the marks of `annotate` and `legend`.
    level : float, optional
        Of a volume; by default the one that the command `isospline render` chooses.
    light : str, Studio, Phong, Outline, AmbientOcclusion, PathTracer, or dict of object or geometry id to shadings
        The light of the whole scene; by default ``Studio()``, which has soft shadows on a ground and tone mapping.
        ``Studio(fast=True)`` has neither shadows nor a ground, and ``Phong()`` is the fastest. The names "studio",
        "phong", "unlit", "outline", "ambient-occlusion" and "path-trace" are those of ``isospline render --light``;
        unlit colours are exactly those of colour bars, so that values can be read off. A `PathTracer` has the variance
        of its noise as a layer. A dict has a `Phong`, `Outline` or `AmbientOcclusion` for some objects; the others have
        ``Phong()``. Objects have the look that they were made with, ``Isosurface(..., color=, opacity=)`` or
        ``material=``, unless the dict has another one; without any, they have that of the light. If opacities are below
        1, the crossings of a ray, entering and leaving, are composited front to back by the over operator, in the exact
        order of `Scene.list_intersections`, until less than 1/8192 of the light is left. Shadows and ambient occlusion
        are attenuated by opacities.
    environment : path, (height, width, 3) array, float, (3,) float or EnvironmentLight, optional
        The light from all around, for path tracing, which is the default with it: an equirectangular panorama, as an
        .exr or .hdr file or an array, or a brightness or colour. A panorama stands upright: its zenith is what is
        nearest to the camera's upward direction, of +z, that of `suggest_view` and the opposites of both.
        ``EnvironmentLight("sky.exr", visible=True)`` is seen behind the surfaces, too.
    color, opacity : optional
        Colour and opacity of all objects, in place of their own, as in `Material`.
    size : (int, int)
        Width and height of the picture in pixels.
    crop : (int, int, int, int), optional
        First column and row, width and height of the part of the picture to render; by default the whole picture. The
        image has the crop's size, and its pixels are those of the whole picture, bit for bit. In OpenEXR files, the
        crop is the data window.
    background : str, float, (3,) float, (4,) float, optional
        Colour of the background: a name, such as "white" or "#ff8000", numbers from 0 to 1 in sRGB, with an opacity if
        there are four, or "transparent". By default, it is light in a `Studio`, and otherwise transparent.
    samples : int, optional
        Rays per pixel, from 1 to 65536, by default 4 in a `Studio` and otherwise 1; the colour is their mean. They are
        evenly spread over the pixel, and over the camera's lens if it has one. With an even number or a lens, one more
        ray goes through the centre, for the layers. In a `Studio` and without a lens, a pixel has only the ray through
        its centre if its colour is about that of its neighbours: surfaces narrower than a pixel may be missed.
    layers : sequence of str
        Further arrays of the `Image`, by name: "depth", "position", "normal", "albedo", "gradient_magnitude",
        "curvature", "ambient_occlusion", "geometry_ids", "primitive_ids", "mask", "certified" and, with a path tracer,
        "direct" and "variance". Only named layers are computed and stored: a picture without layers is the fastest.
    ambient_occlusion_samples : int
        Rays per pixel for the layer "ambient_occlusion", from 1 to 65536.
    encoding : {"linear", "srgb8"}
        How the colour is stored: linear in float32, as `Image.color`, or in 8 bits, as the result of `Image.to_srgb`,
        for viewers and videos. 8 bits need a quarter of the memory.
    annotate : bool, or sequence of {"scale_bar", "colorbar"}, optional
        What to draw into the colour: a scale bar, whose length in a perspective is valid at the camera's target, or,
        for a `ProjectionPlaneCamera`, in the middle of the depths of all objects in front of its eye; a colour bar for
        each colour rule with a map that a visible object has. They are beside the scene if `camera` is not given,
        otherwise where they hide least. True draws all that apply: panoramas and lenses with distortion have no scale.
        By default, a picture without `light` has a scale bar if the unit is known. Not allowed with a crop.
    unit : str, optional
        Unit of world coordinates, for the scale bar, such as "mm"; by default that of the scene's volumes, if all have
        one, without those that a transform converts to another unit.
    legend : bool
        Whether to draw the names of objects, ``Isosurface(..., name="bone")``, each beside its colour; beside the scene
        if `camera` is not given. Not allowed with a crop.
    progress : callable or True, optional
        Called with the finished fraction a few times a second; cancels the rendering by returning
        a false value other than None. True shows a bar.

    Returns
    -------
    Image

    Raises
    ------
    ValueError
        For an invalid size, crop, background or number of rays; for a layer that is unknown, or that the light or the
        objects do not have; for options that exclude each other, such as a crop and a legend, or an environment and a
        light without path tracing; for an object or geometry
        id of a light or material that is not in the scene; without a camera, for a scene without visible surfaces.
    TypeError
        For another type of light or environment.
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
    >>> image = isospline.render(scene, camera, size=(64, 48), light=isospline.Outline(2), layers=("depth",))
    >>> image.color.shape, image.depth.shape
    ((48, 64, 4), (48, 64))
    >>> isospline.render(scene, camera, size=(64, 48), encoding="srgb8").to_srgb().dtype
    dtype('uint8')
    """
    is_default = light is None and environment is None
    given = scene
    scene = as_scene(scene, level)
    if camera is not None:
        check_camera(camera)
    light = lit(scene, camera, size, light, environment)
    look = resolve(scene, light, color, opacity)
    names = marks_of(annotate, scene, camera, look, unit, is_default=is_default, is_crop=crop is not None)
    marks = Marks(scene, look, size, names, legend, unit)
    if marks and crop is not None:
        raise ValueError(f"{'annotate' if names else 'legend'}: cannot be combined with a crop")
    is_fitted = camera is None
    if camera is None:
        camera = marks.camera(size=size)
    shown = in_detail(scene, given, [camera], size)
    if shown is not scene:  # rules and their bars measure what is shown
        look = resolve(shown, light, color, opacity)
        marks = Marks(shown, look, size, names, legend, unit)
    options: dict[str, Any] = {"size": size, "crop": crop, "layers": layers, "progress": progress}
    options.update(samples=samples_of(samples, look), background=background_of(background, look))
    options.update(ambient_occlusion_samples=ambient_occlusion_samples, encoding=encoding)
    image = without_marks(shown, camera, look, **options)
    return marks.draw(image, camera, is_fitted=is_fitted)


def lit(scene: Scene, camera: Any, size: tuple[int, int], light: Light, environment: Any) -> Light:
    """The light of a picture, with the environment if one is given."""
    if environment is None:
        return light
    up = upward_for(scene, camera_for(scene, size=size) if camera is None else camera)
    return in_environment(light, environment, up)


def without_marks(
    scene: Scene,
    camera: Any,
    look: Any,
    *,
    samples: int,
    background: Background,
    size: tuple[int, int],
    crop: tuple[int, int, int, int] | None = None,
    layers: Iterable[Layer] = (),
    ambient_occlusion_samples: int = 16,
    encoding: Literal["linear", "srgb8"] = "linear",
    progress: Progress = None,
) -> Image:
    """The picture of a scene in a light with the looks of all objects, as `resolve` returns it.

    `background` is transparent if it is None.
    """
    names = names_of(layers)
    options: dict[str, Any] = {"size": size, "crop": crop, "layers": compiled(names), "background": background}
    options["ambient_occlusion_samples"] = ambient_occlusion_samples
    if isinstance(look, Studio):
        if encoding not in ("linear", "srgb8"):
            raise ValueError(f'encoding: expected "linear" or "srgb8", got "{encoding}"')
        options.update(samples=samples, encoding=encoding, progress=as_callable(progress))
        arrays = render_in_studio(scene, camera, look, **options)._arrays
    elif isinstance(look, _core.PathTracer):
        renderer = _core.ProgressiveRenderer(scene, camera, path_tracer=look, encoding=encoding, **options)
        renderer.step(samples, progress=progress)
        arrays = renderer.image()
    else:
        options.update(samples=samples, encoding=encoding, progress=progress)
        arrays = _core.render(scene, camera, shading=look, **options)
    return Image(arrays, names)
