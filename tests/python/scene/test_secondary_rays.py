"""Rays that leave a surface: none hits the same surface again, and none passes through a thin wall.

ISOSPLINE_TEST_RAYS sets the number of rays of each test; 10^7 were tried.
"""

import os

import numpy as np
import pytest
import scipy.spatial

import isospline

COUNT = int(os.environ.get("ISOSPLINE_TEST_RAYS", 100_000))
BATCH = 500_000


def batches():
    return [min(BATCH, COUNT - begin) for begin in range(0, COUNT, BATCH)]


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def hemisphere(random, normals):
    """Directions about normals; a third of them graze the surface, down to an angle of 1e-12."""
    directions = unit(random.normal(size=normals.shape))
    directions *= np.where(dot(directions, normals) < 0, -1, 1)
    tangents = unit(directions - dot(directions, normals) * normals)
    grazing = tangents + 10 ** random.uniform(-12, 0, (len(normals), 1)) * normals
    return np.where(random.random((len(normals), 1)) < 1 / 3, unit(grazing), directions)


def hits_of(scene, rays):
    """The rays of a batch that hit, and their hits."""
    hits = scene.cast_rays(rays)
    found = np.isfinite(hits["t_hit"])
    return rays[found], {name: values[found] for name, values in hits.items()}


def rays_towards(random, center, radius, distance, count):
    targets = center + radius * random.uniform(-1, 1, (count, 3))
    origins = center + distance * unit(random.normal(size=(count, 3)))
    return np.hstack([origins, targets - origins])


def square_of_distance(size=24, degree=2, **options):
    """A volume with the model |x - centre|^2 in index space, except for the rounding of coefficients."""
    square = (np.arange(size) - (size - 1) / 2) ** 2 - (degree + 1) / 12
    data = square[:, None, None] + square[None, :, None] + square[None, None, :]
    return isospline.Volume(data, degree=degree, filter="none", **options)


@pytest.mark.sweep(3)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("origin, distance", [((0, 0, 0), 40), ((0, 0, 0), 1e6), ((1e4, -3e4, 2e4), 40)])
def test_rays_that_leave_a_sphere_do_not_meet_it(degree, origin, distance):
    random = np.random.default_rng(1)
    volume = square_of_distance(degree=degree, origin=origin)
    scene = isospline.Scene([isospline.Isosurface(volume, 64.0, inside="below")])
    naive_hits = 0
    for count in batches():
        center = np.asarray(origin) + 11.5
        rays, hits = hits_of(scene, rays_towards(random, center, 8, distance, count))
        normals = hits["primitive_normals"]
        outward = scene.secondary_rays(rays, hits, hemisphere(random, normals))
        assert not scene.test_occlusions(outward).any()
        inward = scene.secondary_rays(rays, hits, hemisphere(random, -normals))
        returning = scene.cast_rays(inward)
        assert np.isfinite(returning["t_hit"]).all()
        assert (dot(returning["primitive_normals"], inward[:, 3:]) > -1e-6).all()  # found from inside

        positions = rays[:, :3] + hits["t_hit"][:, None] * rays[:, 3:]
        naive_hits += scene.test_occlusions(np.hstack([positions, outward[:, 3:]])).sum()
        tolerance = 1e-10 + 1e-15 * distance + 2e-15 * np.abs(origin).max()
        moved = np.linalg.norm(outward[:, :3] - positions, axis=1)
        steep = np.abs(dot(unit(rays[:, 3:]), normals))[:, 0] > 0.1
        assert moved[steep].max() < tolerance
    assert naive_hits > COUNT / 1000  # without an offset, rays hit their own surface


def assert_hits_are_real(scene, volume, level, random, rays, hits):
    """Just beyond each reported hit of a ray that left the surface, the model is on the other side of the surface."""
    for side in (1, -1):
        directions = hemisphere(random, side * hits["primitive_normals"])
        secondary = scene.secondary_rays(rays, hits, directions)
        found = scene.cast_rays(secondary)
        met = found["t_hit"] < 1.0
        t = found["t_hit"][met, None]
        beyond = secondary[met, :3] + (t + 1e-3 * t + 1e-7) * secondary[met, 3:]
        # inside="above": outward is where f is below the level.
        there = side * (volume.sample(beyond) - level)
        before = side * (volume.sample(secondary[:, :3]) - level)
        assert (before < 0).all()
        # There, a ray that grazes the surface is still on it, to the rounding of double precision. A ray that dips into
        # the surface may be out again; the exit is then its next crossing.
        slope = np.linalg.norm(volume.sample(beyond, derivative=1), axis=1)
        dips = there <= -1e-12 * slope
        crossings = scene.list_intersections(secondary[met][dips])
        assert (np.diff(crossings["ray_splits"]) > 1).all()
        out_again = crossings["t_hit"][crossings["ray_splits"][:-1] + 1]
        assert (out_again < 1.002 * t[dips, 0] + 2e-7).all()
        assert met.sum() > len(rays) / 200


@pytest.mark.parametrize("degree", [2, 3])
def test_rays_that_leave_a_torus_have_no_false_hits(degree):
    random = np.random.default_rng(2)
    field = isospline.volumes.torus()
    data = field.values(32)
    volume = isospline.Volume(data, degree=degree)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    for count in batches():
        rays, hits = hits_of(scene, rays_towards(random, np.full(3, 15.5), 12, 60, count))
        assert_hits_are_real(scene, volume, field.level, random, rays, hits)


def test_rays_that_leave_bone_have_no_false_hits(volumes_folder):
    random = np.random.default_rng(3)
    volume = isospline.Volume(isospline.read_volume(volumes_folder / "mouse_skull.nrrd").data)
    scene = isospline.Scene([isospline.Isosurface(volume, 40)])
    center = np.array(volume.shape[::-1]) / 2
    for count in batches():
        rays, hits = hits_of(scene, rays_towards(random, center, center.min(), 400, count))
        assert_hits_are_real(scene, volume, 40, random, rays, hits)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_no_ray_gets_through_a_thin_wall(degree):
    random = np.random.default_rng(4)
    z, y, x = np.mgrid[-12:13, -12:13, -12:13].astype(float)
    distance = np.sqrt(x**2 + y**2 + z**2) - 8.0
    volume = isospline.Volume(np.exp(-(distance**2)), origin=(-12, -12, -12), degree=degree)
    surface = isospline.Isosurface(volume, 0.72 if degree > 1 else 0.6)
    scene = isospline.Scene([surface])
    across = np.stack([np.linspace(6, 10, 4001), *np.zeros((2, 4001))], axis=1)
    assert (volume.sample(across) > surface.level).mean() * 4 < 1.5  # voxels thick

    for count in (max(1, size // 10) for size in batches()):
        rays = np.hstack([np.zeros((count, 3)), unit(random.normal(size=(count, 3)))])
        for _ in range(10):
            hits = scene.cast_rays(rays)
            assert np.isfinite(hits["t_hit"]).all()
            positions = rays[:, :3] + hits["t_hit"][:, None] * rays[:, 3:]
            assert np.linalg.norm(positions, axis=1).max() < 8.0
            rays = scene.secondary_rays(rays, hits, hemisphere(random, hits["primitive_normals"]))


def icosphere(subdivisions):
    golden = (1 + 5**0.5) / 2
    vertices = unit(np.array([(0, i, j * golden) for i in (-1, 1) for j in (-1, 1)], float))
    vertices = np.concatenate([np.roll(vertices, shift, axis=1) for shift in range(3)])
    for _ in range(subdivisions):
        faces = scipy.spatial.ConvexHull(vertices).simplices
        edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])), axis=0)
        vertices = np.concatenate([vertices, unit(vertices[edges].mean(1))])
    faces = scipy.spatial.ConvexHull(vertices).simplices
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    flipped = dot(np.cross(b - a, c - a), a + b + c)[:, 0] < 0
    faces[flipped] = faces[flipped][:, ::-1]
    return vertices, faces


TRANSFORMS = {
    "plain": np.eye(4),
    "stretched and far": np.array([[3, 1, 0, 1e4], [0, 0.2, 0.1, -2e3], [0, 0.3, 1.5, 5e3], [0, 0, 0, 1.0]]),
    "mirrored": np.diag([-10.0, 10, 10, 1]),
}


@pytest.mark.parametrize("transform", TRANSFORMS.values(), ids=TRANSFORMS)
def test_rays_that_leave_a_convex_mesh_do_not_meet_it(transform):
    random = np.random.default_rng(5)
    vertices, faces = icosphere(3)
    scene = isospline.Scene()
    scene.add(isospline.Mesh(vertices, faces), transform)
    for count in batches():
        local = rays_towards(random, np.zeros(3), 1, 5, count)
        rays = np.hstack([local[:, :3] @ transform[:3, :3].T + transform[:3, 3], local[:, 3:] @ transform[:3, :3].T])
        rays, hits = hits_of(scene, rays)
        outward = scene.secondary_rays(rays, hits, hemisphere(random, hits["primitive_normals"]))
        assert not scene.test_occlusions(outward).any()
        inward = scene.secondary_rays(rays, hits, hemisphere(random, -hits["primitive_normals"]))
        assert scene.test_occlusions(inward).all()


BOXES = {
    "cube": (np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)),
    "tetrahedron": np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], float),
    "flat": np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-0.01, 0.01)], float),
}


@pytest.mark.parametrize("vertices", BOXES.values(), ids=BOXES)
def test_no_ray_leaves_a_closed_mesh(vertices):
    random = np.random.default_rng(6)
    scene = isospline.Scene([isospline.Mesh(vertices, scipy.spatial.ConvexHull(vertices).simplices)])
    for count in (max(1, size // 10) for size in batches()):
        rays = np.hstack([np.zeros((count, 3)), unit(random.normal(size=(count, 3)))])
        for _ in range(10):
            hits = scene.cast_rays(rays)
            assert np.isfinite(hits["t_hit"]).all()
            normals = hits["primitive_normals"] * -np.sign(dot(hits["primitive_normals"], rays[:, 3:]))
            rays = scene.secondary_rays(rays, hits, hemisphere(random, normals))


def test_where_the_gradient_vanishes_rays_leave_all_the_same():
    """f = x^3: its coefficients in a cubic model are k^3 - k, and all of the surface has a gradient of zero."""
    _, _, x = np.mgrid[-4:5, -4:5, -4:5].astype(float)
    volume = isospline.Volume(x**3 - x, origin=(-4, -4, -4), degree=3, filter="none")
    scene = isospline.Scene([isospline.Isosurface(volume, 0.0)])
    rays = np.array([(2.0, 0.3, 0.4, -1.0, y, 0.1) for y in np.linspace(-1, 1, 50)])
    hits = scene.cast_rays(rays)
    assert np.isfinite(hits["t_hit"]).all()
    for side in (1.0, -1.0):
        assert not scene.test_occlusions(scene.secondary_rays(rays, hits, np.full((50, 3), (side, 0.2, 0.1)))).any()


def test_bad_secondary_rays():
    vertices, faces = icosphere(0)
    scene = isospline.Scene([isospline.Mesh(vertices, faces)])
    rays = np.array([(0, 0, 5, 0, 0, -1.0)])
    hits = scene.cast_rays(rays)
    for bad_rays, bad_hits, directions, name in (
        (rays[:, :5], hits, [(0, 0, 1)], "rays"),
        (rays, hits, [(0, 0)], "directions"),
        (rays, hits, [(0, 0, 1), (0, 0, 1)], "directions"),
        (rays, hits, [(0, 0, 0)], "directions"),
        (rays, hits, [(0, 0, np.nan)], "directions"),
        (rays, {}, [(0, 0, 1)], "hits"),
        (rays, {**hits, "t_hit": np.zeros(2)}, [(0, 0, 1)], 'hits."t_hit".'),
        (rays, scene.cast_rays(rays + 9), [(0, 0, 1)], "hits"),
        (rays, {**hits, "geometry_ids": np.array([7])}, [(0, 0, 1)], "hit"),
        (rays, {**hits, "primitive_ids": np.array([700])}, [(0, 0, 1)], "hit"),
        (rays, {**hits, "primitive_ids": hits["primitive_ids"] + np.uint64(2**32)}, [(0, 0, 1)], "hit"),
    ):
        with pytest.raises(ValueError, match=f"^{name}: expected .* got "):
            scene.secondary_rays(bad_rays, bad_hits, directions)
