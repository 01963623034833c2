"""Depth of field against the closed form of the circle of confusion; panoramas against spherical coordinates."""

import numpy as np
import pytest
from layered import render

import isospline

SIZE = (96, 64)
RADIUS, FOCUS = 0.4, 5.0


def half_plane(depth):
    """A wall at y = depth that covers x < 0."""
    corners = [(-99, depth, -99), (0, depth, -99), (0, depth, 99), (-99, depth, 99)]
    return isospline.Mesh(corners, [(0, 1, 2), (0, 2, 3)])


def camera(**lens):
    return isospline.PerspectiveCamera((0, 0, 0), (0, 1, 0), field_of_view=40, **lens)


def edge(depth, samples, **lens):
    """The mean coverage of each column in an image of the half-plane, and the columns' x on the plane at distance 1."""
    scene = isospline.Scene([half_plane(depth)])
    image = render(scene, camera(**lens), size=SIZE, samples=samples)
    x = camera().rays(SIZE)[0, :, 3]
    return image.color[..., 3].mean(0), x


def disc_left_of(u):
    """The fraction of the unit disc to the left of x = u."""
    u = np.clip(u, -1, 1)
    return 1 - (np.arccos(u) - u * np.sqrt(1 - u**2)) / np.pi


@pytest.mark.parametrize("depth", [2.0, 3.0, 12.0])
def test_an_edge_out_of_focus_blurs_over_the_circle_of_confusion(depth):
    coverage, x = edge(depth, 64, aperture_radius=RADIUS, focus_distance=FOCUS)
    # The ray for x from the point a r of the lens meets the wall's plane at a r + depth (x - a r / focus).
    blur = RADIUS * abs(1 / depth - 1 / FOCUS)
    pixel = x[1] - x[0]
    assert blur > 2 * pixel
    fine = (x[:, None] + pixel * (np.arange(32) + 0.5) / 32 - pixel / 2) / blur
    expected = disc_left_of(-fine).mean(1)
    assert np.abs(coverage - expected).max() < 0.01
    assert np.abs(coverage - (x < 0)).max() > 0.3


def test_an_edge_in_focus_is_sharp():
    coverage, x = edge(FOCUS, 16, aperture_radius=RADIUS, focus_distance=FOCUS)
    np.testing.assert_allclose(coverage, x < 0, atol=1e-6)
    blurred = edge(FOCUS, 16, aperture_radius=RADIUS)[0]  # by default the target is in focus
    assert np.abs(blurred - coverage).max() > 0.1


def test_the_lens_changes_only_colours():
    scene = isospline.Scene([half_plane(3.0)])
    sharp = render(scene, camera(), size=SIZE)
    for samples in (1, 5, 8):
        image = render(scene, camera(aperture_radius=RADIUS), size=SIZE, samples=samples)
        for name in ("depth", "position", "normal", "geometry_ids", "primitive_ids"):
            np.testing.assert_array_equal(getattr(image, name), getattr(sharp, name))
        assert not np.array_equal(image.color, sharp.color)


def test_threads_do_not_change_an_image_through_a_lens():
    scene = isospline.Scene([half_plane(3.0)])
    images = []
    try:
        for threads in (1, 2):
            isospline.set_thread_count(threads)
            images.append(render(scene, camera(aperture_radius=RADIUS), size=SIZE, samples=3).color.tobytes())
    finally:
        isospline.set_thread_count(0)
    assert images[0] == images[1]


def test_with_lens():
    pinhole = camera()
    assert pinhole.aperture_radius == 0 and pinhole.focus_distance == 1
    assert repr(pinhole).endswith("aperture_radius=0, focus_distance=1)")
    lens = pinhole.with_lens(0.25, focus_distance=3)
    assert (lens.aperture_radius, lens.focus_distance) == (0.25, 3)
    assert repr(lens).endswith("aperture_radius=0.25, focus_distance=3)")
    lens = pinhole.with_lens(f_number=4, focal_length=2)
    assert (lens.aperture_radius, lens.focus_distance) == (0.25, 1)
    np.testing.assert_array_equal(lens.rays(SIZE), pinhole.rays(SIZE))


@pytest.mark.parametrize(
    "arguments, parameter",
    [
        (dict(), "aperture_radius, f_number"),
        (dict(aperture_radius=1, f_number=2), "aperture_radius, f_number"),
        (dict(f_number=2), "f_number, focal_length"),
        (dict(aperture_radius=1, focal_length=2), "f_number, focal_length"),
        (dict(f_number=0, focal_length=2), "f_number"),
        (dict(f_number=2, focal_length=-1), "focal_length"),
        (dict(aperture_radius=-1), "aperture_radius"),
        (dict(aperture_radius=np.nan), "aperture_radius"),
        (dict(aperture_radius=1, focus_distance=0), "focus_distance"),
        (dict(aperture_radius=1, focus_distance=np.inf), "focus_distance"),
    ],
)
def test_bad_lenses(arguments, parameter):
    with pytest.raises(ValueError, match=f"^{parameter}: expected .* got "):
        camera().with_lens(**arguments)


def test_a_panorama_from_inside_a_box():
    box = isospline.volumes.sphere(0.5)
    volume = box.volume(48)
    scene = isospline.Scene([isospline.Isosurface(volume, box.level)])
    eye = np.array([0.1, -0.2, 0.05])
    panorama = isospline.PanoramicCamera(eye, eye + (0, 1, 0))
    size = (120, 60)
    image = render(scene, panorama, size=size)
    assert np.isfinite(image.depth).all()

    # The spherical coordinates of a visible point are those of its pixel.
    seen = image.position - eye
    np.testing.assert_allclose(np.linalg.norm(seen, axis=-1), image.depth, rtol=1e-6)
    longitude = np.degrees(np.arctan2(seen[..., 0], seen[..., 1]))
    latitude = np.degrees(np.arcsin(seen[..., 2] / image.depth))
    np.testing.assert_allclose(longitude, np.broadcast_to(-180 + 3 * (np.arange(120) + 0.5), (60, 120)), atol=1e-3)
    np.testing.assert_allclose(latitude, np.broadcast_to(90 - 3 * (np.arange(60) + 0.5), (120, 60)).T, atol=1e-3)

    assert image.world_to_ndc is None and not hasattr(panorama, "world_to_ndc")
    assert repr(panorama) == "PanoramicCamera(eye=(0.1, -0.2, 0.05), target=(0.1, 0.8, 0.05), up=(0, 0, 1))"
    np.testing.assert_allclose(image.world_to_camera, panorama.world_to_camera)
    for arguments in ((eye, eye), (eye, eye + (0, 0, 2)), ((0, 0, np.nan), eye)):
        with pytest.raises(ValueError, match="expected .* got "):
            isospline.PanoramicCamera(*arguments)


def test_a_panorama_as_exr_has_no_matrix_to_ndc(tmp_path):
    OpenEXR = pytest.importorskip("OpenEXR")
    panorama = isospline.PanoramicCamera((0, 0, 0), (0, 1, 0))
    render(isospline.Scene([half_plane(1.0)]), panorama, size=(8, 4)).write(tmp_path / "a.exr")
    header = OpenEXR.File(str(tmp_path / "a.exr")).header()
    assert "worldToCamera" in header and "worldToNDC" not in header
