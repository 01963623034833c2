"""Rays with proven answers, against exact arithmetic.

ISOSPLINE_CERTIFIED_RAYS is the number of adversarial rays of each degree; placed volumes get a tenth as many.
"""

import os
import pickle
from fractions import Fraction

import numpy as np
import pytest
from exact_rays import ExactModel

import isospline
from isospline import volumes

COUNT = int(os.environ.get("ISOSPLINE_CERTIFIED_RAYS", "1500"))
MISS, HIT, UNDECIDED = range(3)
#: Above the bound of docs/method.md for rays and volumes of this size, relative to the range of the coefficients.
BAND = 1e-11
#: Maps with exact inverses, whose numbers binary fractions represent.
MAPS = [np.eye(4), np.diag([2.0, 0.5, 4.0, 1.0]), [[1, 1, 0, 3], [0, 1, 0, -2.5], [0, 0, 2, 1], [0, 0, 0, 1]]]


def solved(matrix, right):
    """The exact solution of three linear equations, by Cramer's rule."""
    columns, right = list(zip(*(row[:3] for row in matrix[:3]), strict=True)), tuple(right)

    def determinant(a, b, c):
        crossed = (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0])
        return sum(x * y for x, y in zip(a, crossed, strict=True))

    replaced = ([right if i == axis else column for i, column in enumerate(columns)] for axis in range(3))
    return [determinant(*each) / determinant(*columns) for each in replaced]


class Case:
    """A small model of integer coefficients, at an integer level, in a scene; and the same in exact arithmetic."""

    def __init__(self, rng, degree, placed=False):
        size = int(rng.integers(3, 6))
        samples = rng.integers(-3, 4, (size, size, size)).astype(float)
        if rng.random() < 0.6:  # rough samples leave little of a surface at higher degrees
            samples = np.sort(samples, axis=rng.integers(3))
        samples[0, 0, :2] = -3, 3  # so that levels are in the range
        grid = {}
        if placed:  # in any way, so that maps and their inverses are rounded
            direction, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            grid = {"spacing": rng.uniform(0.1, 3, 3), "origin": rng.normal(size=3), "direction": direction}
        self.volume = isospline.Volume(samples, degree=degree, filter="none", **grid)
        self.level = int(rng.choice([-1, 0, 0, 1]))
        self.transform = np.array(MAPS[rng.integers(len(MAPS))], dtype=float)
        if placed:
            self.transform[:3] += rng.normal(size=(3, 4))
        self.to_rays = [[Fraction(x) for x in row] for row in self.transform.tolist()]
        if placed:
            affine = [[Fraction(x) for x in row] for row in self.volume.affine.tolist()]
            self.to_rays = [
                [sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*affine, strict=True)]
                for row in self.to_rays
            ]
        self.scene = isospline.Scene([(isospline.Isosurface(self.volume, self.level), self.transform)])
        self.size = size
        self.exact = ExactModel(np.pad(samples.astype(int), degree // 2, mode="reflect") - self.level, degree)
        self.shift = Fraction(1, 2) if degree == 2 else Fraction(0)

    def rays(self, rng, count):
        """Through vertices, edges and faces of cells and middles of them, along faces and edges, grazing, or any."""
        grid = rng.integers(-2, 2 * self.size + 2, (2, count, 3)) / 2
        origins, directions = grid[0], grid[1] - grid[0]
        along_axes = rng.random(count) < 0.3
        directions[along_axes] *= np.eye(3)[rng.integers(3, size=along_axes.sum())]
        near = rng.random(count) < 0.2  # next to all these
        origins[near] += rng.choice([-1, 1], (near.sum(), 3)) * 2.0 ** -rng.integers(20, 55, (near.sum(), 1))
        any_way = rng.random(count) < 0.2
        directions[any_way] = rng.normal(size=(any_way.sum(), 3))
        directions[(directions == 0).all(axis=1)] = 1, 0, 0
        rays = np.concatenate([origins, directions], axis=1)
        if rng.random() < 0.5:
            rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
        rounded = np.array(self.to_rays, dtype=float)
        linear = rounded[:3, :3]
        return np.concatenate([rays[:, :3] @ linear.T + rounded[:3, 3], rays[:, 3:] @ linear.T], axis=1)

    def lattice_ray(self, ray):
        """The exact origin and direction in lattice space."""
        from_origin = [Fraction(x) - row[3] for x, row in zip(ray[:3], self.to_rays, strict=False)]
        origin, direction = (solved(self.to_rays, each) for each in (from_origin, map(Fraction, ray[3:])))
        return [x + self.shift for x in origin], direction

    def holds(self, ray, status, t_bounds, t_near, t_far):
        """Whether what is said of a ray is true."""
        line = self.lattice_ray(ray)
        lower, upper = t_bounds
        if status == MISS:
            return lower == upper == np.inf and not self.exact.touches(*line, t_near, t_far)
        before = np.nextafter(lower, -np.inf)
        if before >= t_near and self.exact.touches(*line, t_near, before):
            return False
        if status == HIT:
            return t_near <= lower <= upper <= t_far and self.exact.touches(*line, lower, upper)
        return upper == np.inf and self.exact.nearly_touches(*line, lower, BAND * 8)


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
        for ray, status, t_bounds in zip(rays, hits.statuses, hits.t_bounds, strict=True):
            assert case.holds(ray.tolist(), status, t_bounds.tolist(), t_near, t_far), (case.level, ray, t_bounds)
        counts += np.bincount(hits.statuses, minlength=3)
    print(f"degree {degree}: {counts[MISS]} misses, {counts[HIT]} hits, {counts[UNDECIDED]} undecided")
    assert min(counts[MISS], counts[HIT]) > 0.15 * COUNT and 0 < counts[UNDECIDED] < 0.1 * COUNT


@pytest.mark.filterwarnings("ignore:level .* has an empty shell")
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_what_is_proven_of_placed_volumes_is_true(degree):
    rng = np.random.default_rng(40 + degree)
    counts = np.zeros(3, dtype=int)
    for _ in range(COUNT // 250):
        case = Case(rng, degree, placed=True)
        rays = case.rays(rng, 25)
        far = rng.random(25) < 0.3
        rays[far, :3] -= 1e5 * rays[far, 3:]
        hits = case.scene.cast_rays(rays, certify=True)
        for ray, status, t_bounds in zip(rays.tolist(), hits.statuses, hits.t_bounds.tolist(), strict=True):
            if status == UNDECIDED:  # e grows with the distance
                before = np.nextafter(t_bounds[0], -np.inf)
                assert before < 0 or not case.exact.touches(*case.lattice_ray(ray), 0, before)
            else:
                assert case.holds(ray, status, t_bounds, 0, np.inf), (case.level, ray, t_bounds)
        counts += np.bincount(hits.statuses, minlength=3)
    assert min(counts[:2]) > 0.08 * counts.sum() and counts[UNDECIDED] < 0.1 * counts.sum()


def test_the_oracle_finds_what_is_wrong():
    rng = np.random.default_rng(0)
    case = Case(rng, 2)
    rays = case.rays(rng, 400)
    hits = case.scene.cast_rays(rays, certify=True)
    found = {"early": 0, "late": 0, "miss": 0, "hit": 0}
    for ray, status, (lower, upper) in zip(rays.tolist(), hits.statuses, hits.t_bounds.tolist(), strict=True):
        if status == HIT:
            width = 1e-9 + 2 * (upper - lower)
            found["early"] += not case.holds(ray, HIT, (max(lower - width, 0), lower), 0, np.inf)
            found["late"] += not case.holds(ray, HIT, (upper + width, upper + 2 * width), 0, np.inf)
            found["miss"] += not case.holds(ray, MISS, (np.inf, np.inf), 0, np.inf)
        elif status == MISS:
            found["hit"] += not case.holds(ray, HIT, (0, 1e9), 0, np.inf)
    count = (hits.statuses == HIT).sum()
    assert found == {"early": count, "late": count, "miss": count, "hit": (hits.statuses == MISS).sum()}


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_ordinary_rays_are_decided_as_rays_without_proof_are(degree):
    field = volumes.gyroid()
    volume = field.volume(48, degree=degree)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    rays = isospline.camera_for(scene).rays((160, 120))
    hits = scene.cast_rays(rays, certify=True)
    assert {*np.unique(hits.statuses)} == {MISS, HIT}
    assert np.array_equal(hits.statuses == HIT, np.isfinite(hits.t_hit))
    is_hit = hits.statuses == HIT
    lower, upper = hits.t_bounds[is_hit].T
    assert (lower <= hits.t_hit[is_hit]).all() and (hits.t_hit[is_hit] <= upper).all()
    assert np.median(upper - lower) < 1e-11 and (upper - lower).max() < 1e-6
    coherent = scene.cast_rays(rays, certify=True, coherent=True)
    assert coherent == hits


@pytest.mark.filterwarnings("ignore:level .* has an empty shell")
def test_the_level_of_a_plateau_is_not_decided():
    samples = np.zeros((6, 6, 6))
    samples[3:] = 1
    scene = isospline.Scene([isospline.Isosurface(isospline.Volume(samples, degree=1), 0)])
    rays = [(2.5, 2.5, 8, 0, 0, -1), (2.5, 2.5, -8, 0, 0, 1), (2.5, 2.5, 6, 0, 1, 0), (2.5, -1, 2, 0, 1, 0)]
    hits = scene.cast_rays(rays, certify=True)
    assert hits.statuses.tolist() == [UNDECIDED, UNDECIDED, MISS, UNDECIDED]
    assert hits.t_bounds[0, 0] == pytest.approx(6, abs=1e-9) and hits.t_bounds[1, 0] == 8


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


def test_volumes_of_stores(tmp_path):
    pytest.importorskip("zarr")
    field, shape = volumes.gyroid(), (40, 40, 40)
    isospline.convert(field.values(shape), tmp_path / "gyroid.zarr", **field.grid(shape))
    opened, volume = isospline.open_volume(tmp_path / "gyroid.zarr"), field.volume(shape)
    one, other = (isospline.Scene([isospline.Isosurface(each, field.level)]) for each in (opened, volume))
    rays = isospline.camera_for(other).rays((24, 18))
    found, expected = (scene.cast_rays(rays, certify=True) for scene in (one, other))
    assert found == expected and (expected.statuses == HIT).sum() > 50


def test_outputs_and_types():
    field = volumes.sphere()
    scene = isospline.Scene([isospline.Isosurface(field.volume(16), field.level)])
    rays = np.zeros((2, 3, 6), dtype=np.float32)
    rays[..., 4], rays[..., 1] = 1, -3
    hits = scene.cast_rays(rays, certify=True, outputs=("t_hit",))
    assert list(hits) == ["t_hit", "statuses", "t_bounds"] and hits.t_hit.dtype == np.float32
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
                assert abs(value) < BAND or min(edges) < BAND
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
