"""Slices and frames of DICOM: their order, place and scaling, against pydicom and NumPy in float64."""

import contextlib

import numpy as np
import pytest

pydicom = pytest.importorskip("pydicom")
SimpleITK = pytest.importorskip("SimpleITK")
imagecodecs = pytest.importorskip("imagecodecs")

from placed_images import DIRECTIONS
from pydicom import uid
from pydicom.data import get_testdata_file
from pydicom.dataset import Dataset, FileMetaDataset

from isospline import Labels, read_volume

SHAPE = (5, 6, 7)
SPACING, ORIGIN = np.array((0.25, 0.5, 2.0)), np.array((10.0, 20.0, -30.0))
SLOPES, INTERCEPTS = np.array((1, 0.37, 0.0123, 100, 0.5)), np.array((0, -1024, 7.25, 0, 3))
ORDER = [3, 0, 4, 1, 2]


@pytest.fixture
def data(rng):
    return rng.integers(0, 3000, SHAPE)


def item(**attributes):
    dataset = Dataset()
    for name, value in attributes.items():
        setattr(dataset, name, value)
    return dataset


def image(samples, kind=uid.CTImageStorage, dtype="<i2", **attributes):
    """A file with these samples and no place."""
    dataset = item(
        SOPClassUID=kind, SOPInstanceUID=uid.generate_uid(), StudyInstanceUID="1.2.3", SeriesInstanceUID="1.2.3.4",
        Rows=samples.shape[-2], Columns=samples.shape[-1], SamplesPerPixel=1, PhotometricInterpretation="MONOCHROME2",
        BitsAllocated=8 * np.dtype(dtype).itemsize, BitsStored=8 * np.dtype(dtype).itemsize,
        HighBit=8 * np.dtype(dtype).itemsize - 1, PixelRepresentation=int(np.dtype(dtype).kind == "i"),
        PixelData=samples.astype(dtype).tobytes(),
    )  # fmt: skip
    for name, value in attributes.items():
        setattr(dataset, name, value)
    dataset.file_meta = FileMetaDataset()
    dataset.file_meta.MediaStorageSOPClassUID, dataset.file_meta.TransferSyntaxUID = kind, uid.ExplicitVRLittleEndian
    dataset.file_meta.MediaStorageSOPInstanceUID = dataset.SOPInstanceUID
    return dataset


def save(dataset, path):
    dataset.save_as(path, enforce_file_format=True)
    return path


def positions(offsets, direction=np.eye(3)):
    return ORIGIN + np.asarray(offsets, float)[:, None] * direction[:, 2]


def write_series(folder, samples, scalings, places=None, **attributes):
    """A file for each slice; attributes that are lists have a value for each."""
    folder.mkdir()
    places = positions(2.0 * np.arange(len(samples))) if places is None else places
    for number, (plane, (slope, intercept)) in enumerate(zip(samples, scalings)):
        own = {name: value[number] if isinstance(value, list) else value for name, value in attributes.items()}
        dataset = image(plane, **own)
        dataset.ImagePositionPatient = places[number].tolist()
        dataset.ImageOrientationPatient, dataset.PixelSpacing = [1, 0, 0, 0, 1, 0], [0.5, 0.25]
        if slope is not None:
            dataset.RescaleSlope, dataset.RescaleIntercept = slope, intercept
        save(dataset, folder / f"{number}.dcm")
    return folder


def write_frames(path, samples, places, scalings=None, directions=None, order=None, **attributes):
    """A multi-frame file, whose frames are in this order."""
    order = list(range(len(samples))) if order is None else order
    turned = directions or [np.eye(3)] * len(samples)
    dataset = image(samples[order], uid.EnhancedCTImageStorage, NumberOfFrames=len(order), **attributes)
    shared = item(PixelMeasuresSequence=[item(PixelSpacing=[0.5, 0.25], SliceThickness=9, SpacingBetweenSlices=9)])
    if scalings is not None and len(scalings) == 1:
        shared.PixelValueTransformationSequence = [scaling_item(*scalings[0])]
    dataset.SharedFunctionalGroupsSequence, dataset.PerFrameFunctionalGroupsSequence = [shared], []
    for number in order:
        orientation = [f"{value:.12f}" for value in turned[number][:, :2].T.ravel()]
        group = item(PlaneOrientationSequence=[item(ImageOrientationPatient=orientation)])
        if places[number] is not None:
            group.PlanePositionSequence = [item(ImagePositionPatient=[f"{value:.12g}" for value in places[number]])]
        if scalings is not None and len(scalings) > 1:
            group.PixelValueTransformationSequence = [scaling_item(*scalings[number])]
        dataset.PerFrameFunctionalGroupsSequence.append(group)
    return save(dataset, path)


def scaling_item(slope, intercept):
    return item(RescaleSlope=slope, RescaleIntercept=intercept, RescaleType="US")


def staged(path, folder):
    """All samples, and the place, as `convert` reads them."""
    from isospline.store.sources.opening import open_source

    reading = dict(shape=None, dtype=None, offset=0, name=None)
    (folder / "staged").unlink(missing_ok=True)
    source = open_source(path, "zyx", reading).stage(folder / "staged", lambda fraction: None)
    return source.read([(0, count) for count in source.shape]), source


def check(path, expected, tmp_path, dtype=None, corners=None):
    """Check samples exactly, and the positions of the first samples of slices, also of `convert`."""
    volume = read_volume(path)
    samples, source = staged(path, tmp_path)
    for got in (volume.data, samples):
        np.testing.assert_array_equal(got, expected)
        assert dtype is None or got.dtype == dtype
    np.testing.assert_allclose(volume.spacing[:2], SPACING[:2])
    if corners is not None:
        np.testing.assert_allclose(volume.position([(0, 0, k) for k in range(len(expected))]), corners, atol=1e-9)
    for field in ("spacing", "origin", "direction"):
        np.testing.assert_array_equal(getattr(volume, field), getattr(source, field))
    return volume


def check_refused(path, message, tmp_path):
    """Check that Python and `convert` refuse a file, with the same message, which names it."""
    for read in (read_volume, lambda path: staged(path, tmp_path)):
        with pytest.raises(ValueError, match=rf"{path.name}: cannot be read as DICOM.*{message}"):
            read(path)


def scaled(samples, slopes=SLOPES, intercepts=INTERCEPTS):
    return samples * np.asarray(slopes, np.float64)[:, None, None] + np.asarray(intercepts, float)[:, None, None]


# Series


@pytest.mark.parametrize("dtype", ["<i2", "<u2", "u1", "<i4"])
def test_slices_have_slopes_of_their_own(tmp_path, data, dtype):
    data = data % 200 - (100 if "i" in dtype else 0)
    kind = uid.PositronEmissionTomographyImageStorage
    path = write_series(tmp_path / "series", data, zip(SLOPES, INTERCEPTS), kind=kind, dtype=dtype)
    check(path, scaled(data), tmp_path, "f8", positions(2.0 * np.arange(5)))


def test_a_mask_with_almost_equal_slopes_is_no_empty_one(tmp_path, data):
    slopes = [1] + 4 * [0.9999999975]
    path = write_series(tmp_path / "series", data > 1000, [(slope, 0) for slope in slopes])
    check(path, scaled(data > 1000, slopes, np.zeros(5)), tmp_path)


@pytest.mark.parametrize(
    "stored, slope, intercept, expected",
    [
        ("<i2", None, None, "i2"),
        ("<u2", 1, 0, "u2"),
        ("u1", 1, -1024, "i2"),
        ("<u2", 1, -1024, "i4"),
        ("<i2", 2, -1, "i4"),
        ("u1", 3, 5, "u2"),
        ("<u2", 0.5, 0, "f8"),
        ("<i4", 2, 0, "f8"),
        ("<i4", 1, 0, "i4"),
    ],
)
def test_integers_stay_integers_if_all_slices_are_scaled_alike(tmp_path, data, stored, slope, intercept, expected):
    data = data % 256
    series = write_series(tmp_path / "series", data, 5 * [(slope, intercept)], dtype=stored)
    places = positions(2.0 * np.arange(5))
    frames = write_frames(tmp_path / "a.dcm", data, places, [(slope or 1, intercept or 0)], dtype=stored)
    for path in (series, frames):
        check(path, data * (slope or 1) + (intercept or 0), tmp_path, expected)


def test_signed_and_unsigned_slices_meet_in_a_type_that_holds_both(tmp_path, data):
    data[::2] -= 1500
    data[1] += 50000
    path = write_series(tmp_path / "series", data, 5 * [(1, 0)], dtype=["<i2", "<u2", "<i2", "<u2", "<i2"])
    check(path, data, tmp_path, "i4")


def test_monochrome1_is_not_inverted(tmp_path, data):
    path = write_series(tmp_path / "a", data, zip(SLOPES, INTERCEPTS), PhotometricInterpretation="MONOCHROME1")
    check(path, scaled(data), tmp_path, "f8")
    places = positions(2.0 * np.arange(5))
    path = write_frames(tmp_path / "b.dcm", data, places, PhotometricInterpretation="MONOCHROME1")
    check(path, data, tmp_path, "i2")
    mixed = ["MONOCHROME2"] * 4 + ["MONOCHROME1"]
    path = write_series(tmp_path / "c", data, 5 * [(1, 0)], PhotometricInterpretation=mixed)
    message = r"the same photometric interpretation, got MONOCHROME2 in 0\.dcm and MONOCHROME1 in 4\.dcm"
    check_refused(path, message, tmp_path)


def test_bits_beside_the_stored_ones_are_left_out(tmp_path, data):
    data = data % 1000 - 500
    dirty = (data & 0xFFF) | (data[::-1] << 12 & 0xF000)
    path = write_series(tmp_path / "a", dirty, 5 * [(1, 0)], BitsStored=12, HighBit=11)
    check(path, data, tmp_path, "i2")
    path = write_series(tmp_path / "b", dirty, 5 * [(1, 0)], BitsStored=12, HighBit=11, dtype="<u2")
    check(path, data & 0xFFF, tmp_path, "u2")


@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize("size", [(5, 7), (4, 6)])
def test_frames_of_single_bits_need_not_begin_at_a_byte(tmp_path, rng, count, size):
    mask, places = rng.integers(0, 2, (count, *size)), positions(2.0 * np.arange(count))
    one = dict(BitsAllocated=1, BitsStored=1, HighBit=0, PixelRepresentation=0)
    path = write_frames(tmp_path / "a.dcm", mask, places, **one)
    dataset = pydicom.dcmread(path)
    bits = np.packbits(mask.ravel(), bitorder="little").tobytes()
    dataset.PixelData = bits + b"\0" * (len(bits) % 2)
    check(save(dataset, path), mask, tmp_path, "u1", places)
    np.testing.assert_array_equal(dataset.pixel_array.reshape(mask.shape), mask)


def test_slices_without_positions_or_of_another_kind_are_refused(tmp_path, data):
    for name, attribute, value, message in (
        ("a", "ImagePositionPatient", None, r"slices with the attribute ImagePositionPatient, got none in 3\.dcm"),
        ("b", "PixelSpacing", [0.5, 0.3], r"the same spacing, got \[0\.25, 0\.5\] in 0\.dcm and \[0\.3, 0\.5\] in 3"),
        ("c", "ImageOrientationPatient", [0, 1, 0, 0, 0, 1], r"the same direction, got .* and .* in 3\.dcm"),
        ("d", "RescaleSlope", "none", r"3\.dcm"),
        ("e", "ModalityLUTSequence", [Dataset()], r"3\.dcm: expected samples with a rescale slope, got .* LUT"),
        ("f", "PhotometricInterpretation", "PALETTE COLOR", r"3\.dcm: expected photometric interpretation MONOCHROME1"),
        ("g", "ImageOrientationPatient", [1, 0, 0, 1, 0, 0], r"3\.dcm: expected two perpendicular directions"),
    ):
        path = write_series(tmp_path / name, data, 5 * [(1, 0)])
        dataset = pydicom.dcmread(path / "3.dcm")
        if value == "none":
            place = dataset["RescaleSlope"].tag
            dataset[place] = pydicom.DataElement(place, "LO", value)
        else:
            setattr(dataset, attribute, value)
        save(dataset, path / "3.dcm")
        check_refused(path, message, tmp_path)


def test_a_file_without_a_header_is_read(tmp_path, data):
    path = write_series(tmp_path / "series", data, zip(SLOPES, INTERCEPTS))
    for file in path.iterdir():
        dataset = pydicom.dcmread(file)
        del dataset.file_meta, dataset.preamble
        dataset.save_as(file, implicit_vr=True, little_endian=True)
        assert file.read_bytes()[128:132] != b"DICM"
    check(path, scaled(data), tmp_path, "f8")


# Frames


@pytest.mark.parametrize("direction", [each for each in DIRECTIONS.values() if np.linalg.det(each) > 0])
@pytest.mark.parametrize("order", [None, ORDER, [4, 3, 2, 1, 0]])
def test_frames_are_sorted_by_their_positions(tmp_path, data, direction, order):
    places = positions(2.5 * np.arange(5), direction)
    path = write_frames(tmp_path / "a.dcm", data, places, directions=5 * [direction], order=order)
    volume = check(path, data, tmp_path, "i2", places)
    np.testing.assert_allclose(volume.direction, direction, atol=1e-9)


@pytest.mark.parametrize("digits", [3, 2])
def test_positions_may_be_rounded(tmp_path, data, digits):
    places = np.round(positions(0.625 * np.arange(5) - 0.17), digits)
    volume = read_volume(write_frames(tmp_path / "a.dcm", data, places, order=ORDER))
    np.testing.assert_array_equal(volume.data, data)
    np.testing.assert_allclose(volume.position([(0, 0, k) for k in range(5)]), places, atol=0.625 * 0.02)


def test_frames_of_a_tilted_gantry_are_sheared(tmp_path, data):
    places = ORIGIN + np.arange(5)[:, None] * (0, 0.6, 2)
    check(write_frames(tmp_path / "a.dcm", data, places, order=ORDER), data, tmp_path, "i2", places)


def test_frames_have_slopes_of_their_own(tmp_path, data):
    places, scalings = positions(2.0 * np.arange(5)), list(zip(SLOPES, INTERCEPTS))
    for name, order in (("a.dcm", None), ("b.dcm", ORDER)):
        path = write_frames(tmp_path / name, data, places, scalings, order=order)
        check(path, scaled(data), tmp_path, "f8", places)


def test_frames_that_make_no_volume_are_refused(tmp_path, data):
    turned = [np.eye(3)] * 3 + [DIRECTIONS["permuted"]] * 2
    even = positions(2.0 * np.arange(5))
    for name, offsets, options, message in (
        ("uneven.dcm", [0, 2, 4, 9, 14], {}, r"evenly spaced slices, got distances from 2 to 5"),
        ("missing.dcm", [0, 2, 6, 8, 10], {"order": ORDER}, r"evenly spaced slices, got distances from 2 to 4"),
        ("twice.dcm", [0, 0, 2, 2, 4], {}, r"evenly spaced slices, got distances from 0 to 2"),
        ("time.dcm", [3, 3, 3, 3, 3], {}, r"evenly spaced slices, got distances from 0 to 0"),
        ("stacks.dcm", [0, 2, 4, 6, 8], {"directions": turned}, r"same direction, got .*\(frame 1\) and .*\(frame 4\)"),
    ):
        check_refused(write_frames(tmp_path / name, data, positions(offsets), **options), message, tmp_path)
    path = write_frames(tmp_path / "none.dcm", data, [*even[:2], None, *even[3:]])
    check_refused(path, r"attribute ImagePositionPatient, got none in none\.dcm \(frame 3\)", tmp_path)
    path = write_frames(tmp_path / "count.dcm", data, even)
    dataset = pydicom.dcmread(path)
    dataset.NumberOfFrames = 4
    check_refused(save(dataset, path), r"functional groups of 4 frames, got 5", tmp_path)


def test_frames_may_be_in_several_files(tmp_path, data):
    places = positions(2.0 * np.arange(5))
    folder = tmp_path / "series"
    folder.mkdir()
    write_frames(folder / "a.dcm", data, places, list(zip(SLOPES, INTERCEPTS)), order=[4, 0, 2])
    write_frames(folder / "b.dcm", data, places, list(zip(SLOPES, INTERCEPTS)), order=[3, 1])
    check(folder, scaled(data), tmp_path, "f8", places)


@pytest.mark.parametrize("sign", [1, -1])
def test_doses_and_emission_tomograms_tell_the_place_of_the_first_frame(tmp_path, data, sign):
    offsets = sign * 2.0 * np.arange(5)
    place = {"ImagePositionPatient": ORIGIN.tolist(), "ImageOrientationPatient": [1, 0, 0, 0, 1, 0]}
    dose = image(data, uid.RTDoseStorage, NumberOfFrames=5, PixelSpacing=[0.5, 0.25], DoseGridScaling="0.0125",
                 GridFrameOffsetVector=offsets.tolist(), **place)  # fmt: skip
    check(save(dose, tmp_path / "a.dcm"), data[::sign] * 0.0125, tmp_path, "f8", positions(offsets)[::sign])
    emission = image(data, uid.NuclearMedicineImageStorage, NumberOfFrames=5, PixelSpacing=[0.5, 0.25],
                     SpacingBetweenSlices=2 * sign, DetectorInformationSequence=[item(**place)])  # fmt: skip
    check(save(emission, tmp_path / "b.dcm"), data[::sign], tmp_path, "i2", positions(offsets)[::sign])
    dose.GridFrameOffsetVector = [0, 2, 4, 7, 9]
    check_refused(save(dose, tmp_path / "c.dcm"), "evenly spaced slices, got distances from 2 to 3", tmp_path)


@pytest.mark.parametrize(
    ("told", "spacing", "warning"),
    [
        ({"PixelSpacing": [0.5, 0.25], "SliceThickness": 3}, (0.25, 0.5, 3), None),
        ({"PixelSpacing": [0.5, 0.25], "SliceThickness": 3, "SpacingBetweenSlices": 2}, (0.25, 0.5, 2), None),
        ({"PixelSpacing": [0.5, 0.25], "SliceThickness": 3, "SpacingBetweenSlices": 0}, (0.25, 0.5, 3), None),
        ({"NominalScannedPixelSpacing": [0.5, 0.25], "SliceThickness": 3}, (0.25, 0.5, 3), None),
        ({"PixelSpacing": [0.5, 0.25]}, (0.25, 0.5, 1), "no distance of slices: 1 mm is assumed; say spacing="),
        ({"SliceThickness": 3}, (1, 1, 3), "the file has no PixelSpacing: 1 mm is assumed"),
        ({}, (1, 1, 1), "the file has no PixelSpacing and no distance of slices: 1 mm is assumed"),
        (
            {"ImagerPixelSpacing": [0.5, 0.25], "SliceThickness": 3},
            (0.25, 0.5, 3),
            ".* that on the detector",
        ),
    ],
)
def test_frames_without_positions_have_the_distances_that_the_file_tells(tmp_path, data, told, spacing, warning):
    dicomwrappers = pytest.importorskip("nibabel.nicom.dicomwrappers")
    path = save(image(data, uid.NuclearMedicineImageStorage, NumberOfFrames=5, **told), tmp_path / "a.dcm")
    with pytest.warns(match=rf"^a\.dcm: .*{warning}") if warning else contextlib.nullcontext():
        volume = read_volume(path)
    assert volume.spacing == spacing
    assert read_volume(path, spacing=2).spacing == (2, 2, 2)  # without a warning
    np.testing.assert_allclose(volume.position((0, 0, 4)), (0, 0, 4 * spacing[2]))
    if "PixelSpacing" in told and "SpacingBetweenSlices" not in told:
        expected = dicomwrappers.wrapper_from_data(pydicom.dcmread(path)).voxel_sizes
        np.testing.assert_allclose(volume.spacing, [float(expected[axis]) for axis in (1, 0, 2)])


def test_a_series_without_a_spacing_of_pixels_says_so(tmp_path, data):
    path = write_series(tmp_path / "series", data, 5 * [(1, 0)])
    for file in path.iterdir():
        dataset = pydicom.dcmread(file)
        del dataset.PixelSpacing
        save(dataset, file)
    for read in (read_volume, lambda path: staged(path, tmp_path)[1]):
        with pytest.warns(match=r"^series: the file has no PixelSpacing: 1 mm is assumed; say") as caught:
            assert tuple(read(path).spacing) == (1, 1, 2)
        assert len(caught) == 1


def test_only_files_that_tell_directions_are_a_patients(tmp_path, data):
    path = write_series(tmp_path / "series", data, 5 * [(1, 0)])
    assert read_volume(path).patient and staged(path, tmp_path)[1].patient
    for file in path.iterdir():
        dataset = pydicom.dcmread(file)
        del dataset.ImageOrientationPatient
        save(dataset, file)
        assert not read_volume(path).patient  # also if some slices tell them
    volume, source = read_volume(path), staged(path, tmp_path)[1]
    assert not (volume.patient or source.patient) and volume.unit == "mm" and source.unit == "millimeter"
    np.testing.assert_array_equal(volume.direction, np.eye(3))
    np.testing.assert_allclose(volume.position((0, 0, 4)), positions([8.0])[0])
    place = item(ImageOrientationPatient=[1, 0, 0, 0, 1, 0])
    for told in (True, False):
        detector = {"DetectorInformationSequence": [place]} if told else {}
        emission = image(data, uid.NuclearMedicineImageStorage, NumberOfFrames=5, PixelSpacing=[0.5, 0.25],
                         SpacingBetweenSlices=2, **detector)  # fmt: skip
        assert read_volume(save(emission, tmp_path / "a.dcm")).patient == told


def test_frames_of_a_tomogram_are_where_their_slice_numbers_say(tmp_path, data):
    place = {"ImagePositionPatient": ORIGIN.tolist(), "ImageOrientationPatient": [1, 0, 0, 0, 1, 0]}
    emission = image(data, uid.NuclearMedicineImageStorage, NumberOfFrames=5, PixelSpacing=[0.5, 0.25],
                     SpacingBetweenSlices=2, SliceVector=[3, 5, 1, 4, 2], FrameIncrementPointer=0x00540080,
                     DetectorInformationSequence=[item(**place)])  # fmt: skip
    expected = data[[2, 4, 0, 3, 1]]
    check(save(emission, tmp_path / "a.dcm"), expected, tmp_path, "i2", positions(2.0 * np.arange(-2, 3)))
    emission.SliceVector = [1, 2, 3, 5, 6]
    check_refused(save(emission, tmp_path / "b.dcm"), "evenly spaced slices, got distances from 2 to 4", tmp_path)


@pytest.mark.parametrize(
    "names",
    [["FrameTime"], ["FrameTimeVector"], ["PhaseVector", "TimeSliceVector"], ["DetectorVector", "AngularViewVector"],
     ["TimeSlotVector", "SliceVector"], ["RotationVector"]],
)  # fmt: skip
def test_frames_along_time_or_angles_are_refused(tmp_path, data, names):
    known = dict(PixelSpacing=[0.5, 0.25], SpacingBetweenSlices=2, FrameTime=33, DetectorVector=5 * [1])
    frames = image(data, uid.UltrasoundMultiFrameImageStorage, NumberOfFrames=5, **known)
    tags = [pydicom.datadict.tag_for_keyword(name) for name in names]
    frames.FrameIncrementPointer = tags if len(tags) > 1 else tags[0]
    changing = next(name for name in names if name not in ("DetectorVector", "SliceVector"))
    message = rf"frames that are slices, got some that differ by {changing} \(a time series\?\)"
    check_refused(save(frames, tmp_path / "a.dcm"), message, tmp_path)
    for names in (["SliceVector"], ["DetectorVector", "SliceVector"]):
        frames.FrameIncrementPointer = [pydicom.datadict.tag_for_keyword(name) for name in names]
        np.testing.assert_array_equal(read_volume(save(frames, tmp_path / "b.dcm")).data, data)


def write_segments(path, frames, kind="BINARY", names=("liver", "spleen", ""), between=9, **attributes):
    """A segmentation of masks, each with its segment and slice; slices are 2 mm apart, whatever the file tells."""
    samples = np.stack([mask for mask, _, _ in frames]).astype("u1")
    write_frames(path, samples, positions([2.0 * k for _, _, k in frames]), dtype="u1", **attributes)
    dataset = pydicom.dcmread(path)
    dataset.SegmentationType = kind
    dataset.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].SpacingBetweenSlices = between
    dataset.SegmentSequence = [
        item(SegmentNumber=number, **({"SegmentLabel": name} if name else {})) for number, name in enumerate(names, 1)
    ]
    # As highdicom writes the colour (200, 30, 60) in sRGB.
    dataset.SegmentSequence[0].RecommendedDisplayCIELabValue = [28545, 49362, 40212]
    for group, (_, number, _) in zip(dataset.PerFrameFunctionalGroupsSequence, frames):
        if number:
            group.SegmentIdentificationSequence = [item(ReferencedSegmentNumber=number)]
    return save(dataset, path)


def frames_of_segments(masks, first=0):
    """Frames in no order, without those that are empty."""
    frames = [
        (plane, number, k) for number, mask in masks.items() for k, plane in enumerate(mask, first) if plane.any()
    ]
    return frames[::-2] + frames[-2::-2]


def test_segments_of_a_segmentation_are_labels(tmp_path):
    z, y, x = np.mgrid[:8, :6, :7]
    labels = np.select([(z < 3) & (x < 4), (z > 4) & (y > 2), (z == 2) & (x > 4)], [1, 2, 3])
    path = write_segments(tmp_path / "a.dcm", frames_of_segments({n: labels == n for n in (1, 2, 3)}))
    found = Labels.read(path)
    np.testing.assert_array_equal(found.data, labels)  # two slices in the middle have no frame
    assert found.names == ("liver", "spleen", "Segment 3") and found.numbers == (1, 2, 3) and found.data.dtype == "u1"
    np.testing.assert_allclose(255 * found.colors[0], (200, 30, 60), atol=0.5)
    assert (
        found.frame["patient"] and found.frame["spacing"] == (0.25, 0.5, 2) and found.frame["origin"] == tuple(ORIGIN)
    )
    assert Labels.read(path, spacing=3, names={3: "cyst"}).frame["spacing"] == (3, 3, 3)
    message = r"mask of one segment, got 3: 3, 2 \(spleen\), 1 \(liver\); Labels\.read\(path\) reads all of them"
    check_refused(path, message, tmp_path)
    path = write_segments(tmp_path / "b.dcm", frames_of_segments({2: labels == 2}, first=-5))
    np.testing.assert_array_equal(Labels.read(path).mask("spleen"), labels[5:] == 2)
    np.testing.assert_array_equal(read_volume(path).data, labels[5:] == 2)


@pytest.mark.parametrize("filled, between", [((0, 2, 4, 6), 2), ((0, 2, 4, 6), -1.99), ((1, 4, 6), 2), ((0, 6), 2.03)])
def test_segments_in_some_slices_keep_the_distance_of_slices(tmp_path, filled, between):
    labels = np.zeros((filled[-1] + 1, 6, 7), int)
    labels[list(filled), :4], labels[list(filled), 4:, 3:] = 1, 2
    expected = labels[filled[0] :]
    path = write_segments(tmp_path / "a.dcm", frames_of_segments({n: labels == n for n in (1, 2)}), between=between)
    found = Labels.read(path)
    np.testing.assert_array_equal(found.data, expected)
    np.testing.assert_allclose(found.frame["spacing"], SPACING)
    np.testing.assert_allclose(found.frame["origin"], positions([2.0 * filled[0]])[0])
    # The mask of one segment is the same as a volume.
    path = write_segments(tmp_path / "b.dcm", frames_of_segments({2: labels == 2}), between=between)
    for data in (Labels.read(path).source, read_volume(path)):
        np.testing.assert_array_equal(data.data != 0, expected == 2)
        np.testing.assert_allclose(data.spacing, SPACING)


def test_a_distance_of_slices_that_divides_none_is_not_used(tmp_path):
    frames = [(np.ones((6, 7)), 1, k) for k in (0, 2, 4)]
    for between, spacing in ((2.5, 4), (9, 4), (0, 4), (3.9, 4), (4 / 3, 4 / 3)):
        found = Labels.read(write_segments(tmp_path / "a.dcm", frames, between=between))
        np.testing.assert_allclose(found.frame["spacing"], (0.25, 0.5, spacing))


def test_segments_that_overlap_are_in_layers(tmp_path):
    z, y, x = np.mgrid[:4, :6, :7]
    masks = {1: (z < 3) & (x < 4), 2: (z > 1) & (y > 2), 3: (z == 0) & (x > 4)}
    found = Labels.read(write_segments(tmp_path / "a.dcm", frames_of_segments(masks)))
    assert found.data.shape == (2, 4, 6, 7)
    for number, mask in masks.items():
        np.testing.assert_array_equal(found.mask(number), mask)


def test_label_maps_of_dicom_have_the_names_of_their_segments(tmp_path, data):
    labels = data % 3
    frames = [(plane, 0, k) for k, plane in enumerate(labels)]
    path = write_segments(tmp_path / "a.dcm", frames, "LABELMAP")
    dataset = pydicom.dcmread(path)
    dataset.SegmentSequence.insert(0, item(SegmentNumber=0, SegmentLabel="Background"))
    found = Labels.read(save(dataset, path))
    np.testing.assert_array_equal(found.data, labels)
    assert found.names == ("liver", "spleen")


def test_segmentations_that_are_no_label_maps_are_refused(tmp_path, data):
    mask = data % 2
    twice = [(mask[0], 1, 0), (mask[1], 1, 0), (mask[2], 1, 1)]
    for frames, kind, message in (
        ([(mask[0], 1, 0)], "FRACTIONAL", "segments of the type BINARY or LABELMAP, got FRACTIONAL"),
        (twice, "BINARY", "one frame a slice of segment 1, got several"),
        (twice, "LABELMAP", "one frame a slice, got several"),
        ([(mask[0], 0, 0), (mask[1], 0, 1)], "BINARY", r"frames of segments from 1 on, got a\.dcm \(frame 1\) of 0"),
        ([(mask[0], 1, 0), (mask[1], 1, 1), (mask[2], 1, 2.5)], "BINARY", "evenly spaced slices, got distances from 2"),
    ):
        with pytest.raises(ValueError, match=rf"a\.dcm: cannot be read as DICOM: expected {message}"):
            Labels.read(write_segments(tmp_path / "a.dcm", frames, kind))
    with pytest.raises(ValueError, match=r"name: expected none for .*a\.dcm"):
        Labels.read(tmp_path / "a.dcm", name="1")
    path = write_series(tmp_path / "series", data % 3, 5 * [(1, 0)]) / "0.dcm"  # no segmentation
    np.testing.assert_array_equal(Labels.read(path).data, data[:1] % 3)


# Compressed samples


def compressed(samples, syntax, encode, signed=True):
    places = positions(2.0 * np.arange(len(samples)))
    dtype = "<i2" if signed else "<u2"
    scalings = list(zip(SLOPES, INTERCEPTS))

    def write(path, part=1.0):
        write_frames(path, samples, places, scalings, order=ORDER, dtype=dtype)
        dataset = pydicom.dcmread(path)
        encoded = [encode(samples[number].astype("<u2")) for number in ORDER]
        encoded[2] = encoded[2][: int(part * len(encoded[2]))]
        dataset.PixelData = pydicom.encaps.encapsulate(encoded)
        dataset["PixelData"].is_undefined_length = True
        dataset.file_meta.TransferSyntaxUID = syntax
        return save(dataset, path)

    return write


@pytest.mark.sweep(3)
@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize(
    "syntax, encode",
    [
        (uid.JPEGLosslessSV1, imagecodecs.ljpeg_encode),
        (uid.JPEGLSLossless, imagecodecs.jpegls_encode),
        (uid.JPEG2000Lossless, lambda plane: imagecodecs.jpeg2k_encode(plane, codecformat="j2k", reversible=True)),
    ],
)
def test_compressed_frames(tmp_path, data, syntax, encode, signed):
    data = data - (1500 if signed else 0)
    write = compressed(data, syntax, encode, signed)
    check(write(tmp_path / "a.dcm"), scaled(data), tmp_path, "f8", positions(2.0 * np.arange(5)))
    with pytest.raises(ValueError, match=r"a\.dcm: cannot be read as DICOM"):
        read_volume(write(tmp_path / "a.dcm", part=0.7))
    content = write(tmp_path / "a.dcm").read_bytes()
    for part in (0.5, 0.9, 0.99):
        (tmp_path / "a.dcm").write_bytes(content[: int(part * len(content))])
        with pytest.raises(ValueError, match=r"a\.dcm: cannot be read as DICOM.*truncated|expected pixels"):
            read_volume(tmp_path / "a.dcm")


@pytest.mark.parametrize("compressor", ["JPEG", "JPEG2000"])
@pytest.mark.parametrize("dtype", ["int16", "uint16"])
def test_slices_that_gdcm_compressed(tmp_path, rng, compressor, dtype):
    # GDCM crashes when it writes JPEG 2000 of few pixels.
    data = (rng.integers(0, 3000, (1, 40, 50)) - (1500 if dtype == "int16" else 0)).astype(dtype)
    writer = SimpleITK.ImageFileWriter()
    writer.SetImageIO("GDCMImageIO")
    writer.UseCompressionOn()
    writer.SetCompressor(compressor)
    writer.SetFileName(str(tmp_path / "a.dcm"))
    writer.Execute(SimpleITK.GetImageFromArray(data))
    np.testing.assert_array_equal(read_volume(tmp_path / "a.dcm").data, data)


@pytest.mark.parametrize(
    "name",
    ["JPGExtended", "JPEG2000", "J2K_pixelrep_mismatch", "JPEGLSNearLossless_08", "MR_small_RLE", "MR_small_bigendian"],
)
def test_files_of_pydicom_are_read_as_by_gdcm(name):
    path = get_testdata_file(f"{name}.dcm", download=False)
    expected = SimpleITK.ReadImage(path)
    with pytest.warns(match="no PixelSpacing") if name == "JPEGLSNearLossless_08" else contextlib.nullcontext():
        volume = read_volume(path)
    np.testing.assert_array_equal(volume.data, SimpleITK.GetArrayFromImage(expected))
    # Old versions of GDCM read no spacing of nuclear medicine.
    spacing = pydicom.dcmread(path).get("PixelSpacing", (1.0, 1.0))
    np.testing.assert_allclose(volume.spacing[:2], [float(each) for each in spacing[::-1]])
    np.testing.assert_allclose(volume.origin, expected.GetOrigin())
    np.testing.assert_allclose(volume.direction.ravel(), expected.GetDirection(), atol=1e-9)


def test_empty_files_without_a_suffix_of_dicom_do_not_count(tmp_path, rng):
    samples = rng.integers(0, 99, (3, 5, 4))
    folder = write_series(tmp_path / "series", samples, [(1, 0)] * 3)
    (folder / "LOCKFILE").touch()
    np.testing.assert_array_equal(read_volume(folder).data, samples)
    for name in ("IM0004", "1.2.3.4"):
        (folder / name).touch()
        with pytest.raises(ValueError, match=f"{name}: expected a DICOM file, got an empty file"):
            read_volume(folder)
        (folder / name).unlink()
    (folder / "3.dcm").touch()
    with pytest.raises(ValueError, match=r"3\.dcm: expected a DICOM file, got an empty file"):
        read_volume(folder)
    with pytest.raises(ValueError, match=r"3\.dcm: .*expected a DICOM file, got an empty file"):
        read_volume(folder / "3.dcm")
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "notes.txt").touch()
    with pytest.raises(ValueError, match="expected a folder with a DICOM series or TIFF slices, got one without"):
        read_volume(tmp_path / "notes")
