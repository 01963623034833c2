"""Environments from files: panoramas of light."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base.parameters import check_path, flag, printable
from ..base.signatures import explained, explained_methods
from ..base.values import Value
from ..io.checks import check_memory

#: Suffixes of the files that `read_environment` reads.
SUFFIXES = (".exr", ".hdr")


@explained
def read_environment(path: str | os.PathLike[str]) -> NDArray[np.float32]:
    """Read an equirectangular panorama for `EnvironmentLight`.

    The reader is OpenImageIO (``pip install isospline[light]``).

    Parameters
    ----------
    path : str or path-like
        Ends in ``.exr`` for OpenEXR or in ``.hdr`` for Radiance. Rows run from the zenith down; images that are
        stored upside down or mirrored are turned. The display window of OpenEXR is the whole sphere, and is black where
        it has no data.

    Returns
    -------
    (height, width, 3) float32 array
        Linear red, green and blue, for ``EnvironmentLight(image=)``. Negative numbers, which filters of panoramas can
        produce, become 0.

    Raises
    ------
    ValueError
        For another suffix, a file that is damaged or stored by columns, and one without red, green and blue.
    MemoryError
        If the image does not fit into memory.
    OSError
        If the file cannot be read.
    ImportError
        Without OpenImageIO.

    Examples
    --------
    >>> import isospline
    >>> def light_of(path):
    ...     return isospline.EnvironmentLight(image=isospline.read_environment(path), visible=True)
    """
    check_path(path)
    name = printable(path)
    if os.path.splitext(os.fspath(path))[1].lower() not in SUFFIXES:
        raise ValueError(f"path: expected a name that ends in {' or '.join(SUFFIXES)}, got {name!r}")
    with open(path, "rb"):
        pass  # raises the system's own error if it cannot be opened
    try:
        import OpenImageIO
    except ImportError as error:
        raise ImportError(
            "reading an environment needs the package OpenImageIO: pip install isospline[light]"
        ) from error
    buffer = OpenImageIO.ImageBuf(os.fspath(path))
    if not buffer.read(force=True, convert=OpenImageIO.FLOAT):
        raise _unreadable(name, buffer.geterror())
    channels = list(buffer.spec().channelnames)
    missing = [channel for channel in "RGB" if channel not in channels]
    if missing:
        raise ValueError(f"{name}: expected channels R, G and B, got none named {missing[0]}")
    if buffer.orientation > 4:  # OpenImageIO 3.2 takes two of these for each other in Radiance's files
        raise ValueError(f"{name}: expected an image stored by rows, got one stored by columns")
    window = buffer.roi_full
    check_memory(4 * window.npixels * len(channels), f"{name}: {window.width} x {window.height} pixels")
    pixels: Any = OpenImageIO.ImageBufAlgo.reorient(buffer).get_pixels(OpenImageIO.FLOAT, window)
    image = pixels[..., [channels.index(channel) for channel in "RGB"]]
    if not np.isfinite(image).all():
        raise ValueError(f"{name}: expected finite numbers, got {image[~np.isfinite(image)][0]}")
    return np.ascontiguousarray(np.maximum(image, 0), np.float32)


def _unreadable(name, reason):
    return ValueError(f"{name}: cannot be read as an environment: {' '.join(reason.split()) or 'it is damaged'}")


def sky_of(radiance: Any, image: Any) -> Any:
    """The panorama of an environment light whose first argument is a file or an array; None for a radiance."""
    is_file = isinstance(radiance, os.PathLike) or (
        isinstance(radiance, str) and os.path.splitext(radiance)[1].lower() in SUFFIXES
    )
    if not is_file and np.ndim(radiance) != 3:
        return None
    if image is not None:
        raise TypeError("image: cannot be combined with a panorama as radiance")
    return read_environment(radiance) if is_file else radiance


@explained_methods
@dataclass(frozen=True, init=False, eq=False, repr=False)
class EnvironmentLight(Value):
    """Light from infinitely far away, from all directions, for a `PathTracer`.

    Parameters
    ----------
    radiance : float, (3,) float, path or (height, width, 3) array
        Linear red, green and blue, or one number for all three; if there is an `image`, a factor of it. Or the image
        itself: an array, or the path of an .exr or .hdr file, see `read_environment`; the factor is then 1.
    image : (height, width, 3) array_like of numbers, optional
        Linear radiance by direction: an equirectangular panorama. The top row is z, the bottom row is -z, x is in the
        middle, and y is in the middle of the left half. The radiance is constant within a pixel. Directions are sampled
        in proportion to their light.
    rotation : (3, 3) array_like, optional
        Columns are the world directions of the image's x, y and z.
    visible : bool
        Whether the camera sees it behind the surfaces.

    Raises
    ------
    ValueError
        For numbers that are negative or not finite, an image of another shape, and a matrix that is not a rotation.
    TypeError
        If both `radiance` and `image` are panoramas.

    Examples
    --------
    >>> import numpy as np
    >>> import isospline
    >>> sky = np.zeros((16, 32, 3))
    >>> sky[:8] = (0.5, 0.7, 1.0)  # above the horizon
    >>> light = isospline.EnvironmentLight(image=sky)
    """

    radiance: NDArray[np.float64]
    #: (height, width, 3) float32 array, or None.
    image: NDArray[np.float32] | None
    rotation: NDArray[np.float64]
    visible: bool

    def __init__(
        self,
        radiance: str | os.PathLike[str] | ArrayLike = 1.0,
        *,
        image: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
        visible: bool = False,
    ) -> None:
        sky: Any = sky_of(radiance, image)
        panorama = image if sky is None else sky
        factor: Any = radiance if sky is None else 1.0
        self._take(
            None if panorama is None else _core._EnvironmentMap(panorama),
            _core._color(factor, "radiance"),
            np.eye(3) if rotation is None else _core._doubles(rotation, "rotation", (3, 3)),
            flag(visible, "visible"),
        )

    def _take(self, map: Any, radiance: Any, rotation: Any, visible: bool) -> None:
        object.__setattr__(self, "_map", map)
        self._keep(radiance=radiance, image=None if map is None else map.image, rotation=rotation, visible=visible)

    @classmethod
    def _with(cls, map: Any, radiance: Any, rotation: Any, visible: bool) -> EnvironmentLight:
        """The light of a map that has been made."""
        light = cls.__new__(cls)
        light._take(map, radiance, rotation, visible)
        return light

    def _check(self) -> None:
        _core._check_light(self)


def upright(environment: Any, up: ArrayLike) -> EnvironmentLight:
    """The light of an environment: its first argument, or one for a world with z upwards; turned upright."""
    light = environment if isinstance(environment, EnvironmentLight) else EnvironmentLight(environment)
    return light if light.image is None else light.replace(rotation=upright_rotation(up) @ light.rotation)


def upright_rotation(up: ArrayLike, degrees: float = 0.0) -> NDArray[np.float64]:
    """The shortest rotation from z to a direction, after a turn about z."""
    z = np.asarray(up, float) / np.linalg.norm(up)
    if z[2] <= -1 + 1e-12:
        tilt = np.diag([1.0, -1.0, -1.0])
    else:
        x, y = z[:2]
        cross = np.array([[0, 0, x], [0, 0, y], [-x, -y, 0]])  # of the axis (-y, x, 0)
        tilt = np.eye(3) + cross + cross @ cross / (1 + z[2])
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.asarray(tilt @ np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]))
