"""Rays with proven answers, against exact arithmetic.

ISOSPLINE_CERTIFIED_RAYS is the number of adversarial rays of each degree; placed volumes get a tenth as many.
"""

import itertools
import os
import pickle
from fractions import Fraction

import numpy as np
import pytest

pytest.importorskip("flint")
from exact_rays import HIT, MISS, UNDECIDED, Case

import isospline
from isospline import volumes

COUNT = int(os.environ.get("ISOSPLINE_CERTIFIED_RAYS", "1000"))
NAMES = ["statuses", "t_bounds", "level_bounds", "normal_axes", "normal_angles", "model_distances"]


def said_of(hits, i):
    return int(hits.statuses[i]), hits.t_bounds[i].tolist(), float(hits.level_bounds[i])


@pytest.mark.filterwarnings("ignore:level .* has an empty shell")  # pruned: the model may still touch its level
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_what_is_proven_is_true(degree):
    rng = np.random.default_rng(degree)
    counts = np.zeros(3, dtype=int)
    rays_of_case = 50
    for _ in range(COUNT // rays_of_case):
        case = Case(rng, degree)
        rays = case.rays(rng, rays_of_case)
        t_near = float(rng.choice([0, 0, -4, 0.25]))
        t_far = float(rng.choice([np.inf, np.inf, np.inf, 1.25]))
        hits = case.scene.cast_rays(rays, certify=True, t_near=t_near, t_far=t_far)
        for i, ray in enumerate(rays.tolist()):
            assert case.holds(ray, *said_of(hits, i), t_near, t_far), (case.level, ray, hits.t_bounds[i])
        counts += np.bincount(hits.statuses, minlength=3)
    print(f"degree {degree}: {counts[MISS]} misses, {counts[HIT]} hits, {counts[UNDECIDED]} undecided")
    assert min(counts[MISS], counts[HIT]) > 0.15 * COUNT and 0 < counts[UNDECIDED] < 0.1 * COUNT


@pytest.mark.sweep(3)
@pytest.mark.filterwarnings("ignore:level .* has an empty shell")
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("kind", ["placed", "sparse"])
def test_what_is_proven_of_other_volumes_is_true(kind, degree):
    rng = np.random.default_rng(40 + degree)
    counts = np.zeros(3, dtype=int)
    for _ in range(COUNT // 250):
        case = Case(rng, degree, **{kind: True})
        rays = case.rays(rng, 25)
        far = rng.random(25) < 0.3
        rays[far, :3] -= 1e5 * rays[far, 3:]
        hits = case.scene.cast_rays(rays, certify=True)
        for i, ray in enumerate(rays.tolist()):
            assert case.holds(ray, *said_of(hits, i), 0, np.inf), (case.level, ray, hits.t_bounds[i])
        counts += np.bincount(hits.statuses, minlength=3)
    assert min(counts[:2]) > 0.08 * counts.sum() and counts[UNDECIDED] < 0.1 * counts.sum()


def test_the_oracle_finds_what_is_wrong():
    rng = np.random.default_rng(0)
    case = Case(rng, 2)
    rays = case.rays(rng, 150)
    hits = case.scene.cast_rays(rays, certify=True)
    found = {"early": 0, "late": 0, "miss": 0, "hit": 0, "doubt": 0}
    for ray, status, (lower, upper) in zip(rays.tolist(), hits.statuses, hits.t_bounds.tolist(), strict=True):
        if status == HIT:
            width = 1e-9 + 2 * (upper - lower)
            found["early"] += not case.holds(ray, HIT, (max(lower - width, 0), lower), 0, 0, np.inf)
            found["late"] += not case.holds(ray, HIT, (upper + width, upper + 2 * width), 0, 0, np.inf)
            found["miss"] += not case.holds(ray, MISS, (np.inf, np.inf), 0, 0, np.inf)
        elif status == MISS:
            found["hit"] += not case.holds(ray, HIT, (0, 1e9), 0, 0, np.inf)
            found["doubt"] += not case.holds(ray, UNDECIDED, (0, np.inf), 1e-9, 0, np.inf)
    count = (hits.statuses == HIT).sum()
    misses = (hits.statuses == MISS).sum()
    assert found == {"early": count, "late": count, "miss": count, "hit": misses, "doubt": misses}


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_ordinary_rays_are_decided_as_rays_without_proof_are(degree):
    field = volumes.gyroid()
    volume = field.volume(48, degree=degree)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    rays = isospline.camera_for(scene).rays((80, 60))
    hits = scene.cast_rays(rays, certify=True)
    assert {*np.unique(hits.statuses)} == {MISS, HIT}
    assert np.array_equal(hits.statuses == HIT, np.isfinite(hits.t_hit))
    is_hit = hits.statuses == HIT
    lower, upper = hits.t_bounds[is_hit].T
    assert (lower <= hits.t_hit[is_hit]).all() and (hits.t_hit[is_hit] <= upper).all()
    assert np.median(upper - lower) < 1e-11 and (upper - lower).max() < 1e-6
    for coherent in (False, True):
        assert scene.cast_rays(rays, certify=True, coherent=coherent) == hits


@pytest.mark.filterwarnings("ignore:level .* has an empty shell")
def test_the_level_of_a_plateau_is_not_decided():
    samples = np.zeros((6, 6, 6))
    samples[3:] = 1
    scene = isospline.Scene([isospline.Isosurface(isospline.Volume(samples, degree=1), 0)])
    rays = [(2.5, 2.5, 8, 0, 0, -1), (2.5, 2.5, -8, 0, 0, 1), (2.5, 2.5, 6, 0, 1, 0), (2.5, -1, 2, 0, 1, 0)]
    hits = scene.cast_rays(rays, certify=True)
    assert hits.statuses.tolist() == [UNDECIDED, UNDECIDED, MISS, UNDECIDED]
    assert hits.t_bounds[0, 0] == pytest.approx(6, abs=1e-9) and hits.t_bounds[1, 0] == 8


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_normals_are_in_their_cones(degree):
    field = volumes.gyroid()
    linear = np.array([[1, 0.3, 0], [0, 0.7, 0.2], [0.1, 0, 1.5]])
    transform = np.eye(4)
    transform[:3, :3] = linear
    surface = isospline.Isosurface(field.volume(24, degree=degree), field.level, inside="below")
    scene = isospline.Scene([(surface, transform)])
    rays = isospline.camera_for(scene).rays((60, 40)).reshape(-1, 6)
    hits = scene.cast_rays(rays, certify=True).select(slice(None))
    is_hit = hits.statuses == HIT
    cosines = np.einsum("ij,ij->i", hits.primitive_normals, hits.normal_axes)[is_hit]
    angles = hits.normal_angles[is_hit]
    away = np.linalg.norm(hits.primitive_normals - hits.normal_axes, axis=1)[is_hit]  # as long as a small angle
    assert is_hit.sum() > 500 and (cosines > 0).all() and (away <= angles + 1e-14).all()
    assert np.median(angles) < 1e-8 and (degree == 1 or angles.max() < 1e-4)
    others = ~is_hit
    assert (hits.normal_axes[others] == 0).all() and np.isnan(hits.normal_angles[others]).all()
    # The exact gradient on the interval of t is in the cone.
    for i in np.flatnonzero(is_hit)[::200]:
        certificate = scene.certificate(rays[i])
        box = np.array(certificate["hit"]["gradient"])
        for corner in itertools.product(*box):
            direction = np.array(corner) / np.linalg.norm(corner)
            assert np.linalg.norm(direction - hits.normal_axes[i]) <= hits.normal_angles[i] + 1e-15


@pytest.mark.parametrize(
    ("degree", "options"),
    [(1, {}), (2, {}), (3, {}), (2, {"boundary": "periodic"}), (3, {"filter": "smoothing", "smoothing": 0.7})],
)
def test_the_surface_of_unrounded_coefficients_is_near(degree, options):
    ndimage = pytest.importorskip("scipy.ndimage")
    rng = np.random.default_rng(degree)
    z, y, x = np.mgrid[-1:1:20j, -1:1:21j, -1:1:22j]
    samples = np.sqrt(x**2 + y**2 + z**2) + 0.03 * rng.normal(size=x.shape)
    volume = isospline.Volume(samples, degree=degree, **options)
    exact = volume.coefficients
    if "filter" not in options and degree > 1:
        mode = "grid-wrap" if options else "mirror"
        exact = ndimage.spline_filter(samples, degree, output=np.float64, mode=mode)
    elif degree == 1:
        exact = samples
    # What is rounded differs in each coefficient; the stored model's error is below the bound that is used.
    assert np.abs(exact - volume.coefficients).max() < 1e-6
    scene = isospline.Scene(isospline.Isosurface(volume, 0.7))
    rays = isospline.camera_for(scene).rays((48, 36))
    hits = scene.cast_rays(rays, certify=True, outputs=("positions",))
    hits = hits.select(hits.statuses == HIT)
    distances = hits.model_distances
    assert len(distances) > 300 and np.isfinite(distances).all() and (distances > 0).all()
    assert np.median(distances) < 1e-4  # of a voxel; the bound of the coefficients is a worst case
    if "filter" in options:
        return
    mode = {"mirror": "mirror", "periodic": "grid-wrap"}[volume.boundary]

    def value(points):
        return ndimage.map_coordinates(exact, points[:, ::-1].T, order=degree, mode=mode, prefilter=False)

    steps = (distances + 1e-12)[:, None] * hits.normal_axes
    sides = [np.sign(value(hits.positions + way * steps) - 0.7) for way in (-1, 1)]
    assert (sides[0] * sides[1] < 0).all()


def test_the_first_of_several_surfaces():
    field = volumes.sphere()
    surface = isospline.Isosurface(field.volume(32), field.level)
    moved = np.eye(4)
    moved[:3, 3] = 0, 3, 0
    scene = isospline.Scene([(surface, moved), surface])
    ray = (0.05, -3, 0.1, 0, 1, 0)
    alone = isospline.Scene(surface).cast_rays(ray, certify=True)
    hits = scene.cast_rays([ray, (0.05, 6, 0.1, 0, -1, 0), (5, -3, 0, 0, 1, 0)], certify=True)
    assert hits.statuses.tolist() == [HIT, HIT, MISS] and np.array_equal(hits.t_bounds[0], alone.t_bounds)
    assert hits.t_bounds[1, 0] <= hits.t_hit[1] <= hits.t_bounds[1, 1]
    scene.set_visibility(1, visible=False)
    assert scene.cast_rays(ray, certify=True).t_bounds[0] == pytest.approx(alone.t_bounds[0] + 3)
    empty = isospline.Scene().cast_rays(ray, certify=True)
    assert empty.statuses == MISS and (empty.t_bounds == np.inf).all()


def test_one_normal_is_not_given_for_two_surfaces():
    """Three surfaces whose intervals of t overlap: the first crossing may be of a surface of another normal."""
    z, y, x = np.mgrid[:17, :17, :17].astype(float)
    k, h = z - 8, 1.46e-4
    cubic = isospline.Isosurface(isospline.Volume(k**3 - k, degree=3, filter="none"), 0.0)  # (z - 8)^3
    flat = isospline.Isosurface(isospline.Volume(k, degree=1), 1.15 * h)
    tilted = isospline.Isosurface(isospline.Volume(k + x - 8, degree=1), h)
    hits = isospline.Scene([cubic, flat, tilted]).cast_rays([(8, 8, -2, 0, 0, 1)], certify=True)
    assert hits.statuses == HIT and (hits.normal_axes == 0).all()
    assert hits.normal_angles == pytest.approx(np.pi) and hits.model_distances == np.inf


def test_bounds_hold_where_numbers_underflow():
    z, y, x = np.mgrid[:24, :24, :24].astype(float)
    samples = (z - 11.3 + 0.3 * np.sin(y / 3) + 0.2 * np.cos(x)) * 5e-32
    found = []
    for factor in (1.0, 2.0**60):  # an exact scaling: the unrounded surface is the same
        volume = isospline.Volume(samples * factor, filter="smoothing", smoothing=3e4)
        scene = isospline.Scene(isospline.Isosurface(volume, 0.0))
        found.append(scene.cast_rays([(3.3, 5.2, -1, 0, 0, 1)], certify=True))
    apart = abs(found[0].t_bounds[0, 0] - found[1].t_bounds[0, 0])
    assert apart > 1e-3 and found[0].model_distances + found[1].model_distances > apart


def test_volumes_of_stores(tmp_path):
    pytest.importorskip("zarr")
    field, shape = volumes.gyroid(), (40, 40, 40)
    isospline.convert(field.values(shape), tmp_path / "gyroid.zarr", **field.grid(shape))
    opened, volume = isospline.open_volume(tmp_path / "gyroid.zarr"), field.volume(shape)
    one, other = (isospline.Scene([isospline.Isosurface(each, field.level)]) for each in (opened, volume))
    rays = isospline.camera_for(other).rays((24, 18))
    found, expected = (scene.cast_rays(rays, certify=True) for scene in (one, other))
    further = found.model_distances / expected.model_distances  # parts of a store are filtered apart
    assert np.nanmin(further) >= 1 and np.nanmax(further) < 1.1
    names = ["t_hit", "primitive_normals", *NAMES[:-1]]
    assert all(np.array_equal(found[name], expected[name], equal_nan=True) for name in names)
    assert (expected.statuses == HIT).sum() > 50


def test_outputs_and_types():
    field = volumes.sphere()
    scene = isospline.Scene([isospline.Isosurface(field.volume(16), field.level)])
    rays = np.zeros((2, 3, 6), dtype=np.float32)
    rays[..., 4], rays[..., 1] = 1, -3
    hits = scene.cast_rays(rays, certify=True, outputs=("t_hit",))
    assert list(hits) == ["t_hit", *NAMES] and hits.t_hit.dtype == np.float32
    assert hits.statuses.dtype == np.uint8 and hits.statuses.shape == (2, 3)
    assert hits.t_bounds.dtype == np.float64 and hits.t_bounds.shape == (2, 3, 2)
    with pytest.raises(AttributeError, match=r"^statuses: expected certify=True for it"):
        _ = scene.cast_rays(rays).statuses
    none = scene.cast_rays(np.zeros((0, 6)), certify=True)
    assert none.t_bounds.shape == (0, 2)


@pytest.mark.parametrize(
    "options, got",
    [
        ({"clip": isospline.HalfSpace((0, 0, 0), (1, 0, 0))}, "one with a clip"),
        ({"closed": True}, "a closed one"),
        ({"largest": 1}, "one with largest="),
        ({"mask": np.ones((16, 16, 16), dtype=bool)}, "one with a mask"),
    ],
)
def test_surfaces_that_cannot_be_certified(options, got):
    field = volumes.sphere()
    scene = isospline.Scene([isospline.Isosurface(field.volume(16), field.level, **options)])
    with pytest.raises(ValueError, match="^certify: expected isosurfaces that are neither clipped, closed nor masked"):
        scene.cast_rays([(0, -3, 0, 0, 1, 0)], certify=True)


def test_meshes_cannot_be_certified():
    mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    scene = isospline.Scene([mesh])
    with pytest.raises(ValueError, match="^certify: expected a scene of isosurfaces"):
        scene.cast_rays([(0, 0, -3, 0, 0, 1)], certify=True)
    scene.set_visibility(0, visible=False)
    assert scene.cast_rays([(0, 0, -3, 0, 0, 1)], certify=True).statuses.tolist() == [MISS]


@pytest.mark.filterwarnings("ignore:level .* has an empty shell")
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_what_is_proven_of_occlusions_is_true(degree):
    rng = np.random.default_rng(10 + degree)
    counts = np.zeros(3, dtype=int)
    for _ in range(6):
        case = Case(rng, degree)
        rays = case.rays(rng, 50)
        found = case.scene.test_occlusions(rays, certify=True, t_far=2.5)
        statuses = case.scene.cast_rays(rays, certify=True, t_far=2.5).statuses
        assert found.dtype == np.uint8 and ((found == statuses) | (statuses == UNDECIDED)).all()
        for ray, code in zip(rays.tolist(), found, strict=True):
            if code != UNDECIDED:
                assert case.exact.touches(*case.lattice_ray(ray), 0, 2.5) == bool(code)
        counts += np.bincount(found, minlength=3)
    assert min(counts[:2]) > 30


def test_a_crossing_behind_a_doubt_is_an_occlusion():
    samples = np.zeros((3, 3, 8))
    samples[..., ::2] = [[[2, 0, 3, 1]]]  # 2 0 0 0 3 0 1 0 along x
    samples[..., 1::2] = [[[1, 1, -2, 1]]]  # 2 1 0 1 3 -2 1 1: touches 0 at x = 2, and crosses it later
    surface = isospline.Isosurface(isospline.Volume(samples, degree=1), 0)
    scene = isospline.Scene(surface)
    ray = (0.5, 1, 1, 1, 0, 0)
    assert scene.cast_rays([ray], certify=True).statuses.tolist() == [UNDECIDED]
    assert scene.test_occlusions([ray], certify=True).tolist() == [HIT]
    assert scene.test_occlusions([ray], certify=True, t_far=2).tolist() == [UNDECIDED]
    assert scene.test_occlusions([ray], certify=True, t_far=1).tolist() == [MISS]
    scene.set_visibility(0, casts_shadow=False)
    assert scene.test_occlusions([ray], certify=True).tolist() == [MISS]


@pytest.mark.filterwarnings("ignore:level .* has an empty shell")
@pytest.mark.parametrize("inside", ["above", "below"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_what_is_proven_of_points_is_true(degree, inside):
    rng = np.random.default_rng(20 + degree)
    counts = np.zeros(3, dtype=int)
    for _ in range(4):
        case = Case(rng, degree)
        surface = isospline.Isosurface(case.volume, case.level, inside=inside)
        points = rng.integers(-2, 2 * case.size + 2, (100, 3)) / 2
        near = rng.random(100) < 0.3
        points[near] += rng.choice([-1, 1], (near.sum(), 3)) * 2.0 ** -rng.integers(20, 60, (near.sum(), 1))
        found = surface.contains(points, certify=True)
        assert found.dtype == np.uint8
        for point, code in zip(points.tolist(), found, strict=True):
            lattice = [Fraction(x) + case.shift for x in point]
            value = case.exact.value(lattice) * (1 if inside == "above" else -1)
            is_in_domain = all(0 <= x <= n for x, n in zip(lattice, case.exact.shape, strict=True))
            if code == UNDECIDED:
                edges = [abs(x - edge) for x, n in zip(lattice, case.exact.shape, strict=True) for edge in (0, n)]
                assert abs(value) < 1e-11 or min(edges) < 1e-11
            else:
                assert (value > 0 and is_in_domain) == bool(code)
        decided = found != UNDECIDED
        assert np.array_equal(surface.contains(points[decided]), found[decided] == 1)
        counts += np.bincount(found, minlength=3)
    assert min(counts[:2]) > 20
    with pytest.raises(ValueError, match="^certify: expected isosurfaces that are neither clipped"):
        isospline.Isosurface(case.volume, case.level, inside=inside, closed=True).contains(points, certify=True)


@pytest.mark.parametrize("integrator", [None, isospline.PathTracer()], ids=["shading", "path tracer"])
def test_the_layer_of_a_picture(integrator, tmp_path):
    field = volumes.gyroid()
    scene = isospline.Scene([isospline.Isosurface(field.volume(24), field.level)])
    camera, size = isospline.camera_for(scene, size=(32, 24)), (32, 24)
    options = {"size": size, "samples": 2, "light": integrator}
    image = isospline.render(scene, camera, layers=("certified", "geometry_ids"), **options)
    rays = camera.rays(size)
    assert image.certified.dtype == np.uint32 and image.layers == ("geometry_ids", "certified")
    np.testing.assert_array_equal(image.certified, scene.cast_rays(rays, certify=True).statuses)
    np.testing.assert_array_equal(image.certified == HIT, image.geometry_ids == 0)
    np.testing.assert_array_equal(image.color, isospline.render(scene, camera, **options).color)
    crop = isospline.render(scene, camera, layers=("certified",), crop=(3, 5, 20, 10), **options)
    np.testing.assert_array_equal(crop.certified, image.certified[5:15, 3:23])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(image)).certified, image.certified)
    path = tmp_path / "image.exr"
    image.write(path)
    OpenEXR = pytest.importorskip("OpenEXR")
    with OpenEXR.File(str(path), separate_channels=True) as file:
        np.testing.assert_array_equal(file.channels()["certified"].pixels, image.certified)

    scene.add(isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))
    with pytest.raises(ValueError, match="^layers: expected a scene of isosurfaces"):
        isospline.render(scene, camera, layers=("certified",), **options)


@pytest.mark.filterwarnings("ignore:level .* has an empty shell")
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_what_is_proven_of_numbers_is_true(degree):
    rng = np.random.default_rng(30 + degree)
    counts = np.zeros(3, dtype=int)
    for _ in range(6):
        case = Case(rng, degree)
        rays = case.rays(rng, 50)
        found = case.scene.count_intersections(rays, certify=True, t_far=0.75)
        for ray, code in zip(rays.tolist(), found, strict=True):
            signs = case.exact.signs_at_ends(*case.lattice_ray(ray), 0, 0.75)
            assert code == UNDECIDED or code == (len(signs) == 2 and signs[0] * signs[1] < 0)
        decided = found != UNDECIDED
        plain = case.scene.count_intersections(rays[decided], t_far=0.75)
        assert np.array_equal(plain % 2, found[decided])
        counts += np.bincount(found, minlength=3)
    assert min(counts[:2]) > 15 and counts[UNDECIDED] < 60


def test_numbers_of_crossings_with_several_surfaces():
    field = volumes.sphere()
    volume = field.volume(32)
    inner, outer = (isospline.Isosurface(volume, field.level + step) for step in (0.2, 0))
    ray = (0.05, 0.1, 0.1, 0, 1, 0)  # from the inside of both
    for surfaces, code in (([inner], 1), ([inner, outer], 0), ([], 0)):
        assert isospline.Scene(surfaces).count_intersections([ray], certify=True).tolist() == [code]
