"""Rays that touch edges, corners and faces of meshes, beside exact rational arithmetic."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

import isospline
from isospline import RayMeshIntersector, volumes

CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
CUBE_FACES = [
    *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)),
    *((2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def first_contact(origin, direction, triangle):
    """The t >= 0 at which a ray that is not in the triangle's plane meets the closed triangle, exactly, or None."""
    a, b, c = triangle
    normal = cross(minus(b, a), minus(c, a))
    if not any(normal):
        return None
    speed = dot(normal, direction)
    if speed == 0:
        return None
    t = dot(normal, minus(a, origin)) / speed
    place = [x + t * y for x, y in zip(origin, direction)]
    inside = all(dot(cross(normal, minus(q, p)), minus(place, p)) >= 0 for p, q in ((a, b), (b, c), (c, a)))
    return t if t >= 0 and inside else None


def exactly(vertices, faces, origins, directions):
    """For each ray, the first t and the faces that it meets there; None for a miss."""
    exact = [[Fraction(x) for x in vertex] for vertex in np.asarray(vertices, float).tolist()]
    for origin, direction in zip(np.asarray(origins, float).tolist(), np.asarray(directions, float).tolist()):
        ray = [Fraction(x) for x in origin], [Fraction(x) for x in direction]
        contacts = [first_contact(*ray, [exact[i] for i in face]) for face in faces]
        least = min((t for t in contacts if t is not None), default=None)
        yield None if least is None else (float(least), {i for i, t in enumerate(contacts) if t == least})


def check(vertices, faces, origins, directions):
    rays = RayMeshIntersector(isospline.Mesh(vertices, faces))
    hit, first = rays.intersects_any(origins, directions), rays.intersects_first(origins, directions)
    index_tri, index_ray, locations = rays.intersects_id(
        origins, directions, multiple_hits=False, return_locations=True
    )
    expected = [*exactly(vertices, faces, origins, directions)]
    np.testing.assert_array_equal(hit, [each is not None for each in expected])
    np.testing.assert_array_equal(index_ray, np.flatnonzero(hit))
    np.testing.assert_array_equal(index_tri, first[hit])
    assert (first[~hit] == -1).all()
    for row, triangle, location in zip(index_ray, index_tri, locations):
        t, met = expected[row]
        assert triangle in met
        np.testing.assert_allclose(location, origins[row] + t * np.asarray(directions[row]), atol=1e-12)
    return hit


@pytest.mark.parametrize("axis", range(3))
def test_silhouettes_of_a_cube_are_hit_on_all_sides(axis):
    """Rays along an axis through faces, edges and corners, in planes of faces, and beside them, both ways."""
    places = np.array(list(itertools.product((-2.0, -1.0, -0.5, 0.0, 1.0, 1.25), repeat=2)))
    origins = np.insert(places, axis, -3.0, axis=1)
    directions = np.tile(np.eye(3)[axis], (len(origins), 1))
    for sign in (1, -1):
        hit = check(CUBE, CUBE_FACES, sign * origins, sign * directions)
        np.testing.assert_array_equal(hit, (abs(places) <= 1).all(axis=1))
    check(CUBE, CUBE_FACES, origins, -directions)  # away from it
    # From corners, edges and faces.
    starts = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=3)))
    check(CUBE, CUBE_FACES, starts, np.tile(np.eye(3)[axis], (27, 1)))


def test_oblique_rays_through_edges_and_corners_of_a_cube():
    targets = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=3)))
    eyes = np.array([(3, 3, 0), (3, -1, 0), (-3, 1, 1), (0, 3, -3), (5, 1, 1), (-1, -4, -1), (2.5, 0.5, -4)], float)
    origins = np.repeat(eyes, len(targets), axis=0)
    directions = np.tile(targets, (len(eyes), 1)) - origins
    assert check(CUBE, CUBE_FACES, origins, directions).all()


@pytest.mark.parametrize("seed", range(4))
def test_whole_numbers_meet_often(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.integers(-2, 3, (24, 3)).astype(float)  # also triangles without area
    faces = rng.integers(0, 24, (12, 3))
    origins, directions = rng.integers(-3, 4, (150, 3)), rng.integers(-2, 3, (150, 3))
    directions[~directions.any(axis=1)] = (1, 0, 0)
    hit = check(vertices, faces, origins, directions)
    assert 20 < hit.sum() < 150


def test_a_rectangle_seen_edge_on_is_missed():
    """As in trimesh (its issue 2462), in all orders of the axes."""
    corners, faces = np.array([(0, 0, 0), (0.1, 0, 0), (0.1, 0.3, 0), (0, 0.3, 0)]), [(0, 1, 2), (0, 2, 3)]
    for order in itertools.permutations(range(3)):
        turn = np.eye(3)[list(order)]
        rays = RayMeshIntersector(isospline.Mesh(corners @ turn.T, faces))
        origins, directions = np.array([(-0.5, 0.1, 0), (-0.5, 0, 0), (0.05, 0.1, 0)]), np.tile((1.0, 0, 0), (3, 1))
        assert not rays.intersects_any(origins @ turn.T, directions @ turn.T).any()


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.diag(r))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("away", [0.0, 100.0])
def test_turned_silhouettes_are_hit_on_all_sides(seed, away):
    """Rounding puts the rays on either side of the edges; 1e-9 beside them is beyond it."""
    turn, shift = rotation(seed), away * np.array((1.0, -2.0, 0.5))
    rays = RayMeshIntersector(isospline.Mesh(CUBE @ turn.T + shift, CUBE_FACES))
    for axis in range(3):
        sides = np.array([(a, b) for a in (-1, 0.3, 1) for b in (-1, 0.3, 1) if 1 in (abs(a), abs(b))])
        directions = np.tile(turn[:, axis], (len(sides), 1))
        for factor, hits in ((1, True), (1 - 1e-9, True), (1 + 1e-9, False)):
            origins = np.insert(factor * sides, axis, -4.0, axis=1) @ turn.T + shift
            assert (rays.intersects_any(origins, directions) == hits).all()
            assert ((rays.intersects_first(origins, directions) >= 0) == hits).all()


def test_moved_objects_are_touched_too():
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = 2 * rotation(9), (3, -1, 2)
    scene = isospline.Scene([(isospline.Mesh(CUBE, CUBE_FACES), matrix), isospline.Mesh(CUBE - 20, CUBE_FACES)])
    rays = RayMeshIntersector(scene)
    sides = np.array([(-4.0, a, b) for a in (-1, 1) for b in (-1, 0, 1)])
    origins, direction = sides @ matrix[:3, :3].T + matrix[:3, 3], matrix[:3, 0]
    assert rays.intersects_any(origins, np.tile(direction, (6, 1))).all()


def test_lists_have_crossings_in_pairs():
    """Touches are not crossings: each ray through the closed cube has as many entries as exits."""
    places = np.array(list(itertools.product((-1.0, -0.5, 0.0, 1.0), repeat=2)))
    rays = RayMeshIntersector(isospline.Mesh(CUBE, CUBE_FACES))
    for axis in range(3):
        origins = np.insert(places, axis, -3.0, axis=1)
        directions = np.tile(np.eye(3)[axis], (len(origins), 1))
        _, index_ray = rays.intersects_id(origins, directions)
        counts = np.bincount(index_ray, minlength=len(origins))
        assert set(counts.tolist()) <= {0, 2} and (counts[(abs(places) < 1).all(axis=1)] == 2).all()
        np.testing.assert_array_equal(counts, rays.scene.count_intersections(origins, directions))
    inside = np.array([(0, 0, 0), (0.5, 0.5, 0.5), (0, 0.99, 0)])
    assert rays.contains_points(inside).all() and not rays.contains_points(inside + (2, 0, 0)).any()


def test_isosurfaces_have_the_hits_of_the_scene():
    surface = isospline.Isosurface(volumes.torus().volume(12), 0.0)
    rng = np.random.default_rng(1)
    origins, directions = rng.normal(size=(200, 3)) * 2, rng.normal(size=(200, 3))
    hits = isospline.Scene(surface).cast_rays(origins, directions)
    rays = RayMeshIntersector(surface)
    first = np.where(np.isfinite(hits.t_hit), hits.primitive_ids.astype(np.int64), -1)
    np.testing.assert_array_equal(rays.intersects_first(origins, directions), first)
    np.testing.assert_array_equal(rays.intersects_any(origins, directions), first >= 0)
    assert 5 <= (first >= 0).sum() < 200
