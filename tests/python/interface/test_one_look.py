"""One look: Python, the command, notebooks and the viewer show the same picture if nothing is said, bit for bit."""

import io

import numpy as np
import pytest
import scipy.ndimage

import isospline
from isospline.cli.main import main
from isospline.picture.scenes import as_scene
from isospline.viewer.picture import PictureMaker, passes
from isospline.viewer.script import script
from isospline.viewer.state import CameraState

PIL = pytest.importorskip("PIL.Image")
SIZE = (160, 120)  # of pictures that need not have the default size


@pytest.fixture(scope="module")
def samples():
    """A ball with a dent on a slab, a speck apart, and noise."""
    z, y, x = np.mgrid[:32, :40, :36].astype(float)
    values = 900 - 60 * np.hypot(np.hypot(x - 17, y - 18), z - 17)
    values = np.minimum(values, 60 * np.hypot(np.hypot(x - 17, y - 8), z - 22) - 100)
    values[2:5, 4:36, 4:32] = 700
    values[28, 36, 32] = 900
    return (values + np.random.default_rng(1).normal(0, 8, values.shape)).astype(np.float32)


@pytest.fixture(scope="module")
def file(samples, tmp_path_factory):
    path = tmp_path_factory.mktemp("look") / "ball.npy"
    np.save(path, samples)
    return path


def pixels(content):
    return np.asarray(PIL.open(io.BytesIO(content)))


def by_command(path, *options):
    picture = path.with_suffix(".png")
    assert main(["render", str(path), "-o", str(picture), "--quiet", *options]) == 0
    return pixels(picture.read_bytes())


def by_viewer(shown, camera):
    """The picture that stays, and the code that makes it, with a camera: that of a window has a wider margin."""
    with isospline.view(shown, browser=False) as viewer:
        home = viewer.camera_towards("home", SIZE).camera()
        np.testing.assert_allclose(home.world_to_camera[:3, :3], camera.world_to_camera[:3, :3], atol=1e-6)
        state = viewer.state.replace(camera=CameraState.of(camera))
        image = PictureMaker(viewer.document).render(state, SIZE, passes(state)[-1], encoding="srgb8")
        return image.to_srgb(), script(viewer.document, state, SIZE, "viewer.png")


def test_a_file_an_array_a_notebook_and_the_command(file, samples):
    image = isospline.render(file)
    assert image.size == (640, 480)
    expected = image.to_srgb()
    np.testing.assert_array_equal(pixels(isospline.Volume(samples)._repr_png_()), expected)
    np.testing.assert_array_equal(by_command(file), expected)
    # It is in studio light on the light background, and the speck is gone.
    told = isospline.render(samples, light="studio", samples=4, background="#e8ebef", annotate=(), size=SIZE)
    assert told == isospline.render(samples, size=SIZE) == isospline.render(file, size=SIZE)


def test_the_viewer_and_its_code(file, samples, tmp_path, monkeypatch):
    pytest.importorskip("websockets")
    expected = isospline.render(samples, size=SIZE).to_srgb()
    shown, program = by_viewer(file, isospline.camera_for(as_scene(samples)))
    np.testing.assert_array_equal(shown, expected)
    monkeypatch.chdir(tmp_path)
    exec(compile(program, "picture.py", "exec"), {})  # as a user runs it
    np.testing.assert_array_equal(pixels((tmp_path / "viewer.png").read_bytes()), expected)
    volume = isospline.Volume(samples)
    scene = isospline.Scene([isospline.Isosurface(volume, level, closed=True) for level in (300, 600)])
    shown, _ = by_viewer(scene, isospline.camera_for(scene))
    np.testing.assert_array_equal(shown, isospline.render(scene, size=SIZE).to_srgb())


def test_a_level_and_the_quick_variant(file, samples):
    options = {"level": 500.0, "size": SIZE}
    expected = isospline.render(samples, **options)
    words = "-l", "500", "--size", "160x120"
    np.testing.assert_array_equal(by_command(file, *words), expected.to_srgb())
    quick = isospline.render(file, light=isospline.Studio(fast=True), **options)
    np.testing.assert_array_equal(by_command(file, *words, "--fast"), quick.to_srgb())
    assert quick != expected


def test_several_objects_have_the_same_colours_everywhere(file, samples):
    volume = isospline.Volume(samples)
    outer, inner = (isospline.Isosurface(volume, level, closed=True) for level in (300, 600))
    scene = isospline.Scene([outer, inner])
    small = isospline.render(scene, size=SIZE)
    np.testing.assert_array_equal(by_command(file, "-l", "300", "-l", "600", "--size", "160x120"), small.to_srgb())
    np.testing.assert_array_equal(pixels(scene._repr_png_()), isospline.render(scene).to_srgb())


def test_a_scale_bar_if_the_unit_is_known(samples, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(samples.T, np.diag((-0.5, -0.5, 0.5, 1)))
    image.header.set_xyzt_units("mm")
    nibabel.save(image, tmp_path / "ball.nii")
    small = {"size": SIZE}
    shown = isospline.render(tmp_path / "ball.nii", **small)
    np.testing.assert_array_equal(by_command(tmp_path / "ball.nii", "--size", "160x120"), shown.to_srgb())
    data = isospline.read_volume(tmp_path / "ball.nii")
    assert isospline.render(data, **small) == shown != isospline.render(data, annotate=(), **small)
    assert isospline.render(data, light="studio", **small) == isospline.render(data, annotate=(), **small)
    volume = data.to_volume()
    np.testing.assert_array_equal(pixels(volume._repr_png_()), isospline.render(volume).to_srgb())
    crop = isospline.render(volume, crop=(0, 400, 64, 80))
    assert crop.size == (64, 80)  # which has no scale bar


def test_files_of_labels_meshes_and_stores(samples, tmp_path):
    labels = np.zeros((24, 26, 28), np.uint8)
    labels[4:12, 5:20, 5:20], labels[12:20, 5:20, 8:20] = 1, 2
    labels = scipy.ndimage.median_filter(labels, 5)
    np.save(tmp_path / "labels.npy", labels)
    expected = isospline.render(tmp_path / "labels.npy", size=SIZE)
    np.testing.assert_array_equal(by_command(tmp_path / "labels.npy", "--size", "160x120"), expected.to_srgb())
    assert expected == isospline.render(isospline.Labels(labels).scene(closed=True), size=SIZE)

    surface = isospline.Isosurface(isospline.Volume(samples), 400.0, closed=True)
    surface.write(tmp_path / "ball.ply")
    mesh = isospline.read_mesh(tmp_path / "ball.ply")
    assert isospline.render(tmp_path / "ball.ply", size=SIZE) == isospline.render(mesh, size=SIZE)
    with pytest.raises(ValueError, match="^level: expected none with the file of a mesh, got 3"):
        isospline.render(tmp_path / "ball.ply", level=3.0)


def test_a_store_is_shown_at_the_scale_of_the_picture(samples, tmp_path):
    pytest.importorskip("zarr")
    fine = scipy.ndimage.zoom(samples, 2, order=1)
    np.save(tmp_path / "fine.npy", fine)
    assert main(["convert", str(tmp_path / "fine.npy"), str(tmp_path / "fine.zarr"), "--quiet"]) == 0
    expected = isospline.render(tmp_path / "fine.zarr", level=400.0, size=(40, 30))
    by_hand = by_command(tmp_path / "fine.zarr", "-l", "400", "--size", "40x30")
    np.testing.assert_array_equal(by_hand, expected.to_srgb())


def test_what_cannot_be_shown_is_told(tmp_path):
    with pytest.raises(FileNotFoundError):
        isospline.render(tmp_path / "missing.npy")
    with pytest.raises(ValueError, match="expected a name that ends in"):
        (tmp_path / "text.txt").write_text("text", encoding="utf-8")
        isospline.render(tmp_path / "text.txt")
    with pytest.raises(TypeError, match="^scene: expected a Scene, an Isosurface, .*an array or a file, got"):
        isospline.render({"a": 1})


def test_a_name_and_an_opacity_leave_the_colour(samples):
    volume, options = isospline.Volume(samples), {"size": (96, 72)}
    plain, named = (isospline.Isosurface(volume, 400.0, **look) for look in ({}, {"name": "a ball"}))
    assert isospline.render(plain, **options) == isospline.render(named, **options)
    thin = isospline.Isosurface(volume, 400.0, opacity=0.4)
    assert isospline.render(thin, **options) == isospline.render(plain, opacity=0.4, **options)
    assert isospline.render(thin, **options) != isospline.render(plain, **options)


def test_backgrounds_and_encodings_of_the_default_light(samples):
    options = {"size": (96, 72)}
    image = isospline.render(samples, **options)
    transparent = isospline.render(samples, background="transparent", **options)
    assert (image.color[..., 3] > 0.999).all() and (transparent.color[0, 0, 3] < 0.5)
    np.testing.assert_allclose(transparent.over("#e8ebef").color, image.color, atol=2e-6)
    np.testing.assert_array_equal(isospline.render(samples, encoding="srgb8", **options).to_srgb(), image.to_srgb())
    with pytest.raises(ValueError, match="^encoding: expected "):
        isospline.render(samples, encoding="srgb16", **options)
    assert isospline.render(samples, light="phong", **options).color[0, 0, 3] == 0
