"""Sources of stores: each format, read box by box, compared with the result of its library."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import isospline

zarr = pytest.importorskip("zarr")
h5py = pytest.importorskip("h5py")
tensorstore = pytest.importorskip("tensorstore")
nibabel = pytest.importorskip("nibabel")
SimpleITK = pytest.importorskip("SimpleITK")
tifffile = pytest.importorskip("tifffile")
pytest.importorskip("pydicom")

from placed_images import write_slices

from isospline.io.files import files_of
from isospline.store import read_metadata
from isospline.store.sources.opening import open_source
from isospline.store.sources.source import RawSource

READING = dict(shape=None, dtype=None, offset=0, name=None)
BOX = ((1, 5), (2, 7), (3, 8))


@pytest.fixture
def data(rng):
    return rng.integers(-900, 900, (6, 7, 8)).astype(np.int16)


def opened(given, tmp_path, axes="zyx", **reading):
    """The staged source of an argument, also after pickling, as for workers of a cluster."""
    source = open_source(given, axes, READING | reading).stage(tmp_path / "staged", lambda fraction: None)
    return pickle.loads(pickle.dumps(source))


def check(source, expected):
    """Check all samples of a source and those of a box."""
    assert source.shape == expected.shape
    whole = source.read([(0, size) for size in expected.shape])
    assert whole.dtype == source.dtype and whole.dtype.isnative
    assert np.array_equal(whole, expected)
    assert np.array_equal(source.read(BOX), expected[1:5, 2:7, 3:8])
    assert source.working_memory((4, 5, 5)) >= 100 * source.dtype.itemsize


@pytest.mark.parametrize("axes", ["zyx", "xyz"])
@pytest.mark.parametrize("dtype", ["?", "u1", "<i2", ">i2", "<f2", ">f8", "g"])
def test_arrays_of_any_type(data, tmp_path, axes, dtype):
    array = data.astype(dtype)
    source = opened(array.T if axes == "xyz" else array, tmp_path, axes)
    check(source, array)


def test_array_likes_are_sliced_and_never_read_as_a_whole(data, tmp_path):
    class ArrayLike:
        shape, dtype = data.shape, data.dtype

        def __getitem__(self, slices):
            assert all(each.stop - each.start < size for each, size in zip(slices, self.shape))
            return data[slices].tolist()

    assert np.array_equal(open_source(ArrayLike(), "zyx", READING).read(BOX), data[1:5, 2:7, 3:8])
    dask = pytest.importorskip("dask")
    pytest.importorskip("dask.array")
    with dask.config.set(scheduler="synchronous"):  # also after clients of other tests
        check(open_source(dask.array.from_array(data, chunks=3), "zyx", READING), data)


@pytest.mark.parametrize(
    "name", ["a.nii", "a.nii.gz", "a.nrrd", "packed.nrrd", "a.mha", "packed.mha", "a.vtk", "a.npy"]
)
def test_formats_of_read_volume(data, tmp_path, name):
    path = tmp_path / name
    frame = dict(spacing=(0.5, 1.5, 2.0), origin=(3.0, -4.0, 5.0))
    if "nii" in name:
        nibabel.save(nibabel.Nifti1Image(data.T, isospline.VolumeData(data, **frame).affine), path)
    elif name.endswith(".npy"):
        np.save(path, data)
    else:
        image = SimpleITK.GetImageFromArray(data)
        image.SetSpacing(frame["spacing"])
        image.SetOrigin(frame["origin"])
        SimpleITK.WriteImage(image, path, useCompression="packed" in name)
    expected = isospline.read_volume(path)
    source = opened(path, tmp_path)
    check(source, np.asarray(expected.data))
    assert tuple(source.spacing) == expected.spacing and tuple(source.origin) == expected.origin
    assert np.array_equal(source.direction, expected.direction)
    if "packed" not in name and "gz" not in name and name != "a.vtk":
        assert type(source) is RawSource and not (tmp_path / "staged").exists()


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_scaled_nifti(data, tmp_path, suffix):
    image = nibabel.Nifti1Image(data.T, np.eye(4))
    image.header.set_slope_inter(0.25, -3)
    nibabel.save(image, tmp_path / f"a{suffix}")
    source = opened(tmp_path / f"a{suffix}", tmp_path)
    check(source, np.asarray(isospline.read_volume(tmp_path / f"a{suffix}").data))


def test_slices_of_dicom(data, tmp_path):
    folder = tmp_path / "series"
    folder.mkdir()
    write_slices(folder, data)
    expected = isospline.read_volume(folder)
    source = opened(folder, tmp_path)
    check(source, expected.data)
    assert np.allclose(source.spacing, expected.spacing) and np.allclose(source.origin, expected.origin)
    assert np.allclose(source.direction, expected.direction) and source.unit == "millimeter"


@pytest.mark.parametrize(
    "options", [{}, {"compression": "zlib"}, {"bigtiff": True}, {"byteorder": ">"}, {"tile": (16, 16)}]
)
def test_pages_of_tiff(data, tmp_path, options):
    tifffile.imwrite(tmp_path / "a.tif", data, photometric="minisblack", **options)
    check(opened(tmp_path / "a.tif", tmp_path), data)


@pytest.mark.parametrize("options", [{}, {"compression": "zlib"}, {"byteorder": ">"}])
def test_pages_that_were_written_one_by_one(data, tmp_path, options):
    order = {name: options.pop(name) for name in ("byteorder",) if name in options}

    def write(*pages):
        with tifffile.TiffWriter(tmp_path / "a.tif", **order) as writer:
            for page in pages:
                writer.write(page, photometric="minisblack", **options)
        return tmp_path / "a.tif"

    np.testing.assert_array_equal(isospline.read_volume(write(*data)).data, data)
    check(opened(tmp_path / "a.tif", tmp_path), data)
    for pages in ([data, data], [data[0], data[1].astype(np.float64)], [data, data[0]]):
        with pytest.raises(ValueError, match="expected one series of pages of one kind, got 2: "):
            isospline.read_volume(write(*pages))


def test_one_picture_beside_dicom_is_stray_and_several_are_refused(data, tmp_path):
    write_slices(tmp_path, data)
    expected = isospline.read_volume(tmp_path).data
    for file in ("a.tif", "b.tif"):
        tifffile.imwrite(tmp_path / file, np.zeros((30, 40), np.uint8))
        if file == "a.tif":
            read = isospline.read_volume(tmp_path)
            assert read.format == "DICOM series" and np.array_equal(read.data, expected)
            check(opened(tmp_path, tmp_path.parent), expected)
            assert tmp_path / file not in map(Path, files_of(tmp_path))
    for function in (isospline.read_volume, lambda path: opened(path, tmp_path)):
        with pytest.raises(ValueError, match=r"got both: DICOM, \S+ and 5 more, and TIFF, a.tif and 1 more"):
            function(tmp_path)


@pytest.mark.slow
def test_a_folder_of_tiff(data, tmp_path):
    folder = tmp_path / "slices"
    folder.mkdir()
    for number, samples in enumerate(data):
        tifffile.imwrite(folder / f"slice{number + 7}.tif", samples)
    check(opened(folder, tmp_path), data)
    (folder / "slice9.tif").write_bytes((folder / "slice9.tif").read_bytes()[:150])
    (tmp_path / "staged").unlink()
    with pytest.raises(ValueError, match=r"slice9\.tif"):
        opened(folder, tmp_path)


def test_raw_samples(data, tmp_path):
    data.astype(">i2").tofile(tmp_path / "a.raw")
    check(opened(tmp_path / "a.raw", tmp_path, shape=data.shape, dtype=">i2"), data)


def test_staging_goes_on_where_it_was(data, tmp_path):
    nibabel.save(nibabel.Nifti1Image(data.T, np.eye(4)), tmp_path / "a.nii.gz")
    told = []

    def stop(fraction):
        told.append(fraction)
        if len(told) == 3:
            raise KeyboardInterrupt

    source = open_source(tmp_path / "a.nii.gz", "zyx", READING)
    with pytest.raises(KeyboardInterrupt):
        source.stage(tmp_path / "staged", stop)
    with open(tmp_path / "staged", "ab") as file:
        file.write(b"half a slice")
    told = [None] * 3
    check(source.stage(tmp_path / "staged", stop), data)
    assert told[3:] == [4 / 6, 5 / 6, 1]


@pytest.mark.parametrize("version", [2, 3])
def test_zarr_arrays_and_groups(data, tmp_path, version):
    group = zarr.create_group(tmp_path / "a.zarr", zarr_format=version)
    group.create_array("image", data=data, chunks=(3, 4, 5))
    check(opened(tmp_path / "a.zarr", tmp_path), data)
    check(opened(tmp_path / "a.zarr" / "image", tmp_path), data)
    check(opened(zarr.open_array(tmp_path / "a.zarr" / "image"), tmp_path), data)
    group.create_array("other", data=data[:3])
    check(opened(tmp_path / "a.zarr", tmp_path, name="image"), data)
    with pytest.raises(ValueError, match="expected a multiscale image of OME-Zarr, or one array.* image, other"):
        open_source(tmp_path / "a.zarr", "zyx", READING)


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_ome_zarr_takes_the_finest_level_with_its_place(data, tmp_path, version):
    group = zarr.create_group(tmp_path / "a.zarr", zarr_format=2 if version == "0.4" else 3)
    group.create_array("half", data=data[None, None, ::2, ::2, ::2], chunks=(1, 1, 2, 2, 2))
    group.create_array("full", data=data[None, None], chunks=(1, 1, 3, 4, 5))
    axes = [{"name": "t", "type": "time"}, {"name": "c", "type": "channel"}]
    axes += [{"name": axis, "type": "space", "unit": "micrometer"} for axis in "zyx"]

    def level(path, factor):
        steps = [{"type": "scale", "scale": [1, 1, 2 * factor, 0.5 * factor, 0.25 * factor]}]
        return {
            "path": path,
            "coordinateTransformations": [*steps, {"type": "translation", "translation": [0, 0, 3, 4, 5]}],
        }

    image = {"version": version, "axes": axes, "datasets": [level("half", 2), level("full", 1)]}
    image["coordinateTransformations"] = [{"type": "scale", "scale": [1, 1, 10, 10, 10]}]
    group.attrs.update(
        {"multiscales": [image]} if version == "0.4" else {"ome": {"version": "0.5", "multiscales": [image]}}
    )
    source = opened(tmp_path / "a.zarr", tmp_path)
    check(source, data)
    assert source.spacing == (2.5, 5, 20) and source.origin == (50, 40, 30) and source.unit == "micrometer"

    path = isospline.convert(tmp_path / "a.zarr", tmp_path / "store.zarr")
    attributes = zarr.open_group(path, mode="r").attrs["ome"]["multiscales"][0]
    assert [axis["unit"] for axis in attributes["axes"]] == ["micrometer"] * 3
    assert attributes["datasets"][0]["coordinateTransformations"] == [
        {"type": "scale", "scale": [20, 5, 2.5]},
        {"type": "translation", "translation": [30, 40, 50]},
    ]
    assert read_metadata(path).scales[0].spacing == (2.5, 5, 20)


def place_of(source):
    return source.spacing, tuple(source.origin), np.asarray(source.direction).tolist(), source.unit, source.patient


@pytest.mark.parametrize("version", [2, 3])
def test_a_level_of_ome_zarr_has_its_place_by_its_own_path(data, tmp_path, version):
    root = zarr.create_group(tmp_path / "a.zarr", zarr_format=version)
    group = root.create_group("images/scan")
    group.create_array("0", data=data[None], chunks=(1, 3, 4, 5))
    group.create_array("coarse/1", data=data[None, ::2, ::2, ::2], chunks=(1, 3, 4, 5))
    group.create_array("other", data=data)
    axes = [{"name": "c", "type": "channel"}] + [{"name": axis, "type": "space", "unit": "nanometer"} for axis in "zyx"]

    def level(path, *scale):
        steps = [{"type": "scale", "scale": [1, *scale]}, {"type": "translation", "translation": [0, *scale]}]
        return {"path": path, "coordinateTransformations": steps}

    image = {"axes": axes, "datasets": [level("0", 3, 2, 1), level("coarse/1", 6, 4, 2)]}
    image["coordinateTransformations"] = [{"type": "translation", "translation": [0, 30, 20, 10]}]
    group.attrs.update(
        {"multiscales": [image]} if version == 2 else {"ome": {"version": "0.5", "multiscales": [image]}}
    )
    folder = tmp_path / "a.zarr/images/scan"
    for path, name, spacing, origin, expected in (
        (folder / "0", None, (1, 2, 3), (11, 22, 33), data),
        (folder, "0", (1, 2, 3), (11, 22, 33), data),
        (tmp_path / "a.zarr", "images/scan/0", (1, 2, 3), (11, 22, 33), data),
        (folder / "coarse/1", None, (2, 4, 6), (12, 24, 36), data[::2, ::2, ::2]),
        (folder / "coarse", "1", (2, 4, 6), (12, 24, 36), data[::2, ::2, ::2]),
        (folder / "other", None, (1, 1, 1), (0, 0, 0), data),
    ):
        source = opened(path, tmp_path, name=name)
        assert np.array_equal(source.read([(0, size) for size in source.shape]), expected)
        unit = None if expected is data and spacing == (1, 1, 1) else "nanometer"
        assert place_of(source) == (spacing, origin, np.eye(3).tolist(), unit, False)
    with pytest.raises(ValueError, match='axes: expected "zyx" for an image that names its axes, got "xyz"'):
        opened(folder / "0", tmp_path, axes="xyz")
    path = isospline.convert(folder / "0", tmp_path / "store")
    assert read_metadata(path).scales[0].spacing == (1, 2, 3) and read_metadata(path).scales[0].origin == (11, 22, 33)


def test_levels_of_a_store_have_its_directions(data, tmp_path):
    turned = np.array([(0, -1, 0), (0.6, 0, -0.8), (0.8, 0, 0.6)])
    given = isospline.io.VolumeData(data, (1, 2, 3), (10, 20, 30), turned, patient=True)
    path = isospline.convert(given, tmp_path / "store")
    whole = opened(path, tmp_path)
    check(whole, data)
    level = opened(Path(path) / "0", tmp_path)
    check(level, data)
    assert place_of(level) == place_of(whole) and level.patient
    np.testing.assert_allclose(level.direction, turned, atol=1e-12)
    np.testing.assert_allclose(level.origin, (10, 20, 30), atol=1e-12)
    for number, scale in enumerate(read_metadata(path).scales[1:], 1):
        level = opened(Path(path) / str(number), tmp_path)
        assert place_of(level)[:2] == (scale.spacing, tuple(scale.origin)) and level.patient


def test_axes_of_ome_zarr_in_any_order(data, tmp_path):
    group = zarr.create_group(tmp_path / "a.zarr")
    group.create_array("0", data=data.transpose(2, 0, 1), chunks=(5, 3, 4))
    datasets = [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 2, 3]}]}]
    axes = [{"name": axis, "type": "space"} for axis in "xzy"]
    group.attrs["ome"] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": datasets}]}
    source = opened(tmp_path / "a.zarr", tmp_path)
    check(source, data)
    assert source.spacing == (1, 3, 2)


@pytest.mark.parametrize("unit", ["millimeter", "micrometer"])
def test_ome_zarr_tells_the_sides_of_a_patient(data, tmp_path, unit):
    group = zarr.create_group(tmp_path / "a.zarr")
    group.create_array("0", data=data, chunks=(3, 4, 5))
    steps = [{"type": "scale", "scale": [3, 2, 1]}, {"type": "translation", "translation": [30, 20, 10]}]
    image = {"datasets": [{"path": "0", "coordinateTransformations": steps}]}

    def opened_with(*values):
        oriented = [{"orientation": {"type": "anatomical", "value": value}} if value else {} for value in values]
        image["axes"] = [{"name": axis, "type": "space", "unit": unit, **each} for axis, each in zip("zyx", oriented)]
        group.attrs["ome"] = {"version": "0.5", "multiscales": [image]}
        return opened(tmp_path / "a.zarr", tmp_path)

    source = opened_with("superior-to-inferior", "left-to-right", "anterior-to-posterior")
    check(source, data)
    assert np.array_equal(source.direction, [(0, -1, 0), (1, 0, 0), (0, 0, -1)])
    assert source.spacing == (1, 2, 3) and tuple(source.origin) == (-20, 10, -30)
    assert source.patient == (unit == "millimeter")  # a patient's world is in millimetres
    for values in (
        ("inferior-to-superior", "anterior-to-posterior", None),
        ("inferior-to-superior", "superior-to-inferior", "left-to-right"),
        ("rostral-to-caudal", "anterior-to-posterior", "left-to-right"),
    ):
        source = opened_with(*values)
        assert not source.patient and np.array_equal(source.direction, np.eye(3)) and source.origin == (10, 20, 30)


def test_hdf5_datasets(data, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("scan/volume", data=data, chunks=(3, 4, 5), compression="gzip")
        file.create_dataset("table", data=np.arange(3))
    check(opened(tmp_path / "a.h5", tmp_path), data)
    check(opened(f"{tmp_path}/a.h5:/scan/volume", tmp_path), data)
    check(opened(tmp_path / "a.h5", tmp_path, name="scan/volume"), data)
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["whole"] = data
        check(open_source(file["whole"], "zyx", READING), data)
    check(opened(f"{tmp_path}/a.h5:whole", tmp_path), data)
    with pytest.raises(ValueError, match="expected one dataset of three dimensions.* scan/volume, whole"):
        open_source(tmp_path / "a.h5", "zyx", READING)
    with pytest.raises(ValueError, match="expected a dataset nothing, got scan/volume"):
        open_source(f"{tmp_path}/a.h5:/nothing", "zyx", READING)


def test_virtual_datasets_of_hdf5(data, tmp_path):
    (tmp_path / "parts").mkdir()
    layout = h5py.VirtualLayout(data.shape, data.dtype)
    for number, samples in enumerate(data):
        with h5py.File(tmp_path / f"parts/{number}.h5", "w") as file:
            file["a"] = samples
        layout[number] = h5py.VirtualSource(f"parts/{number}.h5", "a", samples.shape)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_virtual_dataset("a", layout)
    check(opened(tmp_path / "a.h5", tmp_path), data)
    (tmp_path / "parts/3.h5").unlink()  # h5py reads zeros in its place
    with pytest.raises(ValueError, match=r"a\.h5: .*expected the file parts/3\.h5"):
        open_source(tmp_path / "a.h5", "zyx", READING)


def test_a_chunk_beyond_memory_is_an_error(tmp_path):
    shape = (1 << 14,) * 3
    zarr.create_array(tmp_path / "a.zarr", shape=shape, chunks=shape, dtype="u1", compressors=None, fill_value=1)
    (tmp_path / "a.zarr/c/0/0").mkdir(parents=True)
    (tmp_path / "a.zarr/c/0/0/0").write_bytes(b"")
    with pytest.raises((MemoryError, ValueError), match=r"a\.zarr"):
        open_source(tmp_path / "a.zarr", "zyx", READING).read(BOX)


def write_n5(folder, data, **attributes):
    spec = {"driver": "n5", "kvstore": {"driver": "file", "path": f"{folder}/"}}
    metadata = {"dataType": "int16", "dimensions": data.shape[::-1], "blockSize": [5, 4, 3]}
    metadata["compression"] = {"type": "gzip"}
    tensorstore.open(spec | {"metadata": metadata}, create=True).result()[...] = data.T
    path = folder / "attributes.json"
    path.write_text(json.dumps({**json.loads(path.read_text(encoding="utf-8")), **attributes}), encoding="utf-8")


@pytest.mark.parametrize("key", ["", "scan"])
def test_n5_datasets(data, tmp_path, key):
    folder = tmp_path / "a.n5" / key / "s0"
    write_n5(folder, data)
    group = tmp_path / "a.n5" / key / "attributes.json"
    group.write_text(json.dumps({"pixelResolution": {"dimensions": [0.5, 1, 2], "unit": "um"}}), encoding="utf-8")
    source = opened(tmp_path / "a.n5" / key, tmp_path)
    check(source, data)
    assert source.spacing == (0.5, 1, 2) and source.unit == "micrometer"
    check(opened(folder, tmp_path), data)
    group.write_text(json.dumps({"resolution": [1, 2, 3], "units": ["um", "µm", "micrometer"]}), encoding="utf-8")
    assert opened(tmp_path / "a.n5" / key, tmp_path).unit == "micrometer"
    group.write_text(json.dumps({"resolution": [1, 2, 3], "units": ["um", "um", "nm"]}), encoding="utf-8")
    with pytest.raises(ValueError, match="one unit along all axes, got micrometer, micrometer, nanometer"):
        opened(tmp_path / "a.n5" / key, tmp_path)


def test_n5_has_offsets_and_levels(data, tmp_path):
    write_n5(tmp_path / "a.n5/s0", data)
    group = tmp_path / "a.n5/attributes.json"
    group.write_text(json.dumps({"resolution": [4, 5, 6], "offset": [10, 20, 30]}), encoding="utf-8")
    source = opened(tmp_path / "a.n5", tmp_path)
    check(source, data)
    assert source.spacing == (4, 5, 6) and source.origin == (10, 20, 30)
    group.write_text(json.dumps({"offset": [10, 20]}), encoding="utf-8")
    with pytest.raises(ValueError, match=r"a\.n5: .*three finite numbers as offset, got \[10\.0, 20\.0\]"):
        opened(tmp_path / "a.n5", tmp_path)
    group.unlink()
    pixel = {"dimensions": [4, 5, 6], "unit": "nm"}
    write_n5(tmp_path / "a.n5/s1", data, pixelResolution=pixel, downsamplingFactors=[2, 2, 1])
    source = opened(tmp_path / "a.n5/s1", tmp_path)
    assert source.spacing == (8, 10, 6) and source.origin == (2, 2.5, 0) and source.unit == "nanometer"


@pytest.mark.parametrize("factors", ["scales", "downsamplingFactors", "of levels", "none"])
def test_a_level_of_n5_has_the_place_that_its_group_tells(data, tmp_path, factors):
    levels = [[1, 1, 1], [2, 2, 1]]
    group = {"pixelResolution": {"dimensions": [4, 5, 6], "unit": "nm"}, "offset": [10, 20, 30]}
    if factors in ("scales", "downsamplingFactors"):
        group[factors] = levels
    for number, each in enumerate(levels):
        own = {"downsamplingFactors": each} if factors == "of levels" else {}
        write_n5(tmp_path / f"a.n5/c0/s{number}", data, **own)
    write_n5(tmp_path / "a.n5/c0/mask", data)
    write_n5(tmp_path / "a.n5/c0/s2", data, resolution=[1, 2, 3], downsamplingFactors=[1, 1, 3])
    (tmp_path / "a.n5/c0/attributes.json").write_text(json.dumps(group), encoding="utf-8")
    for path, name in ((tmp_path / "a.n5/c0/s0", None), (tmp_path / "a.n5/c0", "s0"), (tmp_path / "a.n5/c0", None)):
        source = opened(path, tmp_path, name=name)
        check(source, data)
        assert place_of(source)[:2] == ((4, 5, 6), (10, 20, 30)) and source.unit == "nanometer"
    if factors == "none":
        with pytest.warns(UserWarning, match=r"s1: the group has no downsamplingFactors of s1: a spacing of 1"):
            coarse = opened(tmp_path / "a.n5/c0/s1", tmp_path)
        assert place_of(coarse)[:2] == ((1, 1, 1), (0, 0, 0))
        isospline.convert(tmp_path / "a.n5/c0/s1", tmp_path / "s1.zarr", spacing=(8, 10, 6))  # tells nothing
    else:
        assert place_of(opened(tmp_path / "a.n5/c0/s1", tmp_path))[:2] == ((8, 10, 6), (12, 22.5, 30))
    assert place_of(opened(tmp_path / "a.n5/c0/mask", tmp_path))[:2] == ((1, 1, 1), (0, 0, 0))
    own = opened(tmp_path / "a.n5/c0/s2", tmp_path)
    assert place_of(own)[:2] == ((1, 2, 9), (10, 20, 33))


def test_n5_has_affine_transforms(data, tmp_path):
    affine = np.array([(0, -2, 0, 7), (1, 0, 0.5, -3), (0, 0, 3, 11)], float)
    pixel, factors = np.array((4, 5, 6.0)), np.array((2, 2, 1.0))
    told = {"affineTransform": affine.tolist(), "pixelResolution": pixel.tolist()}
    write_n5(tmp_path / "a.n5/s1", data, downsamplingFactors=factors.tolist())
    for own, group in ((told, {}), ({}, told)):
        write_n5(tmp_path / "a.n5/s0", data, **own)
        (tmp_path / "a.n5/attributes.json").write_text(json.dumps(group), encoding="utf-8")
        source = opened(tmp_path / "a.n5", tmp_path)
        check(source, data)
        # As N5SingleScaleMetadataParser of n5-universe: factors and half of their shift, resolution, then the affine.
        index = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (3, 5, 2)], float)
        levels = [(source, 1)] + ([(opened(tmp_path / "a.n5/s1", tmp_path), factors)] if group else [])
        for level, factor in levels:
            expected = (pixel * (index * factor + (np.array(factor) - 1) / 2)) @ affine[:, :3].T + affine[:, 3]
            got = isospline.io.VolumeData(data, level.spacing, level.origin, level.direction).position(index)
            np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12)
        (tmp_path / "a.n5/s0/attributes.json").unlink()
    for wrong in ([1, 0, 0, 0], np.zeros((3, 4)).tolist(), {"type": "affine"}, [[1, 0, 0, None]] * 3):
        write_n5(tmp_path / "a.n5/s0", data, affineTransform=wrong)
        with pytest.raises(ValueError, match=r"a\.n5: .*affineTransform to be 3 x 4 numbers of an invertible matrix"):
            opened(tmp_path / "a.n5", tmp_path)
        (tmp_path / "a.n5/s0/attributes.json").unlink()


@pytest.mark.parametrize("kind", ["dataset", "group", "zarr"])
@pytest.mark.parametrize("axes", ["zyx", "xyz"])
def test_transforms_of_cosem(data, tmp_path, kind, axes):
    scale, translate = {"x": 4, "y": 5, "z": 3.24}, {"x": 10, "y": 20, "z": -30}
    transform = {
        "axes": list(axes),
        "scale": [scale[axis] for axis in axes],
        "translate": [translate[axis] for axis in axes],
        "units": ["nm"] * 3,
    }
    image = {"datasets": [{"path": "s1", "transform": {}}, {"path": "s0", "transform": transform}]}
    pixel = {"dimensions": [4, 5, 3.24], "unit": "nm"}

    def written(own):
        if kind == "zarr":
            zarr.create_array(tmp_path / "a.zarr", data=data, attributes=own, overwrite=True)
            return tmp_path / "a.zarr"
        (tmp_path / "a.n5").mkdir(exist_ok=True)
        group = {"multiscales": [image]} if kind == "group" else {}
        (tmp_path / "a.n5/attributes.json").write_text(json.dumps(group), encoding="utf-8")
        if not (tmp_path / "a.n5/s0").exists():
            write_n5(tmp_path / "a.n5/s0", data, pixelResolution=pixel, **({} if kind == "group" else own))
        return tmp_path / "a.n5"

    source = opened(written({"transform": transform}), tmp_path)
    check(source, data)
    assert source.spacing == (4, 5, 3.24) and source.origin == (10, 20, -30) and source.unit == "nanometer"
    if kind == "group":
        assert place_of(opened(tmp_path / "a.n5/s0", tmp_path)) == place_of(source)
    if kind == "zarr":
        assert opened(written({"transform": [4, 0, 10, 0, 5, 20]}), tmp_path).spacing == (1, 1, 1)  # of rasterio
    if kind != "dataset":
        transform["axes"] = ["c", "y", "x"]
        with pytest.raises(ValueError, match=r"expected a transform with axes x, y and z, scale, .* got .*'z'"):
            opened(written({"transform": transform}), tmp_path)


def test_other_transformations_of_ome_zarr_are_refused(data, tmp_path):
    group = zarr.create_group(tmp_path / "a.zarr")
    group.create_array("0", data=data)
    axes = [{"name": axis, "type": "space"} for axis in "zyx"]
    for step, told in (
        ({"type": "affine", "affine": [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0]]}, "affine"),
        ({"type": "scale", "path": "scales"}, "one in a file"),
    ):
        image = {"axes": axes, "datasets": [{"path": "0", "coordinateTransformations": [step]}]}
        group.attrs["ome"] = {"version": "0.5", "multiscales": [image]}
        with pytest.raises(ValueError, match=f"got a transformation that is none of identity, scale, .*: {told}"):
            open_source(tmp_path / "a.zarr", "zyx", READING)


@pytest.mark.parametrize("kind", ["zarr", "n5", "h5"])
def test_a_broken_chunk_is_named(data, tmp_path, kind):
    path = tmp_path / f"a.{kind}"
    if kind == "zarr":
        zarr.create_array(path, data=data, chunks=(3, 4, 5))
        chunk = path / "c" / "1" / "0" / "1"
        chunk.write_bytes(chunk.read_bytes()[:10])
    elif kind == "n5":
        write_n5(path, data)
        chunk = path / "1" / "0" / "1"
        chunk.write_bytes(chunk.read_bytes()[:-10])
    else:
        with h5py.File(path, "w") as file:
            stored = file.create_dataset("a", data=data, chunks=(3, 4, 5), fletcher32=True)
            place = stored.id.get_chunk_info_by_coord((3, 0, 5))
        content = bytearray(path.read_bytes())
        content[place.byte_offset + 4] ^= 1
        path.write_bytes(content)
    with pytest.raises(ValueError, match=rf"a\.{kind}.*chunk \(1, 0, 1\) cannot be read: "):
        open_source(path, "zyx", READING).read([(0, 6), (0, 7), (0, 8)])
    with pytest.raises(ValueError, match=r"chunk \(1, 0, 1\)"):
        isospline.convert(path, tmp_path / "store.zarr")
    with pytest.raises(ValueError, match=r"store\.zarr: expected a complete store"):
        read_metadata(tmp_path / "store.zarr")


def test_what_is_no_volume_is_refused(data, tmp_path):
    isospline.convert(data, tmp_path / "store.zarr", image=False)
    with pytest.raises(ValueError, match="expected samples, got a store without them"):
        open_source(tmp_path / "store.zarr", "zyx", READING)
    zarr.create_array(tmp_path / "flat.zarr", data=data[0])
    with pytest.raises(ValueError, match=r"flat\.zarr.*expected an array of three dimensions, got shape \(7, 8\)"):
        open_source(tmp_path / "flat.zarr", "zyx", READING)
    with pytest.raises(TypeError, match="source: expected a path, a VolumeData or an array"):
        isospline.convert(None, tmp_path / "a.zarr")
    for wrong, said in (
        (data.astype(complex), "real numbers"),
        (data[:0], "at least one sample along each axis"),
        (isospline.io.VolumeData(data[:0]), "at least one sample along each axis"),
        (data[0], "three dimensions"),
    ):
        with pytest.raises(ValueError, match=f"^source: expected {said}, got "):
            isospline.convert(wrong, tmp_path / "a.zarr")
    assert not (tmp_path / "a.zarr").exists()
