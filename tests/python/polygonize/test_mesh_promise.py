"""The promise of `to_mesh(tolerance)` for closed, cut and oblique solids, and at levels equal to samples.

Distances of the surface from the mesh are trimesh's. That the surface is near a point of the mesh follows from signs of
SciPy's spline in a ball around the point.
"""

import warnings

import numpy as np
import pytest

import isospline

trimesh = pytest.importorskip("trimesh")
ndimage = pytest.importorskip("scipy.ndimage")


def made(surface, tolerance):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return surface.to_mesh(tolerance, return_report=True)


def check_promise(surface, mesh, report, count=1500):
    """Both directions, against the reported numbers."""
    limit = report["distance"] * (1 + 1e-9) + 1e-9
    points = surface.sample_points(count, seed=0)["points"]
    near = isospline.Scene([mesh]).closest_points(points)["distances"]
    worst = np.argsort(near)[-10:]
    with np.errstate(invalid="ignore"):  # old versions divide by the length of an edge that may be zero
        far = trimesh.proximity.closest_point(mesh.to_trimesh(), points[worst])[1]
    largest_left_out = report["left_out"]["distances"].max(initial=0.0) * (1 + 1e-9)
    assert far.max() <= max(limit, largest_left_out)
    on_mesh, _ = trimesh.sample.sample_surface(mesh.to_trimesh(), count, seed=1)
    found = surface.closest_points(on_mesh, tolerance=1e-3 * report["distance"])
    low = found["distances"] - found["error_bounds"]
    assert low.max() <= limit
    return on_mesh[np.argsort(low)[-5:]]


def random_case(seed):
    """A surface of random samples and a tolerance."""
    rng = np.random.default_rng(seed)
    kind, size = ["noise", "integers", "smooth"][seed % 3], rng.integers(6, 11, 3)
    if kind == "noise":
        samples, level = rng.random(size), 0.8
    elif kind == "integers":
        samples, level = rng.integers(0, 5, size).astype(float), float(rng.integers(1, 4))
    else:
        samples, level = ndimage.gaussian_filter(rng.normal(size=size), 1.0), 0.05
    oblique = np.eye(3) + 0.3 * rng.normal(size=(3, 3))
    spacing = np.linalg.norm(oblique, axis=0)
    volume = isospline.Volume(
        samples, degree=1 + seed // 3 % 3, spacing=spacing, direction=oblique / spacing, origin=10 * rng.normal(size=3)
    )
    options = {"inside": "below"} if rng.random() < 0.3 else {}
    if seed % 4 in (1, 3):
        options["clip"] = isospline.HalfSpace(np.mean(volume.bounds, axis=0), rng.normal(size=3))
        options["capped"] = bool(rng.random() < 0.7)
    if seed % 4 in (2, 3):
        options["closed"] = True
    return isospline.Isosurface(volume, level, **options), float(rng.choice([0.3, 0.6, 1.0])), kind


@pytest.mark.sweep(3)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(18))
def test_solids_are_within_the_tolerance(seed):
    surface, tolerance, kind = random_case(seed)
    mesh, report = made(surface, tolerance)
    check_promise(surface, mesh, report)
    assert report["distance"] <= tolerance
    assert len(report["left_out"]["positions"]) == 0
    if kind != "integers":  # where the solid is infinitely thin, faces coincide
        assert report["self_intersections"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_surface_is_in_balls_around_points_of_the_mesh(degree):
    rng = np.random.default_rng(degree)
    volume = isospline.Volume(ndimage.gaussian_filter(rng.normal(size=(10, 10, 10)), 0.6), degree=degree)
    surface = isospline.Isosurface(volume, 0.1)
    mesh, report = made(surface, 0.4)
    assert report["distance"] <= 0.4
    coefficients = np.asarray(volume.coefficients, float)
    lower, upper = volume.bounds
    for center in check_promise(surface, mesh, report):
        ball = rng.normal(size=(40000, 3))
        ball *= (
            1.02 * report["distance"] * rng.random((len(ball), 1)) ** (1 / 3) / np.linalg.norm(ball, axis=1)[:, None]
        )
        ball += center
        ball = ball[((ball >= lower) & (ball <= upper)).all(axis=1)]
        values = ndimage.map_coordinates(coefficients, ball[:, ::-1].T, order=degree, mode="mirror", prefilter=False)
        assert values.min() < surface.level < values.max()


def gyroid_of_many_blocks():
    x, y, z = np.meshgrid(0.4 * np.arange(72), 0.4 * np.arange(12), 0.4 * np.arange(12), indexing="ij")
    values = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    noise = np.random.default_rng(2).normal(scale=0.1, size=values.shape)
    return isospline.Isosurface(isospline.Volume(values + noise), 0.2), 0.4, "noise"


@pytest.mark.parametrize("case", [lambda: random_case(5), gyroid_of_many_blocks])
def test_meshes_do_not_depend_on_threads(case):
    surface, tolerance, _ = case()
    threads = isospline.thread_count()
    meshes = []
    try:
        for count in (1, 3):
            isospline.set_thread_count(count)
            meshes.append(made(surface, tolerance))
    finally:
        isospline.set_thread_count(threads)
    (one, of_one), (other, of_other) = meshes
    np.testing.assert_array_equal(one.vertices, other.vertices)
    np.testing.assert_array_equal(one.faces, other.faces)
    assert of_one["distance"] == of_other["distance"]
