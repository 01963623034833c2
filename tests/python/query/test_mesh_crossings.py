"""Crossings of meshes against exact rational arithmetic, the same in all queries, at edges and vertices too.

The rule is in docs/method.md, "Triangles": a ray that meets an edge or a vertex, or runs in a face, counts as moved by
(e, e^2, e^3). The oracle moves it by e = 2^-200, and solves for the crossing in fractions.
"""

from fractions import Fraction

import numpy as np
import pytest
from hit_outputs import ALL_OUTPUTS

import isospline

trimesh = pytest.importorskip("trimesh")

E = Fraction(1, 2**200)


def icosphere():
    return trimesh.creation.icosphere(subdivisions=1)


MESHES = {
    "box": trimesh.creation.box,
    "subdivided box": lambda: trimesh.creation.box().subdivide(),
    "icosphere": icosphere,
    "torus": lambda: trimesh.creation.torus(0.6, 0.25, major_sections=8, minor_sections=6),
    "without area": lambda: trimesh.Trimesh(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.5, 0, 0), (0, 0, 1)],
        [(0, 1, 2), (0, 3, 1), (2, 1, 4), (4, 4, 0), (0, 4, 1)],
        process=False,
    ),
}


def fractions(vector):
    return [Fraction(float(value)) for value in vector]


def minus(a, b):
    return [p - q for p, q in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def exact_crossings(triangles, ray):
    """Sorted (t, face, entering) of a moved ray, by the equations of T. Moeller and B. Trumbore."""
    origin, direction = minus(fractions(ray[:3]), [-E, -E * E, -E * E * E]), fractions(ray[3:])
    found = []
    for face, (a, b, c) in enumerate(triangles):
        ab, ac = minus(b, a), minus(c, a)
        p = cross(direction, ac)
        determinant = dot(ab, p)
        if determinant == 0:
            continue
        s = minus(origin, a)
        q = cross(s, ab)
        u, v, t = dot(s, p) / determinant, dot(direction, q) / determinant, dot(ac, q) / determinant
        assert u != 0 and v != 0 and u + v != 1  # the moved ray meets no edge
        if u > 0 and v > 0 and u + v < 1 and t > 0:
            found.append((t, face, determinant > 0))
    return sorted(found)


def degenerate_rays(mesh, rng, count):
    """Rays from outside through vertices and through middles of edges and faces; along axes, edges and faces."""
    rays = np.empty((count, 6))
    for ray in rays:
        a, b, c = mesh.vertices[mesh.faces[rng.integers(len(mesh.faces))]]
        target = (a, (a + b) / 2, (a + b + c) / 3)[rng.integers(3)]
        directions = (
            np.eye(3)[rng.integers(3)],
            b - a,
            (b - a) + rng.integers(3) * (c - a),
            rng.normal(size=3),
            mesh.vertices[rng.integers(len(mesh.vertices))] - target,
        )
        direction = directions[rng.integers(len(directions))]
        direction = direction if direction.any() else np.array((1.0, 0, 0))
        ray[:3], ray[3:] = target - direction * 8 / max(np.linalg.norm(direction), 0.1), direction
    return rays


@pytest.mark.slow
@pytest.mark.parametrize("make", MESHES.values(), ids=MESHES)
def test_crossings_are_those_of_rational_arithmetic(make, rng):
    mesh = make()
    rays = degenerate_rays(mesh, rng, 45)
    triangles = [[fractions(vertex) for vertex in corners] for corners in mesh.vertices[mesh.faces]]
    expected = [exact_crossings(triangles, ray) for ray in rays]
    scene = isospline.Scene([isospline.Mesh(mesh.vertices, mesh.faces)])
    crossings = scene.list_intersections(rays)
    splits = crossings["ray_splits"]
    for row, exact in enumerate(expected):
        mine = slice(splits[row], splits[row + 1])
        assert crossings["primitive_ids"][mine].tolist() == [face for _, face, _ in exact]
        assert crossings["entering"][mine].tolist() == [entering for _, _, entering in exact]
        # Rays that graze a face magnify rounding.
        np.testing.assert_allclose(crossings["t_hit"][mine], [float(t) for t, _, _ in exact], rtol=1e-10)
    assert sum(len(exact) for exact in expected) > 25
    np.testing.assert_array_equal(scene.count_intersections(rays), np.diff(splits))
    for coherent in (False, True):
        np.testing.assert_array_equal(scene.test_occlusions(rays, coherent=coherent), np.diff(splits) > 0)
    hits = scene.cast_rays(rays)
    first = splits[:-1][np.diff(splits) > 0]
    for name in ("t_hit", "primitive_ids"):
        np.testing.assert_array_equal(hits[name][np.isfinite(hits["t_hit"])], crossings[name][first])


@pytest.mark.parametrize("angle", [0, 0.3])
@pytest.mark.parametrize("mirror", [1, -1])
def test_packets_and_single_rays_agree_at_silhouettes(angle, mirror):
    """Rays on a grid that meets the box's edges, exactly or nearly."""
    mesh = trimesh.creation.box().subdivide().subdivide()
    transform = trimesh.transformations.rotation_matrix(angle, (0.2, 1, 0.4)) @ np.diag([mirror, 1, 1, 1])
    scene = isospline.Scene()
    scene.add(isospline.Mesh(mesh.vertices, mesh.faces), transform)
    grid = np.linspace(-0.75, 0.75, 97)
    x, y = (plane.ravel() for plane in np.meshgrid(grid, grid))
    local = [
        np.stack([x, y, 0 * x + 3, 0 * x, 0 * x, 0 * x - 1], axis=1),
        np.stack([0 * x, 0 * x, 0 * x + 3, x, y, 0 * x - 2.5], axis=1),
        np.stack([x, 0 * x - 3, y, 0 * x, 0 * x + 1, x], axis=1),
    ]
    for rays in local:
        for given in (rays, np.hstack([rays[:, :3] @ transform[:3, :3].T, rays[:, 3:] @ transform[:3, :3].T])):
            single = scene.cast_rays(given, outputs=ALL_OUTPUTS)
            packets = scene.cast_rays(given.reshape(97, 97, 6), outputs=ALL_OUTPUTS, coherent=True)
            assert 0.1 < np.isfinite(single["t_hit"]).mean() < 0.9
            for name, values in single.items():
                np.testing.assert_array_equal(packets[name].reshape(values.shape), values, err_msg=name)
            for coherent in (False, True):
                occluded = scene.test_occlusions(given, coherent=coherent)
                np.testing.assert_array_equal(occluded, np.isfinite(single["t_hit"]))
            assert (scene.count_intersections(given) % 2 == 0).all()


def test_rays_in_the_plane_of_a_wall_enter_and_leave_or_miss():
    scene = isospline.Scene([isospline.Mesh.from_trimesh(trimesh.creation.box().subdivide())])
    steps = np.linspace(-0.5, 0.5, 9)
    for axis in range(3):
        for wall in (-0.5, 0.5):
            rays = np.zeros((9, 6))
            rays[:, axis], rays[:, 3 + axis] = -2, 1
            rays[:, (axis + 1) % 3], rays[:, (axis + 2) % 3] = wall, steps
            crossings = scene.list_intersections(rays)
            counts = np.diff(crossings["ray_splits"])
            assert set(counts) <= {0, 2}
            np.testing.assert_array_equal(crossings["entering"], np.tile([True, False], counts.sum() // 2))


def test_of_meshes_that_coincide_the_first_added_is_hit():
    mesh = isospline.Mesh.from_trimesh(trimesh.creation.box())
    scene = isospline.Scene([mesh, isospline.Mesh(mesh.vertices, mesh.faces[::-1]), mesh])
    rays = np.array([(x, y, 3, 0, 0, -1) for x in np.linspace(-0.4, 0.4, 9) for y in np.linspace(-0.4, 0.4, 9)])
    for coherent in (False, True):
        assert (scene.cast_rays(rays, coherent=coherent)["geometry_ids"] == 0).all()
