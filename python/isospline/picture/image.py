"""Rendered images: their arrays, and writing them to files."""

from __future__ import annotations

import os
from collections.abc import Iterable
from copy import copy
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .. import _core
from ..base.mistakes import sentence
from ..base.parameters import check_count, check_path
from ..base.signatures import explained_methods
from ..base.system import whole_file
from ..base.values import same
from .layers import IDS, MASK
from .pixels import denoiser, encoded, over_black, write_bytes
from .tone import CURVES, check_exposure


def _layer(name: str, doc: str) -> Any:
    """A property that is the array of a layer."""

    def get(self: Image) -> Any:
        array = getattr(self._arrays, name)
        if array is None or (name == IDS and not self._has_ids):
            raise self._missing(name)
        return array

    return property(get, doc=doc)


@explained_methods
class Image:
    """A rendered image: colour and the layers that `render` was asked for.

    Layers come from the rays through the centres of the pixels, and show the first surface whose opacity is not 0. A
    layer that the image does not have raises an AttributeError. Rows run from the top, pixels of a row from the left.
    The arrays share the image's memory.
    """

    __slots__ = ("_arrays", "_has_ids", "_has_mask")

    def __init__(self, arrays: _core.Image, layers: Iterable[str] = ()):
        self._arrays = arrays
        # The mask is made of the geometry ids, which are not a layer of the image unless they are named, too.
        self._has_mask = MASK in layers
        self._has_ids = not self._has_mask or IDS in layers

    def _missing(self, name: str) -> AttributeError:
        held = ", ".join(self.layers) or "no layers"
        return AttributeError(f'{name}: expected render(..., layers=("{name}",)) for it, got an image with {held}')

    @property
    def color(self) -> NDArray[np.float32]:
        """(height, width, 4) float32 array: linear red, green and blue, premultiplied by the fourth, alpha.

        Alpha is the part of the pixel that surfaces or an opaque background cover; translucent surfaces count by their
        opacity. Raises an AttributeError if the image has 8-bit sRGB instead.
        """
        color = self._arrays.color
        if color is None:
            raise AttributeError('color: expected render(..., encoding="linear") for it, got an image of 8-bit sRGB')
        return color

    depth: NDArray[np.float32] = _layer(
        "depth",
        """(height, width) float32 array, world units: distance along the view.

        This is z of camera space, as in the Z channel of OpenEXR files, and not the distance along the ray. In a
        panorama it is the distance. Infinite if the ray hit nothing.
        """,
    )
    position: NDArray[np.float32] = _layer(
        "position",
        """(height, width, 3) float32 array: the point that was hit.

        In world space; zero if the ray hit nothing.
        """,
    )
    normal: NDArray[np.float32] = _layer(
        "normal",
        """(height, width, 3) float32 array: the unit outward normal.

        In world space; interpolated for a mesh with vertex normals; zero if the ray hit nothing.
        """,
    )
    albedo: NDArray[np.float32] = _layer(
        "albedo",
        """(height, width, 3) float32 array: linear colour without light.

        The colour from `Phong(color=...)`, `Outline(surface_color=...)` or `Material(color)`, times the colour of
        a mesh's vertices. Zero if the ray hit nothing.
        """,
    )
    gradient_magnitude: NDArray[np.float32] = _layer(
        "gradient_magnitude",
        """(height, width) float32 array: length of the gradient of an isosurface's model.

        In values per world unit; zero for meshes and if the ray hit nothing.
        """,
    )
    curvature: NDArray[np.float32] = _layer(
        "curvature",
        """(height, width, 2) float32 array: mean and Gaussian.

        In 1 / world unit and 1 / world unit^2, of isosurfaces, as in `ColorByCurvature`; zero for meshes and if the ray
        hit nothing.
        """,
    )
    ambient_occlusion: NDArray[np.float32] = _layer(
        "ambient_occlusion",
        """(height, width) float32 array: how open the surroundings are, from 0 to 1.

        This is the integral of `AmbientOcclusion`; zero if the ray hit nothing.
        """,
    )
    direct: NDArray[np.float32] = _layer(
        "direct",
        """(height, width, 3) float32 array: direct light, a part of `color`.

        Of a path traced image: the light that was scattered at most once, including visible lights. The rest of `color`
        is indirect light, scattered between surfaces.
        """,
    )
    variance: NDArray[np.float32] = _layer(
        "variance",
        """(height, width, 3) float32 array: squared standard error.

        For red, green and blue of a path traced `color`, which are estimates.
        """,
    )
    geometry_ids: NDArray[np.uint32] = _layer(
        "geometry_ids",
        """(height, width) uint32 array: the objects' ids.

        As in `Scene.cast_rays`; `INVALID_ID` if the ray hit nothing.
        """,
    )
    primitive_ids: NDArray[np.uint64] = _layer(
        "primitive_ids",
        """(height, width) uint64 array: cells and faces.

        As in `Scene.cast_rays`; `INVALID_PRIMITIVE_ID` if the ray hit nothing.
        """,
    )
    certified: NDArray[np.uint32] = _layer(
        "certified",
        """(height, width) uint32 array: what is proven of the pixels' rays.

        As ``statuses`` of `Scene.cast_rays` with ``certify=True``: 0 for a miss, 1 for a hit, 2 if undecided.
        """,
    )

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(height, width) bool array: where the ray hit an object. Made anew at each access, and not writable."""
        if not self._has_mask:
            raise self._missing(MASK)
        mask = np.asarray(self._arrays.geometry_ids != _core.INVALID_ID)
        mask.setflags(write=False)
        return mask

    @property
    def layers(self) -> tuple[str, ...]:
        """The names of the image's layers."""
        names = [name for name in _core.LAYERS if getattr(self._arrays, name) is not None]
        return tuple(name for name in names if name != IDS or self._has_ids) + ((MASK,) if self._has_mask else ())

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        width, height = self._arrays.size
        return width, height

    @property
    def crop(self) -> tuple[int, int, int, int]:
        """The part of the whole picture that the image shows: first column and row, width and height."""
        (column, row), (width, height) = self._arrays.first, self._arrays.size
        return column, row, width, height

    @property
    def full_size(self) -> tuple[int, int]:
        """Width and height of the whole picture in pixels; `size` unless the image is a crop."""
        width, height = self._arrays.full_size
        return width, height

    @property
    def world_to_camera(self) -> NDArray[np.float64]:
        """(4, 4) float64 array of the camera, for column vectors: world space to camera space."""
        return self._arrays.world_to_camera

    @property
    def world_to_ndc(self) -> NDArray[np.float64] | None:
        """(4, 4) float64 array of the camera, for column vectors; see `PerspectiveCamera.world_to_ndc`.

        None for a panorama and for a lens with distortion.
        """
        return self._arrays.world_to_ndc

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """The displayed picture: (height, width, 4) uint8 sRGB, for `numpy.asarray` and matplotlib's `imshow`."""
        if copy is False and self._arrays.srgb8 is None:
            raise ValueError("copy: expected None or True, because linear colour has to be encoded, got False")
        pixels: NDArray[Any] = self.to_srgb()
        if dtype is not None:
            pixels = pixels.astype(dtype, copy=False)
        return pixels.copy() if copy and pixels.base is not None else pixels

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Image) or self.layers != other.layers:
            return False
        return same(self._arrays.__getstate__(), other._arrays.__getstate__())

    __hash__ = None  # type: ignore[assignment]

    def __copy__(self) -> Image:
        return Image(self._arrays.copy(), self.layers)

    def to_srgb(self) -> NDArray[np.uint8]:
        """Convert the colour for display.

        Returns
        -------
        (height, width, 4) uint8 array
            Red, green and blue with the transfer curve of sRGB (IEC 61966-2-1), not premultiplied, and alpha.
            Values beyond 1 are clipped.
        """
        held = self._arrays.srgb8
        return self._arrays.to_srgb8() if held is None else held

    def _linear_copy(self) -> Image:
        """A copy; raises an AttributeError for an image of 8-bit sRGB."""
        return copy(self) if self.color is not None else self

    def tone_map(self, curve: Literal["neutral", "aces", "linear"] = "neutral", *, exposure: float = 0.0) -> Image:
        """Map light of any brightness to the range of displays and PNG files.

        Parameters
        ----------
        curve : {"neutral", "aces", "linear"}
            "neutral" is Khronos' curve for physically based materials: it keeps the colours of surfaces, and maps
            highlights smoothly below 1. "aces" is the film-like fit of ACES, which adds contrast. "linear" clips at 1.
        exposure : float
            Stops, from -64 to 64: the light is first multiplied by ``2**exposure``.

        Returns
        -------
        Image
            A new image with linear colour from 0 to 1, the same alpha and the same layers.

        Raises
        ------
        ValueError
            For another curve, and an exposure out of range.
        AttributeError
            For an image of 8-bit sRGB; the same holds for `over` and `denoise`.

        References
        ----------
        Khronos Group, "PBR Neutral tone mapper specification", 2024; K. Narkowicz, "ACES filmic tone mapping curve",
        2016.
        """
        if curve not in CURVES:
            raise ValueError(sentence("curve", f"one of {', '.join(CURVES)}", curve))
        check_exposure(exposure)
        result = self._linear_copy()
        result._arrays.tone_map(curve, 2.0**exposure)
        return result

    def over(self, background: Any) -> Image:
        """Composite the image over a background.

        Parameters
        ----------
        background : str, float, (3,) float, (4,) float or None
            As in `render`. Applied after `tone_map`, the background keeps its colour.

        Returns
        -------
        Image
            A new image, with the same layers.
        """
        result = self._linear_copy()
        result._arrays.lay_over(background)
        return result

    def denoise(self) -> Image:
        """Remove noise from the colour of a path traced image, with Intel's Open Image Denoise.

        Returns
        -------
        Image
            A new image with the same alpha. Its layer "variance" is still that of the original noise.

        Raises
        ------
        ImportError
            If the package pyoidn is not installed.
        """
        denoise = denoiser()
        result = copy(self)
        # Use colour only: albedo and normal are those of the pixel's centre and would add jagged edges.
        result.color[..., :3] = denoise(np.ascontiguousarray(self.color[..., :3]), hdr=True)
        return result

    def write(self, path: str | os.PathLike[str], *, half: bool = False, quality: int = 95) -> None:
        """Write the image to a file, completely or not at all.

        Parameters
        ----------
        path : str or path-like
            Ends in ``.exr`` for OpenEXR, with the channels R G B A, channels of the image's layers, and the camera's
            matrices in the header; in ``.npz`` for NumPy's arrays, compressed, as described below; in ``.png`` for
            8-bit sRGB colour; or in ``.jpg`` or ``.jpeg`` for the same over black, without alpha. An OpenEXR file of a
            crop has the picture as its display window and the crop as its data window. Channels of layers are Z
            (depth), P.X P.Y P.Z (position), N.X N.Y N.Z (normal), albedo.R albedo.G albedo.B, gradient_magnitude,
            curvature.mean curvature.gaussian, ambient_occlusion, direct.R direct.G direct.B, variance.R variance.G
            variance.B, certified, id.geometry, and id.primitive and id.primitive_high; a primitive id is
            ``id.primitive + 2**32 * id.primitive_high``. A mask is stored as id.geometry.
        half : bool
            Store R, G, B and A of an OpenEXR file in 16 instead of 32 bits; the largest number is 65504.
        quality : int
            Quality of a JPEG file, from 1 to 100 (best).

        Raises
        ------
        ValueError
            For another suffix, a quality out of range, and an OpenEXR file of an image with 8-bit sRGB.
        OSError
            If the file cannot be written.

        Notes
        -----
        ``numpy.load("x.npz")`` has the image's arrays under their names: "color", or "srgb" of an image of 8-bit sRGB,
        each of `layers`, "crop", "full_size", "world_to_camera" and, where it exists, "world_to_ndc".
        """
        check_path(path)
        suffix = os.path.splitext(os.fspath(path))[1].lower()
        if suffix == ".exr":
            self._arrays.write_exr(path, half=half)
        elif suffix == ".npz":
            names = (*self.layers, "crop", "full_size", "world_to_camera", "world_to_ndc")
            arrays: dict[str, Any] = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
            arrays |= {"color": self.color} if self._arrays.srgb8 is None else {"srgb": self._arrays.srgb8}
            with whole_file(path) as temporary, open(temporary, "wb") as file:
                np.savez_compressed(file, **arrays)
        elif suffix in (".png", ".jpg", ".jpeg"):
            check_count(quality, "quality", 100)
            is_png = suffix == ".png"
            write_bytes(path, self._repr_png_() if is_png else encoded("jpeg", over_black(self), quality=quality))
        else:
            raise ValueError(f"path: expected a name that ends in .exr, .npz, .png or .jpg, got {os.fspath(path)!r}")

    save = write

    def show(self) -> None:
        """Show the image in the system's image viewer, by Pillow. Notebooks show images without this call."""
        import PIL.Image

        PIL.Image.fromarray(self.to_srgb()).show()

    def _repr_png_(self) -> bytes:
        """The image as a PNG file, which notebooks show."""
        return encoded("png", self.to_srgb())

    def __repr__(self) -> str:
        width, height = self.size
        covered = self._arrays.covered_count / (width * height)
        return f"Image({', '.join([f'{width} x {height}', *self.layers, f'{covered:.0%} covered'])})"
