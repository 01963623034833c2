"""Derivatives of hits by level, ray, coefficients and samples, beside finite differences and transposed matrices."""

import numpy as np
import pytest
from hit_outputs import ALL_OUTPUTS

import isospline
from isospline import volumes

TRANSFORM = np.array([[1, 0.3, 0, 0.4], [0, 0.7, 0.2, 0], [0.1, 0, 1.5, -1], [0, 0, 0, 1.0]])
FIELD = volumes.gyroid()


def surface(degree, **options):
    volume = FIELD.volume(20, degree=degree)
    return isospline.Isosurface(volume, FIELD.level, **options)


def rays_at(scene, count=(24, 18)):
    return isospline.camera_for(scene).rays(count).reshape(-1, 6) * [1, 1, 1, 0.3, 0.3, 0.3]


def same_cells(*all_hits):
    """Rays that hit the same cell of the same object each time, and do not graze."""
    first = all_hits[0]
    same = np.isfinite(first.t_hit) & ~first.grazing
    for hits in all_hits[1:]:
        same &= (hits.primitive_ids == first.primitive_ids) & (hits.geometry_ids == first.geometry_ids)
    return same


def differences(cast, names, step):
    """Central differences of results, cast(step) and cast(-step), and the rays for which they are meaningful."""
    before, after = cast(-step), cast(step)
    with np.errstate(invalid="ignore"):  # misses
        found = [(after[name] - before[name]) / (2 * step) for name in names]
    return found, same_cells(cast(0.0), before, after)


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_derivatives_are_limits_of_differences(degree, inside):
    shown = surface(degree, inside=inside)
    scene = isospline.Scene([(shown, TRANSFORM)])
    rays = rays_at(scene)
    hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS)

    def steep(kept):
        cosines = np.abs((hits.primitive_normals * rays[:, 3:]).sum(1)) / np.linalg.norm(rays[:, 3:], axis=1)
        return kept & (cosines > 0.15)

    def at_level(step):
        return isospline.Scene([(shown.with_level(FIELD.level + step), TRANSFORM)]).cast_rays(rays, outputs=ALL_OUTPUTS)

    (of_t, of_normal), kept = differences(at_level, ("t_hit", "primitive_normals"), 1e-6)
    kept = steep(kept)
    assert kept.sum() > 60
    np.testing.assert_allclose(hits.dt_dlevel[kept], of_t[kept], rtol=2e-4, atol=1e-5)
    np.testing.assert_allclose(hits.dnormal_dlevel[kept], of_normal[kept], rtol=2e-3, atol=2e-2)

    for name, first in (("origin", 0), ("direction", 3)):
        for axis in range(3):

            def moved(step, column=first + axis):
                changed = rays.copy()
                changed[:, column] += step
                return scene.cast_rays(changed, outputs=ALL_OUTPUTS)

            (of_t, of_normal), kept = differences(moved, ("t_hit", "primitive_normals"), 1e-6)
            kept = steep(kept)
            by_ray, normal_by_ray = hits[f"dt_d{name}"][:, axis], hits[f"dnormal_d{name}"][:, :, axis]
            np.testing.assert_allclose(by_ray[kept], of_t[kept], rtol=2e-4, atol=1e-4)
            np.testing.assert_allclose(normal_by_ray[kept], of_normal[kept], rtol=5e-3, atol=3e-2)


def test_closed_form_of_a_ball():
    """A linear function of the distance would need a sphere; a quadratic one is exact at degree 2."""
    z, y, x = np.mgrid[-20:21, -20:21, -20:21]  # the mirrored border is not quadratic; its influence fades
    volume = isospline.Volume((x**2 + y**2 + z**2).astype(float), origin=(-20, -20, -20))
    scene = isospline.Scene(isospline.Isosurface(volume, 25.0, inside="below"))
    rng = np.random.default_rng(0)
    targets = rng.uniform(-2, 2, (50, 3))
    rays = np.concatenate([targets - (0, 0, 20), np.tile((0, 0, 1.0), (50, 1))], 1)
    hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS)
    depth = np.sqrt(25.0 - (targets[:, :2] ** 2).sum(1))
    assert hits.t_hit == pytest.approx(20 - targets[:, 2] - depth, abs=1e-4)
    assert hits.dt_dlevel == pytest.approx(-1 / (2 * depth), abs=1e-4)
    assert hits.dt_dorigin[:, :2] == pytest.approx(targets[:, :2] / depth[:, None], abs=1e-4)
    assert hits.dt_dorigin[:, 2] == pytest.approx(-np.ones(50))
    assert hits.dt_ddirection == pytest.approx(hits.t_hit[:, None] * hits.dt_dorigin)
    # The normal is the position over the radius.
    position = hits.positions / 5
    assert hits.dnormal_dlevel == pytest.approx(
        np.stack([0 * depth, 0 * depth, -1 / (2 * depth)], 1) / 5 - position / 50, abs=2e-4
    )
    moved = np.eye(3) + np.einsum("i,nj->nij", [0, 0, 1.0], hits.dt_dorigin)
    assert hits.dnormal_dorigin == pytest.approx(moved / 5, abs=2e-4)


def test_caps_meshes_misses_and_rays_that_graze():
    volume = FIELD.volume(20)
    cut = isospline.Isosurface(volume, FIELD.level, clip=[isospline.HalfSpace((0, 0, -0.5), (0, 0, 1))], capped=True)
    mesh = isospline.Mesh([(3, 0, 0), (5, 0, 0), (3, 2, 1)], [(0, 1, 2)])
    scene = isospline.Scene([cut, mesh])
    down = [(x, y, -3, 0, 0, 1) for x, y in np.random.default_rng(0).uniform(-0.8, 0.8, (60, 2))]
    rays = np.array([*down, (3.5, 0.3, 5, 0, 0.1, -2), (9, 9, 9, 0, 0, 1)], float)
    hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS)
    on_cap = (hits.geometry_ids == 0) & (hits.primitive_ids >= volume.cell_count)
    assert on_cap.sum() > 10
    flat = on_cap | (hits.geometry_ids == 1)
    normals, directions = hits.primitive_normals[flat], rays[flat, 3:]
    expected = -normals / (normals * directions).sum(1, keepdims=True)
    np.testing.assert_allclose(hits.dt_dorigin[flat], expected)
    np.testing.assert_allclose(hits.dt_ddirection[flat], hits.t_hit[flat, None] * expected)
    for name in ("dt_dlevel", "dnormal_dlevel", "dnormal_dorigin", "dnormal_ddirection", "coefficient_weights"):
        assert (hits[name][flat] == 0).all()
    missed = ~np.isfinite(hits.t_hit)
    assert missed[-1] and not hits.grazing[missed].any() and (hits.dt_dorigin[missed] == 0).all()

    ball = volumes.sphere(0.5)
    grazing = isospline.Scene(isospline.Isosurface(ball.volume(32), ball.level))
    found = grazing.cast_rays([(-3, y, 0, 1, 0, 0) for y in np.linspace(0.49, 0.51, 20001)], outputs=ALL_OUTPUTS)
    assert all(np.isfinite(found[name]).all() for name in ("dt_dlevel", "dt_dorigin", "dnormal_dorigin"))
    edge_on = isospline.Scene(isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 1e-8)], [(0, 1, 2)]))
    hit = edge_on.cast_rays([(0.2, -5, 2e-9, 0, 1, 0)], outputs=ALL_OUTPUTS)
    assert np.isfinite(hit.t_hit[0]) and hit.grazing[0] and (hit.dt_dorigin == 0).all()


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
@pytest.mark.parametrize("axes", ["zyx", "xyz"])
def test_weights_are_derivatives_by_coefficients(degree, boundary, axes):
    rng = np.random.default_rng(degree)
    samples = np.round(256 * (rng.normal(size=(6, 7, 8)) + np.linspace(-4, 4, 8))) / 256  # exact in float32
    options = {"degree": degree, "boundary": boundary, "filter": "none", "axes": axes}
    volume = isospline.Volume(samples, **options)
    scene = isospline.Scene(isospline.Isosurface(volume, 0.125))
    low, high = volume.bounds
    rays = np.concatenate([rng.uniform(low - 2, low, (200, 3)), rng.normal(size=(200, 3))], 1)
    rays[:, 3:] = rng.uniform(low, high, (200, 3)) - rays[:, :3]
    hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS)
    hit = np.isfinite(hits.t_hit)
    assert hit.sum() > 40 and hits.coefficient_weights.shape == (200, (degree + 1) ** 3)
    assert hits.coefficient_weights[hit].sum(1) == pytest.approx(np.ones(hit.sum()))
    values = volume.coefficients.ravel("K")[hits.coefficient_indices]
    assert (values * hits.coefficient_weights).sum(1)[hit] == pytest.approx(np.full(hit.sum(), 0.125), abs=1e-6)
    assert volume.sample(hits.positions[hit]) == pytest.approx(np.full(hit.sum(), 0.125), abs=1e-6)

    place = hits.coefficient_indices[hit][0, np.argmax(hits.coefficient_weights[hit][0])]
    step = 2.0**-8
    found = []
    for way in (-step, step):
        changed = volume.coefficients.ravel("K")
        changed[place] += way
        order = "F" if axes == "xyz" else "C"
        other = isospline.Volume(changed.reshape(samples.shape, order=order), **options)
        found.append(isospline.Scene(isospline.Isosurface(other, 0.125)).cast_rays(rays, outputs=ALL_OUTPUTS))
    kept = same_cells(hits, *found) & (np.abs(hits.dt_dlevel) < 1)
    numeric = (found[1].t_hit[kept] - found[0].t_hit[kept]) / (2 * step)
    weights = np.where(hits.coefficient_indices == place, hits.coefficient_weights, 0).sum(1)
    assert (weights[kept] > 0.01).sum() > 0
    np.testing.assert_allclose((-weights * hits.dt_dlevel)[kept], numeric, atol=2e-3)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
@pytest.mark.parametrize(
    "options", [{}, {"axes": "xyz"}, {"filter": "none"}, {"filter": "smoothing", "smoothing": 0.7}]
)
def test_the_adjoint_is_the_transposed_prefilter(degree, boundary, options):
    rng = np.random.default_rng(degree)
    shape = (4, 1, 5) if degree < 3 else (4, 5, 3)
    options = {"degree": degree, "boundary": boundary, **options}
    volume = isospline.Volume(rng.normal(size=shape), **options)
    count = volume.coefficients.size
    matrix = np.stack(  # of the prefilter: its columns are the coefficients of unit samples
        [isospline.Volume(each.reshape(shape), **options).coefficients.ravel() for each in np.eye(count)], 1
    )
    order = np.arange(count).reshape(shape, order="F" if options.get("axes") == "xyz" else "C").ravel()
    weights = rng.normal(size=count)
    found = volume.adjoint(order, weights)  # in the order of ravel()
    assert found.shape == shape
    np.testing.assert_allclose(found.ravel(), matrix.T @ weights, atol=3e-6)
    some = rng.integers(0, count, (3, 40))
    repeated = rng.normal(size=(3, 40))
    dense = np.bincount(some.ravel(), repeated.ravel(), count)
    np.testing.assert_allclose(volume.adjoint(some, repeated), volume.adjoint(np.arange(count), dense), atol=1e-12)
    assert (volume.adjoint(np.zeros(0, int), []) == 0).all()


def test_the_adjoint_is_that_of_scipy():
    ndimage = pytest.importorskip("scipy.ndimage")
    rng = np.random.default_rng(0)
    for degree, boundary, mode in ((2, "mirror", "mirror"), (3, "mirror", "mirror"), (3, "periodic", "grid-wrap")):
        volume = isospline.Volume(rng.normal(size=(20, 21, 22)), degree=degree, boundary=boundary)
        samples, weights = rng.normal(size=(2, 20, 21, 22))
        filtered = ndimage.spline_filter(samples, degree, mode=mode)
        found = volume.adjoint(np.arange(weights.size), weights.ravel())
        assert (filtered * weights).sum() == pytest.approx((samples * found).sum(), rel=1e-5, abs=1e-3)


@pytest.mark.parametrize(
    ("indices", "weights", "error", "message"),
    [
        ([0.5], [1.0], TypeError, "indices: expected integers, got float64"),
        ([0, 1], [1.0], ValueError, r"weights: expected the shape of indices, \(2,\), got \(1,\)"),
        ([-1], [1.0], ValueError, "indices: expected places from 0 to 7999, got -1 to -1"),
        ([8000], [1.0], ValueError, "indices: expected places from 0 to 7999"),
        ([0], [np.nan], ValueError, "weights: expected finite numbers"),
    ],
)
def test_bad_adjoints(indices, weights, error, message):
    with pytest.raises(error, match=message):
        FIELD.volume(20).adjoint(indices, weights)


def test_several_degrees_in_a_scene():
    scene = isospline.Scene([surface(1), (surface(3), moved(0, 4, 0))])
    rays = np.array([(-3, 0.2, 0.3, 1, 0, 0), (-3, 4.2, 0.3, 1, 0, 0)], float)
    hits = scene.cast_rays(rays, outputs=("coefficient_weights", "coefficient_indices"))
    assert hits.coefficient_weights.shape == (2, 64)
    assert hits.coefficient_weights.sum(1) == pytest.approx([1, 1])
    assert (hits.coefficient_weights[0, 8:] == 0).all() and (hits.coefficient_indices[0, 8:] == 0).all()
    empty = isospline.Scene().cast_rays(rays, outputs=ALL_OUTPUTS)
    assert empty.coefficient_weights.shape == (2, 0) and (empty.dt_dlevel == 0).all()


def moved(*offset):
    transform = np.eye(4)
    transform[:3, 3] = offset
    return transform
