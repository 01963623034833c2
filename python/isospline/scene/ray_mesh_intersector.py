"""Ray queries with the interface of trimesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import INVALID_ID, _as_array
from ..base.parameters import check_count
from ..base.signatures import explained_methods
from ..interop.trimesh import check_trimesh, mesh_from_trimesh
from .isosurface import Isosurface
from .mesh import Mesh
from .scene import Scene

# Not along an axis or a diagonal, where rays often meet edges.
_DIRECTION = np.array([0.4395064455, 0.617598629942, 0.652231566745])


@explained_methods
class RayMeshIntersector:
    """Ray queries with the interface of ``trimesh.ray.ray_pyembree.RayMeshIntersector``, for isosurfaces as well.

    Code written for ``mesh.ray`` of trimesh works with it, and it can replace that attribute of a trimesh mesh:
    ``mesh.ray = RayMeshIntersector(mesh)``. Rays are intersected in double precision, and rays whose direction is zero
    miss. Copies share the geometry. It can be pickled if the geometry can, as meshes of trimesh can.

    There are two questions about a ray that meets a triangle of a mesh just at an edge or corner:

    - What it hits. `intersects_any`, `intersects_first` and the others with ``multiple_hits=False`` count touches: a
      ray that meets any triangle, its edges and corners included, hits it, on all sides of a body alike. Rays that
      pass within rounding touch, too: their distance is at most 3.6e-15 times the sum of the largest coordinates of the
      origin and of the corners. A ray in the plane of a triangle does not hit that, as in trimesh, but its neighbours.
    - What it crosses. Lists, with ``multiple_hits=True``, have crossings: each is found once, even on an edge, so that
      rays through closed meshes enter and leave in turn. A ray along the silhouette of a body crosses it twice or not
      at all, and one in the plane of a triangle does not cross that triangle. `contains_points` counts these crossings.

    For isosurfaces both are the same.

    Parameters
    ----------
    geometry : Scene, Isosurface, Mesh, trimesh.Trimesh or trimesh.Scene
        Changes of trimesh's objects take effect at the next query.
    scale_to_box : bool
        Has no effect: trimesh scales meshes because of single precision.

    Attributes
    ----------
    mesh : Scene, Isosurface, Mesh, trimesh.Trimesh or trimesh.Scene
        The geometry.
    scene : Scene
        The scene in which the rays are cast.

    Notes
    -----
    ``index_tri`` is the row of a mesh's faces, or the primitive id of an isosurface's cell; `Volume.cell_at` converts
    it to the cell's indices. If the scene has several objects, `Scene.list_intersections` distinguishes them.

    Examples
    --------
    >>> import isospline
    >>> from isospline import volumes
    >>> field = volumes.sphere(radius=0.5)
    >>> surface = isospline.Isosurface(field.volume(32), field.level)
    >>> rays = isospline.RayMeshIntersector(surface)
    >>> locations, index_ray, index_tri = rays.intersects_location([(-2, 0, 0)], [(1, 0, 0)])
    >>> locations.round(2) + 0.0
    array([[-0.5,  0. ,  0. ],
           [ 0.5,  0. ,  0. ]])
    >>> rays.contains_points([(0, 0, 0), (0.6, 0, 0)])
    array([ True, False])
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True) -> None:
        self._is_of_trimesh = type(geometry).__module__.partition(".")[0] == "trimesh"
        if self._is_of_trimesh:
            check_trimesh(geometry)
        elif not isinstance(geometry, (Scene, Isosurface, Mesh)):
            raise TypeError(
                f"geometry: expected a Scene, an Isosurface, a Mesh or a mesh of trimesh, got {type(geometry).__name__}"
            )
        self.mesh = geometry
        self._scale_to_box = scale_to_box
        self._scene: Scene | None = None
        self._hash: int | None = None  # of the trimesh object from which the scene was made

    @property
    def scene(self) -> Scene:
        """The scene in which the rays are cast."""
        if self._is_of_trimesh:
            current = hash(self.mesh)
            if self._scene is None or self._hash != current:
                self._scene, self._hash = Scene([mesh_from_trimesh(Mesh, self.mesh)]), current
        elif self._scene is None:
            self._scene = self.mesh if isinstance(self.mesh, Scene) else Scene([self.mesh])
        return self._scene

    def __getstate__(self):
        return {**self.__dict__, "_scene": None, "_hash": None}

    def __copy__(self):
        return type(self)(self.mesh, self._scale_to_box)

    def __deepcopy__(self, memo):
        return self.__copy__()

    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        *,
        max_hits: int | None = None,
        return_locations: bool = False,
    ) -> tuple[NDArray[Any], ...]:
        """Find the faces and cells that rays cross.

        Parameters
        ----------
        ray_origins, ray_directions : (N, 3) array_like, world units
            Directions need not have length one.
        multiple_hits : bool
            Whether to return all crossings of a ray, or only the first hit, which may be a touch.
        max_hits : int, optional
            The largest number of crossings of a ray, 0 or more; the first ones are returned.
        return_locations : bool
            Whether to return the positions as well.

        Returns
        -------
        index_tri : (M,) int64 array
            Row of the face, or primitive id of the cell.
        index_ray : (M,) int64 array
            Row of the ray, ascending; crossings of one ray are in their order along it.
        locations : (M, 3) float64 array, world units
            Only with `return_locations`.

        Raises
        ------
        ValueError
            For different numbers of origins and directions, numbers that are not finite, and `max_hits` below 0.
        """
        rays, rows, _ = _rays(ray_origins, ray_directions)
        if max_hits is not None:
            check_count(max_hits, "max_hits", least=0)
        if max_hits == 0:
            rays, rows = rays[:0], rows[:0]
        if multiple_hits:
            crossings = self.scene.list_intersections(rays)
            index_ray, index_tri, t = crossings["ray_ids"], crossings["primitive_ids"], crossings["t_hit"]
            if max_hits is not None:
                first = np.arange(len(t)) - crossings["ray_splits"][index_ray] < max_hits
                index_ray, index_tri, t = index_ray[first], index_tri[first], t[first]
        else:
            hits = self.scene._cast_touching_rays(rays)
            index_ray = np.flatnonzero(hits["geometry_ids"] != INVALID_ID)
            index_tri, t = hits["primitive_ids"][index_ray], hits["t_hit"][index_ray]
        index_tri = index_tri.astype(np.int64)
        if not return_locations:
            return index_tri, rows[index_ray]
        return index_tri, rows[index_ray], rays[index_ray, :3] + t[:, None] * rays[index_ray, 3:]

    def intersects_location(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        *,
        max_hits: int | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
        """The locations, index_ray and index_tri of `intersects_id`, in this order."""
        index_tri, index_ray, locations = self.intersects_id(
            ray_origins, ray_directions, multiple_hits=multiple_hits, return_locations=True, max_hits=max_hits
        )
        return locations, index_ray, index_tri

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.int64]:
        """(N,) int64 array: the first face or cell that each ray crosses or touches; -1 if it misses."""
        rays, rows, count = _rays(ray_origins, ray_directions)
        first = np.full(count, -1, dtype=np.int64)
        hits = self.scene._cast_touching_rays(rays)
        first[rows] = np.where(hits["geometry_ids"] == INVALID_ID, -1, hits["primitive_ids"].astype(np.int64))
        return first

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.bool_]:
        """(N,) bool array: whether each ray crosses or touches anything."""
        return self.intersects_first(ray_origins, ray_directions) >= 0

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points are inside of any object. Rays from them then cross its surface an odd number of times.

        Objects must be closed: meshes without holes, and isosurfaces that do not reach the border of their volume and
        are not cut. Points on a surface may be inside or outside.

        Parameters
        ----------
        points : (N, 3) array_like, world units

        Returns
        -------
        (N,) bool array
        """
        positions = _rows(points, "points")
        contains = np.zeros(len(positions), dtype=np.bool_)
        lower, upper = self.scene.bounds
        near = np.flatnonzero(((positions >= lower) & (positions <= upper)).all(axis=1))
        hits = self.scene.list_intersections(np.hstack([positions[near], np.broadcast_to(_DIRECTION, (len(near), 3))]))
        crossed = np.stack([hits["ray_ids"], hits["geometry_ids"].astype(np.int64)], axis=1)
        objects, counts = np.unique(crossed, axis=0, return_counts=True)
        contains[near[objects[counts % 2 == 1, 0]]] = True
        return contains


def _rays(origins, directions):
    """(N, 6) rays for the scene, without those whose direction is zero, their original rows, and N."""
    origins, directions = _rows(origins, "ray_origins"), _rows(directions, "ray_directions")
    if len(origins) != len(directions):
        raise ValueError(f"ray_directions: expected as many as ray_origins, {len(origins)}, got {len(directions)}")
    rows = np.flatnonzero(directions.any(axis=1))
    return np.hstack([origins, directions])[rows], rows, len(origins)


def _rows(values, parameter):
    array = _as_array(values, parameter).astype(float, copy=False)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{parameter}: expected shape (N, 3), got {array.shape}")
    return array
