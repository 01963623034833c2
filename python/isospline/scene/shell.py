"""The cells that an isosurface can be in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .. import _core
from .public import public

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@public
class Shell(_core.Shell):
    """The cells that may contain a part of an isosurface at its current level.

    Cell (x, y, z) is the cube between the indices (x, y, z) - 1/2 and (x, y, z) + 1/2 for even degrees, (x, y, z) and
    (x, y, z) + 1 for odd ones.
    """

    __slots__ = ()

    @property
    def count(self) -> int:
        """Number of cells."""
        return super().count

    @property
    def cells(self) -> NDArray[np.int32]:
        """(M, 3) int32 array: x, y, z of every cell, in the order of octets of 2 x 2 x 2 bricks of
        8 x 8 x 8 cells, then bricks, then blocks of 2 x 2 x 2 cells. A new array.
        """
        return super().cells

    @property
    def mask(self) -> NDArray[np.bool_]:
        """bool array over the grid of cells, in the order of the axes of the volume's data; one
        item fewer than samples along each axis for odd degrees. A new array.
        """
        return super().mask

    @property
    def memory(self) -> int:
        """Bytes held by the list of cells."""
        return super().memory
