"""The choice of a scale of a store's pyramid for a picture."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.handed import handed
from ..base.mistakes import sentence
from ..base.parameters import check_count, check_type
from ..base.signatures import explained
from ..cameras.camera import _Camera
from ..scene import Volume
from .metadata import ScaleMetadata, StoreMetadata, read_metadata
from .volume import open_level

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

#: Points along each edge of a volume's box at which the size of a voxel in the picture is computed.
_POINTS = 9

#: Longest edge, in samples, of the overview level.
_OVERVIEW = 256


def is_store(path: str | os.PathLike[str] | None) -> bool:
    """Whether a path is the folder of a Zarr 3 group."""
    return path is not None and os.path.isfile(os.path.join(path, "zarr.json"))


@explained
def scale_for(store: StoreMetadata | str | os.PathLike[str], camera: Any, size: tuple[int, int]) -> int:
    """Choose the scale for a picture: the coarsest one whose voxels are nowhere larger than a pixel.

    Parameters
    ----------
    store : StoreMetadata, str or path-like
        The store, or its folder.
    camera : PerspectiveCamera, OrthographicCamera, ProjectionPlaneCamera or PanoramicCamera
        For a panoramic camera, one with distortion, or an eye inside the volume's box, the finest scale is chosen.
    size : (int, int)
        Width and height of the picture in pixels.

    Returns
    -------
    int
        For `open_volume`: 0 is the finest scale.

    Raises
    ------
    TypeError
        For what is not a camera, and for a size that is not two numbers.
    OSError, ValueError
        For a folder that is not a complete store, as `open_volume` does, and for a size below 1.
    """
    check_type(camera, "camera", _Camera, "a camera of isospline")
    if np.asarray(size, dtype=object).shape != (2,):  # objects, as a list may be ragged
        raise TypeError(sentence("size", "width and height", size))
    for pixels in size:
        check_count(pixels, "size")
    metadata = store if isinstance(store, StoreMetadata) else read_metadata(store)
    try:
        to_image = camera.world_to_ndc(size)
    except (AttributeError, ValueError):  # a panoramic camera, or one with distortion
        return 0
    ratio = _pixels_per_voxel(metadata.scales[0], to_image, np.array(size))
    if not ratio < 1:
        return 0
    return min(int(-math.log2(max(ratio, 1e-12))), len(metadata.scales) - 1)


def _pixels_per_voxel(level: ScaleMetadata, to_image: Any, size: Any) -> float:
    """The largest extent of a voxel's edges in the picture, over the volume's box; infinite behind the eye."""
    axes = [np.linspace(-0.5, count - 0.5, _POINTS) for count in level.shape[::-1]]
    index = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    steps = level.affine[:3, :3]  # columns
    points = np.array(level.origin) + index @ steps.T

    def project(world):
        clip = np.c_[world, np.ones(len(world))] @ to_image.T
        return clip[:, :2] * size, clip[:, 3:]

    at, depth = project(points)
    if depth.min() <= 0:
        return math.inf
    largest = 0.0
    for step in steps.T:
        beside, depth_beside = project(points + step)
        if depth_beside.min() <= 0:
            return math.inf
        largest = max(largest, float(np.linalg.norm(beside / depth_beside - at / depth, axis=1).max()))
    return largest


class Scales:
    """The volumes of a store's pyramid. Each is opened when it is first requested.

    Parameters
    ----------
    path : str or path-like
        Folder of the store.
    memory_limit : int or str
        For each volume, as in `open_volume`.

    Attributes
    ----------
    metadata : StoreMetadata
    overview : int
        The finest scale whose longest edge has at most 256 samples, or the coarsest one.
    shape, axes, affine
        The grid of the finest scale, as in a `Volume`.
    """

    axes = "zyx"

    def __init__(self, path: str | os.PathLike[str], memory_limit: int | str = "4GB") -> None:
        self.metadata, self._limit = read_metadata(path), memory_limit
        self._volumes: dict[int, Volume] = {}
        self.shape, self.affine = self.metadata.scales[0].shape, self.metadata.scales[0].affine
        sizes = [max(level.shape) for level in self.metadata.scales]
        self.overview = next((i for i, size in enumerate(sizes) if size <= _OVERVIEW), len(sizes) - 1)

    def volume(self, scale: int) -> Volume:
        """The volume of a scale."""
        if scale not in self._volumes:
            opened = open_level(self.metadata, self.metadata.scales[scale], self._limit)
            self._volumes.setdefault(scale, opened)
        return self._volumes[scale]

    def choose(self, cameras: Any, size: tuple[int, int]) -> int:
        """The coarsest scale that is fine enough for the pictures of all cameras."""
        return min(scale_for(self.metadata, camera, size) for camera in cameras)

    def choose_for_points(self, distances: ArrayLike, axes: Sequence[int]) -> int:
        """The scale for points at some distances along some of the axes x, y and z.

        The coarsest one whose samples are no farther apart along any of these axes, but none coarser than the overview.
        """
        scales = self.metadata.scales[: self.overview + 1]
        fine = [bool((np.array(level.spacing)[axes] <= distances).all()) for level in scales]
        return int(max(np.flatnonzero(fine), default=0))

    def describe(self, scale: int) -> str:
        """A text with the scale, the number of scales, and the size of its voxels."""
        coarse, fine = (self.metadata.scales[i].spacing[0] for i in (scale, 0))
        finest = "" if scale == 0 else f", those of scale 0 are {fine:g}"
        last = len(self.metadata.scales) - 1
        return f"scale {scale} (0 to {last}): voxels of {coarse:g}{finest}"


@handed
def overview_of(volume: Volume) -> Volume:
    """The overview of the store of a volume."""
    folder, array, memory_limit = volume.__getstate__()["store"]
    scales = Scales(folder, memory_limit)
    return volume if scales.metadata.scales[scales.overview].path == array else scales.volume(scales.overview)
