"""The promise of `to_mesh(tolerance)`, in both directions, against oracles that are not ours.

Points of the surface are checked with SciPy's spline, their distances from the mesh are trimesh's, and crossings of
faces are decided with exact fractions.
"""

import warnings
from fractions import Fraction

import numpy as np
import pytest

import isospline

trimesh = pytest.importorskip("trimesh")
ndimage = pytest.importorskip("scipy.ndimage")
spatial = pytest.importorskip("scipy.spatial")


def meshed(surface, tolerance):
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "tolerance: .* left out")
        return surface.to_mesh(tolerance, return_report=True)


def is_left_out(points, report):
    """Whether points are in the boxes of parts that are left out, of volumes without a transform."""
    left_out = report["left_out"]
    inside = np.zeros(len(points), bool)
    for position, size in zip(left_out["positions"], left_out["sizes"]):
        inside |= (np.abs(points - position) <= 0.5 * size + 1e-6).all(axis=1)
    return inside


def check_surface_to_mesh(surface, mesh, report, tolerance, count=3000):
    """Points of the surface are near the mesh, or are left out."""
    volume = surface.volume
    points = surface.sample_points(count, seed=0)["points"]
    values = ndimage.map_coordinates(
        np.asarray(volume.coefficients, float), points[:, ::-1].T, order=volume.degree, mode="mirror", prefilter=False
    )
    assert np.abs(values - surface.level).max() < 1e-6  # on the surface
    far = np.full(len(points), np.inf)
    if len(mesh.faces):
        near = isospline.Scene([mesh]).closest_points(points)["distances"]
        worst = np.argsort(near)[-10:]
        far[:] = near
        far[worst] = trimesh.proximity.closest_point(mesh.to_trimesh(), points[worst])[1]
    out = is_left_out(points, report)
    assert far[~out].max(initial=0.0) <= min(tolerance, report["distance"]) * (1 + 1e-9) + 1e-9
    if out.any():
        assert far[out].max() <= report["left_out"]["distances"].max() * (1 + 1e-9)
    return out


def check_mesh_to_surface(surface, mesh, report, tolerance, count=3000):
    if not len(mesh.faces):
        return
    points, _ = trimesh.sample.sample_surface(mesh.to_trimesh(), count, seed=1)
    found = surface.closest_points(points, tolerance=1e-3 * tolerance)
    low = found["distances"] - found["error_bounds"]
    assert low.max() <= min(tolerance, report["distance"]) * (1 + 1e-9)


def sign(a, b, c, d):
    """The sign of det(b - a, c - a, d - a), exactly."""
    u, v, w = b - a, c - a, d - a
    rough = np.dot(np.cross(u, v), w)
    if abs(rough) > 1e-10 * np.linalg.norm(u) * np.linalg.norm(v) * np.linalg.norm(w):
        return 1 if rough > 0 else -1
    a, b, c, d = ([Fraction(float(x)) for x in p] for p in (a, b, c, d))
    u, v, w = ([p - q for p, q in zip(e, a)] for e in (b, c, d))
    exact = (u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] + (u[0] * v[1] - u[1] * v[0]) * w[2]
    return (exact > 0) - (exact < 0)


def count_crossings(mesh):
    """The number of pairs of faces without a common vertex of which an edge of one goes through the other."""
    vertices, faces = mesh.vertices, mesh.faces.astype(int)
    corners = vertices[faces]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    radii = 0.5 * np.linalg.norm(upper - lower, axis=1)
    tree = spatial.cKDTree(0.5 * (lower + upper))
    pairs = tree.query_pairs(2 * radii.max(), output_type="ndarray")
    i, j = pairs.T
    overlap = ((lower[i] <= upper[j]) & (lower[j] <= upper[i])).all(axis=1)
    apart = ~(faces[i][:, :, None] == faces[j][:, None, :]).any(axis=(1, 2))

    def goes_through(p, q, t):
        sides = sign(*t, p), sign(*t, q)
        if sides[0] * sides[1] >= 0:
            return False
        turns = {sign(p, q, t[k], t[(k + 1) % 3]) for k in range(3)}
        return len(turns) == 1 and 0 not in turns

    found = 0
    for s, t in corners[pairs[overlap & apart]]:
        found += any(goes_through(s[k], s[(k + 1) % 3], t) or goes_through(t[k], t[(k + 1) % 3], s) for k in range(3))
    return found


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    "case", [(1, 0.95, 0.5), (2, 0.95, 0.5), (2, 0.9, 1.0), (2, 0.95, 5.0), (3, 0.95, 0.5), (3, 0.9, 1.0)]
)
def test_noise_is_within_the_tolerance(case):
    degree, level, tolerance = case
    for seed in range(2):
        volume = isospline.Volume(np.random.default_rng(seed).random((9, 9, 9)), degree=degree)
        surface = isospline.Isosurface(volume, level)
        mesh, report = meshed(surface, tolerance)
        check_surface_to_mesh(surface, mesh, report, tolerance)
        check_mesh_to_surface(surface, mesh, report, tolerance, 500)
        assert report["distance"] <= tolerance
        assert report["self_intersections"] == count_crossings(mesh) == 0


def test_smooth_noise_is_within_a_fine_tolerance():
    """The mesh of the lattice may have faces beyond the tolerance between the points where they are measured."""
    samples = ndimage.gaussian_filter(np.random.default_rng(6).normal(size=(12, 12, 12)), 1.0)
    surface = isospline.Isosurface(isospline.Volume(samples), 0.05, closed=True)
    mesh, report = meshed(surface, 0.1)
    check_mesh_to_surface(surface, mesh, report, 0.1, 500)
    assert report["distance"] <= 0.1


def test_a_smaller_tolerance_does_not_give_fewer_faces():
    # A face at which the first proof fails leaves what is around it fine, but not all of a small volume.
    data = ndimage.gaussian_filter(np.random.default_rng(1).normal(size=(10, 8, 8)), 1.0)
    surface = isospline.Isosurface(isospline.Volume(data), float(np.quantile(data, 0.6)))
    counts = [len(surface.to_mesh(tolerance).faces) for tolerance in (0.2, 0.14, 0.1)]
    assert counts == sorted(counts)


def ball_with(amplitude, where):
    z, y, x = np.mgrid[:30, :30, :30].astype(float)
    data = np.clip(6 - np.sqrt((x - 9) ** 2 + (y - 15) ** 2 + (z - 15) ** 2), -1, 1)
    data[where] = amplitude
    return data


@pytest.mark.sweep(4)
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("amplitude", [0.1, 0.35])
@pytest.mark.parametrize("where", [np.s_[15, 15, 24], np.s_[8:22, 15, 24]], ids=["voxel", "line"])
def test_separate_pieces_are_kept(where, amplitude, degree):
    volume = isospline.Volume(ball_with(amplitude, where), degree=degree)
    surface = isospline.Isosurface(volume, -0.1 if degree == 2 else -1e-3)
    for tolerance in (0.5, 2.0):
        mesh, report = meshed(surface, tolerance)
        out = check_surface_to_mesh(surface, mesh, report, tolerance)
        assert not out.any()
        check_mesh_to_surface(surface, mesh, report, tolerance, 1000)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_thin_walls_are_kept(degree):
    data = np.full((12, 14, 16), -1.0)
    data[6, 2:12, 2:14] = 0.2
    surface = isospline.Isosurface(isospline.Volume(data, degree=degree), 0.05)
    for tolerance in (0.3, 1.0):
        mesh, report = meshed(surface, tolerance)
        assert not check_surface_to_mesh(surface, mesh, report, tolerance).any()
        check_mesh_to_surface(surface, mesh, report, tolerance)
        assert mesh.to_trimesh().is_watertight


def test_a_part_between_the_finest_nodes_is_listed():
    data = np.zeros((9, 9, 16))
    data[4, 4, 4], data[4, 4, 5] = 1, 0.3
    data[4, 4, 10:12] = 1  # a higher and wider bump
    volume = isospline.Volume(data, filter="none")
    line = np.full((100001, 3), 4.0)
    line[:, 0] = np.linspace(3.5, 5.5, len(line))
    values = volume.sample(line)
    surface = isospline.Isosurface(volume, values.max() - 2e-6)
    with pytest.warns(UserWarning, match="1 parts of the surface are left out"):
        mesh, report = surface.to_mesh(0.05, return_report=True)
    assert len(mesh.faces) > 0
    left_out = report["left_out"]
    assert len(left_out["positions"]) == 1
    np.testing.assert_allclose(left_out["positions"][0], line[values.argmax()], atol=0.02)
    assert (left_out["sizes"][0] < 0.1).all()
    assert 4 < left_out["distances"][0] < 7
    assert report["distance"] <= 0.05


def test_a_part_that_is_left_out_does_not_refine_the_mesh():
    z, y, x = np.indices((25, 25, 25))
    ball = ((x - 14) ** 2 + (y - 12) ** 2 + (z - 12) ** 2 < 49).astype(float)
    with_speck = ball.copy()
    with_speck[12, 12, 3], with_speck[12, 12, 4] = 1, 0.3
    line = np.full((100001, 3), 12.0)
    line[:, 0] = np.linspace(2.5, 4.5, len(line))
    level = isospline.Volume(with_speck, filter="none").sample(line).max() - 2e-6
    meshes = [isospline.Isosurface(isospline.Volume(data, filter="none"), level) for data in (ball, with_speck)]
    with pytest.warns(UserWarning, match="1 parts of the surface are left out"):
        plain, speck = (surface.to_mesh(1.0) for surface in meshes)
    assert len(speck.faces) <= 1.1 * len(plain.faces)


@pytest.mark.sweep(1)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("tolerance", [pytest.param(0.25, marks=pytest.mark.long), 0.5])
def test_faces_of_caps_are_within_the_tolerance(degree, tolerance):
    spacing = np.array([0.7, 0.9, 1.4])
    rng = np.random.default_rng(0)
    data = ndimage.gaussian_filter(rng.random((14, 14, 14)), 1.0)
    data = (data - data.min()) / np.ptp(data)
    volume = isospline.Volume(data, degree=degree, spacing=spacing)
    clip = isospline.HalfSpace(6.5 * spacing, rng.normal(size=3))
    surface = isospline.Isosurface(volume, 0.5, clip=clip, capped=True)
    mesh, report = meshed(surface, tolerance)
    assert report["distance"] <= tolerance
    check_mesh_to_surface(surface, mesh, report, tolerance, 2000)
    assert report["self_intersections"] == count_crossings(mesh)


# The mesh of seed 63 takes 15 s, of which nearly all is the proof of its distance.
@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    "seed, degree", [(45, 2), pytest.param(63, 3, marks=pytest.mark.long), (71, 2), (74, 3), (88, 3)]
)
def test_faces_do_not_cross_caps(seed, degree):
    # Simplification could connect two vertices of a seam by an edge under the cap.
    spacing = np.array([0.7, 0.9, 1.4])
    rng = np.random.default_rng(seed)
    data = ndimage.gaussian_filter(rng.random((12, 12, 12)), 1.0)
    data = (data - data.min()) / np.ptp(data)
    clip = isospline.HalfSpace(5.5 * spacing, rng.normal(size=3))
    surface = isospline.Isosurface(isospline.Volume(data, degree=degree, spacing=spacing), 0.5, clip=clip, capped=True)
    mesh, report = meshed(surface, 0.5)
    assert report["self_intersections"] == 0
    assert count_crossings(mesh) == 0


# Near the border, where the padding makes the surface steep, fewer faces go.
@pytest.mark.slow
@pytest.mark.parametrize(
    "size, share", [(16, 0.8), *(pytest.param(*each, marks=pytest.mark.long) for each in ((24, 0.6), (36, 0.3)))]
)
def test_simplified_blobs_do_not_cross_themselves(size, share):
    data = ndimage.gaussian_filter(np.random.default_rng(0).normal(size=(size, size, size)), 1.2)
    surface = isospline.Isosurface(isospline.Volume(np.pad(data, 2, constant_values=-1)), 0.02)
    mesh, report = meshed(surface, 0.5)
    assert report["self_intersections"] == 0
    assert count_crossings(mesh) == 0
    assert len(mesh.faces) < share * len(surface.to_mesh().faces)


def test_reports_need_a_tolerance():
    surface = isospline.Isosurface(isospline.Volume(np.mgrid[:5, :5, :5][0]), 1.7)
    with pytest.raises(ValueError, match="return_report: expected a tolerance or faces as well"):
        surface.to_mesh(return_report=True)
    with pytest.raises(ValueError, match="return_distance: expected one of"):
        surface.to_mesh(0.1, return_distance=True, return_report=True)


@pytest.mark.parametrize("edge", [2.0**-199, 2.0**199])  # of a voxel: almost the shortest and the longest
def test_edges_of_voxels_only_scale_the_mesh(edge):
    z, y, x = np.mgrid[-6:7, -6:7, -6:7]
    one, other = (isospline.Isosurface(isospline.Volume(16 - x * x - y * y - z * z, spacing=h), 0) for h in (1, edge))
    plain, scaled = one.to_mesh(0.2), other.to_mesh(0.2 * edge)
    np.testing.assert_array_equal(scaled.faces, plain.faces)
    np.testing.assert_allclose(scaled.vertices / edge, plain.vertices, atol=1e-9)
    assert len(other.to_mesh(faces=100).faces) == len(one.to_mesh(faces=100).faces) <= 100
