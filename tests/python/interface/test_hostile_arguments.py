"""Invalid arguments: one sentence that names the parameter."""

import subprocess
import sys

import numpy as np
import pytest

import isospline
from isospline import volumes


@pytest.fixture(scope="module")
def volume():
    return isospline.Volume(np.indices((6, 7, 8)).sum(0).astype(np.float32))


@pytest.mark.parametrize(
    "wrong, got",
    [
        (None, "None"),
        (3, "3"),
        ({"a": 1}, "dict of str to int"),
        (np.zeros(3), "ndarray of shape (3,) and type float64"),
    ],
)
def test_none_is_not_an_object(wrong, got):
    data = "volume: expected a Volume, a VolumeData or a three-dimensional array"
    colors = f"{data} whose values give the colours"
    shown = "scene: expected a Scene, an Isosurface, a Mesh, a list of them, a Volume, an array or a file"
    for call, message in (
        (lambda: isospline.ColorByVolume(wrong), colors),
        (lambda: isospline.ColorByVolume(wrong, limits=(0, 1)), colors),
        (lambda: isospline.Isosurface(wrong, 1.0), data),
        (lambda: isospline.research.VoxelHopper(wrong), "surface: expected an Isosurface"),
        (
            lambda: isospline.Scene().add(wrong),
            "obj: expected an Isosurface, a Mesh, or a mesh of trimesh, PyVista, VTK or meshio",
        ),
        (lambda: isospline.render(wrong, None, light="phong"), shown),
        (lambda: isospline.ProgressiveRenderer(wrong, None), shown),
    ):
        with pytest.raises(TypeError) as caught:
            call()
        assert str(caught.value).partition("; did you mean ")[0] == f"{message}, got {got}"


def test_masked_values_are_not_taken_for_data(volume):
    masked = np.ma.masked_greater(np.arange(60.0).reshape(3, 4, 5), 50)
    points = np.ma.masked_less(np.ones((2, 3)) * [[0], [1]], 0.5)
    for call, name in (
        (lambda: isospline.Volume(masked), "data"),
        (lambda: isospline.suggest_levels(masked), "data"),
        (lambda: volume.sample(points), "points"),
        (lambda: isospline.Mesh(points, [[0, 1, 1]]), "vertices"),
        (lambda: isospline.VolumeData(masked), "data"),
        (lambda: isospline.VolumeData.from_affine(masked, np.eye(4)), "data"),
        (lambda: isospline.Labels(masked), "data"),
        (lambda: isospline.Labels(np.ones((2, 2, 2), int), spacing=np.ma.masked_less([1, 2, 3], 2)), "spacing"),
        (lambda: isospline.measure(volume, np.ma.masked_less([1, 2, 3], 2)), "levels"),
        (lambda: isospline.camera_for(volume, up=np.ma.masked_less([1, 2, 3], 2)), "up"),
        (lambda: isospline.turntable_cameras(volume, 2, up=np.ma.masked_less([1, 2, 3], 2)), "up"),
        (lambda: isospline.camera_for(volume, view=np.ma.masked_less([1, 2, 3], 2)), "view"),
        (lambda: isospline.camera_for(np.ma.masked_less([[-1, -1, -1], [1, 1, 1]], 0)), "scene"),
        (lambda: isospline.Phong(color=np.ma.masked_less([0, 0.5, 1], 0.5)), "color"),
        (lambda: isospline.ridges_and_valleys(1, ridge=np.ma.masked_less([0, 0.5, 1], 0.5)), "ridge"),
        (lambda: isospline.Mesh(np.eye(3), [[0, 1, 2]], colors=np.ma.masked_less(np.eye(3), 1)), "colors"),
        (lambda: isospline.ColorByDepth(np.ma.masked_less(np.eye(3), 1)), "cmap"),
    ):
        with pytest.raises(ValueError, match=f"^{name}: expected an array without masked values.*, got [0-9]+ masked"):
            call()
    unmasked = np.ma.array(np.arange(60.0).reshape(3, 4, 5))
    assert isospline.Labels(unmasked).shape == isospline.VolumeData(unmasked).shape == (3, 4, 5)
    assert isospline.Volume(unmasked).maximum == isospline.Volume(masked.filled(0)).shape[0] * 20 - 1


def test_masked_values_are_not_taken_for_the_source_of_a_store(tmp_path):
    pytest.importorskip("zarr")
    masked = np.ma.masked_greater(np.arange(60.0).reshape(3, 4, 5), 50)
    with pytest.raises(ValueError, match="^source: expected an array without masked values.*, got [0-9]+ masked"):
        isospline.convert(masked, tmp_path / "store")


@pytest.mark.parametrize("stop", [False, 0, 0.0, "", [], np.False_, np.int64(0)])
def test_false_values_of_progress_cancel(stop):
    data = np.zeros((250, 250, 250), np.uint8)
    with pytest.raises(isospline.Cancelled):
        isospline.Volume(data, progress=lambda fraction: stop)


@pytest.mark.parametrize("go_on", [None, True, 1, "yes", np.True_])
def test_other_values_of_progress_do_not(go_on):
    told = []
    isospline.Volume(np.zeros((4, 4, 4), np.float32), progress=lambda fraction: told.append(fraction) or go_on)
    assert told[-1] == 1


def test_progress_that_cannot_be_judged_raises_its_own_error():
    with pytest.raises(ValueError, match="ambiguous"):
        isospline.Volume(np.zeros((4, 4, 4), np.float32), progress=lambda fraction: np.zeros(3))


def test_affines_are_matrices():
    data = np.zeros((3, 4, 5))
    for affine in (3, None, np.eye(3), np.zeros(4), "matrix", [[1, 2], [3]]):
        with pytest.raises((TypeError, ValueError), match="^affine: expected a .*matrix"):
            isospline.VolumeData.from_affine(data, affine)
    for affine in (np.zeros((4, 4)), np.full((4, 4), np.nan)):
        with pytest.raises(ValueError, match="^affine: expected finite numbers and no column of zeros"):
            isospline.VolumeData.from_affine(data, affine)


def test_counts_are_whole_numbers_from_one_on():
    box = [(-1, -1, -1), (1, 1, 1)]
    calls = (
        volumes.waves,
        volumes.blobs,
        lambda count: isospline.turntable_cameras(box, count),
        lambda count: isospline.suggest_levels(np.arange(9), count),
    )
    for call in calls:
        for wrong in (0, -1, 1.5, np.nan, np.inf, 1e308, 2**31):
            with pytest.raises(ValueError, match="^count: expected a whole number of at least 1(, and .*)?"):
                call(count=wrong)
        for wrong in (None, "3", [3]):
            with pytest.raises(TypeError, match="^count: expected a whole number"):
                call(count=wrong)
        call(count=2)


@pytest.mark.parametrize("wrong", [None, 3, [None], [1, 2], ["image"], [np.zeros((4, 4, 3))]])
def test_videos_are_made_of_images(tmp_path, wrong):
    with pytest.raises(TypeError, match="^images: expected an "):
        isospline.write_video(tmp_path / "a.mp4", wrong)
    assert not list(tmp_path.iterdir())


def test_images_are_written_to_paths():
    camera = isospline.PerspectiveCamera((0, -1, 0), (0, 0, 0))
    image = isospline.render(isospline.Scene(), camera, size=(4, 4), light="phong")
    for wrong in (None, 3, b"a.png"):
        with pytest.raises(TypeError, match="^path: expected a str or path-like"):
            image.write(wrong)
    with pytest.raises(ValueError, match="^path: expected a name without null characters"):
        image.write("a\0.png")


def test_memory_errors_name_the_purpose_of_the_memory():
    script = """
import resource
import numpy as np
import isospline
volume = isospline.Volume(np.random.default_rng(0).random((16, 16, 16)))
scene = isospline.Scene([isospline.Isosurface(volume, 0.5)])
camera = isospline.camera_for(scene)
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
for call in (lambda: isospline.render(scene, camera, size=(60000, 60000)),
             lambda: isospline.ProgressiveRenderer(scene, camera, size=(60000, 60000)),
             lambda: isospline.Volume(np.zeros((1000, 1000, 1000), np.uint8))):
    try:
        call()
    except MemoryError as error:
        print(error)
print(scene.cast_rays([(8, 8, -9, 0.01, 0.02, 1)])["t_hit"].shape)
"""
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, encoding="utf-8", timeout=120)
    assert result.stdout.splitlines() == [
        "out of memory: to render 60000 x 60000 pixels",
        "out of memory: to render 60000 x 60000 pixels",
        "out of memory: to make a volume of (1000, 1000, 1000) samples",
        "(1,)",
    ], result.stderr
