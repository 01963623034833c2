"""Compressed samples are decompressed in a process of their own, and no further than their header promises."""

import bz2
import gzip
import re
import zlib

import numpy as np
import pytest

from isospline import convert, open_volume, read_volume
from isospline.io import packed
from isospline.store.sources.opening import open_source

nibabel = pytest.importorskip("nibabel")
pytest.importorskip("SimpleITK")

SHAPE = (6, 7, 8)
NRRD = "NRRD0004\ntype: short\ndimension: 3\nsizes: 8 7 6\nendian: little\nencoding: {}\n{}\n"
METAIMAGE = "NDims = 3\nDimSize = 8 7 6\nElementType = MET_SHORT\nCompressedData = True\nElementDataFile = LOCAL\n"
HEADERS = {
    "a.nii.gz": (b"", gzip.compress),
    "gzip.nrrd": (NRRD.format("gzip", "").encode(), gzip.compress),
    "bzip2.nrrd": (NRRD.format("bzip2", "").encode(), bz2.compress),
    "a.mha": (METAIMAGE.encode(), zlib.compress),
}
ZEROS = bytes(1 << 24)


@pytest.fixture
def data(rng):
    return rng.integers(-900, 900, SHAPE).astype("<i2")


def nifti_header(data, **fields):
    header = nibabel.Nifti1Header()
    header.set_data_shape(data.shape[::-1])
    header.set_data_dtype(data.dtype)
    header.set_sform(np.eye(4), 1)
    for name, value in {"vox_offset": 352, "magic": "n+1", **fields}.items():
        header[name] = value
    return header.binaryblock + bytes(4)


def write(folder, name, data, rest=b"", beyond=b""):
    """A file with these samples, and more decompressed bytes, or more compressed ones, after them."""
    header, compress = HEADERS[name]
    content = (nifti_header(data) if name == "a.nii.gz" else b"") + data.tobytes() + rest
    (folder / name).write_bytes(header + compress(content) + beyond)
    return folder / name


@pytest.mark.parametrize("name", HEADERS)
def test_nothing_is_decompressed_in_the_process_of_the_caller(tmp_path, data, monkeypatch, name):
    def refuse(*args, **options):
        raise AssertionError("decompressed by the caller")

    path = write(tmp_path, name, data)
    for module, function in ((gzip, "GzipFile"), (gzip, "open"), (bz2, "BZ2File"), (zlib, "decompressobj")):
        monkeypatch.setattr(module, function, refuse)
    monkeypatch.setattr(nibabel.Nifti1Header, "__init__", refuse)
    monkeypatch.setattr(nibabel, "load", refuse)
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.data, data)
    assert volume.data.flags.writeable
    source = open_source(path, "zyx", {"shape": None, "name": None})
    for first in (0, 4):
        np.testing.assert_array_equal(list(source.slices(first)), data[first:])


@pytest.mark.parametrize("name", HEADERS)
def test_no_more_is_decompressed_than_the_header_promises_and_a_block(tmp_path, data, name):
    pytest.importorskip("zarr")
    compress = HEADERS[name][1]
    path = write(tmp_path, name, data, ZEROS, b"" if name == "a.mha" else 160 * compress(ZEROS))
    assert path.stat().st_size < 4_000_000
    with pytest.raises(ValueError, match=rf"{name}: cannot be .*expected {data.nbytes} bytes.*damaged") as caught:
        read_volume(path)
    got = int(re.search(r"got at least (\d+)", str(caught.value))[1])
    assert got <= data.nbytes + 2 * packed._BLOCK
    with pytest.raises(ValueError, match=f"expected {data.nbytes} bytes of samples, got at least {got}"):
        convert(path, tmp_path / "a.zarr")


@pytest.mark.parametrize("name", HEADERS)
def test_some_bytes_after_the_samples_are_left_out(tmp_path, data, name):
    path = write(tmp_path, name, data, b"x" * 1000)
    np.testing.assert_array_equal(read_volume(path).data, data)


def test_bytes_before_compressed_samples_are_limited(tmp_path, data):
    (tmp_path / "a.nii.gz").write_bytes(gzip.compress(nifti_header(data, vox_offset=1e9) + ZEROS))
    extension = np.array([1 << 30, 4], "<i4").tobytes()  # of which only its size is there
    header = nifti_header(data, vox_offset=1 << 30)[:-4] + bytes([1, 0, 0, 0]) + extension
    (tmp_path / "b.nii.gz").write_bytes(gzip.compress(header + ZEROS))
    header = NRRD.format("bzip2", f"byte skip: {10**15}\n").encode()
    (tmp_path / "a.nrrd").write_bytes(header + 160 * bz2.compress(ZEROS))
    for name in ("a.nii.gz", "b.nii.gz", "a.nrrd"):
        with pytest.raises(ValueError, match=rf"{name}: .*expected at most {packed.SKIP_LIMIT} bytes before"):
            read_volume(tmp_path / name)


@pytest.mark.parametrize("name", HEADERS)
def test_truncated_samples_are_an_error(tmp_path, data, name):
    path = write(tmp_path, name, data)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ValueError, match=f"{name}: cannot be read as "):
        read_volume(path)
    path = write(tmp_path, name, data[:-1] if name != "a.nii.gz" else data)
    if name == "a.nii.gz":
        path.write_bytes(gzip.compress(gzip.decompress(path.read_bytes())[:-10]))
    with pytest.raises(ValueError, match=f"expected {data.nbytes} bytes of samples, got .* bytes: the file is trunc"):
        read_volume(path)


@pytest.mark.parametrize("kind", ["Nifti1Image", "Nifti2Image"])
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("dtype", ["<i2", ">f4"])
@pytest.mark.parametrize("slope, inter", [(1, 0), (0.5, -3)])
def test_samples_and_place_of_nifti_are_those_of_nibabel(tmp_path, rng, kind, suffix, dtype, slope, inter):
    data = rng.integers(0, 200, SHAPE).astype(dtype)
    image = getattr(nibabel, kind)(data.T, np.diag([2.0, 3, -4, 1]))
    image.header.set_data_dtype(dtype)
    header = type(image.header)(endianness=">" if dtype[0] == ">" else "<")
    header.set_data_dtype(dtype)
    image = type(image)(data.T, rng.normal(size=(4, 4)) * [[1], [1], [1], [0]] + np.diag([0, 0, 0, 1]), header)
    image.header.set_slope_inter(slope, inter)
    path = tmp_path / f"a{suffix}"
    nibabel.save(image, path)
    expected = nibabel.load(path)
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.data, expected.get_fdata().T)
    np.testing.assert_allclose(volume.affine, np.diag([-1, -1, 1, 1]) @ expected.affine, atol=1e-6)
    assert volume.data.dtype.kind == np.asanyarray(expected.dataobj).dtype.kind


def test_a_store_of_compressed_samples_is_that_of_plain_ones(tmp_path, rng):
    pytest.importorskip("zarr")
    data = rng.integers(-900, 900, (40, 30, 20)).astype("<i2")
    image = nibabel.Nifti1Image(data.T, np.eye(4))
    points = rng.uniform(1, 18, (50, 3))
    values = []
    for suffix in (".nii", ".nii.gz"):
        nibabel.save(image, tmp_path / f"a{suffix}")
        convert(tmp_path / f"a{suffix}", tmp_path / f"{suffix}.zarr")
        volume = open_volume(tmp_path / f"{suffix}.zarr")
        values.append(volume.sample(points * [-1, -1, 1]))
    np.testing.assert_array_equal(*values)
