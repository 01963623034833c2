"""Isosurfaces of volumes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .. import _core
from .conversions import as_volume
from .public import attributes_of, from_state, public
from .scene_object import SceneObject
from .surface_measures import SurfaceMeasures
from .surface_meshes import SurfaceMeshes
from .surface_queries import SurfaceQueries

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ..base.types import Color, Progress
    from ..clips import _Cut
    from ..io import VolumeData
    from ..looks import Material
    from .shell import Shell
    from .volume import Volume


@public
class Isosurface(SceneObject, SurfaceMeasures, SurfaceMeshes, SurfaceQueries):
    r"""The surface on which the model of a volume has a given value.

    .. math:: f(\mathbf{x}) = f_0

    Only the cells of its shell can contain a part of it [1]_. These are the cells whose coefficients, minus the level,
    have both signs, except those that pruning by two-scale subdivision rules out.

    Parameters
    ----------
    volume : Volume, VolumeData or (nz, ny, nx) array
        Its degree is 1, 2 or 3. Odd degrees need at least two samples along each axis.
    level : float
        The value :math:`f_0`.
    mask : bool array of the volume's shape, optional
        The parts to keep. A cell is cut away if the sample in its centre is False (degree 2), or one of the samples at
        its corners (odd degrees).
    largest : int, optional
        Keeps this number of connected components of the solid, those with the largest volumes, see `components`; by
        default all are kept. Components are found again whenever the level is set.
    clip : HalfSpace, Box or a list or tuple of them, optional
        In the volume's world space. Only the part inside of all of them is kept. The cuts are planes.
    capped : bool
        Whether the solid is closed where `clip` cuts it: the parts of the cut's plane in the solid are caps, faces that
        belong to the surface. Hits on them have the plane's normal. Their primitive ids begin at ``volume.cell_count``
        and are in the order of the half-spaces of `clip`; a Box has six: lower x, upper x, lower y, and so on. Cuts by
        `mask` stay open.
    closed : bool
        Whether the solid is closed at the border of the volume's domain, `Volume.bounds`, with caps like those of cuts.
        Their primitive ids follow those of `clip`, along the volume's own axes: lower x, upper x, lower y, and so on.
        The border is exact for oblique directions, too.
    inside : {"above", "below"}
        The side of the surface that is the solid. Normals point to the other side. Points where f equals the level are
        above.
    material : Material, optional
        Its look. A `PathTracer` or a `Studio` may have another material for it, and a dict of lights another look.
    color : str, float, (3,) float, or a rule such as ColorByVolume, optional
        Its colour, in place of `material`; as in `Material`. By default, the light decides.
    opacity : float, optional
        Its opacity from 0 to 1, in place of `material`. Path tracers draw all surfaces opaque.
    name : str, optional
        What legends call it.
    progress : callable, optional
        Called with the finished fraction; cancels if it returns a false value other than None.

    Warns
    -----
    UserWarning
        If the shell is empty and there are no caps, for example because the level is out of the data's range. All rays
        then miss.

    Raises
    ------
    ValueError
        For a volume of another degree, or with too few samples; a level that is not finite; a mask of another shape; a
        `largest` below 1; an opacity out of range; and `capped` without a clip, unless `closed` is True.
    TypeError
        For a mask of another type, another type of `clip`, and a color, opacity or name together with a material.
    Cancelled
        If `progress` cancels.

    Notes
    -----
    A change of `level` reuses the coefficients and visits only the bricks whose ranges of values contain the new level.
    Any thread may set it; running queries continue with the level that they began with.

    References
    ----------
    .. [1] P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001.

    Examples
    --------
    >>> import numpy as np
    >>> import isospline
    >>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
    >>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2))
    >>> sphere = isospline.Isosurface(volume, 5.0, inside="below")
    >>> sphere.shell.mask.shape
    (17, 17, 17)
    >>> small = sphere.shell.count
    >>> sphere.level = 7.0
    >>> sphere.shell.count > small
    True
    """

    __slots__ = ()

    def __init__(
        self,
        volume: Volume | VolumeData | NDArray[Any],
        level: float,
        *,
        mask: ArrayLike | None = None,
        largest: int | None = None,
        clip: _Cut | Sequence[_Cut] | None = None,
        capped: bool = False,
        closed: bool = False,
        inside: Literal["above", "below"] = "above",
        material: Material | None = None,
        color: Color | None = None,
        opacity: float | None = None,
        name: str | None = None,
        progress: Progress = None,
    ) -> None:
        super().__init__(
            as_volume(volume, "volume"),
            level,
            mask,
            largest,
            clip,
            capped,
            closed,
            inside,
            material,
            color,
            opacity,
            name,
            progress,
        )

    def with_level(self, level: float, *, progress: Progress = None) -> Isosurface:
        """A surface of the same volume at another level, with the same options. Both share the volume's data."""
        return super().with_level(level, progress)

    @property
    def level(self) -> float:
        """The value of the model on the surface, a finite number; may be set."""
        return super().level

    @level.setter
    def level(self, level: float) -> None:
        _core.Isosurface.level.fset(self, level)  # type: ignore[attr-defined]

    @property
    def shell(self) -> Shell:
        """The cells that may contain a part of the surface at its current level."""
        return super().shell

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) float64 array, world units: lower and upper corner of the box of the cells that may contain the
        surface, and of its caps; inf, -inf if there are none.
        """
        return super().bounds

    @property
    def volume(self) -> Volume:
        """The volume."""
        return super().volume

    @property
    def material(self) -> Material | None:
        """Its look, or None."""
        return super().material

    @property
    def method(self) -> Literal["exact", "reference", "bracket"]:
        """How rays find the surface in a cell: "exact", "reference" or "bracket"."""
        return super().method

    @property
    def inside(self) -> Literal["above", "below"]:
        """The side of the surface that is the solid: "above" or "below"."""
        return super().inside

    @property
    def largest(self) -> int | None:
        """How many connected components of the solid are kept, those with the largest volume; None: all."""
        return super().largest

    @property
    def capped(self) -> bool:
        """Whether the solid is closed where the clip cuts it."""
        return super().capped

    @property
    def closed(self) -> bool:
        """Whether the solid is closed at the border of the volume."""
        return super().closed

    @property
    def prune_depth(self) -> int:
        """Levels of subdivision that the shell was pruned with."""
        return super().prune_depth

    @property
    def prune_border(self) -> bool:
        """Whether cells on the border of the volume are pruned as well."""
        return super().prune_border

    def __reduce__(self) -> Any:
        return from_state, (type(self), self.__getstate__(), attributes_of(self))

    def __copy__(self) -> Isosurface:
        if type(self) is Isosurface:  # with the same index
            return self.with_level(self.level)
        copied: Isosurface = from_state(*self.__reduce__()[1])
        return copied

    def __deepcopy__(self, memo: Any) -> Isosurface:
        memo[id(self)] = copied = self.__copy__()
        return copied
