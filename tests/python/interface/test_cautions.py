"""Warnings: each names the line of the user that it is about."""

import inspect
import warnings

import numpy as np
import pytest

import isospline


def lines_warned(function, pattern):
    """The numbers of the lines of this file that calling the function warns of, counted from the function's first."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        function()
    first = inspect.getsourcelines(function)[1]
    assert all(each.filename == __file__ for each in caught), [each.filename for each in caught]
    assert all(pattern in str(each.message) for each in caught)
    return [each.lineno - first for each in caught]


def test_of_compiled_functions():
    volume = isospline.Volume(isospline.volumes.sphere().values(12))

    def call():
        isospline.Isosurface(volume, 0)
        isospline.Isosurface(volume, 9)

    assert lines_warned(call, "out of the data's range") == [2]


def test_of_functions_that_call_others(tmp_path):
    data = isospline.volumes.blobs().values((24, 32, 40))
    data.tofile(tmp_path / "a.raw")
    labels = np.zeros((12, 12, 12), np.uint8)
    labels[2:6, 2:10, 2:10], labels[6:10, 2:10, 2:10] = 1, 2

    def call():
        isospline.read_volume(tmp_path / "a.raw", shape=(24, 32, 40), dtype="f4")
        isospline.read_volume(tmp_path / "a.raw", shape=(24, 40, 32), dtype="f4")

    def model():
        isospline.Isosurface(labels == 1, 0.5)
        isospline.Isosurface(labels, 1.5)

    assert lines_warned(call, "did you mean (24, 32, 40)?") == [2]
    assert lines_warned(model, "looks like a label map, 3 values") == [2]


# Raw files


# Few numbers divide the numbers of samples, so that few other shapes are tried.
VOLUMES = {
    "heart": isospline.volumes.heart().values((19, 26, 34)),
    "waves": isospline.volumes.waves().values((19, 26, 34)),
    "thick slices": isospline.volumes.blobs(width=0.25).values((11, 94, 106)),
}


def read(path, shape):
    """The warnings of reading a raw file."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        isospline.read_volume(path, shape=shape, dtype="f4")
    return [str(each.message) for each in caught]


@pytest.mark.slow
@pytest.mark.parametrize("name", VOLUMES)
def test_a_wrong_shape_of_raw_samples_is_told(name, tmp_path):
    data = VOLUMES[name]
    data.tofile(tmp_path / "a.raw")
    z, y, x = data.shape
    assert read(tmp_path / "a.raw", (z, y, x)) == []
    for wrong in ((y, z, x), (z, x, y), (x, y, z), (2 * z, y, x // 2), (z, 2 * y, x // 2), (2 * z, y // 2, x)):
        (message,) = read(tmp_path / "a.raw", wrong)
        assert message.endswith(
            f"got rows or slices that differ in shape {wrong} (shape=(nz, ny, nx) in Python, "
            f"--shape NX,NY,NZ on the command line); did you mean {(z, y, x)}?"
        )


def test_a_shape_is_not_doubted_without_a_better_one(rng, tmp_path):
    noise = rng.normal(size=(20, 24, 28)).astype("f4")
    stripes = np.broadcast_to(np.sin(np.arange(28, dtype="f4")), (20, 24, 28))
    slanted = np.sin(0.3 * np.add.outer(np.arange(20), np.add.outer(np.arange(24), np.arange(28)))).astype("f4")
    for data in (noise, stripes, slanted, np.zeros_like(noise)):
        np.ascontiguousarray(data).tofile(tmp_path / "a.raw")
        assert read(tmp_path / "a.raw", data.shape) == []


# Label maps


def test_only_label_maps_are_told(rng, volumes_folder):
    grid = np.mgrid[:40, :40, :40]
    distance = np.sqrt(((grid - 20) ** 2).sum(axis=0))
    nested = (distance < 16).astype(np.int16) + 3 * (distance < 12) + 7 * (distance < 6)
    others = [
        (distance < 12).astype(np.uint8),  # a mask
        (255 * np.clip(1 - distance / 20, 0, 1)).astype(np.uint8),
        rng.integers(0, 5, (20, 20, 20)),
        nested + np.float32(0.5) * (nested > 0),
    ]
    others += [isospline.read_volume(volumes_folder / name).data for name in ("bonsai.nii.gz", "fuel.nii.gz")]
    with pytest.warns(UserWarning, match="label map, 4 values .* Labels.data..surface.number."):
        isospline.Isosurface(nested, 2)
    for data in others:
        isospline.VolumeData(data).to_volume()


@pytest.mark.parametrize("shape", [(0, 3, 6), (3, 0, 6), (3, 6, 0)])
def test_data_without_samples_are_refused_before_they_are_compared_with_labels(shape):
    for function in (isospline.Volume, isospline.render, lambda data: isospline.VolumeData(data).to_volume()):
        with pytest.raises(ValueError, match=r"data: expected at least one sample along each axis"):
            function(np.zeros(shape, np.uint8))
