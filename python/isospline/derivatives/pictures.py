"""Pictures and their derivatives: of what is inside of outlines, and of the outlines."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..looks import Phong
from ..scene import Scene
from .film import Film, Samples, jittered
from .gradients import Gradients, Placed, as_gradients, check_scene, outputs_of_hits
from .outlines import BESIDE, Feet, Outlines
from .shades import Depth, Mask, Normals, PhongShade, Seen
from .straight_edges import counted_once, feet_on_segments, segments_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Literal

    from numpy.typing import ArrayLike, NDArray

#: Samples that are differentiated together: each needs up to 2.6 kB.
_SAMPLES_AT_A_TIME = 1 << 16
#: The widest tube, in pixels.
_WIDEST = 64.0


def picture_vjp(
    scene: Scene,
    camera: Any,
    size: tuple[int, int],
    channel: Literal["mask", "depth", "normals"] | Phong = "mask",
    *,
    samples_per_pixel: int = 4,
    tube: float = 1.0,
    background: ArrayLike = 0.0,
    seed: int = 0,
) -> tuple[NDArray[np.float64], Callable[..., dict[str, Any]]]:
    """A picture and its vector-Jacobian product, outlines included.

    Inside of outlines, the derivatives are those of hits. The outlines are found by the tube estimator: each sample
    within `tube` pixels of one is projected to it, where rays are tangent to the surface or meet its end, and counts as
    a part of its length. It is unbiased for each width. docs/method.md, "Derivatives of pictures".

    Parameters
    ----------
    scene : Scene
        Volumes of degree 2 or 3. It must not change before `vjp` is called.
    camera : PerspectiveCamera, OrthographicCamera or ProjectionPlaneCamera
        Without distortion. A lens counts as a pinhole.
    size : (int, int)
        Width and height, in pixels.
    channel : {"mask", "depth", "normals"} or Phong
        What the picture shows: 1 where there is a hit; the distance along the viewing direction; the unit outward
        normals in the world; or colors by Phong's formula, opaque, of one color, with lights and without shadows. The
        colors and materials of objects do not count. Normals of meshes are those of their faces, as rays find them.
    samples_per_pixel : int
        Samples of each pixel, uniform in its square. The variance falls most for square numbers: each then has a square
        of its own.
    tube : float
        How far from outlines samples count for them, in pixels, and at most half of the outline's radius. Wider tubes
        give less variance, and take longer.
    background : float or (3,) float
        The value where there is no hit.
    seed : int
        The same seed gives the same samples.

    Returns
    -------
    picture : (height, width) or (height, width, 3) float64 array
        The mean of the samples of each pixel.
    vjp : callable
        ``vjp(picture, samples=True)`` takes the gradients of a number by the picture's numbers, in its shape. It
        returns its gradients as a dict: ``camera``, (4, 4), by a matrix that is applied to the camera, at the identity;
        and by geometry id, ``levels``, ``transforms`` and ``samples``, as those of `cast_vjp`.

    Raises
    ------
    ValueError
        For an unknown channel, a volume of degree 1, whose outlines have corners, a camera with distortion, a Phong
        that is not as above, and options out of range; and by `vjp` for gradients of another shape or that are not
        finite.
    TypeError
        If `scene` is not a `Scene`, or the camera is a `PanoramicCamera`.
    RuntimeError
        By `vjp`, if the scene has changed.

    Notes
    -----
    Outlines are where rays are tangent to an isosurface, its edges at the border of the volume, at cuts and between
    caps, and the edges of meshes. Those where two objects run through each other, and at the border of a mask, are not
    among them: there, depths are continuous, but other channels are not. A sample needs about 100 bytes.

    Examples
    --------
    How much of a picture a ball covers, by its level:

    >>> import numpy as np
    >>> import isospline
    >>> field = isospline.volumes.sphere(0.6)
    >>> scene = isospline.Scene(isospline.Isosurface(field.volume(32), field.level))
    >>> camera = isospline.OrthographicCamera((3, 0, 0), (0, 0, 0), height=2)
    >>> picture, vjp = isospline.derivatives.picture_vjp(scene, camera, (64, 64), samples_per_pixel=16)
    >>> slope = vjp(np.full((64, 64), (2 / 64) ** 2), samples=False)["levels"][0]
    >>> bool(abs(slope / (-2 * np.pi * 0.6 / 1.2) - 1) < 0.02)  # the field is 0.6^2 - r^2: dr/dlevel = -1 / 1.2
    True
    """
    return moved_picture_vjp(
        scene,
        camera,
        size,
        channel,
        samples_per_pixel=samples_per_pixel,
        tube=tube,
        background=background,
        seed=seed,
    )


def moved_picture_vjp(scene, camera, size, channel, motion=None, *, samples_per_pixel, tube, background, seed):
    """The same for a camera that a matrix moves; the gradient ``camera`` is by that matrix."""
    check_scene(scene)
    width, height = _size(size)
    samples_per_pixel = _whole("samples_per_pixel", samples_per_pixel, 1, 65536)
    seed = _whole("seed", seed, 0, 2**64 - 1)
    if not isinstance(tube, (int, float, np.number)) or not 0.0 < tube <= _WIDEST:
        raise ValueError(f"tube: expected a number above 0 and at most {_WIDEST:g}, got {tube!r}")
    own = Film.of_camera(camera, (width, height))
    shade = _shade_of(channel, camera, own)
    film = own if motion is None else own.mapped(motion)
    background = _core._as_array(background, "background").astype(float)
    if background.shape not in ((), (shade.channels,)) or not np.isfinite(background).all():
        raise ValueError(f"background: expected a finite number or {shade.channels} of them, got {background.tolist()}")
    placed = Placed(scene)
    for surface in placed.surfaces.values():
        if surface.volume.degree < 2:
            raise ValueError(
                "scene: expected volumes of degree 2 or 3, got one of degree 1, whose outlines have corners"
            )
    picture = _Picture(scene, film, (width, height), shade, samples_per_pixel, seed, background)

    def vjp(picture_gradients, samples=True):
        by_picture = as_gradients("picture", picture_gradients, picture.values.shape).reshape(height, width, -1)
        placed.check_is_of(scene)
        found = Gradients(placed, samples)
        picture.differentiate(by_picture, found, tube)
        by_camera = found.camera if motion is None else found.camera @ np.linalg.inv(motion).T
        by_camera[3] = 0.0
        return {
            "camera": by_camera,
            "levels": found.levels,
            "transforms": found.transforms,
            "samples": found.samples(),
        }

    return picture.values, vjp


def _whole(name, given, least, most):
    try:
        number = operator.index(given)
    except TypeError:
        raise TypeError(f"{name}: expected a whole number, got {given!r}") from None
    if not least <= number <= most:
        raise ValueError(f"{name}: expected {least} to {most}, got {number}")
    return number


def _size(given):
    if not isinstance(given, (tuple, list, np.ndarray)) or len(given) != 2:
        raise ValueError(f"size: expected width and height, got {given!r}")
    return tuple(_whole("size", side, 1, 1 << 24) for side in given)


def _shade_of(channel, camera, film):
    if isinstance(channel, Phong):
        return PhongShade(channel)
    if not isinstance(channel, str):
        raise TypeError(f'channel: expected "mask", "depth", "normals" or a Phong, got {type(channel).__name__}')
    if channel == "mask":
        return Mask()
    if channel == "depth":
        forward = camera.world_to_camera[2, :3]
        return Depth(float(film.direction @ forward))
    if channel == "normals":
        return Normals()
    raise ValueError(f'channel: expected "mask", "depth", "normals" or a Phong, got {channel!r}')


class _Picture:
    """The values of a picture, and what is needed to differentiate it."""

    def __init__(self, scene, film, size, shade, count, seed, background):
        self.scene, self.film, self.size, self.shade = scene, film, size, shade
        self.count, self.seed = count, seed
        self.background = np.broadcast_to(np.asarray(background, float), (shade.channels,))
        positions = self.positions(margin=0)
        values = np.empty((len(positions), shade.channels))
        for some in _chunks(len(positions), _SAMPLES_AT_A_TIME * 8):
            values[some] = self.values_along(film.rays(positions[some]))
        shape = (size[1], size[0]) if shade.channels == 1 else (size[1], size[0], shade.channels)
        self.values = values.reshape(size[0] * size[1], count, -1).mean(axis=1).reshape(shape)

    def positions(self, margin):
        """Samples of the pixels, in their order, and of so many rows and columns around the picture."""
        y, x = np.mgrid[-margin : self.size[1] + margin, -margin : self.size[0] + margin]
        return jittered(np.stack([x.reshape(-1), y.reshape(-1)], axis=1), self.count, self.seed)

    def values_along(self, rays):
        """(N, channels) values of rays."""
        hits = self.scene.cast_rays(rays, outputs=("t_hit", "geometry_ids", "primitive_normals"))
        values = np.tile(self.background, (len(rays), 1))
        found = np.isfinite(hits.t_hit)
        values[found] = self.shade.values(_seen(hits, rays, found))
        return values

    def differentiate(self, by_picture, found: Gradients, tube):
        """Adds the gradients for those by the pixels, (height, width, channels)."""
        positions = self.positions(math.ceil(tube))
        samples = Samples(positions)
        outlines = {}
        for id, surface in found.surfaces.items():
            film = self.film.mapped(np.linalg.inv(found.placed[id][1]))
            outlines[id] = Outlines(surface, film, samples, tube)
        feet_of = self.feet(outlines, samples)
        for id, feet in feet_of.items():
            self.add_outlines(id, feet, by_picture, found, moves_with_f=True)
        for id, feet in self.feet_on_straight_edges(samples, found, tube).items():
            self.add_outlines(id, feet, by_picture, found, moves_with_f=False)
        if isinstance(self.shade, Mask):
            return
        nearer = self.nearer(feet_of)
        density = 1.0 + np.append(
            _density(feet_of, len(positions)),
            _density(self.feet(outlines, Samples(nearer)), len(nearer)),
        )
        positions = np.concatenate([positions, nearer])
        inside = ((positions >= 0.0) & (positions < self.size)).all(axis=1)
        positions, density = positions[inside], density[inside]
        weights = _pixels(by_picture, positions) / (self.count * density[:, None])
        used = weights.any(axis=1)
        positions, weights = positions[used], weights[used]
        for some in _chunks(len(positions), _SAMPLES_AT_A_TIME):
            self.add_inside(self.film.rays(positions[some]), weights[some], found)

    def feet(self, outlines: dict[int, Outlines], samples) -> dict[int, Feet]:
        """The feet of samples on outlines of isosurfaces, by geometry id, where they are seen."""
        feet_of: dict[int, Feet] = {}
        for id, of_surface in outlines.items():
            if (feet := of_surface.feet(samples)) is not None:
                feet_of[id] = self.seen(id, feet)
        return feet_of

    def feet_on_straight_edges(self, samples, found: Gradients, tube) -> dict[int, Feet]:
        """The same on edges of meshes and of caps."""
        feet_of: dict[int, Feet] = {}
        for id, (item, transform) in found.placed.items():
            film = self.film.mapped(np.linalg.inv(transform))
            segments = segments_of(item, film, creases=self.shade.needs_normals)
            if (feet := feet_on_segments(segments, film, samples, tube)) is not None:
                feet_of[id] = counted_once(self.seen(id, feet))
        return feet_of

    def seen(self, id, feet: Feet) -> Feet:
        """Those where the surface is the first hit beside the outline: on its inner side; at an edge, on any side."""
        margins = feet.margins + 1e-9 * np.abs(feet.t)

        def is_at_surface(side):
            hits = self.scene.cast_rays(self.beside(feet, side), outputs=("t_hit", "geometry_ids"))
            with np.errstate(invalid="ignore"):
                return (hits.geometry_ids == id) & (np.abs(hits.t_hit - feet.t) <= margins)

        return feet.select(is_at_surface(-BESIDE) | (feet.is_edge & is_at_surface(BESIDE)))

    def beside(self, feet: Feet, distance):
        return self.film.rays(feet.positions + distance * feet.outward)

    def nearer(self, feet_of):
        """Samples near outlines, as many as in the tube: at the distance s^2 / width for those at s inside.

        There, derivatives grow as 1 / sqrt(s) does, and a sample in a uniform density has no variance.
        """
        parts = [np.empty((0, 2))]
        for feet in feet_of.values():
            inner = feet.select((feet.distances < 0.0) & ~feet.is_edge)
            parts.append(inner.positions - (inner.distances**2 / inner.widths)[:, None] * inner.outward)
        return np.concatenate(parts)

    def add_inside(self, rays, weights, found: Gradients):
        """Adds what moves within outlines, for rays and the gradients by their values."""
        hits = self.scene.cast_rays(rays, outputs=outputs_of_hits(self.shade.needs_normals))
        hit = np.isfinite(hits.t_hit)
        hits, rays = hits.select(hit), rays[hit]
        of = self.shade.vjp(_seen(hits, rays, slice(None)), weights[hit])
        of_t = np.zeros(len(rays)) if of.t is None else of.t
        by_rays = found.add_hits(hits, rays, of_t, of.normals)
        found.add_rays(by_rays if of.rays is None else by_rays + of.rays, rays)

    def add_outlines(self, id, feet: Feet, by_picture, found: Gradients, moves_with_f):
        """Adds what an outline of an object moves; with f, or only with the object."""
        feet = feet.select(((feet.positions >= 0.0) & (feet.positions < self.size)).all(axis=1))
        weights = _pixels(by_picture, feet.positions)
        rays = self.film.rays(feet.positions)
        item, transform = found.placed[id]
        by_point = feet.gradients @ np.linalg.inv(transform[:3, :3])
        inner = self.values_along(self.beside(feet, -BESIDE))
        outer = self.values_along(self.beside(feet, BESIDE))
        tangent = ~feet.is_edge
        if tangent.any():
            # Beside a tangent ray the surface changes as a root does: there, its value is taken on that ray.
            side = 1.0 if item.inside == "above" else -1.0
            normals = -side * by_point / np.linalg.norm(by_point, axis=1, keepdims=True)
            at = Seen(feet.t, normals, rays, np.sign(side * feet.speeds)[:, None])
            inner[tangent] = self.shade.values(at)[tangent]
        # The length of outline that a sample stands for, in pixels, and how far it moves for a change of its function.
        gains = (weights * (inner - outer)).sum(axis=1) * feet.speeds / (2.0 * feet.widths * self.count * feet.stretch)
        used = gains != 0.0
        feet, gains, rays, by_point = feet.select(used), gains[used], rays[used], by_point[used]
        if moves_with_f:
            found.levels[id] -= gains.sum()
            indices, of_coefficients, _ = item.volume.coefficient_weights(feet.points)
            found.add_coefficients(id, indices, gains[:, None] * of_coefficients)
        by_world = gains[:, None] * by_point
        found.add_motion(id, -by_world, rays[:, :3] + feet.t[:, None] * rays[:, 3:])
        found.add_rays(np.concatenate([by_world, feet.t[:, None] * by_world], axis=1), rays)


def _density(feet_of, count):
    """The density of `_Picture.nearer` at samples, relative to theirs."""
    found = np.zeros(count)
    for feet in feet_of.values():
        inner = feet.select((feet.distances < 0.0) & ~feet.is_edge)
        distances = np.maximum(-inner.distances, 1e-12 * inner.widths)
        earlier = np.sqrt(inner.widths * distances)
        stretch = np.abs(1.0 - inner.curvatures * earlier) / inner.stretch
        found += np.bincount(inner.samples, stretch * 0.5 * np.sqrt(inner.widths / distances), count)
    return found


def _pixels(picture, positions):
    places = positions.astype(np.int64)
    return picture[places[:, 1], places[:, 0]]


def _chunks(count, size):
    return [slice(begin, min(begin + size, count)) for begin in range(0, count, size)]


def _seen(hits, rays, which) -> Seen:
    rays, normals = rays[which], hits.primitive_normals[which]
    away = (normals * rays[:, 3:]).sum(axis=1, keepdims=True) > 0.0
    return Seen(hits.t_hit[which], normals, rays, np.where(away, -1.0, 1.0))
