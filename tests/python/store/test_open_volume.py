"""Volumes of stores give the same results as in memory, within their memory limit; errors name broken chunks."""

import copy
import os
import pickle
import threading

import numpy as np
import pytest

import isospline
from isospline import volumes

pytest.importorskip("zarr")

FIELD, SHAPE = volumes.heart(), (70, 64, 90)
SIZE = (80, 60)


@pytest.fixture(scope="module", params=[(1, "mirror"), (2, "periodic"), (3, "mirror")])
def pair(request, tmp_path_factory):
    """A volume in memory and the folder of its store."""
    degree, boundary = request.param
    data, grid = FIELD.values(SHAPE), FIELD.grid(SHAPE)
    folder = tmp_path_factory.mktemp("store") / "heart.zarr"
    isospline.convert(data, folder, degree=degree, boundary=boundary, **grid)
    return isospline.Volume(data, degree=degree, boundary=boundary, **grid), folder


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("store") / "heart.zarr"
    isospline.convert(FIELD.values(SHAPE), folder, **FIELD.grid(SHAPE))
    return folder


def picture(volume, **options):
    scene = isospline.Scene([isospline.Isosurface(volume, FIELD.level)])
    camera = isospline.PerspectiveCamera((2.5, -3, 1.5), (0, 0, 0), field_of_view=35)
    return isospline.render(scene, camera, size=SIZE, layers=("depth", "normal", "primitive_ids"), **options)


@pytest.mark.slow
def test_pictures_and_samples_equal_those_in_memory(pair):
    volume, folder = pair
    opened = isospline.open_volume(folder, memory_limit="64MB")
    np.testing.assert_array_equal(opened.coefficients, volume.coefficients)
    points = np.random.default_rng(1).uniform(-1.3, 1.3, (5000, 3))
    for derivative in range(3):
        np.testing.assert_array_equal(
            opened.sample(points, derivative=derivative), volume.sample(points, derivative=derivative)
        )
    expected, image = picture(volume), picture(opened)
    for layer in ("color", "depth", "normal", "primitive_ids"):
        np.testing.assert_array_equal(getattr(image, layer), getattr(expected, layer))
    assert opened.shape == volume.shape and repr(opened) == repr(volume)
    assert (opened.minimum, opened.maximum) == (volume.minimum, volume.maximum)


@pytest.mark.slow
def test_everything_else_that_asks_for_coefficients(pair):
    volume, folder = pair
    opened = isospline.open_volume(folder, memory_limit="64MB")
    box = isospline.Box((-0.6, -0.5, -0.7), (0.7, 0.6, 0.5))
    expected, surface = (
        isospline.Isosurface(each, FIELD.level, clip=[box], capped=True, largest=1) for each in (volume, opened)
    )
    assert surface.shell.count == expected.shell.count
    np.testing.assert_array_equal(surface.bounds, expected.bounds)
    whole, expected_whole = (isospline.Isosurface(each, FIELD.level).area(tolerance=0.01) for each in (opened, volume))
    assert whole.value == pytest.approx(expected_whole.value, rel=1e-12)
    mesh, expected_mesh = surface.to_mesh(), expected.to_mesh()
    for name in ("vertices", "faces"):
        np.testing.assert_array_equal(getattr(mesh, name), getattr(expected_mesh, name))
    points = np.random.default_rng(2).uniform(-0.8, 0.8, (100, 3))
    ours, theirs = (isospline.Scene([each]) for each in (surface, expected))
    np.testing.assert_array_equal(ours.signed_distance(points), theirs.signed_distance(points))
    rays = np.concatenate([points, -points], axis=1)
    for name, array in ours.cast_rays(rays).items():
        np.testing.assert_array_equal(array, theirs.cast_rays(rays)[name])


@pytest.mark.slow
def test_bricks_are_dropped_under_the_limit_and_pictures_stay_the_same(pair):
    volume, folder = pair
    limit = 36_000_000
    opened = isospline.open_volume(folder, memory_limit=limit)
    expected = picture(volume)
    surfaces = [isospline.Isosurface(opened, FIELD.level + 0.001 * i) for i in range(20)]
    camera = isospline.PerspectiveCamera((2.5, -3, 1.5), (0, 0, 0), field_of_view=35)
    for surface in surfaces:
        isospline.render(isospline.Scene([surface]), camera, size=SIZE, light="phong")
        assert opened.paging["memory"] <= limit
    np.testing.assert_array_equal(picture(opened).depth, expected.depth)


def test_only_chunks_on_rays_are_read(store):
    opened = isospline.open_volume(store, memory_limit="64MB")
    before = opened.paging
    assert before["chunks_read"] == before["bricks_made"] == 0 and before["memory_limit"] == 64_000_000
    scene = isospline.Scene([isospline.Isosurface(opened, FIELD.level)])
    assert opened.paging["chunks_read"] <= 8
    hits = scene.cast_rays([[0, -3, 0.1, 0, 1, 0]])
    paging = opened.paging
    assert np.isfinite(hits["t_hit"]).all() and 1 <= paging["chunks_read"] <= 16 and paging["bricks_made"] < 20
    assert paging["bytes_read"] > paging["chunks_read"] * 32**3 * 4
    scene.cast_rays([[0, -3, 0.1, 0, 1, 0]])
    assert opened.paging["bytes_read"] == paging["bytes_read"]
    assert isospline.Volume(np.zeros((3, 3, 3))).paging is None


def test_threads_share_a_volume(store):
    opened, expected = isospline.open_volume(store, memory_limit="64MB"), None
    expected = picture(isospline.open_volume(store)).depth
    same = []

    def render():
        same.append(np.array_equal(picture(opened).depth, expected, equal_nan=True))

    threads = [threading.Thread(target=render) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert same == [True] * 4


def test_pickles_hold_the_path(store):
    opened = isospline.open_volume(store, memory_limit="64MB", scale=1)
    state = pickle.dumps(opened)
    assert len(state) < 2000
    again = pickle.loads(state)
    assert again.paging["memory_limit"] == 64_000_000 and again.shape == opened.shape
    scene = pickle.loads(pickle.dumps(isospline.Scene([isospline.Isosurface(opened, FIELD.level)])))
    assert len(scene.cast_rays([[0, -3, 0.1, 0, 1, 0]])["t_hit"]) == 1
    assert copy.deepcopy(opened).shape == opened.shape


def test_scales(store):
    fine, coarse = (isospline.open_volume(store, scale=level) for level in (0, 1))
    assert coarse.shape == tuple((size + 1) // 2 for size in fine.shape)
    np.testing.assert_allclose(coarse.spacing, 2 * fine.spacing)
    points = np.random.default_rng(3).uniform(-0.7, 0.7, (200, 3))
    assert np.abs(coarse.sample(points) - fine.sample(points)).max() < 0.05 * (fine.maximum - fine.minimum)
    levels = len(isospline.store.read_metadata(store).scales)
    for wrong in (-1, levels, 0.5, 1.0, [0, 1], np.array([0, 1])):
        with pytest.raises(ValueError, match=f"scale: expected 0 to {levels - 1}"):
            isospline.open_volume(store, scale=wrong)


def test_the_scale_follows_the_size_of_a_pixel(store):
    step = isospline.open_volume(store).spacing.max()
    last = len(isospline.store.read_metadata(store).scales) - 1
    for pixels, expected in ((2.0, 0), (1.01, 0), (0.99, 0), (0.49, 1), (0.24, 2), (1e-6, last)):
        # The size of pixels of an orthographic picture, relative to the largest side of a voxel.
        camera = isospline.OrthographicCamera((0, 0, 9), (0, 0, 0), up=(0, 1, 0), height=SIZE[1] * step / pixels)
        assert isospline.scale_for(store, camera, SIZE) == min(expected, last)
    inside = isospline.PerspectiveCamera((0, 0, 0), (1, 0, 0))
    assert isospline.scale_for(store, inside, SIZE) == 0
    near = isospline.PerspectiveCamera((0, -30, 0), (0, 0, 0), field_of_view=30)
    assert isospline.scale_for(store, near, (4000, 3000)) <= isospline.scale_for(store, near, SIZE)


def test_the_size_of_a_picture_has_pixels(store):
    camera = isospline.PerspectiveCamera((0, -30, 0), (0, 0, 0))
    with pytest.raises(ValueError, match="^size: expected a whole number of at least 1, got 0$"):
        isospline.scale_for(store, camera, (0, 3))
    for wrong in (64, (64, 48, 3), None):
        with pytest.raises(TypeError, match="^size: expected width and height, got "):
            isospline.scale_for(store, camera, wrong)
    with pytest.raises(TypeError, match=r"^size: expected a whole number, got \[1, 2\]$"):
        isospline.scale_for(store, camera, [[1, 2], [3]])


def shards_of(folder):
    return sorted(path for path in (folder / "coefficients" / "0" / "c").rglob("*") if path.is_file())


def damage(name, folder):
    (shard,) = shards_of(folder)
    content = bytearray(shard.read_bytes())
    if name == "truncated":
        shard.write_bytes(content[:100])
    elif name == "flipped":
        for place in range(0, len(content) - 5000, 5000):
            content[place] ^= 1
        shard.write_bytes(content)
    elif name == "deleted":
        shard.unlink()
    elif name == "linked":
        outside = folder.parent / "outside"
        shard.rename(outside)
        os.symlink(outside, shard)


SAID = {
    "truncated": "the file ends before",
    "flipped": r"checksum of chunk \(\d, \d, \d\) is wrong",
    "deleted": "cannot open a shard: No such file",
    "linked": "cannot open a shard: Too many levels of symbolic links",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SAID)
def test_broken_chunks_are_named_and_give_no_picture(tmp_path, name):
    folder = tmp_path / "broken.zarr"
    isospline.convert(FIELD.values(SHAPE), folder, **FIELD.grid(SHAPE))
    opened = isospline.open_volume(folder)
    scene = isospline.Scene([isospline.Isosurface(opened, FIELD.level)])
    damage(name, folder)
    for _ in range(2):
        with pytest.raises(OSError, match=SAID[name]) as caught:
            isospline.render(scene, isospline.PerspectiveCamera((2.5, -3, 1.5), (0, 0, 0)), size=SIZE, light="phong")
        assert str(caught.value.filename) == str(
            shards_of(folder)[0] if name != "deleted" else folder / "coefficients/0/c/0/0/0"
        )
    with pytest.raises(OSError, match=SAID[name]):
        opened.sample([[0, 0, 0]])


def test_bad_arguments(tmp_path, store):
    with pytest.raises(OSError):
        isospline.open_volume(tmp_path / "missing.zarr")
    with pytest.raises(ValueError, match="memory_limit: expected"):
        isospline.open_volume(store, memory_limit="many")
    with pytest.raises(ValueError, match="memory_limit: expected at least"):
        isospline.open_volume(store, memory_limit=1000)


def test_command_line(tmp_path, store, capsys):
    from isospline.cli.main import main

    for options, said in (([], "scale"), (["--exact"], "scale 0 ")):
        out = tmp_path / "a.png"
        assert main(["render", str(store), "-q", "-o", str(out), "--size", "80x60", "--fast", *options]) == 0
        assert out.exists() and said in capsys.readouterr().out
    assert main(["render", str(store), "-o", str(tmp_path / "b.png"), "--degree", "3"]) == 2
    assert "--degree: expected 2, as in the store, got 3" in capsys.readouterr().err


def test_a_level_out_of_range_is_warned_of_once_for_the_scale_of_the_picture(tmp_path, store, capsys):
    from isospline.cli.main import main

    def warnings_of(folder, level, size):
        given = ["--level", level, "--no-closed", "--view", "front", "--samples", "1", "-q", "--size", size]
        assert main(["render", str(folder), *given, "-o", str(tmp_path / "a.png")]) == 0
        printed = capsys.readouterr()
        return printed.err.splitlines(), printed.out

    for size, scale in (("16x12", "scale 1"), ("400x300", "scale 0")):  # the overview is scale 0
        (warned,), said = warnings_of(store, "9999", size)
        assert "level 9999 is out of the data's range" in warned and scale in said

    peak = np.zeros((4, 4, 300), np.float32)
    peak[2, 2, 150] = 100  # in scale 0, but not in the overview, which is scale 1
    folder = isospline.convert(peak, tmp_path / "peak.zarr")
    assert warnings_of(folder, "90", "2000x30")[0] == []
    (warned,), said = warnings_of(folder, "90", "16x12")
    assert "level 90 has an empty shell" in warned and "scale 3" in said
