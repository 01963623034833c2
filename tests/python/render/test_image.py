"""Arrays of an image, and the files it is written to."""

import copy
import errno
import io
import os
import subprocess
import sys
import textwrap

import numpy as np
import PIL.Image
import pytest
from layered import render

import isospline

OpenEXR = pytest.importorskip("OpenEXR")

SIZE = (60, 45)
IDS = ("id.geometry", "id.primitive", "id.primitive_high")
CURVATURES = ("curvature.mean", "curvature.gaussian")


@pytest.fixture(scope="module")
def camera():
    return isospline.PerspectiveCamera((4, -25, 3), (0, 0, 0), field_of_view=40)


@pytest.fixture(scope="module")
def image(camera):
    z, y, x = np.mgrid[-12:13, -12:13, -12:13].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=(-12, -12, -12))
    scene = isospline.Scene([isospline.Isosurface(volume, 40, inside="below")])
    return render(
        scene, camera, size=SIZE, light=isospline.Phong(color=(1, 0.5, 0.2)), samples=4, layers=("curvature",)
    )


def test_arrays_share_the_images_memory(image):
    width, height = SIZE
    for name, shape, dtype in (
        ("color", (height, width, 4), np.float32),
        ("depth", (height, width), np.float32),
        ("position", (height, width, 3), np.float32),
        ("normal", (height, width, 3), np.float32),
        ("albedo", (height, width, 3), np.float32),
        ("gradient_magnitude", (height, width), np.float32),
        ("curvature", (height, width, 2), np.float32),
        ("geometry_ids", (height, width), np.uint32),
        ("primitive_ids", (height, width), np.uint64),
    ):
        array = getattr(image, name)
        assert array.shape == shape and array.dtype == dtype and array.flags.c_contiguous
        assert not array.flags.owndata and np.shares_memory(array, getattr(image, name))


def test_arrays_outlive_the_image(camera):
    volume = isospline.Volume(np.random.default_rng(1).random((9, 9, 9)), origin=(-4, -4, -4))
    color = render(isospline.Scene([isospline.Isosurface(volume, 0.5)]), camera, size=(50, 50)).color
    before = color.copy()
    np.full((50, 50, 4), 7, np.float32)
    np.testing.assert_array_equal(color, before)


def test_repr(image):
    assert repr(image).startswith("Image(60 x 45, ")


def test_srgb_is_the_standards_curve(image):
    srgb = image.to_srgb()
    assert srgb.shape == (45, 60, 4) and srgb.dtype == np.uint8
    alpha = image.color[..., 3].astype(float)
    np.testing.assert_array_equal(srgb[..., 3], np.rint(255 * alpha))
    shown = alpha > 0
    # Back through the inverse curve: within half a step of the stored value.
    encoded = srgb[shown][:, :3] / 255
    decoded = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    linear = np.clip(image.color[shown][:, :3] / alpha[shown, None], 0, 1)
    slope = np.where(encoded <= 0.04045, 1 / 12.92, 2.4 / 1.055 * ((encoded + 0.055) / 1.055) ** 1.4)
    assert (np.abs(decoded - linear) <= 0.51 / 255 * np.maximum(slope, 1 / 12.92) + 2e-5).all()
    assert not srgb[~shown].any()


@pytest.mark.parametrize("integrator", [None, isospline.PathTracer()], ids=["shading", "path tracer"])
@pytest.mark.parametrize("background", [None, (0.2, 0.4, 0.8), (1, 1, 1, 0.3)])
def test_an_image_of_8_bits_is_the_linear_one_encoded(camera, tmp_path, integrator, background):
    scene = isospline.Scene([isospline.Mesh([(-9, 0, -9), (9, 0, -9), (0, 0, 9)], [(0, 1, 2)])])
    options = dict(size=SIZE, samples=2, light=integrator, background=background)
    linear, encoded = (isospline.render(scene, camera, encoding=name, **options) for name in ("linear", "srgb8"))
    srgb = encoded.to_srgb()
    assert srgb.shape == (45, 60, 4) and srgb.dtype == np.uint8 and len(np.unique(srgb)) > 3
    np.testing.assert_array_equal(srgb, linear.to_srgb())
    assert not srgb.flags.owndata and repr(encoded) == repr(linear)
    encoded.write(tmp_path / "image.png")
    np.testing.assert_array_equal(np.asarray(PIL.Image.open(tmp_path / "image.png")), srgb)
    with pytest.raises(AttributeError, match="^color: expected render.*linear.* got an image of 8-bit sRGB$"):
        encoded.color
    with pytest.raises(ValueError, match="^image: expected one of linear colour"):
        encoded.write(tmp_path / "image.exr")
    assert os.listdir(tmp_path) == ["image.png"]


def test_srgb_follows_changes_of_the_colour(camera):
    image = isospline.render(isospline.Scene(), camera, size=(4, 3), light="phong")
    image.color[1, 2] = (0.25, 0.5, 0.0, 0.5)
    assert image.to_srgb()[1, 2].tolist() == [188, 255, 0, 128] and not image.to_srgb()[0].any()


def test_exr_holds_everything(image, camera, tmp_path):
    path = tmp_path / "image.exr"
    image.write(path)
    assert os.listdir(tmp_path) == ["image.exr"]
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
        header = dict(file.header())
    vectors = [layer + part for layer, parts in (("P.", "XYZ"), ("N.", "XYZ"), ("albedo.", "RGB")) for part in parts]
    assert set(channels) == {"R", "G", "B", "A", "Z", "gradient_magnitude", *vectors, *CURVATURES, *IDS}
    for part, name in enumerate("RGBA"):
        np.testing.assert_array_equal(channels[name], image.color[..., part])
    for axis, name in enumerate("XYZ"):
        np.testing.assert_array_equal(channels["P." + name], image.position[..., axis])
        np.testing.assert_array_equal(channels["N." + name], image.normal[..., axis])
        np.testing.assert_array_equal(channels["albedo." + "RGB"[axis]], image.albedo[..., axis])
    for part, name in enumerate(CURVATURES):
        np.testing.assert_array_equal(channels[name], image.curvature[..., part])
    np.testing.assert_array_equal(channels["gradient_magnitude"], image.gradient_magnitude)
    np.testing.assert_array_equal(channels["Z"], image.depth)
    for name in IDS:
        assert channels[name].dtype == np.uint32
    np.testing.assert_array_equal(channels["id.geometry"], image.geometry_ids)
    low, high = (channels[name].astype(np.uint64) for name in IDS[1:])
    np.testing.assert_array_equal(low + (high << np.uint64(32)), image.primitive_ids)

    # The header's matrices map row vectors.
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    np.testing.assert_allclose(header["worldToCamera"], camera.world_to_camera.T, rtol=1e-6)
    np.testing.assert_allclose(header["worldToNDC"], camera.world_to_ndc(SIZE).T, rtol=1e-6)
    hit = np.isfinite(image.depth)
    ndc = np.concatenate([image.position[hit], np.ones((hit.sum(), 1))], axis=1) @ header["worldToNDC"]
    y, x = np.nonzero(hit)
    np.testing.assert_allclose(ndc[:, :2] / ndc[:, 3:] * SIZE, np.stack([x, y], -1) + 0.5, atol=1e-3)


def test_half_exr(image, tmp_path):
    image.write(tmp_path / "image.exr", half=True)
    with OpenEXR.File(str(tmp_path / "image.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    assert channels["R"].dtype == np.float16 and channels["Z"].dtype == np.float32
    np.testing.assert_array_equal(channels["G"], image.color[..., 1].astype(np.float16))


def test_png(image, tmp_path):
    path = tmp_path / "image.PNG"
    image.write(str(path))
    assert os.listdir(tmp_path) == ["image.PNG"]
    with PIL.Image.open(path) as file:
        assert file.mode == "RGBA"
        np.testing.assert_array_equal(np.asarray(file), image.to_srgb())
    with PIL.Image.open(io.BytesIO(image._repr_png_())) as file:
        assert file.size == SIZE


def test_numpy_reads_all_arrays(image, camera, tmp_path):
    image.save(tmp_path / "image.npz")
    assert os.listdir(tmp_path) == ["image.npz"]
    with np.load(tmp_path / "image.npz") as found:
        assert set(found) == {*image.layers, "color", "crop", "full_size", "world_to_camera", "world_to_ndc"}
        for name in found:
            expected = np.asarray(getattr(image, name))
            assert found[name].dtype == expected.dtype
            np.testing.assert_array_equal(found[name], expected)
    panorama = isospline.PanoramicCamera((0, -5, 0), (0, 0, 0))
    encoded = isospline.render(
        isospline.Scene(), panorama, size=(6, 4), encoding="srgb8", crop=(1, 2, 3, 2), light="phong"
    )
    encoded.save(tmp_path / "image.npz")
    with np.load(tmp_path / "image.npz") as found:
        assert set(found) == {"srgb", "crop", "full_size", "world_to_camera"}
        assert found["srgb"].shape == (2, 3, 4) and found["crop"].tolist() == [1, 2, 3, 2]


@pytest.mark.parametrize("name", ["image.gif", "image", "exr", ".png.txt"])
def test_unknown_suffix(image, tmp_path, name):
    with pytest.raises(ValueError, match=r"\.exr, \.npz, \.png or \.jpg, got"):
        image.write(tmp_path / name)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("suffix", [".exr", ".npz", ".png"])
def test_unwritable_paths_leave_nothing_behind(image, tmp_path, suffix):
    missing = tmp_path / "missing" / f"image{suffix}"
    with pytest.raises(FileNotFoundError) as raised:
        image.write(missing)
    assert raised.value.filename == str(missing)

    folder = tmp_path / f"folder{suffix}"
    folder.mkdir()
    with pytest.raises(OSError) as raised:
        image.write(folder)
    assert raised.value.filename == str(folder)
    assert os.listdir(tmp_path) == [folder.name] and os.listdir(folder) == []

    with pytest.raises(OSError):
        image.write(f"/proc/image{suffix}")


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".exr", ".png"])
def test_a_full_disk_leaves_the_old_file(tmp_path, suffix):
    pytest.importorskip("resource")
    path = tmp_path / f"image{suffix}"
    path.write_bytes(b"old")
    program = textwrap.dedent(
        """
        import resource, sys
        import numpy as np
        import isospline

        volume = isospline.Volume(np.random.default_rng(1).random((9, 9, 9)), origin=(-4, -4, -4))
        scene = isospline.Scene([isospline.Isosurface(volume, 0.5)])
        image = isospline.render(scene, isospline.camera_for(scene), size=(200, 200))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        try:
            image.write(sys.argv[1])
        except OSError as error:
            print(error.errno, error.filename)
        """
    )
    done = subprocess.run([sys.executable, "-c", program, path], stdout=subprocess.PIPE, encoding="utf-8", check=True)
    assert done.stdout.split() == [str(errno.EFBIG), str(path)]
    assert os.listdir(tmp_path) == [path.name] and path.read_bytes() == b"old"


def test_files_replace_older_ones_and_obey_the_umask(image, tmp_path):
    for suffix in (".exr", ".png"):
        path = tmp_path / f"image{suffix}"
        path.write_bytes(b"old")
        image.write(path)
        assert path.stat().st_size > 1000
        fresh = tmp_path / f"fresh{suffix}"
        fresh.touch()
        assert path.stat().st_mode == fresh.stat().st_mode


def test_half_has_the_largest_number_in_place_of_infinity(image, tmp_path):
    bright = copy.copy(image)
    bright.color[0, 0] = (1e5, -1e5, 0.25, 1.0)
    bright.write(tmp_path / "image.exr", half=True)
    with OpenEXR.File(str(tmp_path / "image.exr"), separate_channels=True) as file:
        assert [float(file.channels()[name].pixels[0, 0]) for name in "RGBA"] == [65504, -65504, 0.25, 1]
    assert image.color.max() < 1e5
