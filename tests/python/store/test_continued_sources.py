"""A conversion continues with the same source only, and only if that is read as it was."""

import numpy as np
import pytest

import isospline

zarr = pytest.importorskip("zarr")
h5py = pytest.importorskip("h5py")

#: Several blocks, so that a conversion can stop between them.
SMALL = {"chunk": 16, "shard": 16, "workers": 1}
SHAPE = (20, 20, 20)


@pytest.fixture
def data(rng):
    return rng.integers(0, 200, (2 * SHAPE[0], *SHAPE[1:])).astype("<u2")


def read_as(way, data, folder, second):
    """The source and the options of a way to read the same files, the first or the second time."""
    cube, raw = data[: SHAPE[0]], folder / "a.raw"
    if not second:
        cube.tofile(raw)
        cube.tofile(folder / "b.raw")
        np.save(folder / "b.npy", data)
        with h5py.File(folder / "c.h5", "w") as file:
            file["data"] = cube
    order = "<u2" if second else ">u2"
    if way == "byte order":
        return raw, {"shape": SHAPE, "dtype": order}
    if way == "series":
        return [raw, folder / "b.raw"], {"shape": SHAPE, "dtype": order}
    if way == "mapped":
        mapped = np.load(folder / "b.npy", mmap_mode="r")
        return mapped[SHAPE[0] :] if second else mapped[: SHAPE[0]], {}
    if way == "axes":
        return folder / "c.h5", {"axes": "xyz" if second else "zyx"}
    header = "ObjectType = Image\nNDims = 3\nDimSize = 20 20 20\nElementType = MET_USHORT\n{}\nElementDataFile = {}\n"
    files = "LIST\n" + "\n".join(str(folder / name) for name in ("acbd" if second else "abcd"))
    if way == "order":
        for name, part in zip("abcd", np.split(cube, 4)):
            part.tofile(folder / name)
        text = header.format("BinaryDataByteOrderMSB = False", files)
    else:
        text = header.format(f"BinaryDataByteOrderMSB = {not second}", "a.raw")
    (folder / "h.mhd").write_text(text, encoding="utf-8")
    return folder / "h.mhd", {}


@pytest.mark.parametrize("way", ["byte order", "series", "mapped", "axes", "header", "order"])
def test_a_source_that_is_read_otherwise_does_not_continue(data, tmp_path, way):
    path = tmp_path / "s.zarr"
    source, options = read_as(way, data, tmp_path, second=False)
    with pytest.raises(isospline.Cancelled):
        isospline.convert(source, path, **SMALL, **options, progress=lambda fraction: fraction < 0.6)
    other, changed = read_as(way, data, tmp_path, second=True)
    with pytest.raises(ValueError, match="expected source as in the conversion that was begun"):
        isospline.convert(other, path, **SMALL, **changed)
    if way in ("byte order", "series", "mapped", "axes"):
        isospline.convert(source, path, **SMALL, **options)


def test_a_series_of_ome_zarr_continues(rng, tmp_path):
    samples = rng.integers(0, 200, (2, *SHAPE)).astype("u1")
    group = zarr.open_group(str(tmp_path / "a.zarr"), mode="w", zarr_format=3)
    group.create_array("0", shape=samples.shape, chunks=(1, 16, 16, 16), dtype="u1")[:] = samples
    scale = {"type": "scale", "scale": [1, 1, 1, 1]}
    image = {
        "axes": [{"name": "t", "type": "time"}, *({"name": axis, "type": "space"} for axis in "zyx")],
        "datasets": [{"path": "0", "coordinateTransformations": [scale]}],
    }
    group.attrs["ome"] = {"version": "0.5", "multiscales": [image]}
    with pytest.raises(isospline.Cancelled):
        isospline.convert(tmp_path / "a.zarr", tmp_path / "b.zarr", **SMALL, progress=lambda fraction: fraction < 0.7)
    path = isospline.convert(tmp_path / "a.zarr", tmp_path / "b.zarr", **SMALL)
    for step, expected in zip(isospline.store.time_steps(path), samples):
        assert np.array_equal(zarr.open_group(str(step), mode="r")["0"][:], expected)
