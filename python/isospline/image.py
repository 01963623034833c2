"""Rendered images: their arrays, and the files that they are written to."""

from __future__ import annotations

import contextlib
import errno
import io
import os

import numpy as np

from . import _core
from .parameters import check_path, check_type


def render(
    scene,
    camera,
    *,
    size=(640, 360),
    shading=None,
    integrator=None,
    background=None,
    samples=1,
    layers=(),
    ambient_occlusion_samples=16,
    encoding="linear",
    progress=None,
):
    """Render a scene.

    The image is the same, bit for bit, for any number of threads. Ctrl-C stops the work.

    Parameters
    ----------
    scene : Scene
        Isosurfaces and meshes.
    camera : PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera or PanoramicCamera
        Where from; `camera_for` makes one that has all of the scene in view.
    size : (int, int)
        Width and height of the image in pixels.
    shading : Phong, Outline, AmbientOcclusion, or dict of geometry id to one of them, optional
        The illumination model, of the whole scene or of each geometry; by default, and for geometries that a dict
        leaves out, ``Phong()``. Where its opacity is below 1, all that a ray meets, entering and leaving, is composited
        front to back by the over operator, up to the first surface that is opaque, in the exact order of
        `Scene.list_intersections`; shadows and ambient occlusion let through what opacities leave.
    integrator : PathTracer, optional
        Takes the place of the shading: light on all paths, by chance, with the variance of its noise in the image. All
        surfaces are opaque.
    background : float, (3,) float, (4,) float, optional
        Linear colour that shows where no surface is, with an opacity if there are four numbers; transparent by default.
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
    progress : callable, optional
        Called with the finished fraction a few times a second; cancels the rendering by returning
        a false value other than None.

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
    return Image(
        _core.render(
            scene, camera, size=size, shading=shading, background=background, samples=samples, layers=layers,
            ambient_occlusion_samples=ambient_occlusion_samples, encoding=encoding, progress=progress,
        )  # fmt: skip
    )


def _layer(name):
    """A property that is the array of a layer."""

    def get(self):
        array = getattr(self._arrays, name)
        if array is None:
            held = ", ".join(self.layers) or "no layers"
            raise AttributeError(f'{name}: expected render(..., layers=("{name}",)) for it, got an image with {held}')
        return array

    return property(get)


class Image:
    """A rendered image: colour and, where `render` was asked for them, layers.

    Layers are what the rays through the centres of the pixels found, of the first surface whose opacity is not 0; a
    layer that the image does not hold is an AttributeError. Rows run from the top, pixels of a row from the left.
    The arrays share the image's memory.

    Attributes
    ----------
    color : (height, width, 4) float32 array
        Linear red, green and blue, premultiplied by the fourth, alpha: the part of the pixel that surfaces, or an
        opaque background, cover, translucent ones as far as they are opaque. An AttributeError where the image holds
        8-bit sRGB instead.
    layers : tuple of str
        The names of the layers that the image holds.
    size : (int, int)
        Width and height in pixels.
    depth : (height, width) float32 array, world units
        Distance from the eye along the viewing direction (not along the ray), as in the Z channel of OpenEXR files: z
        of camera space. In a panorama it is the distance. Infinite where the ray met nothing.
    position, normal : (height, width, 3) float32 array, world space
        The point that was hit, and the unit outward normal there, of a mesh with normals the one that lies between
        them; zero where the ray met nothing.
    albedo : (height, width, 3) float32 array
        Linear colour of the surface itself, without light: what `Phong(color=...)`, `Outline(surface_color=...)` or
        `Material(base_color)` gives, times the colour of a mesh's vertices. Zero where the ray met nothing.
    gradient_magnitude : (height, width) float32 array, value / world unit
        Length of the gradient of an isosurface's model; zero for meshes and where the ray met nothing.
    curvature : (height, width, 2) float32 array, 1 / world unit and 1 / world unit^2
        Mean and Gaussian curvature of isosurfaces, as `ColorByCurvature` has them; zero for meshes and where the ray
        met nothing.
    ambient_occlusion : (height, width) float32 array
        How open the surroundings are, from 0 to 1: the integral of `AmbientOcclusion` for a white surface; zero where
        the ray met nothing.
    direct : (height, width, 3) float32 array
        Of a path traced `color`, the light that came after one hit at most, and not from surface to surface: that of
        the lights and of what the camera sees of them. The rest is indirect.
    geometry_ids : (height, width) uint32 array
        As given by Scene.cast_rays; `INVALID_ID` where the ray met nothing.
    primitive_ids : (height, width) uint64 array
        As given by Scene.cast_rays; `INVALID_PRIMITIVE_ID` where the ray met nothing.
    variance : (height, width, 3) float32 array
        Of red, green and blue of a path traced `color`, which are estimates: the square of their standard error.
    world_to_camera, world_to_ndc : (4, 4) float64 array
        The camera's matrices, for column vectors; see `PerspectiveCamera.world_to_ndc`. A panorama's `world_to_ndc` is
        None.
    """

    __slots__ = ("_arrays",)

    def __init__(self, arrays: _core.Image):
        self._arrays = arrays

    @property
    def color(self):
        color = self._arrays.color
        if color is None:
            raise AttributeError('color: expected render(..., encoding="linear") for it, got an image of 8-bit sRGB')
        return color

    depth = _layer("depth")
    position = _layer("position")
    normal = _layer("normal")
    albedo = _layer("albedo")
    gradient_magnitude = _layer("gradient_magnitude")
    curvature = _layer("curvature")
    ambient_occlusion = _layer("ambient_occlusion")
    direct = _layer("direct")
    variance = _layer("variance")
    geometry_ids = _layer("geometry_ids")
    primitive_ids = _layer("primitive_ids")
    layers = property(lambda self: tuple(name for name in _core.LAYERS if getattr(self._arrays, name) is not None))
    size = property(lambda self: tuple(self._arrays.size))
    world_to_camera = property(lambda self: self._arrays.world_to_camera)
    world_to_ndc = property(lambda self: self._arrays.world_to_ndc)

    def to_srgb(self):
        """Convert the colour for display.

        Returns
        -------
        (height, width, 4) uint8 array
            Red, green and blue with the transfer curve of sRGB (IEC 61966-2-1), not premultiplied, and alpha.
            Values beyond 1 are clipped.
        """
        encoded = self._arrays.srgb8
        return self._arrays.to_srgb8() if encoded is None else encoded

    def denoise(self):
        """Take the noise out of the colour of a path traced image, by Intel's Open Image Denoise.

        Returns
        -------
        Image
            Another one with the same alpha; its variance is still that of the noise that it had.

        Raises
        ------
        ImportError
            Where the package pyoidn is not installed.
        """
        denoise = denoiser()
        result = Image(self._arrays.copy())
        # Colour alone: albedo and normal, which are those of the pixel's centre, bring their jagged edges along.
        result.color[..., :3] = denoise(np.ascontiguousarray(self.color[..., :3]), hdr=True)
        return result

    def write(self, path, *, half=False):
        """Write the image to a file, which appears whole or not at all.

        Parameters
        ----------
        path : str or path-like
            Ends in ``.exr`` for OpenEXR, with the channels R G B A, those of the layers that the image holds, and the
            camera's matrices in the header; or in ``.png`` for sRGB colour of 8 bits. Channels of layers are Z (depth),
            P.X P.Y P.Z (position), N.X N.Y N.Z (normal), albedo.R albedo.G albedo.B, gradient_magnitude,
            curvature.mean curvature.gaussian, ambient_occlusion, direct.R direct.G direct.B, variance.R variance.G
            variance.B, id.geometry, and id.primitive and id.primitive_high, of which a primitive id is
            ``id.primitive + 2**32 * id.primitive_high``.
        half : bool
            Store R, G, B and A of an OpenEXR file in 16 instead of 32 bits.

        Raises
        ------
        ValueError
            For another suffix, and an OpenEXR file of an image that holds 8-bit sRGB.
        OSError
            Where the file cannot be written.
        """
        check_path(path)
        suffix = os.path.splitext(os.fspath(path))[1].lower()
        if suffix == ".exr":
            self._arrays.write_exr(path, half=half)
        elif suffix == ".png":
            png = self._repr_png_()
            with whole_file(path) as temporary, open(temporary, "wb") as file:
                file.write(png)
        else:
            raise ValueError(f"path: expected a name that ends in .exr or .png, got {os.fspath(path)!r}")

    def _repr_png_(self):
        """The image as a PNG file, which notebooks show."""
        import PIL.Image

        file = io.BytesIO()
        PIL.Image.fromarray(self.to_srgb(), "RGBA").save(file, "png")
        return file.getvalue()

    def __repr__(self):
        width, height = self.size
        covered = self._arrays.covered_count / (width * height)
        return f"Image({', '.join([f'{width} x {height}', *self.layers, f'{covered:.0%} covered'])})"


def row_bands(array):
    """Slices of some rows each that cover an image: Ctrl-C is heard between them."""
    return (slice(first, first + 64) for first in range(0, len(array), 64))


def denoiser():
    """The function that takes the noise out of colours."""
    try:
        from pyoidn import denoise
    except ImportError as error:
        raise ImportError("Image.denoise needs Open Image Denoise: pip install pyoidn") from error
    return denoise


@contextlib.contextmanager
def whole_file(path):
    """The name of a file beside `path` to write to, which takes its place at the end, or goes away on an error."""
    file = _core.OutputFile(path)
    temporary = file.temporary
    try:
        yield temporary
        file.commit()
    except OSError as error:
        if error.filename not in (None, temporary):
            raise
        raise OSError(error.errno or errno.EIO, error.strerror or str(error), os.fspath(path)) from None
    finally:
        file.discard()
