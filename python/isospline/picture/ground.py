"""A ground on which scenes stand."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.parameters import check_type, number, unit_vector
from ..base.signatures import explained
from ..scene import Mesh, Scene


@explained
def ground_for(scene: Scene, *, up: ArrayLike = (0, 0, 1), reach: float = 20.0) -> Mesh:
    """Make a square ground, on which a scene stands and casts shadows.

    Make the camera before the ground is added, so that it does not show the whole ground.

    Parameters
    ----------
    scene : Scene
    up : (3,) float
        The direction away from the ground. The ground touches the visible objects from below, to the size of a cell.
    reach : float
        Extent of the ground from the middle of the scene, in diagonals of the scene.

    Returns
    -------
    Mesh
        Two triangles.

    Raises
    ------
    ValueError
        For a scene without extent, and invalid numbers.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> volume = field.volume(32)
    >>> scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    >>> camera = isospline.camera_for(scene)
    >>> ground = scene.add(isospline.ground_for(scene))
    """
    check_type(scene, "scene", Scene, "a Scene")
    axes = upright_axes(unit_vector(up, "up"))
    reach = number(reach, "reach")
    if not 0 < reach < np.inf:
        raise ValueError(f"reach: expected a finite number above 0, got {reach!r}")
    extents = scene.extent(axes)
    if not 0 < diagonal(extents) < np.inf:
        raise ValueError("scene: expected one with an extent, got an empty one")
    return square_below(axes, extents, reach)


def upright_axes(up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors (3, 3) at right angles, of which the last one is a unit vector `up`."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(up))], up)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(up, x), up])


def diagonal(extents: NDArray[np.float64]) -> float:
    """The diagonal of a box with extents (3, 2) along its axes; infinite or NaN for an empty one."""
    return float(np.linalg.norm(extents[:, 1] - extents[:, 0]))


def square_below(axes: NDArray[np.float64], extents: NDArray[np.float64], reach: float) -> Mesh:
    """The square of `ground_for` below a box with extents (3, 2) along axes (3, 3)."""
    x, y, z = axes
    foot = extents[0].mean() * x + extents[1].mean() * y + extents[2, 0] * z
    half = reach * diagonal(extents)
    places = [foot + half * (a * x + b * y) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return Mesh(places, [(0, 1, 2), (0, 2, 3)])
