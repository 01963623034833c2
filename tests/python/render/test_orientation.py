"""A patient is upright and faces the viewer in the default picture, for every format and order of axes."""

import locale

import numpy as np
import pytest

import isospline
from isospline.base import views

nibabel = pytest.importorskip("nibabel")
SimpleITK = pytest.importorskip("SimpleITK")

#: The positions of a patient's marks, in LPS.
MARKS = {"nose": (0, -26, 0), "crown": (0, 0, 28), "left ear": (26, 0, 0)}
COUNT, SPACING = 48, 1.5
# Axes of storage: columns of the direction matrix, LPS.
AXES = {
    "LPS": np.eye(3),
    "RAS": np.diag([-1.0, -1.0, 1.0]),
    "LPI": np.diag([1.0, 1.0, -1.0]),
    "PSR": np.array([(0, 0, -1.0), (1, 0, 0), (0, 1, 0)]),
}


def patient(direction):
    """Samples [z, y, x] of a head with marks, and the origin, for axes in these directions."""
    half = (COUNT - 1) / 2 * SPACING
    origin = -direction @ np.full(3, half)
    index = np.stack(np.meshgrid(*[np.arange(COUNT)] * 3, indexing="ij")[::-1], axis=-1)
    points = index * SPACING @ direction.T + origin
    inside = 22 - np.linalg.norm(points, axis=-1)
    for mark in MARKS.values():
        inside = np.maximum(inside, 6 - np.linalg.norm(points - mark, axis=-1))
    return np.clip(100 + 20 * inside, 0, 200).astype(np.int16), origin


def write_nifti(path, data, direction, origin):
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = direction * SPACING, origin
    nibabel.save(nibabel.Nifti1Image(data.T, np.diag([-1, -1, 1, 1]) @ affine), path)


def write_itk(path, data, direction, origin):
    image = SimpleITK.GetImageFromArray(data)
    image.SetSpacing([SPACING] * 3)
    image.SetOrigin(origin.tolist())
    image.SetDirection(direction.ravel().tolist())
    SimpleITK.WriteImage(image, path)


def write_nrrd_ras(path, data, direction, origin):
    import nrrd

    to_ras = np.diag([-1, -1, 1])
    header = {
        "space": "right-anterior-superior",
        "space origin": to_ras @ origin,
        "space directions": (to_ras @ direction * SPACING).T,
        "kinds": ["domain"] * 3,
    }
    nrrd.write(str(path), data.T, header)


WRITERS = {"a.nii.gz": write_nifti, "a.nrrd": write_itk, "ras.nrrd": write_nrrd_ras, "a.mha": write_itk}


def write_dicom(folder, data, direction, origin):
    before = locale.setlocale(locale.LC_ALL)  # writing sets that of the whole process to "C"
    image = SimpleITK.GetImageFromArray(data)
    image.SetSpacing([SPACING] * 3)
    writer = SimpleITK.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    for number in range(len(data)):
        cut = image[:, :, number]
        place = origin + direction[:, 2] * SPACING * number
        tags = {
            "0008|0060": "CT",
            "0008|0016": "1.2.840.10008.5.1.4.1.1.2",
            "0020|000d": "1.2.3",
            "0020|000e": "1.2.3.4",
            "0008|0018": f"1.2.3.4.{number + 1}",
            "0020|0013": str(number),
            "0020|0032": join(place),
            "0020|0037": join(direction[:, :2].T.ravel()),
        }
        for tag, value in tags.items():
            cut.SetMetaData(tag, value)
        writer.SetFileName(str(folder / f"{number:03}.dcm"))
        writer.Execute(cut)
    locale.setlocale(locale.LC_ALL, before)


def join(numbers):
    return "\\".join(f"{number:g}" for number in numbers)


def seen_marks(volume, view):
    """Column, row and depth of each mark in the picture."""
    surface = isospline.Isosurface(volume, 100)
    camera = isospline.camera_for(surface, view=view, size=(120, 120))
    image = isospline.render(surface, camera, size=(120, 120), layers=("position", "depth"), light="phong")
    found = {}
    for name, mark in MARKS.items():
        near = (np.linalg.norm(image.position - mark, axis=-1) < 6.5) & np.isfinite(image.depth)
        rows, columns = np.nonzero(near)
        found[name] = (columns.mean(), rows.mean(), image.depth[near].min()) if near.any() else None
    return found


def check_face(volume, view):
    marks = seen_marks(volume, view)
    nose, crown, ear = (np.array(marks[name]) for name in MARKS)
    assert nose[2] == min(mark[2] for mark in marks.values())  # towards the viewer
    assert crown[1] < min(nose[1], ear[1]) - 15  # upright
    assert ear[0] > max(nose[0], crown[0]) + 15  # the patient's left is at the right


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("axes", AXES)
def test_a_patient_faces_the_viewer(tmp_path, name, axes):
    data, origin = patient(AXES[axes])
    WRITERS[name](tmp_path / name, data, AXES[axes], origin)
    read = isospline.read_volume(tmp_path / name)
    assert read.patient
    for view in (views.DEFAULT_VIEW, "anterior", "front"):
        check_face(read.to_volume(), view)


def test_a_dicom_patient_faces_the_viewer(tmp_path):
    for name, axes in (("lps", "LPS"), ("psr", "PSR")):
        folder = tmp_path / name
        folder.mkdir()
        data, origin = patient(AXES[axes])
        write_dicom(folder, data, AXES[axes], origin)
        read = isospline.read_volume(folder)
        assert read.patient and read.format == "DICOM series"
        check_face(read.to_volume(), views.DEFAULT_VIEW)


#: The names of the axes' directions, LPS, in RFC-4 of OME-Zarr.
ORIENTATIONS = {
    (1, 0, 0): "right-to-left",
    (-1, 0, 0): "left-to-right",
    (0, 1, 0): "anterior-to-posterior",
    (0, 0, 1): "inferior-to-superior",
    (0, -1, 0): "posterior-to-anterior",
    (0, 0, -1): "superior-to-inferior",
}


@pytest.mark.sweep(1)
@pytest.mark.slow
@pytest.mark.parametrize("axes", AXES)
def test_a_patient_in_a_store_faces_the_viewer(tmp_path, axes):
    zarr = pytest.importorskip("zarr")
    data, origin = patient(AXES[axes])
    write_nifti(tmp_path / "a.nii.gz", data, AXES[axes], origin)
    (tmp_path / "dicom").mkdir()
    write_dicom(tmp_path / "dicom", data, AXES[axes], origin)
    for source in ("a.nii.gz", "dicom"):
        path = isospline.convert(tmp_path / source, tmp_path / f"{source}.zarr")
        assert isospline.store.read_metadata(path).patient
        check_face(isospline.open_volume(path), "anterior")
        told = zarr.open_group(path, mode="r").attrs["ome"]["multiscales"][0]["axes"]
        columns = np.rint(isospline.read_volume(tmp_path / source).direction).astype(int).T.tolist()
        expected = [{"type": "anatomical", "value": ORIENTATIONS[tuple(column)]} for column in columns]
        assert [axis["orientation"] for axis in told] == expected[::-1]


def test_a_store_of_no_patient_names_no_sides(tmp_path):
    zarr = pytest.importorskip("zarr")
    data, origin = patient(np.eye(3))
    frames = {"none": {}, "turned": dict(direction=turned(40)), "oblique": dict(direction=turned(57), patient=True)}
    for name, frame in frames.items():
        given = isospline.VolumeData(data, origin=tuple(origin), **frame)
        path = isospline.convert(given, tmp_path / f"{name}.zarr")
        assert isospline.store.read_metadata(path).patient == (name == "oblique")
        told = zarr.open_group(path, mode="r").attrs["ome"]["multiscales"][0]["axes"]
        # Axes turned by 57 degrees about the diagonal are 46 degrees from where they were.
        assert not any("orientation" in axis for axis in told)


def turned(degrees):
    """Axes that are turned about the diagonal."""
    axis, angle = np.full(3, 3**-0.5), np.radians(degrees)
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) * np.cos(angle) + np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer(axis, axis)


def test_all_sides_of_a_patient():
    data, origin = patient(np.eye(3))
    volume = isospline.Volume(data, spacing=(SPACING,) * 3, origin=origin)
    middle = 59.5
    for view, nearest in (("left", "left ear"), ("superior", "crown"), ("anterior", "nose")):
        marks = {name: mark for name, mark in seen_marks(volume, view).items() if mark is not None}
        assert min(marks, key=lambda name: marks[name][2]) == nearest
    for view, hidden in (("posterior", "nose"), ("right", "left ear"), ("inferior", "crown")):
        marks = seen_marks(volume, view)
        assert all(mark is None or mark[2] < 1e9 for mark in marks.values())
        assert marks[hidden] is None
    left = seen_marks(volume, "left")
    assert left["nose"][0] < middle - 15 and left["crown"][1] < middle - 15
    above = seen_marks(volume, "superior")
    assert above["nose"][1] < middle - 15 and above["left ear"][0] < middle - 15
    below = seen_marks(volume, "inferior")  # as radiologists see slices
    assert below["nose"][1] < middle - 15 and below["left ear"][0] > middle + 15


def test_one_rule_with_and_without_a_patient():
    pairs = {"front": "anterior", "back": "posterior", "bottom": "inferior"}
    for thing, of_patient in pairs.items():
        assert views.VIEWS[thing] == views.VIEWS[of_patient]
    assert views.VIEWS["left"] == views.VIEWS["+x"] and views.VIEWS["right"] == views.VIEWS["-x"]


@pytest.mark.parametrize(("orientation", "expected"), [("RAI", True), ("LPS", True), ("???", False), ("RRI", False)])
def test_a_metaimage_declares_whether_it_is_of_a_patient(tmp_path, orientation, expected):
    data, origin = patient(np.eye(3))
    write_itk(tmp_path / "a.mha", data, np.eye(3), origin)
    content = (tmp_path / "a.mha").read_bytes()
    assert b"AnatomicalOrientation = RAI" in content
    (tmp_path / "a.mha").write_bytes(content.replace(b"Orientation = RAI", f"Orientation = {orientation}".encode()))
    assert isospline.read_volume(tmp_path / "a.mha").patient == expected


def test_files_without_a_frame_are_of_no_patient(tmp_path):
    data, _ = patient(np.eye(3))
    np.save(tmp_path / "a.npy", data)
    image = nibabel.Nifti1Image(data.T, None)
    nibabel.save(image, tmp_path / "a.nii")
    assert int(nibabel.load(tmp_path / "a.nii").header["sform_code"]) == 0
    (tmp_path / "a.nrrd").write_bytes(
        b"NRRD0004\ntype: short\ndimension: 3\nsizes: 48 48 48\nencoding: raw\nendian: little\n"
        b"space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n\n" + data.astype("<i2").tobytes()
    )
    for name in ("a.npy", "a.nii", "a.nrrd"):
        assert not isospline.read_volume(tmp_path / name).patient
