"""Straight edges of objects in pictures: of meshes, and where two caps of a surface meet."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..scene import Mesh
from .outlines import BESIDE, Feet

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .film import Film, Samples

#: Segments are looked at in pieces of this length, in pixels.
_PIECE = 4.0


@dataclass
class Segments:
    """K segments with the normals of the two faces beside each, zero if there is only one; in the object's space."""

    ends: NDArray[np.float64]  # (K, 2, 3)
    normals: NDArray[np.float64]  # (K, 2, 3)

    def select(self, which) -> Segments:
        return Segments(self.ends[which], self.normals[which])


def segments_of(item: object, film: Film, creases: bool) -> Segments:
    """The edges that may be seen as outlines from the film's eye; with `creases`, all between faces of two planes."""
    if isinstance(item, Mesh):
        return _edges_of_mesh(item, film, creases)
    return _edges_of_caps(item)


def _edges_of_mesh(mesh, film, creases) -> Segments:
    # Triangles may have corners of their own, as in STL files.
    vertices, merged = np.unique(mesh.vertices, axis=0, return_inverse=True)
    faces = merged.reshape(-1)[mesh.faces]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    facing = np.sign((normals * (film.eye[3] * a - film.eye[:3])).sum(axis=1))
    pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, place, counts = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(place.reshape(-1), kind="stable")
    face = np.tile(np.arange(len(faces)), 3)[order]
    along = np.concatenate([faces[:, 0] < faces[:, 1], faces[:, 1] < faces[:, 2], faces[:, 2] < faces[:, 0]])[order]
    begin = np.cumsum(counts) - counts
    end = begin + counts - 1
    first, last = face[begin], face[end]
    # Two faces with one outer side pass along their edge in opposite ways; the order of corners may be another.
    turned = np.where(along[begin] != along[end], 1.0, -1.0)
    wanted = (counts != 2) | (facing[first] != turned * facing[last])
    if creases:  # also of meshes with normals at the vertices: rays find the normals of faces
        wanted |= (np.abs(normals[first] - normals[last]) > 1e-12).any(axis=1)
    beside = np.stack([normals[first], np.where((counts == 1)[:, None], 0.0, normals[last])], axis=1)
    return Segments(vertices[edges[wanted]], beside[wanted])


def _edges_of_caps(surface) -> Segments:
    planes = surface._end_planes() if surface.capped or surface.closed else np.empty((0, 4))
    ends, normals = [], []
    for i in range(len(planes)):
        for j in range(i):
            along = np.cross(planes[i, :3], planes[j, :3])
            if np.linalg.norm(along) < 1e-9:
                continue
            point = np.linalg.solve(np.array([planes[i, :3], planes[j, :3], along]), [planes[i, 3], planes[j, 3], 0.0])
            others = np.delete(planes, [i, j], axis=0)
            slopes, above = others[:, :3] @ along, others[:, :3] @ point - others[:, 3]
            crosses = np.abs(slopes) > 1e-12 * np.linalg.norm(along)
            if (above[~crosses] < 0.0).any():
                continue
            at = -above[crosses] / slopes[crosses]
            begin = at[slopes[crosses] > 0.0].max(initial=-np.inf)
            end = at[slopes[crosses] < 0.0].min(initial=np.inf)
            if begin < end:
                ends.append([point + begin * along, point + end * along])
                normals.append([planes[i, :3], planes[j, :3]])
    return Segments(np.reshape(ends, (-1, 2, 3)), np.reshape(normals, (-1, 2, 3)))


def feet_on_segments(segments: Segments, film: Film, samples: Samples, tube: float) -> Feet | None:
    """The feet of samples within `tube` pixels of segments; None if there are none. Some may be hidden."""
    segments = _in_view(segments, film, samples, tube)
    (first, t_first), (last, t_last) = (film.project(segments.ends[:, k]) for k in range(2))
    lengths = np.linalg.norm(last - first, axis=1)
    kept = (t_first > 0.0) & (t_last > 0.0) & (lengths > 0.0) & np.isfinite(lengths)
    segments, first, last, lengths = segments.select(kept), first[kept], last[kept], lengths[kept]
    t_first, t_last = t_first[kept], t_last[kept]
    if not len(lengths):
        return None
    counts = np.ceil(lengths / _PIECE).astype(np.int64)
    segment = np.repeat(np.arange(len(counts)), counts)
    piece = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    middle = first[segment] + ((piece + 0.5) / counts[segment])[:, None] * (last - first)[segment]
    pair, sample = samples.near(middle, int(np.ceil(0.5 * _PIECE + tube)))
    segment, piece = segment[pair], piece[pair]
    along = (last - first)[segment] / lengths[segment, None]
    offsets = samples.positions[sample] - first[segment]
    place = (offsets * along).sum(axis=1) / lengths[segment]
    distances = offsets[:, 0] * along[:, 1] - offsets[:, 1] * along[:, 0]
    here = (np.abs(distances) <= tube) & (np.floor(place * counts[segment]) == piece)
    segment, sample, place, distances = segment[here], sample[here], place[here], distances[here]
    u = first[segment] + place[:, None] * (last - first)[segment]
    if film.is_parallel:
        t = (1.0 - place) * t_first[segment] + place * t_last[segment]
    else:  # 1 / t is linear in the picture
        t = 1.0 / ((1.0 - place) / t_first[segment] + place / t_last[segment])
    rays = film.rays(u)
    ends = segments.ends[segment]
    gradients = np.cross(rays[:, 3:], ends[:, 1] - ends[:, 0])
    by_u = film.origins + t[:, None, None] * film.directions
    across = np.einsum("ni,nij->nj", gradients, by_u)
    slopes = np.linalg.norm(across, axis=1)
    outward = across / slopes[:, None]
    side = np.sign(
        (samples.positions[sample] - u)[:, 0] * outward[:, 0] + (samples.positions[sample] - u)[:, 1] * outward[:, 1]
    )
    # How fast t changes on the planes of the faces beside the edge.
    normals = segments.normals[segment]
    with np.errstate(divide="ignore", invalid="ignore"):
        steepness = np.linalg.norm(normals @ by_u, axis=2) / np.abs((normals * rays[:, None, 3:]).sum(axis=2))
    margins = np.minimum(2.0 * BESIDE * np.nan_to_num(steepness, posinf=np.inf).max(axis=1), 1e-2 * t)
    return Feet(
        positions=u,
        t=t,
        points=rays[:, :3] + t[:, None] * rays[:, 3:],
        is_edge=np.ones(len(u), bool),
        outward=outward,
        gradients=gradients,
        speeds=-1.0 / slopes,
        margins=margins,
        widths=np.full(len(u), tube),
        distances=side * np.abs(distances),
        curvatures=np.zeros(len(u)),
        samples=sample,
    )


def counted_once(feet: Feet) -> Feet:
    """Feet where segments lie on each other count as one: where a face ends at the middle of another one's edge."""
    if not len(feet.samples):
        return feet
    places = np.column_stack([feet.samples, np.round(1e6 * feet.positions)])
    _, place, counts = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    return replace(feet, speeds=feet.speeds / counts[place.reshape(-1)])


def _in_view(segments: Segments, film: Film, samples: Samples, tube: float) -> Segments:
    """The parts of segments that are ahead of the eye and in the tube around the samples' pixels."""
    columns = film.origins if film.is_parallel else film.directions
    solved = np.linalg.solve(np.column_stack([columns, film.direction]), (segments.ends - film.origin)[..., None])[
        ..., 0
    ]
    # Homogeneous positions (u, v, w), and t.
    position = np.concatenate([solved[..., :2], np.ones_like(solved[..., :1])], axis=2) if film.is_parallel else solved
    low, high = samples.corner - tube, samples.corner + (samples.width, samples.height) + tube
    sides = np.array([(1, 0, -low[0]), (-1, 0, high[0]), (0, 1, -low[1]), (0, -1, high[1])])
    inside = np.concatenate(
        [position @ sides.T, solved[..., 2:] - 1e-9 * np.abs(solved[..., 2:]).max(initial=0.0)], axis=2
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        cut = inside[:, 0] / (inside[:, 0] - inside[:, 1])
    begin = np.where(inside[:, 0] < 0.0, cut, 0.0).max(axis=1, initial=0.0)
    end = np.where(inside[:, 1] < 0.0, cut, 1.0).min(axis=1, initial=1.0)
    kept = (begin < end) & ~np.any((inside < 0.0).all(axis=1), axis=1)
    ends, part = segments.ends[kept], np.stack([begin, end], axis=1)[kept]
    along = (ends[:, 1] - ends[:, 0])[:, None]
    return Segments(ends[:, :1] + part[:, :, None] * along, segments.normals[kept])
