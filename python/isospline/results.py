"""Results of queries: mappings from names to arrays whose items are also attributes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .signatures import explained_methods
from .values import same

__all__ = ["ClosestPoints", "Components", "Crossings", "Hits"]


def _item(name: str, doc: str) -> Any:
    """A property that is the item of this name."""

    def get(self: dict[str, NDArray[Any]]) -> NDArray[Any]:
        try:
            return self[name]
        except KeyError:
            held = ", ".join(self) or "nothing"
            raise AttributeError(f'{name}: expected outputs=("{name}",) for it, got a result with {held}') from None

    return property(get, doc=doc)


class _Result(dict[str, NDArray[Any]]):
    """Results are equal if their arrays are, with NaN equal to NaN."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, dict) and same(dict(self), dict(other))

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None

    def __repr__(self) -> str:
        """Names, shapes and types, without numbers."""
        arrays = ", ".join(f"{name}: {array.dtype}{list(array.shape)}" for name, array in self.items())
        return f"{type(self).__name__}({arrays})"


@explained_methods
class Hits(_Result):
    """The first crossings of rays, as `Scene.cast_rays` returns them: ``hits.t_hit`` is ``hits["t_hit"]``.

    It has the arrays named by `outputs`; the leading axes are those of the rays. The type of real numbers is that of
    the rays, float32 or float64, unless `dtype` is given.
    """

    t_hit: NDArray[Any] = _item("t_hit", "(...) t of the crossing, inf if the ray misses.")
    geometry_ids: NDArray[np.uint32] = _item("geometry_ids", "(...) uint32, `INVALID_ID` if the ray misses.")
    primitive_ids: NDArray[np.uint64] = _item(
        "primitive_ids", "(...) uint64: the place of the cell in its volume or the face of a mesh."
    )
    primitive_normals: NDArray[Any] = _item(
        "primitive_normals", "(..., 3) unit outward normals in world space, zero if the ray misses."
    )
    positions: NDArray[Any] = _item("positions", "(..., 3) points in world space, NaN if the ray misses.")
    primitive_uvs: NDArray[np.float32] = _item(
        "primitive_uvs", "(..., 2) float32, weights of a triangle's second and third corner."
    )
    gradient_magnitudes: NDArray[Any] = _item(
        "gradient_magnitudes", "(...) for an isosurface's model, in values per world unit; 0 for meshes."
    )

    def select(self, rays: NDArray[Any]) -> Hits:
        """The hits of some of the rays.

        Parameters
        ----------
        rays : bool or int array
            The rays: any index of the leading axes, such as ``np.isfinite(hits.t_hit)``.

        Returns
        -------
        Hits
        """
        return Hits({name: array[rays] for name, array in self.items()})


class Crossings(_Result):
    """All crossings of rays, as `Scene.list_intersections` returns them: those of ray i are the items from
    ``ray_splits[i]`` to ``ray_splits[i + 1]``.
    """

    ray_splits: NDArray[np.int64] = _item("ray_splits", "(N + 1,) int64: where the crossings of each ray begin.")
    ray_ids: NDArray[np.int64] = _item("ray_ids", "(M,) int64: the ray of each crossing.")
    t_hit: NDArray[np.float64] = _item("t_hit", "(M,) float64, ascending along each ray.")
    geometry_ids: NDArray[np.uint32] = _item("geometry_ids", "(M,) uint32.")
    primitive_ids: NDArray[np.uint64] = _item("primitive_ids", "(M,) uint64, as in `Hits`.")
    primitive_uvs: NDArray[np.float32] = _item("primitive_uvs", "(M, 2) float32, as in `Hits`.")
    primitive_normals: NDArray[np.float64] = _item("primitive_normals", "(M, 3) float64: unit, outward, world space.")
    positions: NDArray[np.float64] = _item("positions", "(M, 3) float64, world space.")
    entering: NDArray[np.bool_] = _item("entering", "(M,) bool: whether the ray enters the solid there.")


class ClosestPoints(_Result):
    """The nearest points of a surface, as `Isosurface.closest_points` returns them."""

    points: NDArray[np.float64] = _item("points", "(..., 3) float64, world space; NaN if there is none.")
    distances: NDArray[np.float64] = _item("distances", "(...) float64, world units.")
    error_bounds: NDArray[np.float64] = _item(
        "error_bounds", "(...) float64: the true distance is smaller by at most this, world units."
    )
    primitive_ids: NDArray[np.uint64] = _item("primitive_ids", "(...) uint64, as in `Hits`.")
    primitive_normals: NDArray[np.float64] = _item("primitive_normals", "(..., 3) float64: unit, outward, world space.")


class Components(_Result):
    """The connected components of a solid, as `Isosurface.components` returns them: the largest volume first.

    Volumes, areas and their errors exist only if they were measured.
    """

    enclosed_volumes: NDArray[np.float64] = _item("enclosed_volumes", "(N,) float64, world units cubed.")
    volume_errors: NDArray[np.float64] = _item("volume_errors", "(N,) float64: estimated errors of `enclosed_volumes`.")
    areas: NDArray[np.float64] = _item(
        "areas", "(N,) float64, world units squared: including the surfaces of cavities."
    )
    area_errors: NDArray[np.float64] = _item("area_errors", "(N,) float64: estimated errors of `areas`.")
    bounds: NDArray[np.float64] = _item(
        "bounds", "(N, 2, 3) float64, world units: lower and upper corner of the box of each component's cells."
    )
    cell_counts: NDArray[np.int64] = _item(
        "cell_counts", "(N,) int64: number of cells that contain a part of each component."
    )
    inside_counts: NDArray[np.int64] = _item(
        "inside_counts", "(N,) int64: number of cells that are completely in each component, by their coefficients."
    )
