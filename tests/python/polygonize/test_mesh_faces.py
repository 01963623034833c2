"""`to_mesh(faces=...)`: the number of triangles, and the distance against closed forms."""

import numpy as np
import pytest

import isospline

RADIUS = 0.7


@pytest.fixture(scope="module")
def ball():
    """A surface that is the sphere, up to the error of the spline, which is 1e-4 at most."""
    field = isospline.volumes.sphere(RADIUS)
    return isospline.Isosurface(field.volume(32, degree=3), field.level)


def cube():
    samples = np.minimum.reduce([6.3 - abs(each - 11.5) for each in np.mgrid[:24, :24, :24]])
    return isospline.Isosurface(isospline.Volume(samples, degree=1), 0.0)


@pytest.mark.parametrize("faces", [30, 100, 501, 1000])
def test_a_ball_has_the_faces_and_is_within_the_distance(ball, faces):
    mesh, distance = ball.to_mesh(faces=faces, return_distance=True)
    assert 0.8 * faces <= len(mesh.faces) <= faces
    weights = np.random.default_rng(0).dirichlet((1, 1, 1), size=(50, 1))
    points = (weights[..., None] * mesh.vertices[mesh.faces.astype(int)]).sum(axis=2).reshape(-1, 3)
    off = np.abs(np.linalg.norm(points, axis=1) - RADIUS)
    assert off.max() <= distance + 1e-4
    directions = np.random.default_rng(1).normal(size=(2000, 3))
    on_sphere = RADIUS * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    assert isospline.Scene([mesh]).closest_points(on_sphere)["distances"].max() <= distance + 1e-4


def test_more_faces_are_nearer(ball):
    distances = [ball.to_mesh(faces=faces, return_report=True)[1].distance for faces in (50, 200, 800)]
    assert distances[0] > 2 * distances[1] > 4 * distances[2]


def test_flat_faces_take_no_more_than_they_need():
    mesh, distance = cube().to_mesh(faces=12, return_distance=True)
    assert len(mesh.faces) == 12 and distance < 10
    lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    assert np.abs(lower - 5.2).max() <= distance and np.abs(upper - 17.8).max() <= distance


def test_caps_and_closed_borders_count(ball):
    half = isospline.HalfSpace((0, 0, 0), (0.3, 1, 0.2))
    slab = isospline.Isosurface(isospline.Volume(np.ones((9, 9, 9)), degree=1), 0.5, closed=True)
    for surface, faces in ((isospline.Isosurface(ball.volume, ball.level, clip=half, capped=True), 400), (slab, 12)):
        mesh = surface.to_mesh(faces=faces)
        assert 0.8 * faces <= len(mesh.faces) <= faces
        edges = np.sort(mesh.faces.astype(int)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_no_more_faces_than_the_finest_tolerance_needs():
    flat = isospline.Isosurface(isospline.Volume(np.mgrid[:5, :5, :5][0]), 1.7)
    mesh, distance = flat.to_mesh(faces=100_000, return_distance=True)
    assert 2 <= len(mesh.faces) < 100 and distance < 1 / 32 + 1e-9


def test_an_empty_surface_has_an_empty_mesh():
    field = isospline.volumes.sphere(RADIUS)
    with pytest.warns(UserWarning, match="there is no surface"):
        surface = isospline.Isosurface(field.volume(8), 1e9)
    assert len(surface.to_mesh(faces=10).faces) == 0


def test_too_few_faces_are_an_error_that_names_the_fewest(ball):
    with pytest.raises(ValueError, match=r"faces: expected about \d+ or more.* at most [\d.]+ from.*, got 4"):
        ball.to_mesh(faces=4)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"faces": 0}, "faces: expected at least 1, got 0"),
        ({"faces": 9, "tolerance": 1.0}, "faces: expected either a tolerance or faces, got both"),
        ({"faces": 9, "return_distance": True, "return_report": True}, "return_distance: expected one of"),
        ({"return_report": True}, "return_report: expected a tolerance or faces as well"),
    ],
)
def test_bad_options_are_refused(ball, options, message):
    with pytest.raises(ValueError, match=message):
        ball.to_mesh(**options)


def test_progress_grows_and_cancels(ball):
    seen = []
    ball.to_mesh(faces=500, progress=seen.append)
    assert seen == sorted(seen) and seen[0] >= 0 and seen[-1] <= 1
    with pytest.raises(RuntimeError, match="cancelled"):
        ball.to_mesh(faces=2000, progress=lambda fraction: fraction < 0.1)


def test_interop_and_files_take_faces(ball, tmp_path):
    pytest.importorskip("trimesh")
    assert 80 <= len(ball.to_trimesh(faces=100).faces) <= 100
    ball.write(tmp_path / "ball.stl", faces=100)
    assert 80 <= len(isospline.read_mesh(tmp_path / "ball.stl").faces) <= 100
