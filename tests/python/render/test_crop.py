"""Crops: windows of pictures have the pixels of the whole, bit for bit."""

import pickle

import numpy as np
import pytest

import isospline

SIZE = (61, 47)
WINDOWS = [(13, 5, 31, 29), (0, 0, 61, 47), (60, 46, 1, 1), (0, 16, 17, 31)]
LAYERS = ("depth", "position", "normal", "albedo", "gradient_magnitude", "curvature", "geometry_ids", "primitive_ids")


@pytest.fixture(scope="module")
def scene():
    field = isospline.volumes.gyroid()
    volume = field.volume(24)
    ball = isospline.volumes.sphere()
    beside = isospline.Isosurface(ball.volume(16), ball.level, inside="below")
    return isospline.Scene([isospline.Isosurface(volume, field.level), beside])


@pytest.fixture(scope="module")
def camera(scene):
    return isospline.camera_for(scene, view=(2, -3, 1), size=SIZE)


def compare(whole, part, window):
    x, y, width, height = window
    assert part.size == (width, height) and part.crop == window and part.full_size == whole.size
    assert np.array_equal(part.world_to_camera, whole.world_to_camera)
    pixels = np.s_[y : y + height, x : x + width]
    assert np.array_equal(np.asarray(part), np.asarray(whole)[pixels])
    for name in (*whole.layers, "color"):
        if name == "color" and whole._arrays.color is None:
            continue
        assert np.array_equal(getattr(part, name), getattr(whole, name)[pixels]), name


@pytest.mark.parametrize(
    "look",
    [
        dict(light=isospline.Phong(), layers=LAYERS),
        dict(light=isospline.Phong(color=isospline.ColorByDepth(cmap=[(0, 0, 0), (1, 1, 1)])), samples=4),
        dict(light=isospline.Phong(shadows=True, opacity=0.6), samples=3, background=(0.2, 0.4, 0.6)),
        dict(light=isospline.Outline(2), samples=2, layers=("curvature",)),
        dict(light=isospline.AmbientOcclusion(8), layers=("ambient_occlusion",)),
        dict(encoding="srgb8", samples=4, background="white"),
        dict(light=isospline.PathTracer(max_bounces=3), samples=3, layers=("albedo", "direct", "variance")),
        dict(light=isospline.PathTracer(seed=5), samples=1, encoding="srgb8"),
        dict(light=isospline.Studio(light_samples=2), samples=4, background="white"),
        dict(light=isospline.Studio(), opacity=0.5, samples=3, background="white"),
        dict(light=isospline.Studio(fast=True), background="white"),
    ],
    ids=lambda look: "-".join(look),
)
def test_a_crop_has_the_pixels_of_the_whole_picture(scene, camera, look):
    whole = isospline.render(scene, camera, size=SIZE, **look)
    assert whole.crop == (0, 0, *SIZE)
    for window in WINDOWS:
        compare(whole, isospline.render(scene, camera, size=SIZE, crop=window, **look), window)


def test_every_camera_is_cropped(scene):
    eye, target = (3, -6, 2), (0, 0, 0)
    cameras = [
        isospline.PerspectiveCamera(eye, target, aperture_radius=0.2),
        isospline.OrthographicCamera(eye, target, height=4),
        isospline.PanoramicCamera((0.1, 0.2, 0.3), target),
        isospline.ProjectionPlaneCamera(eye, right=(2, 1, 0), down=(0, 0.1, -2), center=(1.5, -3, 1)),
    ]
    for camera in cameras:
        for look in (dict(samples=4, layers=("depth",)), dict(light=isospline.PathTracer(), samples=2)):
            whole = isospline.render(scene, camera, size=SIZE, **look)
            compare(whole, isospline.render(scene, camera, size=SIZE, crop=WINDOWS[0], **look), WINDOWS[0])


def test_a_crop_keeps_its_place_in_pickles_copies_and_files(scene, camera, tmp_path):
    OpenEXR = pytest.importorskip("OpenEXR")
    x, y, width, height = window = WINDOWS[0]
    image = isospline.render(scene, camera, size=SIZE, crop=window, layers=("depth", "primitive_ids"), light="phong")
    assert pickle.loads(pickle.dumps(image)) == image and pickle.loads(pickle.dumps(image)).crop == window
    image.write(tmp_path / "crop.exr")
    with OpenEXR.File(str(tmp_path / "crop.exr")) as file:
        header, channels = file.header(), file.channels()
        assert [corner.tolist() for corner in header["dataWindow"]] == [[x, y], [x + width - 1, y + height - 1]]
        assert [corner.tolist() for corner in header["displayWindow"]] == [[0, 0], [SIZE[0] - 1, SIZE[1] - 1]]
        assert np.array_equal(channels["RGBA"].pixels, image.color)
        assert np.array_equal(channels["Z"].pixels, image.depth)
    image.write(tmp_path / "crop.png")


@pytest.mark.parametrize("window", [(-1, 0, 4, 4), (0, 0, 0, 4), (60, 0, 2, 4), (0, 0, 4, 2**31 - 1), (0, 47, 1, 1)])
@pytest.mark.parametrize("look", [{}, {"light": isospline.PathTracer()}])
def test_crops_beyond_the_picture_are_refused(scene, camera, window, look):
    with pytest.raises(ValueError, match="^crop: expected columns and rows within 61 x 47 pixels"):
        isospline.render(scene, camera, size=SIZE, crop=window, **look)


def test_crops_of_another_type_and_marks_are_refused(scene, camera):
    with pytest.raises(TypeError, match="crop"):
        isospline.render(scene, camera, size=SIZE, crop=(1, 2, 3), light="phong")
    with pytest.raises(TypeError, match="crop"):
        isospline.render(scene, camera, size=SIZE, crop=(0.5, 0, 2, 2), light="phong")
    with pytest.raises(ValueError, match="^annotate: cannot be combined with a crop"):
        isospline.render(scene, camera, size=SIZE, crop=(0, 0, 4, 4), annotate="scale_bar", light="phong")
