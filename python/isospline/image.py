"""Rendered images: their arrays, and the files that they are written to."""

from __future__ import annotations

import contextlib
import errno
import io
import os
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from . import _core
from .colors import linear_to_srgb, srgb_to_linear
from .parameters import check_count, check_path
from .signatures import explained_methods
from .values import same


def _layer(name: str, doc: str) -> Any:
    """A property that is the array of a layer."""

    def get(self: Image) -> Any:
        array = getattr(self._arrays, name)
        if array is None:
            held = ", ".join(self.layers) or "no layers"
            raise AttributeError(f'{name}: expected render(..., layers=("{name}",)) for it, got an image with {held}')
        return array

    return property(get, doc=doc)


@explained_methods
class Image:
    """A rendered image: colour and, where `render` was asked for them, layers.

    Layers are what the rays through the centres of the pixels found, of the first surface whose opacity is not 0; a
    layer that the image does not hold is an AttributeError. Rows run from the top, pixels of a row from the left.
    The arrays share the image's memory.
    """

    __slots__ = ("_arrays",)

    def __init__(self, arrays: _core.Image):
        self._arrays = arrays

    @property
    def color(self) -> NDArray[np.float32]:
        """(height, width, 4) float32 array: linear red, green and blue, premultiplied by the fourth, alpha.

        Alpha is the part of the pixel that surfaces, or an opaque background, cover, translucent ones as far as they
        are opaque. An AttributeError where the image holds 8-bit sRGB instead.
        """
        color = self._arrays.color
        if color is None:
            raise AttributeError('color: expected render(..., encoding="linear") for it, got an image of 8-bit sRGB')
        return color

    depth: NDArray[np.float32] = _layer("depth", """(height, width) float32 array, world units: distance along the view.

        It is z of camera space, not along the ray, as in the Z channel of OpenEXR files. In a panorama it is the
        distance. Infinite where the ray met nothing.
        """)
    position: NDArray[np.float32] = _layer("position", """(height, width, 3) float32 array: the point that was hit.

        In world space; zero where the ray met nothing.
        """)
    normal: NDArray[np.float32] = _layer("normal", """(height, width, 3) float32 array: the unit outward normal.

        In world space, of a mesh with normals the one that lies between them; zero where the ray met nothing.
        """)
    albedo: NDArray[np.float32] = _layer("albedo", """(height, width, 3) float32 array: linear colour without light.

        What `Phong(color=...)`, `Outline(surface_color=...)` or `Material(base_color)` gives, times the colour of a
        mesh's vertices. Zero where the ray met nothing.
        """)
    gradient_magnitude: NDArray[np.float32] = _layer("gradient_magnitude", """(height, width) float32 array, value /
        world unit: length of the gradient of an isosurface's model; zero for meshes and where the ray met nothing.
        """)
    curvature: NDArray[np.float32] = _layer("curvature", """(height, width, 2) float32 array: mean and Gaussian.

        1 / world unit and 1 / world unit^2, of isosurfaces, as `ColorByCurvature` has them; zero for meshes and where
        the ray met nothing.
        """)
    ambient_occlusion: NDArray[np.float32] = _layer("ambient_occlusion", """(height, width) float32 array: how open the
        surroundings are, from 0 to 1: the integral of `AmbientOcclusion` for a white surface; zero where the ray met
        nothing.
        """)
    direct: NDArray[np.float32] = _layer("direct", """(height, width, 3) float32 array: the part of `color` of one hit.

        Of a path traced image, the light that came after one hit at most, and not from surface to surface: that of the
        lights and of what the camera sees of them. The rest is indirect.
        """)
    variance: NDArray[np.float32] = _layer("variance", """(height, width, 3) float32 array: squared standard error.

        Of red, green and blue of a path traced `color`, which are estimates.
        """)
    geometry_ids: NDArray[np.uint32] = _layer("geometry_ids", """(height, width) uint32 array: the objects' ids.

        As given by Scene.cast_rays; `INVALID_ID` where the ray met nothing.
        """)
    primitive_ids: NDArray[np.uint64] = _layer("primitive_ids", """(height, width) uint64 array: cells and faces.

        As given by Scene.cast_rays; `INVALID_PRIMITIVE_ID` where the ray met nothing.
        """)

    @property
    def layers(self) -> tuple[str, ...]:
        """The names of the layers that the image holds."""
        return tuple(name for name in _core.LAYERS if getattr(self._arrays, name) is not None)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        width, height = self._arrays.size
        return width, height

    @property
    def world_to_camera(self) -> NDArray[np.float64]:
        """(4, 4) float64 array of the camera, for column vectors: world space to camera space."""
        return self._arrays.world_to_camera

    @property
    def world_to_ndc(self) -> NDArray[np.float64] | None:
        """(4, 4) float64 array of the camera, for column vectors; see `PerspectiveCamera.world_to_ndc`.

        None of a panorama.
        """
        return self._arrays.world_to_ndc

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """The picture as it is shown: (height, width, 4) uint8 sRGB, for `numpy.asarray` and matplotlib's `imshow`."""
        if copy is False and self._arrays.srgb8 is None:
            raise ValueError("copy: expected None or True, as linear colour has to be encoded, got False")
        pixels: NDArray[Any] = self.to_srgb()
        if dtype is not None:
            pixels = pixels.astype(dtype, copy=False)
        return pixels.copy() if copy and pixels.base is not None else pixels

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Image) and same(self._arrays.__getstate__(), other._arrays.__getstate__())

    __hash__ = None  # type: ignore[assignment]

    def __copy__(self) -> Image:
        return Image(self._arrays.copy())

    def to_srgb(self) -> NDArray[np.uint8]:
        """Convert the colour for display.

        Returns
        -------
        (height, width, 4) uint8 array
            Red, green and blue with the transfer curve of sRGB (IEC 61966-2-1), not premultiplied, and alpha.
            Values beyond 1 are clipped.
        """
        encoded = self._arrays.srgb8
        return self._arrays.to_srgb8() if encoded is None else encoded

    def denoise(self) -> Image:
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

    def write(self, path: str | os.PathLike[str], *, half: bool = False, quality: int = 95) -> None:
        """Write the image to a file, which appears whole or not at all.

        Parameters
        ----------
        path : str or path-like
            Ends in ``.exr`` for OpenEXR, with the channels R G B A, those of the layers that the image holds, and the
            camera's matrices in the header; in ``.png`` for sRGB colour of 8 bits; or in ``.jpg`` or ``.jpeg`` for the
            same over black, without alpha. Channels of layers are Z (depth),
            P.X P.Y P.Z (position), N.X N.Y N.Z (normal), albedo.R albedo.G albedo.B, gradient_magnitude,
            curvature.mean curvature.gaussian, ambient_occlusion, direct.R direct.G direct.B, variance.R variance.G
            variance.B, id.geometry, and id.primitive and id.primitive_high, of which a primitive id is
            ``id.primitive + 2**32 * id.primitive_high``.
        half : bool
            Store R, G, B and A of an OpenEXR file in 16 instead of 32 bits.
        quality : int
            Of a JPEG file, from 1 to 100, the best.

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
        elif suffix in (".png", ".jpg", ".jpeg"):
            check_count(quality, "quality", 100)
            is_png = suffix == ".png"
            encoded = self._repr_png_() if is_png else self._encoded("jpeg", over_black(self), quality=quality)
            with whole_file(path) as temporary, open(temporary, "wb") as file:
                file.write(encoded)
        else:
            raise ValueError(f"path: expected a name that ends in .exr, .png or .jpg, got {os.fspath(path)!r}")

    save = write

    def show(self) -> None:
        """Show the image in the viewer of the system, as Pillow does; notebooks show it without."""
        import PIL.Image

        PIL.Image.fromarray(self.to_srgb()).show()

    def _encoded(self, format: str, pixels: NDArray[np.uint8], **options: Any) -> bytes:
        import PIL.Image

        file = io.BytesIO()
        PIL.Image.fromarray(pixels).save(file, format, **options)
        return file.getvalue()

    def _repr_png_(self) -> bytes:
        """The image as a PNG file, which notebooks show."""
        return self._encoded("png", self.to_srgb())

    def __repr__(self) -> str:
        width, height = self.size
        covered = self._arrays.covered_count / (width * height)
        return f"Image({', '.join([f'{width} x {height}', *self.layers, f'{covered:.0%} covered'])})"


def over_black(image: Image) -> NDArray[np.uint8]:
    """Red, green and blue of 8 bits over black, (height, width, 3)."""
    srgb = image.to_srgb()
    color, alpha = srgb[..., :3], srgb[..., 3:]
    if alpha.min() == 255:
        return np.ascontiguousarray(color)
    over = np.empty(color.shape, np.uint8)
    for rows in row_bands(srgb):
        linear = srgb_to_linear(color[rows] / 255) * (alpha[rows] / 255)
        over[rows] = np.rint(255 * linear_to_srgb(linear))
    return over


def row_bands(array: NDArray[Any]) -> Iterator[slice]:
    """Slices of some rows each that cover an image: Ctrl-C is heard between them."""
    return (slice(first, first + 64) for first in range(0, len(array), 64))


def denoiser() -> Callable[..., NDArray[np.float32]]:
    """The function that takes the noise out of colours."""
    try:
        from pyoidn import denoise  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise ImportError("Image.denoise needs Open Image Denoise: pip install pyoidn") from error
    return denoise


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[str]:
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
