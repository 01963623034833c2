"""Reading volumes from files of independent writers. The oracle is their own position of a sample."""

import contextlib
import os
import re
import subprocess
import sys
import tempfile
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest
from placed_images import DIRECTIONS, ORIGIN, SHAPE, SPACING, directions, itk_image, vtk_image, write_slices

import isospline
from isospline import read_volume
from isospline.io.files import files_of

nibabel = pytest.importorskip("nibabel")
nrrd = pytest.importorskip("nrrd")
pydicom = pytest.importorskip("pydicom")
SimpleITK = pytest.importorskip("SimpleITK")
tifffile = pytest.importorskip("tifffile")
pytest.importorskip("vtkmodules")

INDICES = np.array([(0, 0, 0), (6, 0, 0), (0, 5, 0), (0, 0, 4), (3, 2, 1)])  # x, y, z
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])


dtypes = pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "int32", "float32", "float64"])


@pytest.fixture
def data(rng):
    return rng.integers(0, 200, SHAPE).astype(np.int16)


def itk_positions(image):
    return [image.TransformContinuousIndexToPhysicalPoint(index.astype(float).tolist()) for index in INDICES]


# NIfTI


@directions
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_nifti_is_placed_as_by_nibabel(tmp_path, data, direction, suffix):
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = direction * SPACING, ORIGIN
    image = nibabel.Nifti1Image(data.T, affine)
    nibabel.save(image, tmp_path / f"a{suffix}")

    volume = read_volume(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(volume.data, data)
    assert (volume.data.dtype, volume.format) == (data.dtype, "NIfTI")
    np.testing.assert_allclose(volume.spacing, SPACING, rtol=1e-6)
    ras = nibabel.affines.apply_affine(image.affine, INDICES)
    np.testing.assert_allclose(volume.position(INDICES), ras @ LPS_FROM_RAS, rtol=1e-6, atol=1e-5)


@directions
def test_nifti_is_placed_as_by_itk(tmp_path, data, direction):
    image = itk_image(data, direction)
    SimpleITK.WriteImage(image, tmp_path / "a.nii.gz")
    np.testing.assert_allclose(read_volume(tmp_path / "a.nii.gz").position(INDICES), itk_positions(image), atol=1e-4)


def test_nifti_keeps_sheared_axes(tmp_path, data):
    affine = np.array([[1, 0.2, 0, 1], [0, 2, 0.1, 2], [0, 0, 3, 3], [0, 0, 0, 1.0]])
    nibabel.save(nibabel.Nifti1Image(data.T, affine), tmp_path / "a.nii")
    np.testing.assert_allclose(read_volume(tmp_path / "a.nii").affine, np.diag([-1, -1, 1, 1]) @ affine, atol=1e-6)


def test_nifti_scales_its_samples(tmp_path, data):
    image = nibabel.Nifti1Image(data.T.astype(np.int16), np.eye(4))
    image.header.set_slope_inter(0.5, -10)
    nibabel.save(image, tmp_path / "a.nii")
    np.testing.assert_allclose(read_volume(tmp_path / "a.nii").data, nibabel.load(tmp_path / "a.nii").get_fdata().T)


def test_nifti_is_not_confused_by_its_neighbour(tmp_path, data):
    nibabel.save(nibabel.Nifti1Image(data.T, np.eye(4)), tmp_path / "a.nii.gz")
    nibabel.save(nibabel.Nifti1Image(data.T * 0, np.eye(4)), tmp_path / "a.nii")
    np.testing.assert_array_equal(read_volume(tmp_path / "a.nii.gz").data, data)


# NRRD and MetaImage


@directions
@pytest.mark.parametrize("name", ["a.nrrd", "a.nhdr", "a.mha", "a.mhd"])
@pytest.mark.parametrize("compressed", [False, True])
def test_itk_formats_are_placed_as_by_itk(tmp_path, data, direction, name, compressed):
    image = itk_image(data, direction)
    SimpleITK.WriteImage(image, tmp_path / name, compressed)

    volume = read_volume(tmp_path / name)
    np.testing.assert_array_equal(volume.data, data)
    np.testing.assert_allclose(volume.spacing, SPACING)
    np.testing.assert_allclose(volume.position(INDICES), itk_positions(image), atol=1e-6)


@dtypes
@pytest.mark.parametrize("name", ["a.nii", "a.nrrd", "a.mha"])
def test_types_are_kept(tmp_path, data, dtype, name):
    SimpleITK.WriteImage(itk_image(data.astype(dtype)), tmp_path / name)
    volume = read_volume(tmp_path / name)
    assert volume.data.dtype == dtype
    np.testing.assert_array_equal(volume.data, data.astype(dtype))


@directions
@pytest.mark.parametrize("space", ["left-posterior-superior", "right-anterior-superior"])
def test_nrrd_of_pynrrd_comes_in_the_patient_s_world(tmp_path, data, direction, space):
    header = {"space": space, "space directions": (direction * SPACING).T, "space origin": ORIGIN, "encoding": "gzip"}
    nrrd.write(str(tmp_path / "a.nrrd"), data.T, header)

    samples, header = nrrd.read(str(tmp_path / "a.nrrd"))
    volume = read_volume(tmp_path / "a.nrrd")
    np.testing.assert_array_equal(volume.data, samples.T)
    positions = INDICES @ header["space directions"] + header["space origin"]
    if space.startswith("right"):
        positions = positions @ LPS_FROM_RAS
    np.testing.assert_allclose(volume.position(INDICES), positions, atol=1e-6)


def test_a_series_of_one_volume_is_a_volume(tmp_path, data):
    nibabel.save(nibabel.Nifti1Image(data.T[..., None], np.eye(4)), tmp_path / "a.nii")
    SimpleITK.WriteImage(SimpleITK.JoinSeries(itk_image(data, DIRECTIONS["oblique"])), tmp_path / "a.mha")
    np.testing.assert_array_equal(read_volume(tmp_path / "a.nii").data, data)
    volume = read_volume(tmp_path / "a.mha")
    np.testing.assert_array_equal(volume.data, data)
    np.testing.assert_allclose(volume.direction, DIRECTIONS["oblique"], atol=1e-12)


# DICOM


# Slices are sorted along their normal, so that the axes of a series are right-handed.
@pytest.mark.parametrize("direction", [matrix for matrix in DIRECTIONS.values() if np.linalg.det(matrix) > 0])
def test_dicom_series_is_where_its_slices_are(tmp_path, data, direction):
    write_slices(tmp_path / "series", data, direction)
    volume = read_volume(tmp_path / "series")
    np.testing.assert_array_equal(volume.data, data * 2 - 1000)
    expected = np.array(ORIGIN) + (INDICES * SPACING) @ direction.T
    np.testing.assert_allclose(volume.position(INDICES), expected, atol=1e-6)

    itk = SimpleITK.ImageSeriesReader()
    itk.SetFileNames(SimpleITK.ImageSeriesReader.GetGDCMSeriesFileNames(str(tmp_path / "series")))
    np.testing.assert_allclose(volume.position(INDICES), itk_positions(itk.Execute()), atol=1e-6)


def test_dicom_of_a_tilted_gantry_is_sheared(tmp_path, data):
    step = (0.0, 0.6, 2.0)
    write_slices(tmp_path / "series", data, step=step)
    volume = read_volume(tmp_path / "series")
    np.testing.assert_allclose(volume.position((0, 0, 3)), np.array(ORIGIN) + 3 * np.array(step), atol=1e-6)
    np.testing.assert_allclose(volume.position((2, 0, 0)), np.array(ORIGIN) + (2 * SPACING[0], 0, 0), atol=1e-6)


def test_dicom_with_a_slice_missing_is_refused(tmp_path, data):
    write_slices(tmp_path / "series", data, skip=[2])
    with pytest.raises(ValueError, match="evenly spaced slices, got distances from 2.5 to 5"):
        read_volume(tmp_path / "series")


@pytest.mark.parametrize("read", [read_volume, lambda path, **options: isospline.convert(path, "a.zarr", **options)])
def test_options_without_effect_are_refused(tmp_path, data, read, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("a.npy", data)
    tifffile.imwrite("b.tif", data, photometric="minisblack")
    SimpleITK.WriteImage(itk_image(data), "c.nrrd")
    write_slices(tmp_path / "series", data)
    (tmp_path / "pages").mkdir()
    tifffile.imwrite("pages/0.tif", data[0])
    for path in ("a.npy", "b.tif", "c.nrrd", "pages"):
        with pytest.raises(ValueError, match=f"^name: expected none for {path}, which has one array, got 'x'"):
            read(path, name="x")
    for path in ("series", "pages"):
        for option in (dict(shape=SHAPE), dict(dtype="u1"), dict(offset=8)):
            with pytest.raises(ValueError, match=f"^{min(option)}: expected none for the folder {path}, got"):
                read(path, **option)
    with pytest.raises(ValueError, match="^shape: expected the shape of a raw file with dtype and offset, got None"):
        read("b.tif", dtype="u1")


@pytest.mark.parametrize("shape", [(5, 6, 7), (5, 4, 11)])
def test_raw_samples_do_not_begin_before_their_file(tmp_path, shape):
    np.zeros(210, np.uint8).tofile(tmp_path / "a.raw")
    with pytest.raises(ValueError, match=r"a\.raw: .*expected an offset of at least 0, got -10"):
        read_volume(tmp_path / "a.raw", shape=shape, dtype="u1", offset=-10)


def test_dicom_series_is_chosen_by_name(tmp_path, data):
    write_slices(tmp_path / "series", data)
    write_slices(tmp_path / "series", data[::-1], uid="1.2.9")
    with pytest.raises(ValueError, match=r"expected one series, or its UID as name, got 2: 1\.2\.[39]"):
        read_volume(tmp_path / "series")
    with pytest.raises(ValueError, match=rf"1\.2\.9 \({len(data)} images\)$"):
        read_volume(tmp_path / "series")
    np.testing.assert_array_equal(read_volume(tmp_path / "series", name="1.2.9").data, data[::-1] * 2 - 1000)
    with pytest.raises(ValueError, match="UID of a series"):
        read_volume(tmp_path / "series", name="7")


def test_a_dicom_file_needs_no_suffix(tmp_path, data):
    write_slices(tmp_path / "series", data[:1])
    for path in (tmp_path / "series", next((tmp_path / "series").iterdir())):
        np.testing.assert_array_equal(read_volume(path).data, data[:1] * 2 - 1000)


# TIFF


@dtypes
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"compression": "zlib"},
        {"compression": "lzw"},
        {"bigtiff": True},
        {"byteorder": ">"},
    ],
    ids=str,
)
def test_tiff_pages_are_slices(tmp_path, data, dtype, options):
    tifffile.imwrite(tmp_path / "a.tif", data.astype(dtype), photometric="minisblack", **options)
    volume = read_volume(tmp_path / "a.tif")
    np.testing.assert_array_equal(volume.data, data.astype(dtype))
    assert volume.data.dtype.newbyteorder("=") == dtype
    assert volume.spacing == (1, 1, 1)


def test_tiff_resolution_is_not_taken_as_spacing(tmp_path, data):
    tifffile.imwrite(tmp_path / "a.tif", data, resolution=(72, 72), resolutionunit="INCH", photometric="minisblack")
    assert read_volume(tmp_path / "a.tif").spacing == (1, 1, 1)


def test_tiff_of_imagej_has_a_spacing(tmp_path, data):
    metadata = {"spacing": 2.5, "unit": "um", "axes": "ZYX"}
    tifffile.imwrite(tmp_path / "a.tif", data, imagej=True, resolution=(1 / 0.5, 1 / 0.75), metadata=metadata)
    assert read_volume(tmp_path / "a.tif").spacing == pytest.approx((0.5, 0.75, 2.5))


@pytest.mark.parametrize(
    ("metadata", "spacing", "unit"),
    [
        ("unit=micron\n", (0.5, 0.25, 1), "µm"),  # ImageJ does not write a depth of 1
        ("unit=mm\nspacing=-2.5\n", (0.5, 0.25, 2.5), "mm"),
        ("unit=nm\nzunit=\\u00B5m\nspacing=0.05\n", (0.5, 0.25, 50), "nm"),
        ("unit=mm\nyunit=inch\nzunit=cm\n", (0.5, 6.35, 10), "mm"),
        ("", (1, 1, 1), ""),
        ("unit=pixel\n", (1, 1, 1), ""),
        ("unit=inch\n", (1, 1, 1), ""),  # a printer's resolution
        ("unit=inch\nspacing=2\n", (0.5, 0.25, 2), "inch"),
    ],
)
def test_tiff_of_imagej_has_the_units_of_its_axes(tmp_path, data, metadata, spacing, unit):
    description = f"ImageJ=1.53t\nimages={len(data)}\nslices={len(data)}\n{metadata}loop=false\n"
    resolution = {"resolution": (2, 4), "resolutionunit": 1}
    tifffile.imwrite(tmp_path / "a.tif", data, **resolution, **of_imagej(description))
    volume = read_volume(tmp_path / "a.tif")
    assert volume.spacing == pytest.approx(spacing, rel=1e-12) and volume.unit == unit


@pytest.mark.parametrize(
    ("calibration", "dtype", "expected"),
    [
        ("cf=0\nc0=-32768.0\nc1=1.0\n", np.int16, lambda raw: raw - 32768.0),
        ("cf=0\nc0=-1000.0\nc1=0.5\n", np.float32, lambda raw: 0.5 * raw - 1000),
        ("cf=1\nc0=1.0\nc1=0.0\nc2=0.001\n", np.float32, lambda raw: 1 + 0.001 * raw**2),
        ("cf=20\n", np.uint16, lambda raw: raw),
        ("cf=0\nc0=1e30\nc1=1.0\n", np.float32, lambda raw: raw + 1e30),
        ("cf=0\nc0=0.0\nc1=1.0\n", np.uint16, lambda raw: raw),
    ],
)
def test_tiff_of_imagej_has_calibrated_samples(tmp_path, rng, calibration, dtype, expected):
    """The values that ImageJ shows in its status bar."""
    raw = rng.integers(0, 2**16, (3, 4, 5)).astype(np.uint16)
    description = f"ImageJ=1.53t\nimages=3\nslices=3\n{calibration}loop=false\n"
    tifffile.imwrite(tmp_path / "a.tif", raw, **of_imagej(description))
    found = read_volume(tmp_path / "a.tif").data
    assert found.dtype == dtype
    np.testing.assert_allclose(found, expected(raw.astype(float)), rtol=1e-6)
    (tmp_path / "slices").mkdir()
    description = description.replace("=3", "=1")
    for number, each in enumerate(raw):
        tifffile.imwrite(tmp_path / "slices" / f"{number}.tif", each, **of_imagej(description))
    np.testing.assert_array_equal(read_volume(tmp_path / "slices").data, found)


def test_tiff_of_imagej_with_another_calibration_is_refused(tmp_path):
    description = "ImageJ=1.53t\nimages=3\nslices=3\ncf=4\nc0=1.0\nc1=1.0\nloop=false\n"
    tifffile.imwrite(tmp_path / "a.tif", np.zeros((3, 4, 5), np.uint16), **of_imagej(description))
    with pytest.raises(ValueError, match="a.tif: .*calibrated by a polynomial, got ImageJ's function 4"):
        read_volume(tmp_path / "a.tif")


@pytest.mark.parametrize("move", ["inf", "nan", "-1e999"])
def test_tiff_of_imagej_with_a_calibration_that_is_not_finite_is_refused(tmp_path, move):
    description = f"ImageJ=1.53t\nimages=3\nslices=3\ncf=0\nc0={move}\nc1=1.0\nloop=false\n"
    tifffile.imwrite(tmp_path / "a.tif", np.zeros((3, 4, 5), np.uint16), **of_imagej(description))
    with pytest.raises(
        ValueError, match=r"a\.tif: .*expected finite coefficients of the calibration of samples, got \["
    ):
        read_volume(tmp_path / "a.tif")


def of_imagej(description):
    """Options of tifffile for a description as ImageJ writes it."""
    return {"description": description, "metadata": None, "photometric": "minisblack"}


def test_tiff_of_ome_without_a_spacing_along_z_says_so(tmp_path, data):
    metadata = {"axes": "ZYX", "PhysicalSizeX": 0.1, "PhysicalSizeY": 0.2, "PhysicalSizeYUnit": "mm"}
    tifffile.imwrite(tmp_path / "a.ome.tif", data, ome=True, metadata=metadata)
    with pytest.warns(UserWarning, match=r"^a\.ome\.tif: the file has no spacing along z: 1 µm is assumed"):
        volume = read_volume(tmp_path / "a.ome.tif")
    assert volume.spacing == pytest.approx((0.1, 200, 1)) and volume.unit == "µm"


def test_tiff_of_ome_has_a_spacing(tmp_path, data):
    sizes = {f"PhysicalSize{axis}": size for axis, size in zip("XYZ", (0.5, 0.75, 2.5))}
    tifffile.imwrite(tmp_path / "a.ome.tif", data, ome=True, metadata={"axes": "ZYX", **sizes})
    assert read_volume(tmp_path / "a.ome.tif").spacing == (0.5, 0.75, 2.5)


def read_both(path):
    """A volume, and the source of `convert`, which has the same samples and place, and their warnings."""
    from isospline.store.sources.opening import open_source

    found, told = [], []
    for read in (read_volume, lambda path: open_source(path, "zyx", dict(shape=None, dtype=None, offset=0, name=None))):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found.append(read(path))
        told.append([str(each.message) for each in caught])
    volume, source = found
    with tempfile.TemporaryDirectory() as folder:
        samples = source.stage(Path(folder) / "staged", lambda fraction: None).read([(0, n) for n in source.shape])
    np.testing.assert_array_equal(samples, volume.data)
    assert source.spacing == volume.spacing and told[0] == told[1]
    return volume, told[0]


def test_tiff_has_its_first_row_where_the_tag_orientation_says(tmp_path, rng):
    pillow = pytest.importorskip("PIL.Image")
    operations = pytest.importorskip("PIL.ImageOps")
    stored = rng.integers(0, 255, (3, 4, 5)).astype(np.uint8)
    for orientation in (0, 2, 3, 4, 5, 6, 7, 8):
        expected = []
        for plane in stored:
            picture = pillow.fromarray(plane)
            picture.getexif()[274] = orientation
            expected.append(np.asarray(operations.exif_transpose(picture)))
        description = "ImageJ=1.53t\nimages=COUNT\nunit=mm\nspacing=2\n"
        options = dict(resolution=(2, 4), resolutionunit=1, extratags=[(274, "H", 1, orientation, True)])
        folder = tmp_path / f"{orientation}"
        folder.mkdir()
        for number, plane in enumerate(stored):
            content = description.replace("COUNT", "1")
            tifffile.imwrite(folder / f"{number}.tif", plane, **options, **of_imagej(content))
        tifffile.imwrite(tmp_path / "a.tif", stored, **options, **of_imagej(description.replace("COUNT", "3")))
        for path in (tmp_path / "a.tif", folder) if orientation == 6 else (tmp_path / "a.tif",):
            volume, _ = read_both(path)
            np.testing.assert_array_equal(volume.data, expected)
            assert volume.spacing == ((0.25, 0.5, 2) if orientation > 4 else (0.5, 0.25, 2))
    tifffile.imwrite(tmp_path / "a.tif", stored, photometric="minisblack", extratags=[(274, "H", 1, 4, True)])
    expected = SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(str(tmp_path / "a.tif")))
    np.testing.assert_array_equal(read_volume(tmp_path / "a.tif").data, expected)


def write_tiff_slices(folder, numbers, **options):
    folder.mkdir()
    for number in numbers:
        tifffile.imwrite(folder / f"a_{number}.tif", np.full((4, 3), number % 250, np.uint8), **options)
    return folder


def test_tiff_folder_has_the_spacing_of_its_slices(tmp_path):
    of_slices = dict(resolution=(2, 4), resolutionunit=1)
    description = "ImageJ=1.53t\nimages=1\nunit=mm\n"
    known = of_imagej(description + "spacing=3\n")
    volume, told = read_both(write_tiff_slices(tmp_path / "imagej", range(4), **of_slices, **known))
    assert volume.spacing == (0.5, 0.25, 3) and volume.unit == "mm" and not told
    path = write_tiff_slices(tmp_path / "no_z", range(4), **of_slices, **of_imagej(description))
    volume, told = read_both(path)
    assert volume.spacing == (0.5, 0.25, 1) and volume.unit == "mm"
    assert told == ["no_z: the file has no spacing along z: 1 mm is assumed; say spacing=(x, y, z)"]
    assert read_volume(path, spacing=2).spacing == (2, 2, 2)  # without a warning, as here
    isospline.convert(path, tmp_path / "a.zarr", spacing=2)
    metadata = {"axes": "YX", "PhysicalSizeX": 0.5, "PhysicalSizeY": 0.75, "PhysicalSizeZ": 2.5}
    volume, told = read_both(write_tiff_slices(tmp_path / "ome", range(4), ome=True, metadata=metadata))
    assert volume.spacing == (0.5, 0.75, 2.5) and volume.unit == "µm" and not told
    tifffile.imwrite(path / "a_2.tif", np.zeros((4, 3), np.uint8), resolution=(2, 5), **of_imagej(description))
    for read in (read_volume, read_both):
        with pytest.raises(ValueError, match=r"a_2\.tif: expected slices with the spacing of the first .* 0\.2, 1"):
            read(path)


@pytest.mark.parametrize(
    ("resolution", "unit", "told"),
    [
        ((1000, 500), "CENTIMETER", "spacing is 1, and not 0.01 and 0.02 mm, the resolution that tags tell"),
        ((25400, 25400), "INCH", "spacing is 1, and not 0.001 and 0.001 mm"),
        ((300, 300), "INCH", ""),
        ((28.3465, 28.3465), "CENTIMETER", ""),  # 72 per inch
        ((1000, 1000), "NONE", ""),
    ],
)
def test_tiff_tells_of_a_resolution_that_is_not_used(tmp_path, data, resolution, unit, told):
    options = dict(resolution=resolution, resolutionunit=unit, photometric="minisblack")
    tifffile.imwrite(tmp_path / "a.tif", data, **options)
    for path in (tmp_path / "a.tif", write_tiff_slices(tmp_path / "slices", range(4), **options)):
        volume, warned = read_both(path)
        assert volume.spacing == (1, 1, 1) and len(warned) == bool(told) and all(told in each for each in warned)


@pytest.mark.parametrize(
    ("numbers", "told"),
    [
        ([1, 2, 3, 4], ""),
        ([2, 4, 6], ""),
        ([1, 2, 4, 5], "a_4.tif follows a_2.tif: are slices missing?"),
        ([1, 2, 3, 13, 14, 16], "a_13.tif follows a_3.tif, and 1 more such gaps: are slices missing?"),
    ],
)
def test_tiff_folder_tells_of_gaps(tmp_path, numbers, told):
    volume, warned = read_both(write_tiff_slices(tmp_path / "slices", numbers))
    assert volume.data[:, 0, 0].tolist() == numbers
    assert warned == ([f"slices: {told}"] if told else [])
    with pytest.warns(match="missing") if told else contextlib.nullcontext():  # also if spacing is known
        read_volume(tmp_path / "slices", spacing=2)


def test_tiff_folder_is_sorted_by_number(tmp_path, rng):
    data = rng.integers(0, 1000, (12, 4, 3)).astype(np.uint16)
    for index, slice_ in enumerate(data):
        tifffile.imwrite(tmp_path / f"slice{index}.TIF", slice_)
    (tmp_path / "notes.txt").write_text("not a slice", encoding="utf-8")
    volume = read_volume(tmp_path)
    np.testing.assert_array_equal(volume.data, data)
    assert volume.format == "TIFF slices"

    tifffile.imwrite(tmp_path / "slice12.tif", data[0, 1:])
    with pytest.raises(ValueError, match=r"expected slices like the first one, \(4, 3\) uint16, got \(3, 3\)"):
        read_volume(tmp_path)


# VTK


def write_vtk(image, path, ascii=False, **settings):
    from vtkmodules.vtkIOLegacy import vtkStructuredPointsWriter
    from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

    writer = vtkStructuredPointsWriter() if path.suffix == ".vtk" else vtkXMLImageDataWriter()
    if path.suffix == ".vtk":
        writer.SetFileTypeToASCII() if ascii else writer.SetFileTypeToBinary()
    for setting in settings:
        getattr(writer, setting)()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.Write()


@dtypes
@pytest.mark.parametrize("ascii", [False, True])
def test_legacy_vtk_is_placed_as_by_vtk(tmp_path, data, dtype, ascii):
    image = vtk_image(data.astype(dtype))
    write_vtk(image, tmp_path / "a.vtk", ascii)
    volume = read_volume(tmp_path / "a.vtk")
    np.testing.assert_array_equal(volume.data, data.astype(dtype))
    assert volume.data.dtype == dtype
    assert (volume.spacing, volume.origin) == (SPACING, ORIGIN)


@pytest.mark.parametrize("name", ["a.vtk", "a.vti"])
def test_vtk_s_arrays_of_bits_are_bytes(tmp_path, data, name):
    from vtkmodules.vtkCommonCore import vtkBitArray

    image, bits = vtk_image(data), vtkBitArray()
    for bit in (data % 2).ravel().tolist():
        bits.InsertNextValue(bit)
    image.GetPointData().SetScalars(bits)
    write_vtk(image, tmp_path / name)
    volume = read_volume(tmp_path / name)
    np.testing.assert_array_equal(volume.data, data % 2)
    assert volume.data.dtype == np.uint8


@directions
@pytest.mark.parametrize(
    "setting",
    [
        "SetDataModeToAscii",
        "SetDataModeToBinary",
        "SetDataModeToAppended",
        "EncodeAppendedDataOff",
        "SetCompressorTypeToNone",
    ],
)
def test_vti_is_placed_as_by_vtk(tmp_path, data, direction, setting):
    image = vtk_image(data, direction, extent=(2, 8, -3, 2, 10, 14))
    write_vtk(image, tmp_path / "a.vti", **{setting: True})
    volume = read_volume(tmp_path / "a.vti")
    np.testing.assert_array_equal(volume.data, data)
    expected = [image.GetPoint(image.ComputePointId((index + (2, -3, 10)).tolist())) for index in INDICES]
    np.testing.assert_allclose(volume.position(INDICES), expected, atol=1e-9)


def test_samples_of_vtk_cells_are_in_their_middle(tmp_path, data):
    image = vtk_image(data, DIRECTIONS["oblique"], cells=True)
    write_vtk(image, tmp_path / "a.vti")
    volume = read_volume(tmp_path / "a.vti")
    np.testing.assert_array_equal(volume.data, data)
    for index in INDICES:
        bounds = np.reshape(image.GetCell(image.ComputeCellId(index.tolist())).GetBounds(), (3, 2))
        np.testing.assert_allclose(volume.position(index), bounds.mean(axis=1), atol=1e-9)


def test_vtk_arrays_are_chosen_by_name(tmp_path, data):
    from vtkmodules.util.numpy_support import numpy_to_vtk

    image = vtk_image(data)
    other = numpy_to_vtk((data + 1).ravel(), deep=True)
    other.SetName("other")
    image.GetPointData().AddArray(other)
    write_vtk(image, tmp_path / "a.vti")
    np.testing.assert_array_equal(read_volume(tmp_path / "a.vti").data, data)
    np.testing.assert_array_equal(read_volume(tmp_path / "a.vti", name="other").data, data + 1)
    with pytest.raises(ValueError, match="expected an array named third, got density, other"):
        read_volume(tmp_path / "a.vti", name="third")


# Arrays and raw files


@pytest.mark.parametrize("size", [0, 1, 5, 7, 60])
def test_npy_that_is_cut_off_is_refused(tmp_path, data, size):
    np.save(tmp_path / "a.npy", data)
    (tmp_path / "a.npy").write_bytes((tmp_path / "a.npy").read_bytes()[:size])
    with pytest.raises(ValueError, match=r"a\.npy: cannot be read as NPY: ") as error:
        read_volume(tmp_path / "a.npy")
    assert "pickle" not in str(error.value) and (size > 5 or "the file is truncated or damaged" in str(error.value))


@pytest.mark.parametrize("order", ["C", "F"])
def test_npy_is_mapped(tmp_path, data, order):
    np.save(tmp_path / "a.npy", np.asarray(data, order=order))
    volume = read_volume(tmp_path / "a.npy", spacing=SPACING, origin=ORIGIN, direction=DIRECTIONS["oblique"])
    assert isinstance(volume.data, np.memmap)
    np.testing.assert_array_equal(volume.data, data)
    np.testing.assert_allclose(volume.affine[:3, :3], DIRECTIONS["oblique"] * SPACING)
    assert (volume.spacing, volume.origin) == (SPACING, ORIGIN)


@pytest.mark.parametrize("dtype", ["<u2", ">u2", "<f4", ">f8", "i1"])
def test_raw_of_either_byte_order(tmp_path, data, dtype):
    (tmp_path / "a.bin").write_bytes(b"header" + data.astype(dtype).tobytes())
    volume = read_volume(tmp_path / "a.bin", shape=SHAPE, dtype=dtype, offset=6)
    np.testing.assert_array_equal(volume.data, data.astype(dtype))


def test_raw_of_another_size_is_refused(tmp_path, data):
    path = tmp_path / "a.raw"
    path.write_bytes(data.tobytes())
    for shape in ((5, 6, 8), (5, 6, 6)):
        expected = rf"a\.raw: .*expected \d+ bytes, {shape[2]} x 6 x 5 samples \(x, y, z\) of int16"
        with pytest.raises(ValueError, match=expected):
            read_volume(path, shape=shape, dtype="int16")
    with pytest.raises(ValueError, match="shape and the type"):
        read_volume(path)
    with pytest.raises(ValueError, match="dtype="):
        read_volume(path, shape=SHAPE)
    for shape, expected in (
        ((0, 6, 7), r"a whole number of at least 1, got 0"),
        ((2.5, 6, 7), r"a whole number of at least 1, got 2\.5"),
        (210, r"three whole numbers, \(nz, ny, nx\), got 210"),
    ):
        with pytest.raises((ValueError, TypeError), match=f"^shape: expected {expected}"):
            read_volume(path, shape=shape, dtype="int16")


# What was read becomes a model


def test_volume_data_becomes_a_volume(tmp_path, data):
    SimpleITK.WriteImage(itk_image(data, DIRECTIONS["oblique and mirrored"]), tmp_path / "a.nrrd")
    read = read_volume(tmp_path / "a.nrrd")
    volume = read.to_volume(degree=3)
    assert volume.degree == 3
    np.testing.assert_allclose(volume.affine, read.affine)
    np.testing.assert_allclose(volume.sample(read.position(INDICES)), data[tuple(INDICES.T[::-1])], atol=1e-3)


# Bad input


def write_any(path, data):
    """Any format, by its suffix."""
    if path.suffix in (".vtk", ".vti"):
        write_vtk(vtk_image(data), path)
    elif path.suffix == ".tif":
        with tifffile.TiffWriter(path) as writer:
            for slice_ in data:
                writer.write(slice_, metadata=None)
    elif path.suffix == ".npy":
        np.save(path, data)
    elif path.suffix == ".dcm":
        write_slices(path.parent / "series", data[:1])
        next((path.parent / "series").iterdir()).rename(path)
    else:
        SimpleITK.WriteImage(itk_image(data), path, path.name.startswith("packed"))


@pytest.mark.parametrize("part", [0.0, 0.001, 0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize(
    "name",
    ["a.nii", "a.nii.gz", "a.nrrd", "packed.nrrd", "a.mha", "packed.mha", "a.tif", "a.vtk", "a.vti", "a.npy", "a.dcm"],
)
def test_truncated_files_are_refused(tmp_path, rng, name, part, capfd):
    path = tmp_path / name
    write_any(path, rng.integers(0, 1000, (9, 10, 11)).astype(np.int16))
    content = path.read_bytes()
    path.write_bytes(content[: int(part * len(content))])
    with pytest.raises(ValueError, match=f"{name}: cannot be read as "):
        read_volume(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "setting", ["SetDataModeToAscii", "SetDataModeToBinary", "EncodeAppendedDataOff", "SetCompressorTypeToNone"]
)
@pytest.mark.parametrize("part", [0.3, 0.99])
def test_truncated_vti_of_any_mode_is_refused(tmp_path, data, setting, part):
    path = tmp_path / "a.vti"
    write_vtk(vtk_image(data), path, **{setting: True})
    content = path.read_bytes()
    path.write_bytes(content[: int(part * len(content))])
    with pytest.raises(ValueError, match="truncated"):
        read_volume(path)


@pytest.mark.parametrize("options", [{}, {"compression": "zlib"}, {"imagej": True}, {"ome": True}], ids=str)
@pytest.mark.parametrize("part", [0.1, 0.3, 0.9, 0.99])
def test_truncated_tiff_of_any_kind_is_refused(tmp_path, rng, options, part):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, rng.integers(0, 1000, (20, 24, 28)).astype(np.int16), photometric="minisblack", **options)
    content = path.read_bytes()
    path.write_bytes(content[: int(part * len(content))])
    with pytest.raises(ValueError, match=r"a\.tif: cannot be read as TIFF"):
        read_volume(path)


@pytest.mark.parametrize("suffix", ["nii", "nii.gz", "nrrd", "nhdr", "mha", "mhd", "dcm", "tif", "vtk", "vti", "npy"])
def test_other_content_is_refused(tmp_path, rng, suffix, capfd):
    for content in (b"", b"hello\nworld\n", rng.bytes(5000)):
        (tmp_path / f"a.{suffix}").write_bytes(content)
        with pytest.raises(ValueError, match=rf"a\.{suffix}: cannot be read as"):
            read_volume(tmp_path / f"a.{suffix}")
    assert capfd.readouterr() == ("", "")


def test_missing_files_and_unknown_names_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"missing\.nrrd"):
        read_volume(tmp_path / "missing.nrrd")
    (tmp_path / "a.xyz").write_bytes(b"12345678")
    with pytest.raises(ValueError, match=r"a\.xyz: expected a name that ends in \.nii"):
        read_volume(tmp_path / "a.xyz")
    with pytest.raises(ValueError, match="shape: expected"):
        read_volume(tmp_path / "a.xyz", dtype="u1")
    (tmp_path / "folder").mkdir()
    with pytest.raises(ValueError, match="a folder with a DICOM series or TIFF slices, got one without images"):
        read_volume(tmp_path / "folder")


@pytest.mark.parametrize("name", ["read_volume", "read_mesh", "open_volume", "convert"])
def test_an_empty_path_is_not_the_current_folder(tmp_path, monkeypatch, rng, name):
    samples = rng.integers(0, 255, (2, 20, 20)).astype("u1")
    for number, page in enumerate(samples):
        tifffile.imwrite(tmp_path / f"{number}.tif", page)
    monkeypatch.chdir(tmp_path)
    np.testing.assert_array_equal(read_volume(".").data, samples)
    with pytest.raises(FileNotFoundError, match="No such file or directory: ''"):
        getattr(isospline, name)("", *["a.zarr"] * (name == "convert"))


def test_detached_samples_must_be_there(tmp_path, data):
    for name, samples in (("a.nhdr", "a.raw"), ("b.mhd", "b.raw")):
        SimpleITK.WriteImage(itk_image(data), tmp_path / name)
        content = (tmp_path / samples).read_bytes()
        (tmp_path / samples).write_bytes(content[:-1])
        with pytest.raises(ValueError, match=f"{name}: "):
            read_volume(tmp_path / name)
        (tmp_path / samples).unlink()
        with pytest.raises((ValueError, FileNotFoundError), match=f"{name}|{samples}"):
            read_volume(tmp_path / name)


def test_the_files_of_a_volume_are_those_that_are_read(tmp_path, data):
    for name in ("a.nhdr", "b.mhd", "c.nrrd"):
        SimpleITK.WriteImage(itk_image(data), tmp_path / name)
    write_slices(tmp_path / "series", data)
    (tmp_path / "pages").mkdir()
    for number, page in enumerate(data):
        tifffile.imwrite(tmp_path / "pages" / f"{number}.tif", page)
    slices = {folder: sorted((tmp_path / folder).iterdir()) for folder in ("series", "pages")}
    for folder in slices:
        (tmp_path / folder / "picture.png").write_bytes(b"a picture of it")

    def names(path, **options):
        return [Path(file).relative_to(tmp_path).as_posix() for file in files_of(tmp_path / path, **options)]

    assert names("a.nhdr") == ["a.nhdr", "a.raw"] and names("b.mhd") == ["b.mhd", "b.raw"]
    assert names("c.nrrd") == ["c.nrrd"] and names("a.raw") == ["a.raw"]
    assert names("a.nhdr", shape=SHAPE) == ["a.nhdr"]
    assert all(files_of(tmp_path / folder) == list(map(str, files)) for folder, files in slices.items())
    (tmp_path / "a.nhdr").write_text("nonsense", encoding="utf-8")
    with pytest.raises(ValueError, match=r"a\.nhdr: cannot be read as NRRD: expected"):
        files_of(tmp_path / "a.nhdr")


def test_colours_are_refused(tmp_path, rng):
    colours = rng.integers(0, 255, (*SHAPE, 3)).astype(np.uint8)
    for name in ("a.mha", "a.nrrd"):
        SimpleITK.WriteImage(SimpleITK.GetImageFromArray(colours, isVector=True), tmp_path / name)
    tifffile.imwrite(tmp_path / "a.tif", colours, photometric="rgb")
    rgb = np.zeros(SHAPE[::-1], [("R", "u1"), ("G", "u1"), ("B", "u1")])
    nibabel.save(nibabel.Nifti1Image(rgb, np.eye(4)), tmp_path / "a.nii")
    image = vtk_image(np.zeros(SHAPE, np.uint8))
    from vtkmodules.util.numpy_support import numpy_to_vtk

    image.GetPointData().SetScalars(numpy_to_vtk(colours.reshape(-1, 3), deep=True))
    write_vtk(image, tmp_path / "a.vti")
    for name in ("a.mha", "a.nrrd", "a.tif", "a.nii", "a.vti"):
        with pytest.raises(ValueError, match="expected one number a sample, got 3"):
            read_volume(tmp_path / name)


def test_time_series_and_flat_pictures_are_refused(tmp_path, rng):
    series = rng.integers(0, 255, (3, *SHAPE)).astype(np.uint8)
    nibabel.save(nibabel.Nifti1Image(series.T, np.eye(4)), tmp_path / "a.nii")
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(series, isVector=False), tmp_path / "a.mha")
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(series, isVector=False), tmp_path / "a.nrrd")
    tifffile.imwrite(tmp_path / "a.tif", series, imagej=True, metadata={"axes": "TZYX"})
    np.save(tmp_path / "a.npy", series)
    for name in ("a.nii", "a.mha", "a.nrrd", "a.npy"):
        with pytest.raises(ValueError, match="expected three dimensions, got 4: 7 x 6 x 5 x 3"):
            read_volume(tmp_path / name)
    tifffile.imwrite(tmp_path / "b.tif", series[:, 0], imagej=True, metadata={"axes": "TYX"})
    tifffile.imwrite(tmp_path / "c.ome.tif", series[:, 0], metadata={"axes": "TYX"}, photometric="minisblack")
    for name in ("a.tif", "b.tif", "c.ome.tif"):
        for read in (read_volume, lambda path: isospline.convert(path, tmp_path / "a.zarr")):
            with pytest.raises(ValueError, match=rf"{name}: .*one item along axis T, got 3 \(a time series\)"):
                read(tmp_path / name)

    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(series[0, 0]), tmp_path / "flat.mha")
    tifffile.imwrite(tmp_path / "flat.tif", series[0, 0])
    np.save(tmp_path / "flat.npy", series[0, 0])
    for name in ("flat.mha", "flat.tif", "flat.npy"):
        with pytest.raises(ValueError, match="expected three dimensions, got 2: 7 x 6"):
            read_volume(tmp_path / name)


def test_other_types_are_refused(tmp_path, data):
    np.save(tmp_path / "a.npy", data.astype(complex))
    with pytest.raises(ValueError, match="expected real numbers, got complex128"):
        read_volume(tmp_path / "a.npy")
    np.save(tmp_path / "b.npy", data.astype(object))
    with pytest.raises(ValueError, match=r"b\.npy: cannot be read as NPY"):
        read_volume(tmp_path / "b.npy")


HUGE = {
    "a.mha": b"ObjectType = Image\nNDims = 3\nDimSize = 100000 100000 100000\nElementType = MET_SHORT\n"
    b"CompressedData = True\nElementDataFile = LOCAL\n",
    "a.nrrd": b"NRRD0004\ntype: short\ndimension: 3\nsizes: 100000 100000 100000\nendian: little\nencoding: gzip\n\n",
    "a.vtk": b"# vtk DataFile Version 3.0\nhuge\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 100000 100000 100000\n"
    b"SPACING 1 1 1\nORIGIN 0 0 0\nPOINT_DATA 1000000000000000\nSCALARS density short\n"
    b"LOOKUP_TABLE default\n",
    "a.vti": b'<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64"><ImageData '
    b'WholeExtent="0 99999 0 99999 0 99999" Origin="0 0 0" Spacing="1 1 1"><Piece '
    b'Extent="0 99999 0 99999 0 99999"><PointData Scalars="density"><DataArray type="Int16" Name="density" '
    b'format="ascii">1 2 3</DataArray></PointData></Piece></ImageData></VTKFile>',
}


@pytest.mark.parametrize("name", HUGE)
def test_volumes_beyond_the_memory_are_refused_at_once(tmp_path, name):
    (tmp_path / name).write_bytes(HUGE[name] + (b"" if name == "a.vti" else b"\0" * 100))
    with pytest.raises(MemoryError, match=rf"{name}: 100000 x 100000 x 100000 samples of u?int16 need 1862645\.1 GiB"):
        read_volume(tmp_path / name)


def test_places_that_make_no_sense_are_refused(tmp_path, data):
    np.save(tmp_path / "a.npy", data)
    for options in (
        {"spacing": (1, 0, 1)},
        {"spacing": (1, 1)},
        {"origin": (0, np.nan, 0)},
        {"direction": np.ones((3, 3))},
    ):
        with pytest.raises(ValueError, match=f"^{next(iter(options))}: expected"):
            read_volume(tmp_path / "a.npy", **options)


@pytest.mark.parametrize(
    ("options", "got"),
    [
        ({"spacing": "1,1,1"}, r"finite numbers of shape \(3,\), got '1,1,1'"),
        ({"spacing": 1j}, r"finite numbers of shape \(3,\), got 1j"),
        ({"origin": [0, "a", 2]}, r"finite numbers of shape \(3,\), got \[0, 'a', 2\]"),
        ({"direction": [[1], [1, 2]]}, r"finite numbers of shape \(3, 3\), got list of 2 list"),
        ({"nan": "0"}, "a number, got '0'"),
        ({"offset": "3"}, "a whole number, got '3'"),
        ({"within": 5}, "a str or path-like, got 5"),
    ],
)
def test_places_that_are_no_numbers_are_refused(tmp_path, data, options, got):
    np.save(tmp_path / "a.npy", data)
    with pytest.raises(TypeError, match=f"^{next(iter(options))}: expected {got}"):
        read_volume(tmp_path / "a.npy", **options)


def test_reading_does_not_import_the_libraries_of_other_formats(tmp_path, data):
    np.save(tmp_path / "a.npy", data)
    script = (
        "import sys, isospline\n"
        f"isospline.read_volume({str(tmp_path / 'a.npy')!r})\n"
        "print(*{'SimpleITK', 'vtkmodules', 'tifffile', 'nibabel', 'pydicom'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, encoding="utf-8", check=True)
    assert run.stdout.strip() == ""


# Real volumes

REAL = {  # name: size, type, spacing, options
    "engine.nii.gz": ((256, 256, 128), "uint8", 1, {}),
    "bonsai.nii.gz": ((256, 256, 256), "uint8", 1, {}),
    "fuel.nii.gz": ((64, 33, 32), "uint8", 1, {}),
    "vismale_128x256x256_uint8.raw": (
        (128, 256, 256),
        "uint8",
        (1.57774, 0.995861, 1.00797),
        {"shape": (256, 256, 128), "dtype": "u1", "spacing": (1.57774, 0.995861, 1.00797)},
    ),
    "tooth_103x94x161_uint16.raw": ((103, 94, 161), "uint16", 1, {"shape": (161, 94, 103), "dtype": "<u2"}),
    "headsq.mha": ((64, 64, 93), "uint16", (3.2, 3.2, 1.5), {}),
    "ironprot.vtk": ((68, 68, 68), "uint8", 1, {}),
    "mouse_skull.nrrd": ((176, 320, 128), "uint8", 0.0706, {}),
    "weave.tif": ((150, 150, 150), "uint8", 1, {}),
    "abdomen_512x512x275_int16.nii.gz": ((512, 512, 275), "int16", (0.78125, 0.78125, 1), {}),
}


@pytest.mark.parametrize("name", REAL)
def test_real_volumes_match_their_description(volumes_folder, name):
    size, dtype, spacing, options = REAL[name]
    volume = read_volume(volumes_folder / name, **options)
    assert volume.data.shape == size[::-1]
    assert volume.data.dtype == dtype
    np.testing.assert_allclose(volume.spacing, np.broadcast_to(spacing, 3), rtol=1e-3)
    assert volume.data.min() < volume.data.max()


def test_the_mouse_looks_the_other_way(volumes_folder):
    volume = read_volume(volumes_folder / "mouse_skull.nrrd")
    np.testing.assert_array_equal(volume.direction, np.diag([-1, -1, 1]))
    samples, header = nrrd.read(str(Path(volumes_folder) / "mouse_skull.nrrd"))
    np.testing.assert_array_equal(volume.data, samples.T)
    np.testing.assert_allclose(
        volume.position(INDICES), INDICES @ header["space directions"] + header["space origin"], atol=1e-9
    )


def test_samples_that_are_nan_are_replaced_when_asked(tmp_path):
    data = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
    data[1, 2, 3] = np.nan
    np.save(tmp_path / "a.npy", data)
    with pytest.raises(ValueError, match=r"^data: expected finite samples"):
        read_volume(tmp_path / "a.npy").to_volume()
    found = read_volume(tmp_path / "a.npy", nan=-5).data
    assert found.dtype == np.float32 and found[1, 2, 3] == -5
    np.testing.assert_array_equal(found.ravel()[:-1], data.ravel()[:-1])


@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")  # nibabel leaves .mgh open
@pytest.mark.parametrize("kind, name", [("MGHImage", "a.mgz"), ("MGHImage", "a.mgh"), ("AnalyzeImage", "a.img")])
def test_other_formats_of_nibabel_are_refused_with_the_remedy(tmp_path, kind, name):
    data = np.arange(60, dtype=np.float32).reshape(3, 4, 5)
    nibabel.save(getattr(nibabel, kind)(data, np.diag([2.0, 3, 4, 1])), tmp_path / name)
    names = [name, "a.hdr"] if name == "a.img" else [name]
    for each in names:
        with pytest.raises(
            ValueError, match=rf"{each}: .*: isospline\.Volume\.from_nibabel\(nibabel\.load\("
        ) as caught:
            read_volume(tmp_path / each)
        (remedy,) = re.findall(r"isospline\.Volume\S+\)", str(caught.value))
        volume = eval(remedy, {"isospline": isospline, "nibabel": nibabel})
        image = nibabel.load(tmp_path / each)
        position = nibabel.affines.apply_affine(image.affine, (1, 2, 3)) * (-1, -1, 1)  # RAS to LPS
        assert volume.sample([position])[0] == pytest.approx(float(image.dataobj[1, 2, 3]), abs=1e-4)


def test_a_folder_of_zarr_is_refused_with_the_remedy(tmp_path):
    zarr = pytest.importorskip("zarr")
    zarr.create_group(tmp_path / "a.zarr")
    with pytest.raises(ValueError, match=r"a\.zarr: .*got a folder of Zarr: open_volume opens a store, and convert"):
        read_volume(tmp_path / "a.zarr")


def test_the_place_of_samples_may_be_any_numbers():
    flipped = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]
    data = isospline.VolumeData(np.ones((2, 3, 4), int), 2, [1, 2, 3], flipped)
    np.testing.assert_array_equal(data.affine, [[0, 2, 0, 1], [2, 0, 0, 2], [0, 0, -2, 3], [0, 0, 0, 1]])
    assert isospline.Labels(data).measure().enclosed_volumes == pytest.approx(24 * 2**3)
    with pytest.raises(ValueError, match=r"direction: expected shape \(3, 3\), got \(2, 2\)"):
        isospline.VolumeData(np.ones((2, 3, 4)), direction=np.eye(2))


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("detached", [False, True])
def test_the_header_of_metaimage_has_the_size_that_it_says(data, tmp_path, detached, compressed):
    packed = zlib.compress(data.tobytes()) if compressed else data.tobytes()
    size = " ".join(map(str, data.shape[::-1]))
    lines = ["ObjectType = Image", "NDims = 3", "BinaryData = True", f"CompressedData = {compressed}"]
    lines += [f"CompressedDataSize = {len(packed)}", "HeaderSize = 512", f"DimSize = {size}", "ElementType = MET_SHORT"]
    lines.append(f"ElementDataFile = {'a.raw' if detached else 'LOCAL'}\n")
    header, path = "\n".join(lines).encode(), tmp_path / "a.mha"
    path.write_bytes(header if detached else header.ljust(512) + packed + bytes(600))
    (tmp_path / "a.raw").write_bytes(bytes(512) + packed + bytes(600))
    np.testing.assert_array_equal(SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(path)), data)
    np.testing.assert_array_equal(read_volume(path).data, data)


def test_bytes_of_booleans_other_than_0_are_true(tmp_path):
    """As for NumPy, which keeps the bytes of a file."""
    mask = np.zeros((4, 5, 6), np.uint8)
    mask[1:3, 1:3, 1:4] = 255
    mask.tofile(tmp_path / "mask.raw")
    read = read_volume(tmp_path / "mask.raw", shape=mask.shape, dtype=bool)
    plain = isospline.Volume(mask.astype(bool).astype(float))
    for given in (mask.view(bool), mask.view(bool)[:, ::-1], read.data):
        flipped = plain if given[1, 1, 1] else isospline.Volume((mask != 0)[:, ::-1].astype(float))
        np.testing.assert_allclose(isospline.Volume(given).sample([2, 2, 2]), flipped.sample([2, 2, 2]), atol=1e-6)
    assert isospline.suggest_levels(read.data) == [0.5]
    assert isospline.Labels(mask.view(bool)).numbers == isospline.Labels(read).numbers == (1,)


@pytest.mark.parametrize("nan, dtype", [(1e39, "f4"), (-1e5, "f2")])
def test_a_number_in_place_of_nan_fits_the_samples(tmp_path, nan, dtype):
    np.save(tmp_path / "a.npy", np.full((4, 4, 4), np.nan, dtype))
    with pytest.raises(ValueError, match=rf"^nan: expected a number that {np.dtype(dtype)} holds, got"):
        read_volume(tmp_path / "a.npy", nan=nan)
    if dtype == "f4":
        with pytest.raises(ValueError, match="^nan: expected a number that float32 holds, got"):
            isospline.convert(tmp_path / "a.npy", tmp_path / "a.zarr", nan=nan)
        assert os.listdir(tmp_path) == ["a.npy"]
