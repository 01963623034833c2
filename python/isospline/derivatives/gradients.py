"""Sums of gradients by what a scene is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..scene import Isosurface, Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..base.results import Hits

OF_T = ("dt_dlevel", "dt_dorigin", "dt_ddirection", "grazing", "coefficient_indices", "coefficient_weights")
OF_NORMALS = ("dnormal_dlevel", "dnormal_dorigin", "dnormal_ddirection", "coefficient_gradients")


def check_scene(scene: object) -> None:
    if not isinstance(scene, Scene):
        raise TypeError(f"scene: expected a Scene, got {type(scene).__name__}")


def outputs_of_hits(normals: bool) -> Any:
    """The outputs of `cast_rays` that `Gradients.add_hits` needs."""
    parts = OF_T + (OF_NORMALS if normals else ())
    return ("t_hit", "geometry_ids", "primitive_ids", "primitive_normals", "positions", *parts)


class Placed:
    """The objects of a scene, as they are now, and their transforms, by geometry id."""

    def __init__(self, scene: Scene) -> None:
        found = scene._placed_objects()
        self.objects: dict[int, Any] = {id: (item, transform) for id, item, transform, _ in found}
        self.surfaces = {id: item for id, item, *_ in found if isinstance(item, Isosurface)}
        self._state = [
            (id, item, getattr(item, "level", None), transform.tobytes(), visibility.visible)
            for id, item, transform, visibility in found
        ]

    def check_is_of(self, scene: Scene) -> None:
        """Raises if the scene has changed."""
        if self._state != Placed(scene)._state:
            raise RuntimeError("scene: expected one that has not changed since the call, got one that has")


class Gradients:
    """Gradients by levels, transforms and samples of the objects of a scene, by geometry id, and by the camera."""

    def __init__(self, placed: Placed, samples: bool) -> None:
        self.placed, self.surfaces = placed.objects, placed.surfaces
        self.levels = dict.fromkeys(self.surfaces, 0.0)
        self.transforms = {id: np.zeros((4, 4)) for id in self.placed}
        self.camera = np.zeros((4, 4))
        self._has_samples = samples
        self._sums: dict[int, Any] = {}

    def add_coefficients(self, id: int, indices, weights) -> None:
        """Adds gradients by coefficients, given their places in ``volume.coefficients.ravel("K")``."""
        if self._has_samples and indices.size:
            if id not in self._sums:
                self._sums[id] = np.zeros(int(np.prod(self.surfaces[id].volume.shape)))
            np.add.at(self._sums[id], indices, weights)

    def samples(self) -> dict[int, NDArray[np.float64]]:
        if not self._has_samples:
            return {}
        found: dict[int, Any] = {}
        for id, surface in self.surfaces.items():
            sums = self._sums.get(id)
            found[id] = np.zeros(surface.volume.shape) if sums is None else surface.volume._by_samples(sums)
        return found

    def add_motion(self, id: int, by_world, points) -> None:
        """Adds to the transform of an object: its points, in the world, move as the transform changes, at a gain."""
        inverse = np.linalg.inv(self.placed[id][1])
        at_home = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ inverse.T
        self.transforms[id][:3] += by_world.T @ at_home

    def add_rays(self, by_rays, rays) -> None:
        """Adds gradients by the rays of the camera: a matrix applied to it maps origins as points, and directions."""
        self.camera[:3, :3] += by_rays[:, :3].T @ rays[:, :3] + by_rays[:, 3:].T @ rays[:, 3:]
        self.camera[:3, 3] += by_rays[:, :3].sum(axis=0)

    def add_hits(self, hits: Hits, rays, of_t, of_normals):
        """Adds gradients by t and normals of hits, (N) and (N, 3); None without normals. Returns those by rays."""
        by_rays = np.zeros_like(rays)
        moves = are_moving(hits)
        moving = _Moving(
            hits.select(moves), rays[moves], of_t[moves], None if of_normals is None else of_normals[moves]
        )
        by_rays[moves] = moving.by_rays()
        for id, (item, transform) in self.placed.items():
            own = moving.of_object(id)
            self.transforms[id] += own.by_transform(transform)
            if isinstance(item, Isosurface):
                self.levels[id] += float(own.by_level().sum())
                self.add_coefficients(id, own.hits.coefficient_indices, own.by_coefficients())
        return by_rays


class _Moving:
    """Hits that move, their rays, and the gradients by t and by normals, (N) and (N, 3); None without normals."""

    def __init__(self, hits, rays, of_t, of_normals):
        self.hits, self.rays, self.of_t, self.of_normals = hits, rays, of_t, of_normals

    def of_object(self, id):
        own = self.hits.geometry_ids == id
        of_normals = None if self.of_normals is None else self.of_normals[own]
        return _Moving(self.hits.select(own), self.rays[own], self.of_t[own], of_normals)

    def by_rays(self):
        hits = self.hits
        found = self.of_t[:, None] * np.concatenate([hits.dt_dorigin, hits.dt_ddirection], axis=1)
        if self.of_normals is not None:
            by_parts = (hits.dnormal_dorigin, hits.dnormal_ddirection)
            found += np.concatenate([np.einsum("ni,nij->nj", self.of_normals, each) for each in by_parts], axis=1)
        return found

    def by_level(self):
        found = self.of_t * self.hits.dt_dlevel
        if self.of_normals is not None:
            found += (self.of_normals * self.hits.dnormal_dlevel).sum(1)
        return found

    def by_coefficients(self):
        """A coefficient moves a hit as the level does, the other way, by its weight; and it turns the gradient of f."""
        found = -self.by_level()[:, None] * self.hits.coefficient_weights
        if self.of_normals is not None:
            normals = self.hits.primitive_normals
            over_gradient = self.hits.dt_dlevel * (normals * self.rays[:, 3:]).sum(1)  # with the sign of the side
            turns = over_gradient[:, None] * across(normals, self.of_normals)
            found += np.einsum("ni,nki->nk", turns, self.hits.coefficient_gradients)
        return found

    def by_transform(self, transform):
        """With the object's point y, the surface moves by dT y at a fixed ray, and normals turn by the inverse of T."""
        inverse = np.linalg.inv(transform)
        points = np.concatenate([self.hits.positions, np.ones((len(self.of_t), 1))], axis=1) @ inverse.T
        moved = self.of_t[:, None] * self.hits.dt_dorigin
        found = np.zeros((4, 4))
        if self.of_normals is not None:
            moved = moved + np.einsum("ni,nij->nj", self.of_normals, self.hits.dnormal_dorigin)
            normals = self.hits.primitive_normals
            found[:3, :3] = -normals.T @ (across(normals, self.of_normals) @ inverse[:3, :3].T)
        found[:3] -= moved.T @ points
        return found


def across(axes, vectors):
    """The parts of vectors perpendicular to unit axes."""
    return vectors - axes * (axes * vectors).sum(axis=1, keepdims=True)


def are_moving(hits):
    """Whether rays hit, and their hits move smoothly."""
    return np.isfinite(hits.t_hit) & ~hits.grazing


def as_gradients(name: str, given, shape, count=None) -> NDArray[np.float64]:
    """Gradients by the numbers of an array of this shape; zeros for None. Where `count` is false, they are zero too."""
    if given is None:
        return np.zeros(shape)
    array = _core._as_array(given, name).astype(float)
    if array.shape != tuple(shape):
        raise ValueError(f"{name}: expected gradients of shape {tuple(shape)}, got {array.shape}")
    if count is not None:
        array[~count] = 0.0
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: expected finite gradients, got some that are not")
    return array
