"""Vector-Jacobian products of cast_rays: by rays, levels, placements and samples, beside finite differences."""

import numpy as np
import pytest

import isospline
from isospline import volumes
from isospline.derivatives import cast_vjp

FIELD = volumes.gyroid()
TRANSFORM = np.array([[1, 0.3, 0, 0.4], [0, 0.7, 0.2, 0], [0.1, 0, 1.5, -1], [0, 0, 0, 1.0]])


class Problem:
    """A number that depends on hits, with random gradients by t and normals, and what the hits depend on."""

    def __init__(self, degree, normals):
        rng = np.random.default_rng(degree)
        self.degree, self.normals = degree, normals
        self.samples = FIELD.values((14, 14, 14))
        self.grid = FIELD.grid((14, 14, 14))
        self.transform = TRANSFORM.copy()
        self.level = FIELD.level
        self.mesh_transform = np.eye(4)
        scene = self.scene()
        self.rays = isospline.camera_for(scene).rays((30, 22)).reshape(-1, 6)
        hits, self.vjp = cast_vjp(scene, self.rays, normals=normals)
        cosines = np.abs((hits.primitive_normals * self.rays[:, 3:]).sum(1))
        self.kept = np.isfinite(hits.t_hit) & (cosines > 0.3 * np.linalg.norm(self.rays[:, 3:], axis=1))
        self.hits = hits
        self.of_t = rng.normal(size=len(self.rays))
        self.of_normals = rng.normal(size=(len(self.rays), 3)) if normals else None

    def scene(self):
        volume = isospline.Volume(self.samples, degree=self.degree, **self.grid)
        mesh = isospline.Mesh([(-2, 3, -2), (2, 3, -2), (0, 3.5, 3)], [(0, 1, 2)])
        surface = isospline.Isosurface(volume, self.level)
        return isospline.Scene([(surface, self.transform), (mesh, self.mesh_transform)])

    def number(self, kept, hits):
        total = (self.of_t[kept] * hits.t_hit[kept]).sum()
        if self.normals:
            total += (self.of_normals[kept] * hits.primitive_normals[kept]).sum()
        return total

    def differs(self, change, step):
        """The derivative by a change, and by vjp, of rays whose cells are the same on both sides."""
        found = []
        for way in (-step, step):
            undo = change(way)
            found.append(self.scene().cast_rays(self.rays))
            undo()
        kept = self.kept.copy()
        for hits in found:
            same = (hits.primitive_ids == self.hits.primitive_ids) & (hits.geometry_ids == self.hits.geometry_ids)
            kept &= same
        numeric = (self.number(kept, found[1]) - self.number(kept, found[0])) / (2 * step)
        of_normals = None if self.of_normals is None else self.of_normals * kept[:, None]
        assert kept.sum() > 100
        return numeric, self.vjp(self.of_t * kept, of_normals)


def moved(array, place):
    def change(step):
        before = array[place]
        array[place] += step
        return lambda: array.__setitem__(place, before)

    return change


@pytest.fixture(scope="module", params=[(1, False), (2, False), (2, True), (3, True)], ids=str)
def problem(request):
    return Problem(*request.param)


def test_by_level(problem):
    def change(step):
        before, problem.level = problem.level, problem.level + step
        return lambda: setattr(problem, "level", before)

    numeric, found = problem.differs(change, 1e-6)
    assert found["levels"][0] == pytest.approx(numeric, rel=1e-3, abs=1e-2)
    assert list(found["levels"]) == [0]


@pytest.mark.parametrize("row", [0, 1, 2])
@pytest.mark.parametrize("column", [0, 1, 2, 3])
def test_by_placement(problem, row, column):
    for id, transform in ((0, problem.transform), (1, problem.mesh_transform)):
        numeric, found = problem.differs(moved(transform, (row, column)), 1e-6)
        assert found["transforms"][id][row, column] == pytest.approx(numeric, rel=1e-3, abs=2e-2)
        assert (found["transforms"][id][3] == 0).all()


def test_by_rays(problem):
    for column in range(6):
        before = problem.rays.copy()

        def change(step, column=column, before=before):
            problem.rays[:, column] += step
            return lambda: problem.rays.__setitem__(slice(None), before)

        numeric, found = problem.differs(change, 1e-6)
        assert found["rays"][:, column].sum() == pytest.approx(numeric, rel=1e-3, abs=2e-2)


def test_by_samples(problem):
    _, found = problem.differs(lambda _: lambda: None, 1.0)
    strongest = np.unravel_index(np.argsort(np.abs(found["samples"][0]), axis=None)[-3:], problem.samples.shape)
    for place in zip(*strongest, strict=True):
        numeric, found = problem.differs(moved(problem.samples, place), 2e-4)
        assert found["samples"][0][place] == pytest.approx(numeric, rel=5e-2, abs=0.1)


def test_what_moves_no_hit_has_no_gradient():
    volume = FIELD.volume(14)
    scene = isospline.Scene([isospline.Isosurface(volume, FIELD.level)])
    rays = np.array([[(9, 9, 9, 0, 0, 1.0), (0, 9, 9, 0, 0, 1.0)]])
    hits, vjp = cast_vjp(scene, rays)
    found = vjp(t_hit=np.ones((1, 2)))
    assert hits.t_hit.shape == (1, 2) and found["rays"].shape == (1, 2, 6) and (found["rays"] == 0).all()
    assert found["levels"] == {0: 0.0} and (found["samples"][0] == 0).all() and (found["transforms"][0] == 0).all()
    assert vjp(samples=False)["samples"] == {}
    with pytest.raises(TypeError, match="scene: expected a Scene, got Isosurface"):
        cast_vjp(scene.object(0), rays)
    with pytest.raises(TypeError, match="rays: expected an array of real numbers"):
        cast_vjp(scene, "abc")
    with pytest.raises(ValueError, match=r"t_hit: expected gradients of shape \(1, 2\), got \(2,\)"):
        vjp(t_hit=np.ones(2))
    with pytest.raises(ValueError, match=r"primitive_normals: expected cast_vjp\(..., normals=True\)"):
        vjp(primitive_normals=np.ones((1, 2, 3)))


@pytest.mark.parametrize("shape", [(), (0,), (2, 0), (3,)])
@pytest.mark.parametrize("objects", [[], [isospline.Mesh([(-1, -1, 0), (2, -1, 0), (-1, 2, 0)], [(0, 1, 2)])]])
def test_scenes_without_isosurfaces(objects, shape):
    rays = np.broadcast_to((0, 0, 5, 0, 0, -1.0), (*shape, 6))
    hits, vjp = cast_vjp(isospline.Scene(objects), rays)
    found = vjp(t_hit=np.ones(shape))
    np.testing.assert_array_equal(found["rays"][..., 2], len(objects))
    assert hits.coefficient_weights.shape == (*shape, 0) and found["levels"] == found["samples"] == {}


@pytest.mark.parametrize("odd", [np.nan, np.inf])
def test_gradients_of_rays_that_do_not_count_may_be_anything(odd):
    scene = isospline.Scene(isospline.Isosurface(volumes.sphere().volume(32), 0.0))
    rays = np.array([(9, 9, 9, 0, 0, 1.0), (-3, 0, 0, 1, 0, 0)])
    _, vjp = cast_vjp(scene, rays, normals=True)
    found, expected = (vjp([each, 1.0], [(0, each, 0), (0, 1, 0)]) for each in (odd, 0.0))
    assert found["levels"] == expected["levels"] and (found["rays"] == expected["rays"]).all()
    with pytest.raises(ValueError, match="^t_hit: expected finite gradients"):
        vjp([1.0, odd])


def test_hits_may_be_changed_before_their_gradients():
    scene = isospline.Scene(isospline.Isosurface(volumes.sphere().volume(32), 0.0))
    rays = np.array([(9, 9, 9, 0, 0, 1.0), (-3, 0, 0.1, 1, 0, 0)])
    of_normals = [(0, 0, 0), (1.0, 2, 3)]
    (_, expected_of), (hits, vjp) = (cast_vjp(scene, rays, normals=True) for _ in range(2))
    hits.t_hit[~np.isfinite(hits.t_hit)] = 0
    hits.primitive_normals[:] *= -1
    hits.positions[:] = 0
    found, expected = (function([0.0, 1.0], of_normals) for function in (vjp, expected_of))
    assert found["levels"] == expected["levels"] != {0: 0.0}
    for name in ("transforms", "samples"):
        assert (found[name][0] == expected[name][0]).all()
    assert (found["rays"] == expected["rays"]).all()


def test_the_pose_of_an_object_from_a_depth_map():
    """Six numbers, off by a few degrees and a tenth of the size, from depths where both objects are seen."""
    field = volumes.heart()
    surface = isospline.Isosurface(field.volume(32), field.level)
    camera = isospline.camera_for(isospline.Scene(surface))
    rays = camera.rays((40, 30))

    def pose(six):
        x, y, z = six[:3]
        turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = max(np.linalg.norm(six[:3]), 1e-12)
        matrix = np.eye(4)
        matrix[:3, :3] += np.sin(angle) / angle * turn + (1 - np.cos(angle)) / angle**2 * turn @ turn
        matrix[:3, 3] = six[3:]
        return matrix

    target = isospline.Scene([(surface, np.eye(4))]).cast_rays(rays).t_hit
    six = np.array([0.05, -0.06, 0.04, 0.05, -0.05, 0.04])
    for _ in range(12):  # Gauss-Newton, with one row of the Jacobian a pixel from dt/dT
        transform = pose(six)
        hits, _ = cast_vjp(isospline.Scene([(surface, transform)]), rays)
        both = np.isfinite(hits.t_hit) & np.isfinite(target) & ~hits.grazing
        off = np.abs(hits.t_hit[both] - target[both])
        both[both] = off <= 4 * np.median(off)  # others are of another sheet
        points = np.concatenate([hits.positions[both], np.ones((both.sum(), 1))], 1) @ np.linalg.inv(transform).T
        by_matrix = -np.einsum("ni,nj->nij", hits.dt_dorigin[both], points)
        step = 1e-6
        columns = [(pose(six + step * e) - pose(six - step * e)) / (2 * step) for e in np.eye(6)]
        jacobian = np.stack([np.einsum("nij,ij->n", by_matrix, each[:3]) for each in columns], 1)
        residual = hits.t_hit[both] - target[both]
        six = six - np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    assert np.abs(six).max() < 1e-4
