"""Meshes with a tolerance enclose the volume of the surface; against closed forms and integrals.

Splines of degree 2 and 3 contain all quadratic polynomials, so the surface of one is an exact ellipsoid.
"""

import numpy as np
import pytest

import isospline

trimesh = pytest.importorskip("trimesh")
ndimage = pytest.importorskip("scipy.ndimage")

RADII = np.array([11.0, 13.0, 9.0])  # along x, y, z, in voxels


def ellipsoid(degree=2, matrix=None, **options):
    """The surface, and the volume that it encloses."""
    z, y, x = (np.arange(size) - (size - 1) / 2 for size in (28, 36, 32))
    z, y, x = np.meshgrid(z, y, x, indexing="ij")
    data = 1 - (x / RADII[0]) ** 2 - (y / RADII[1]) ** 2 - (z / RADII[2]) ** 2
    grid, scale = {}, 1.0
    if matrix is not None:
        spacing = np.linalg.norm(matrix, axis=0)
        grid = {"spacing": spacing, "direction": matrix / spacing, "origin": (3, -2, 5)}
        scale = abs(np.linalg.det(matrix))
    volume = isospline.Volume(data, degree=degree, **grid)
    return isospline.Isosurface(volume, 0.0, **options), 4 / 3 * np.pi * RADII.prod() * scale


OBLIQUE = np.array([[0.8, 0.1, 0.0], [0.0, 0.7, 0.2], [0.1, 0.0, 1.1]])
MIRRORED = OBLIQUE * (1, -1, 1)


@pytest.mark.sweep(5)
@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("matrix", [None, OBLIQUE, MIRRORED], ids=["plain", "oblique", "mirrored"])
@pytest.mark.parametrize("tolerance", [0.33, 0.1])  # 0.03 and 0.01 of the middle radius
def test_convex_bodies_do_not_shrink(degree, matrix, tolerance):
    surface, expected = ellipsoid(degree, matrix)
    mesh, report = surface.to_mesh(tolerance, return_report=True)
    volume = mesh.to_trimesh().volume
    assert report["distance"] <= tolerance
    assert volume == pytest.approx(expected, rel=1e-3)
    assert report["missing_volume"] == pytest.approx(expected - volume, abs=3e-4 * expected)
    assert surface.contains(mesh.vertices).mean() < 0.2  # those of a convex mesh that is large enough are outside


def test_a_cavity_does_not_grow():
    surface, expected = ellipsoid(inside="below", closed=True)
    mesh = surface.to_mesh(0.33)
    box = np.diff(surface.volume.bounds, axis=0).prod()
    assert box - mesh.to_trimesh().volume == pytest.approx(expected, rel=1e-3)


def test_a_number_of_faces_keeps_the_volume():
    surface, expected = ellipsoid()
    assert surface.to_mesh(faces=300).to_trimesh().volume == pytest.approx(expected, rel=1e-3)


def test_normals_are_those_of_the_surface():
    surface, _ = ellipsoid()
    mesh = surface.to_mesh(0.2)
    center = np.mean(surface.volume.bounds, axis=0)
    feet = surface.closest_points(mesh.vertices)["points"]
    expected = (feet - center) / RADII**2
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert (mesh.normals * expected).sum(axis=1).min() > np.cos(0.02)


def test_vertices_on_caps_and_seams_do_not_move():
    center = np.array([15.5, 17.5, 13.5])
    clip = isospline.HalfSpace(center + (0, 0, 2), (0.2, -0.1, 1.0))
    surface, _ = ellipsoid(clip=clip, capped=True)
    mesh, report = surface.to_mesh(0.2, return_report=True)
    solid = mesh.to_trimesh()
    assert solid.is_watertight
    heights = (mesh.vertices - center - (0, 0, 2)) @ np.array([0.2, -0.1, 1.0])
    on_cap = np.abs(heights) < 1e-9
    assert on_cap.sum() > 20
    assert heights.min() > -1e-9
    values = surface.volume.sample(mesh.vertices[on_cap])
    assert values.min() > -1e-9  # seams are on the surface, other vertices in the solid
    assert solid.volume == pytest.approx(float(surface.enclosed_volume()), rel=2e-3)


def test_ends_at_the_border_do_not_move():
    z, y, x = np.mgrid[:24, :24, :24]
    surface = isospline.Isosurface(isospline.Volume(100.0 - (x - 11.5) ** 2 - (y - 11.5) ** 2 + 0.0 * z), 0.0)
    mesh = surface.to_mesh(0.4)
    lower, upper = surface.volume.bounds
    at_end = (np.abs(mesh.vertices[:, 2] - lower[2]) < 1e-9) | (np.abs(mesh.vertices[:, 2] - upper[2]) < 1e-9)
    values = np.abs(surface.volume.sample(mesh.vertices))
    assert at_end.sum() > 20
    assert values[at_end].max() < 1e-6 < 0.1 < values[~at_end].max()


@pytest.mark.parametrize("tolerance", [0.2, 0.1])
def test_curved_sheets_keep_the_volume(tolerance):
    rng = np.random.default_rng(5)
    data = ndimage.gaussian_filter(np.pad(rng.normal(size=(26, 26, 26)), 5, constant_values=-1), 2.2)
    surface = isospline.Isosurface(isospline.Volume(data), 0.01)
    expected = float(surface.enclosed_volume())
    mesh, report = surface.to_mesh(tolerance, return_report=True)
    volume = mesh.to_trimesh().volume
    assert volume == pytest.approx(expected, rel=1e-3)
    assert report["missing_volume"] == pytest.approx(expected - volume, abs=1e-3 * expected)


def torus():
    z, y, x = (np.arange(size) - (size - 1) / 2 for size in (16, 38, 38))
    z, y, x = np.meshgrid(z, y, x, indexing="ij")
    return isospline.Volume(5 - np.hypot(np.hypot(x, y) - 12, z))


def noise(degree):
    rng = np.random.default_rng(6)
    return isospline.Volume(ndimage.gaussian_filter(rng.normal(size=(9, 10, 11)), 1.5), degree=degree)


BOX = isospline.Box((9, 12, 9), (22, 30, 30))
LEFT = {  # a solid, the tolerance, and the precision relative to its volume
    "ellipsoid": (lambda: ellipsoid(3)[0], 0.1, 1e-6),
    "mirrored": (lambda: ellipsoid(2, MIRRORED)[0], 0.1, 1e-6),
    "cut": (lambda: ellipsoid(clip=BOX, capped=True)[0], 0.3, 1e-6),
    "torus": (lambda: isospline.Isosurface(torus(), 0), 0.3, 1e-6),
    "finer torus": (lambda: isospline.Isosurface(torus(), 0), 0.1, 1e-6),
    "noise": (lambda: isospline.Isosurface(noise(2), 0.01, closed=True), 0.1, 5e-6),
    "creases": (lambda: isospline.Isosurface(noise(1), 0.01, closed=True), 0.1, 4e-6),
}


@pytest.mark.parametrize("case", LEFT)
def test_what_the_moves_leave_is_reported(case):
    """It is as small as the wedges at edges between the normals of faces."""
    make, tolerance, precision = LEFT[case]
    surface = make()
    expected = float(surface.enclosed_volume(tolerance=1e-6))
    mesh, report = surface.to_mesh(tolerance, return_report=True)
    left = expected - mesh.to_trimesh().volume
    assert report["missing_volume"] == pytest.approx(left, abs=precision * expected)


def volume_with_lid(mesh):
    """The volume of a mesh whose open edges are in one plane, closed by triangles in it."""
    vertices, faces = mesh.vertices, mesh.faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, inverse, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    open_edges = edges[counts[inverse.ravel()] == 1]
    assert len(open_edges) > 8
    center = vertices[open_edges[:, 0]].mean(axis=0)
    lid = np.stack([vertices[open_edges[:, 1]], vertices[open_edges[:, 0]]], axis=1)
    first, second, third = (vertices[faces[:, corner]] - center for corner in range(3))
    assert abs(np.linalg.svd(lid.reshape(-1, 3) - center)[1][-1]) < 1e-6  # in a plane, with the center
    return np.einsum("ij,ij->", first, np.cross(second, third)) / 6  # the lid adds nothing from its own plane


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("matrix", [np.eye(3), OBLIQUE, MIRRORED], ids=["plain", "oblique", "mirrored"])
def test_what_is_missing_at_an_open_border_ends_there(degree, matrix):
    # Half of an ellipsoid, whose plane of symmetry is that of the first samples: the model is exact beside the border.
    z, y, x = np.meshgrid(np.arange(17), *(np.arange(size) - (size - 1) / 2 for size in (40, 38)), indexing="ij")
    data = 1 - (x / RADII[0]) ** 2 - (y / RADII[1]) ** 2 - (z / RADII[2]) ** 2
    spacing = np.linalg.norm(matrix, axis=0)
    volume = isospline.Volume(data, degree=degree, spacing=spacing, direction=matrix / spacing)
    begin = -0.5 if degree == 2 else 0.0
    height = RADII[2] * 2 / 3 - (begin - begin**3 / (3 * RADII[2] ** 2))
    expected = np.pi * RADII[0] * RADII[1] * height * abs(np.linalg.det(matrix))
    mesh, report = isospline.Isosurface(volume, 0.0).to_mesh(0.2, return_report=True)
    assert report["missing_volume"] == pytest.approx(expected - volume_with_lid(mesh), abs=3e-6 * expected)


def test_what_is_missing_at_an_open_cut_ends_there():
    mask = np.ones((28, 36, 32), bool)
    mask[:, :, 23:] = False
    for options in (
        {"clip": isospline.HalfSpace((15.5, 17.5, 16.5), (0.2, -0.1, 1.0))},
        {"clip": isospline.HalfSpace((9, 0, 0), (1, 0, 0))},
        {"mask": mask},
    ):
        surface, _ = ellipsoid(3, **options)
        mesh, report = surface.to_mesh(0.2, return_report=True)
        expected = float(surface.enclosed_volume(tolerance=1e-6))
        assert report["missing_volume"] == pytest.approx(expected - volume_with_lid(mesh), abs=3e-6 * expected)
