"""Label maps on the command line."""

import csv
import json

import numpy as np
import pytest
from cli.command_line import fails, pixels
from labels import label_maps as maps

import isospline
from isospline.cli.main import main
from isospline.io.label_map import count_of_labels


@pytest.fixture
def cells(tmp_path):
    """A file with a label map of three labels, and the map."""
    data = maps.cells(3, size=30, radius=12.0)
    np.save(tmp_path / "cells.npy", data)
    return tmp_path / "cells.npy", data


def test_a_label_map_is_recognized_and_rendered(cells, tmp_path, capsys):
    path, data = cells
    output = tmp_path / "a.png"
    options = ["--size", "64x48", "--samples", "1", "--view", "front", "--light", "phong", "--background", "black"]
    assert main(["render", str(path), *options, "-o", str(output), "--quiet"]) == 0
    assert "a label map, as its 4 values are constant over large parts; --level" in capsys.readouterr().err
    scene = isospline.Labels(data).scene()
    expected = isospline.render(
        scene,
        isospline.camera_for(scene, view="front", size=(64, 48)),
        size=(64, 48),
        samples=1,
        background=0.0,
        light={id: isospline.Phong(color=item.color) for id, item, *_ in scene._placed_objects()},
    )
    np.testing.assert_allclose(pixels(output)[..., :3], expected.to_srgb()[..., :3], atol=1)
    # With a legend, with some of the labels, and as a volume.
    assert main(["render", str(path), *options, "--legend", "-o", str(tmp_path / "b.png"), "--quiet"]) == 0
    assert (pixels(tmp_path / "b.png") != pixels(output)).any()
    one = ["--label", "2", "--label", "label 1", "--color", "red"]
    assert main(["render", str(path), *options, *one, "-o", str(tmp_path / "c.png"), "--quiet"]) == 0
    assert main(["render", str(path), *options, "-l", "1.5", "-o", str(tmp_path / "d.png"), "--quiet"]) == 0
    assert "warning: data: looks like a label map" in capsys.readouterr().err
    assert len({pixels(tmp_path / f"{name}.png").tobytes() for name in "abcd"}) == 4


def test_a_table_of_measures(cells, tmp_path, capsys):
    path, data = cells
    expected = isospline.Labels(data).measure()
    table = tmp_path / "table.csv"
    assert main(["measure", str(path), "-o", str(table), "--quiet"]) == 0
    with open(table, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["names"] for row in rows] == ["label 1", "label 2", "label 3"]
    np.testing.assert_allclose([float(row["areas"]) for row in rows], expected.areas, rtol=1e-12)
    np.testing.assert_allclose([float(row["centroids_z"]) for row in rows], expected.centroids[:, 2], rtol=1e-12)
    capsys.readouterr()
    assert main(["measure", str(path), "--label", "3", "--json", "--quiet"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [row["numbers"] for row in found["labels"]] == [3]
    assert found["labels"][0]["enclosed_volumes"] == expected.enclosed_volumes[2]
    assert main(["measure", str(path), "--quiet"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5 and lines[2].split()[:3] == ["1", "label", "1"]


def test_a_label_with_a_negative_number(tmp_path, capsys):
    data = np.zeros((6, 7, 8), np.int16)
    data[2:4, 2:5, 3:6] = -3
    np.save(tmp_path / "negative.npy", data)
    assert main(["measure", str(tmp_path / "negative.npy"), "--label", "-3", "--json", "--quiet"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["labels"]
    assert (found["numbers"], found["voxel_counts"]) == (-3, 18)


def test_layers_that_are_cut_short_and_a_name_of_digits(tmp_path, capsys, monkeypatch):
    nrrd = pytest.importorskip("nrrd")
    monkeypatch.chdir(tmp_path)
    layers = np.zeros((2, 6, 7, 8), np.uint8)
    layers[0, 1:3, 2:5, 3:7], layers[1, 3:5, 2:5, 3:6] = 1, 1
    header = {"kinds": ["list", *["domain"] * 3], "space": "left-posterior-superior", "encoding": "raw"}
    header["space directions"] = np.vstack([np.full(3, np.nan), np.eye(3)])
    for place, name in enumerate(("12", "2")):  # of the numbers 1 and 2
        header |= {f"Segment{place}_{field}": value for field, value in (("Name", name), ("LabelValue", "1"))}
        header[f"Segment{place}_Layer"] = str(place)
    nrrd.write("a.seg.nrrd", layers.transpose(0, 3, 2, 1), header)
    for label, number in (("12", 1), ("1", 1), ("2", 2)):
        assert main(["measure", "a.seg.nrrd", "--label", label, "--json", "--quiet"]) == 0
        (found,) = json.loads(capsys.readouterr().out)["labels"]
        assert found["numbers"] == number
    fails(capsys, 2, "expected one of the numbers 1, 2, got 3", "measure", "a.seg.nrrd", "--label", "3")
    content = (tmp_path / "a.seg.nrrd").read_bytes()
    (tmp_path / "a.seg.nrrd").write_bytes(content[:-50])
    for command in ("info", "measure"):
        fails(capsys, 2, "expected 672 bytes of samples, got 622 bytes: the file is truncated", command, "a.seg.nrrd")


@pytest.fixture
def segmentation(tmp_path):
    """A DICOM segmentation of two segments, and the label map."""
    pydicom = pytest.importorskip("pydicom")

    def item(**attributes):
        dataset = pydicom.Dataset()
        for name, value in attributes.items():
            setattr(dataset, name, value)
        return dataset

    labels = np.zeros((3, 8, 9), int)
    labels[:, 2:5, 2:5], labels[1:, 5:, 3:] = 1, 2
    frames = [(number, k) for number in (1, 2) for k in range(3) if (labels[k] == number).any()]
    dataset = item(
        SOPClassUID=pydicom.uid.SegmentationStorage, SOPInstanceUID="1.2.3", SegmentationType="BINARY",
        Rows=8, Columns=9, NumberOfFrames=len(frames), SamplesPerPixel=1, PhotometricInterpretation="MONOCHROME2",
        BitsAllocated=8, BitsStored=8, HighBit=7, PixelRepresentation=0,
        PixelData=np.stack([labels[k] == number for number, k in frames]).astype("u1").tobytes(),
        ImageOrientationPatient=[1, 0, 0, 0, 1, 0], PixelSpacing=[0.5, 0.25], SpacingBetweenSlices=2,
        SegmentSequence=[item(SegmentNumber=1, SegmentLabel="liver"), item(SegmentNumber=2, SegmentLabel="spleen")],
        PerFrameFunctionalGroupsSequence=[
            item(
                PlanePositionSequence=[item(ImagePositionPatient=[10, 20, 2 * k])],
                SegmentIdentificationSequence=[item(ReferencedSegmentNumber=number)],
            )
            for number, k in frames
        ],
    )  # fmt: skip
    dataset.file_meta = pydicom.dataset.FileMetaDataset()
    dataset.file_meta.MediaStorageSOPClassUID = dataset.SOPClassUID
    dataset.file_meta.MediaStorageSOPInstanceUID = dataset.SOPInstanceUID
    dataset.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    dataset.save_as(tmp_path / "seg.dcm", enforce_file_format=True)
    return tmp_path / "seg.dcm", labels


def test_segments_of_dicom_are_listed_and_errors_name_the_option(segmentation, tmp_path, capsys):
    path, labels = segmentation
    assert main(["info", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["segments"] == [
        {"number": number, "name": name, "voxels": int((labels == number).sum())}
        for number, name in ((1, "liver"), (2, "spleen"))
    ]
    assert found["size"] == [9, 8, 3] and found["spacing"] == [0.25, 0.5, 2] and found["patient"]
    assert main(["info", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-3].split()[:2] == ["segments", "2"] and lines[-1].split() == ["2", "spleen,", "36", "voxels"]
    told = r"seg\.dcm: .* got 2: 1 \(liver\), 2 \(spleen\); --labels of render and measure reads all of them$"
    for command in ("render", "measure", "mesh", "convert"):
        output = [tmp_path / "store"] if command == "convert" else ["-o", tmp_path / "a.png"]
        output = {"measure": [], "mesh": ["-o", tmp_path / "a.ply"]}.get(command, output)
        fails(capsys, 2, told, command, path, *output, "--quiet")
    assert main(["measure", str(path), "--labels", "--json", "--quiet"]) == 0
    assert [row["names"] for row in json.loads(capsys.readouterr().out)["labels"]] == ["liver", "spleen"]
    # One segment, and fractions, which have no label map.
    dataset = pytest.importorskip("pydicom").dcmread(path)
    count = sum((labels[k] == 1).any() for k in range(3))
    dataset.NumberOfFrames, dataset.PixelData = count, dataset.PixelData[: count * 72]
    dataset.SegmentSequence = dataset.SegmentSequence[:1]
    dataset.PerFrameFunctionalGroupsSequence = dataset.PerFrameFunctionalGroupsSequence[:count]
    dataset.save_as(tmp_path / "one.dcm")
    assert main(["info", str(tmp_path / "one.dcm"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["segments"] == found["segments"][:1]
    dataset.SegmentationType = "FRACTIONAL"
    dataset.save_as(tmp_path / "one.dcm")
    assert main(["info", str(tmp_path / "one.dcm"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["maximum"] == 1


def test_segments_of_other_files_are_listed(tmp_path, capsys, monkeypatch):
    nrrd, nibabel = pytest.importorskip("nrrd"), pytest.importorskip("nibabel")
    monkeypatch.chdir(tmp_path)
    data = np.zeros((6, 7, 8), np.int16)
    data[1:3, 2:5, 3:7], data[3:5, 2:5, 3:7] = 1, 5
    header = {
        f"Segment{place}_{field}": value
        for place, values in enumerate([("Leber", "5"), ("Milz", "1"), ("none", "3")])
        for field, value in zip(("Name", "LabelValue"), values)
    }
    nrrd.write("a.seg.nrrd", data.T, header)
    image = nibabel.Nifti1Image(data.T, np.eye(4))
    table = '<LabelTable><Label Key="1">Milz</Label><Label Key="5">Leber</Label></LabelTable>'
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, table.encode()))
    nibabel.save(image, "a.nii.gz")
    expected = [
        {"number": number, "name": name, "voxels": int((data == number).sum())}
        for number, name in ((1, "Milz"), (5, "Leber"))
    ]
    for name in ("a.seg.nrrd", "a.nii.gz"):
        assert main(["info", name, "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["segments"] == expected and found["size"] == [8, 7, 6]
        assert main(["info", name]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert lines[-3].split()[:2] == ["segments", "2"]
        assert [line.split(maxsplit=1)[1] for line in lines[-2:]] == [
            f"{each['name']}, {each['voxels']} voxels" for each in expected
        ]
        fails(capsys, 2, "--memory-limit: expected a store with it", "info", name, "--memory-limit", "1GB")

    # Several layers; and fractions, which are read as a volume.
    layers = np.stack([data, np.where(data == 1, 3, 0).astype(np.int16)])
    directions = np.vstack([np.full(3, np.nan), np.eye(3)])
    layered = {"kinds": ["list", *["domain"] * 3], "space directions": directions, "Segment2_Layer": "1", **header}
    nrrd.write("b.seg.nrrd", layers.transpose(0, 3, 2, 1), {"space": "left-posterior-superior", **layered})
    assert main(["info", "b.seg.nrrd", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["segments"]
    assert found == [expected[0], {"number": 3, "name": "none", "voxels": int((data == 1).sum())}, expected[1]]
    nrrd.write("c.seg.nrrd", data.T * np.float32(0.25), header)
    assert main(["info", "c.seg.nrrd"]) == 0
    assert "range      0 to 1.25" in capsys.readouterr().out


def test_wrong_options(cells, tmp_path, capsys):
    path, _ = cells
    fails(capsys, 2, "--level: expected none with a label map", "measure", path, "--labels", "-l", "1")
    for option in (("--degree", "2"), ("--largest", "1"), ("--memory-limit", "1GB")):
        fails(capsys, 2, f"{option[0]}: expected none with a label map", "measure", path, "--labels", *option)
    for option in (("--clip", "0,0,0,0,0,1"), ("--clip-box", "0,0,0,9,9,9"), ("--closed",)):
        told = f"{option[0]}: expected none with measures of a label map, got"
        fails(capsys, 2, told, "measure", path, "--labels", *option)
    fails(capsys, 2, "label: expected the name of a label, got 'liver'", "measure", path, "--label", "liver", "--quiet")
    fails(capsys, 2, "a table, which ends in .csv", "measure", path, "--labels", "-o", tmp_path / "a.txt")
    np.save(tmp_path / "real.npy", np.full((3, 3, 3), 0.5))
    fails(capsys, 2, "data: expected whole numbers", "measure", tmp_path / "real.npy", "--labels")
    assert not list(tmp_path.glob("*.csv"))


def test_what_looks_like_labels():
    cells = maps.cells(3, size=30, radius=12.0)
    assert count_of_labels(cells) == 4
    assert count_of_labels(cells.astype(np.float32)) == 4
    assert count_of_labels(cells + 1) is None  # no background
    assert count_of_labels((cells > 0).astype(np.uint8)) is None  # a mask, for which 0.5 is right
    noise = np.random.default_rng(0).poisson(3, (30, 30, 30))
    assert count_of_labels(noise.astype(np.uint8)) is None
    ramp = np.clip(np.add.outer(np.zeros((30, 30)), np.arange(-15, 45)), 0, 30)
    assert count_of_labels(ramp.astype(np.int16)) is None
    assert count_of_labels(cells + 0.25 * (cells > 1)) is None


def test_volumes_are_no_labels(volumes_folder):
    for path in sorted(volumes_folder.iterdir()):
        if path.suffix != ".md":
            assert count_of_labels(isospline.read_volume(path).data) is None, path
