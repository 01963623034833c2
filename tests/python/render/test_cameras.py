"""Cameras: rays against closed forms, matrices against rays, framing of bounds."""

import numpy as np
import pytest
from projections import corners_of, project

import isospline

CAMERAS = [
    isospline.PerspectiveCamera((3, -5, 2), (0.5, 0.2, 0.1), (0, 0, 1), 35),
    isospline.PerspectiveCamera((-1, 4, 7), (2, 2, 2), (0.3, 1, 0), 100, field_of_view_axis="diagonal"),
    isospline.ProjectionPlaneCamera((0.3, -4, 0.2), corner=(-1, -2, 1), right=(2.5, 0.1, 0), down=(0.1, 0.3, -1.5)),
    isospline.OrthographicCamera((1, 2, -6), (0, 0, 0), (0, 1, 0), height=3),
]


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: type(camera).__name__)
def test_points_of_a_ray_project_onto_its_pixel(camera, rng):
    size = (33, 21)
    rays = camera.rays(size)
    assert rays.shape == (21, 33, 6) and rays.dtype == np.float64
    points = rays[..., :3] + rng.uniform(0.1, 9, (21, 33, 1)) * rays[..., 3:]
    pixels = project(camera.world_to_ndc(size), points, size)
    centers = np.stack(np.meshgrid(np.arange(33) + 0.5, np.arange(21) + 0.5), axis=-1)
    np.testing.assert_allclose(pixels, centers, atol=1e-9)


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: type(camera).__name__)
def test_camera_space_is_rigid_and_left_handed(camera):
    rotation = camera.world_to_camera[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(-1)
    np.testing.assert_allclose(camera.world_to_camera @ [*camera.eye, 1], [0, 0, 0, 1], atol=1e-12)


def test_perspective_rays_are_the_closed_form():
    camera = isospline.PerspectiveCamera((1, 2, 3), (1, 7, 3), field_of_view=60)
    rays = camera.rays((8, 4))
    i, j = np.meshgrid(np.arange(8), np.arange(4))
    scale = 2 * np.tan(np.radians(30)) / 4
    expected = np.stack([scale * (i + 0.5 - 4), np.ones_like(i), -scale * (j + 0.5 - 2)], axis=-1)
    np.testing.assert_allclose(rays[..., 3:], expected, atol=1e-12)
    np.testing.assert_array_equal(rays[..., :3], np.broadcast_to((1, 2, 3), (4, 8, 3)))


@pytest.mark.parametrize("axis, pixels", [("vertical", 30), ("horizontal", 40), ("diagonal", 50)])
def test_field_of_view_axis(axis, pixels):
    camera = isospline.PerspectiveCamera((0, 0, 0), (0, 1, 0), (0, 0, 1), 80, field_of_view_axis=axis)
    right_edge = np.array([np.tan(np.radians(40)) * 40 / pixels, 1, 0])
    np.testing.assert_allclose(project(camera.world_to_ndc((40, 30)), right_edge, (40, 30)), [40, 15])


def test_the_papers_camera():
    camera = isospline.ProjectionPlaneCamera((0, -5, 0), center=(0, 0, 0), right=(1.6, 0, 0), down=(0, 0, -0.9))
    np.testing.assert_allclose(camera.corner, (-0.8, 0, 0.45))
    rays = camera.rays((16, 9))
    plane = rays[..., :3] + rays[..., 3:]
    np.testing.assert_allclose(plane[0, 0], (-0.75, 0, 0.4), atol=1e-12)
    np.testing.assert_allclose(plane[-1, -1], (0.75, 0, -0.4), atol=1e-12)
    with pytest.raises(ValueError, match="one of them, got both"):
        isospline.ProjectionPlaneCamera((0, -5, 0), corner=(0, 0, 0), center=(0, 0, 0), right=(1, 0, 0), down=(0, 1, 0))
    with pytest.raises(ValueError, match="one of them, got none"):
        isospline.ProjectionPlaneCamera((0, -5, 0), right=(1, 0, 0), down=(0, 1, 0))


@pytest.mark.parametrize(
    "arguments, parameter",
    [
        (dict(eye=(1, 2, 3), target=(1, 2, 3)), "target"),
        (dict(up=(0, 3, 0)), "up"),
        (dict(up=(0, 0, 0)), "up"),
        (dict(up=(0, 1)), "up"),
        (dict(eye=(0, np.nan, 0)), "eye"),
        (dict(target=(0, np.inf, 0)), "target"),
        (dict(field_of_view=0), "field_of_view"),
        (dict(field_of_view=180), "field_of_view"),
        (dict(field_of_view=np.nan), "field_of_view"),
        (dict(field_of_view_axis="vertikal"), "field_of_view_axis"),
    ],
)
def test_bad_perspective_cameras(arguments, parameter):
    with pytest.raises(ValueError, match=f"^{parameter}: expected .* got "):
        isospline.PerspectiveCamera(**{"eye": (0, -9, 0), "target": (0, 0, 0), **arguments})


def test_bad_other_cameras():
    for height in (0, -1, np.nan, np.inf):
        with pytest.raises(ValueError, match="height"):
            isospline.OrthographicCamera((0, -9, 0), (0, 0, 0), height=height)
    with pytest.raises(ValueError, match="down"):
        isospline.ProjectionPlaneCamera((0, -5, 0), corner=(0, 0, 0), right=(1, 0, 0), down=(2, 0, 0))
    with pytest.raises(ValueError, match="eye"):
        isospline.ProjectionPlaneCamera((0.3, 0, 7), corner=(0, 0, 0), right=(1, 0, 0), down=(0, 0, 1))
    with pytest.raises(ValueError, match="size"):
        CAMERAS[0].rays((0, 4))
    with pytest.raises(TypeError):
        isospline.OrthographicCamera((0, -9, 0), (0, 0, 0), height=1, width=2)
    with pytest.raises(TypeError):
        isospline.PerspectiveCamera("eye", (0, 0, 0))


@pytest.mark.parametrize("size", [(640, 360), (90, 200)])
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("view", ["front", "back", "left", "right", "top", "bottom", "+x", "-z", "iso", (1, 2, -3)])
def test_camera_for_frames_bounds(view, projection, size):
    bounds = np.array([(-3, 10, 2), (5, 11, 8)])
    camera = isospline.camera_for(bounds, view=view, projection=projection, size=size, margin=0.1)
    pixels = project(camera.world_to_ndc(size), corners_of(bounds), size) / size
    assert (pixels >= 0.05 - 1e-9).all() and (pixels <= 0.95 + 1e-9).all()
    # Tight: a corner touches the margin.
    assert np.abs(pixels - 0.5).max() == pytest.approx(0.45)
    depths = corners_of(bounds) @ camera.world_to_camera[2, :3] + camera.world_to_camera[2, 3]
    assert (depths > 0).all()


@pytest.mark.parametrize(
    "view, forward, up",
    [
        ("front", (0, 1, 0), (0, 0, 1)),
        ("back", (0, -1, 0), (0, 0, 1)),
        ("left", (-1, 0, 0), (0, 0, 1)),
        ("right", (1, 0, 0), (0, 0, 1)),
        ("top", (0, 0, -1), (0, 1, 0)),
        ("bottom", (0, 0, 1), (0, -1, 0)),
        ("anterior", (0, 1, 0), (0, 0, 1)),
        ("posterior", (0, -1, 0), (0, 0, 1)),
        ("superior", (0, 0, -1), (0, -1, 0)),
        ("inferior", (0, 0, 1), (0, -1, 0)),
        ((0, 0, 2), (0, 0, -1), (0, 1, 0)),
    ],
)
def test_view_names_are_axes(view, forward, up):
    camera = isospline.camera_for([(-1, -1, -1), (1, 1, 1)], view=view)
    np.testing.assert_allclose(camera.world_to_camera[2, :3], forward, atol=1e-12)
    np.testing.assert_allclose(camera.world_to_camera[1, :3], up, atol=1e-12)
    if view in ("front", "top", "bottom"):
        np.testing.assert_allclose(camera.world_to_camera[0, :3], (1, 0, 0), atol=1e-12)


def test_camera_for_takes_an_up_vector_and_flat_boxes():
    camera = isospline.camera_for([(-1, -1, -1), (1, 1, 1)], view="front", up=(1, 0, 0))
    np.testing.assert_allclose(camera.world_to_camera[1, :3], (1, 0, 0), atol=1e-12)
    for projection in ("perspective", "orthographic"):
        isospline.camera_for([(0, 0, 0), (1, 0, 1)], view="right", projection=projection)
        isospline.camera_for([(2, 3, 4), (2, 3, 4)], projection=projection)


@pytest.mark.parametrize(
    "arguments, parameter",
    [
        (dict(view="above"), "view"),
        (dict(view=(0, 0, 0)), "view"),
        (dict(view=(0, np.nan, 1)), "view"),
        (dict(view="front", up=(0, 1, 0)), "up"),
        (dict(projection="fisheye"), "projection"),
        (dict(margin=1), "margin"),
        (dict(field_of_view=180), "field_of_view"),
        (dict(scene=[(1, 1, 1), (0, 0, 0)]), "scene"),
        (dict(scene=[(0, 0, 0), (1, 1, np.inf)]), "scene"),
        (dict(scene=[0, 1]), "scene"),
        (dict(size=(0, 3)), "size"),
    ],
)
def test_bad_framing(arguments, parameter):
    with pytest.raises(ValueError, match=f"^{parameter}: expected .* got "):
        isospline.camera_for(**{"scene": [(0, 0, 0), (1, 1, 1)], **arguments})


def test_margins_that_are_no_numbers():
    with pytest.raises(TypeError, match="^margin: expected a number, got 'wide'$"):
        isospline.camera_for([(0, 0, 0), (1, 1, 1)], margin="wide")
