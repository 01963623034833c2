"""A ground on which scenes stand."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..base.parameters import check_type, unit_vector
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
    z = unit_vector(up, "up")
    if not 0 < reach < np.inf:
        raise ValueError(f"reach: expected a finite number above 0, got {reach!r}")
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    extents = scene.extent([x, y, z])
    size = float(np.linalg.norm(extents[:, 1] - extents[:, 0]))
    if not 0 < size < np.inf:
        raise ValueError("scene: expected one with an extent, got an empty one")
    foot = extents[0].mean() * x + extents[1].mean() * y + extents[2, 0] * z
    places = [foot + reach * size * (a * x + b * y) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return Mesh(places, [(0, 1, 2), (0, 2, 3)])
