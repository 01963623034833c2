"""Files that are dropped together: series of slices, headers with samples, sessions, and others beside them."""

import io
import json

import numpy as np
import pytest

pytest.importorskip("playwright")
from test_viewer_uploads import SHAPE, mhd, nhdr
from viewer_client import Client


def array(samples):
    file = io.BytesIO()
    np.save(file, samples)
    return file.getvalue()


def test_files_that_no_header_names_are_opened_or_told(viewer):
    """Beside a header and its samples, and beside a session."""
    samples = np.random.default_rng(0).integers(0, 255, SHAPE, np.uint8)
    client = Client(viewer)
    pair = {"c.mhd": mhd("c.raw"), "c.raw": samples.tobytes()}
    client.upload({**pair, "other.raw": samples.tobytes()})
    about, _ = client.receive("raw")
    assert about["name"] == "other.raw"
    client.receive("uploaded")
    assert "b.mgz" in client.uploaded({**pair, "b.mgz": b"nothing"})
    pattern = {f"part{number}.raw": part.tobytes() for number, part in enumerate(samples)}
    assert not client.uploaded({"d.nhdr": nhdr(f"part%d.raw 0 {SHAPE[0] - 1} 1"), **pattern})
    assert not client.uploaded({"e.nhdr": nhdr("\n".join(["LIST", *pattern])), **pattern})
    source = {"key": "source1", "path": "v.npy"}
    session = {"format": "isospline session 2", "sources": [source], "state": {}}
    off = b"OFF\n3 1 0\n0 0 7\n7 0 7\n0 7 7\n3 0 1 2\n"
    files = {"s.json": json.dumps(session).encode(), "v.npy": array(samples), "m.off": off, **pair}
    assert not client.uploaded(files)
    names = [source.name for source in viewer.document][1:]
    assert names == ["c.mhd", "c.mhd", "d.nhdr", "e.nhdr", "v.npy", "m.off", "c.mhd"]
    client.close()


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    """The files of a function of names: 6 slices of a series."""
    pydicom = pytest.importorskip("pydicom")
    from pydicom import uid

    def files(*names, series="1.2.3.4"):
        folder = tmp_path_factory.mktemp("slices")
        for number, name in enumerate(names):
            dataset = pydicom.Dataset()
            dataset.SOPClassUID, dataset.SOPInstanceUID = uid.CTImageStorage, uid.generate_uid()
            dataset.StudyInstanceUID, dataset.SeriesInstanceUID = "1.2.3", series
            dataset.Rows, dataset.Columns, dataset.SamplesPerPixel = 5, 6, 1
            dataset.PhotometricInterpretation, dataset.PixelRepresentation = "MONOCHROME2", 0
            dataset.BitsAllocated, dataset.BitsStored, dataset.HighBit = 16, 16, 15
            dataset.PixelData = (1000 * (np.abs(np.mgrid[-2:3, -2.5:3]).max(axis=0) < 2)).astype("<u2").tobytes()
            dataset.ImagePositionPatient, dataset.ImageOrientationPatient = [0, 0, number], [1, 0, 0, 0, 1, 0]
            dataset.PixelSpacing = [1, 1]
            dataset.file_meta = pydicom.dataset.FileMetaDataset()
            dataset.file_meta.TransferSyntaxUID = uid.ExplicitVRLittleEndian
            dataset.save_as(folder / name, enforce_file_format=True)
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}

    return files


@pytest.mark.parametrize(
    ("names", "others"),
    [
        ([f"s{number}.IMA" for number in range(8)], []),
        ([f"1.2.826.0.1.3680043.8.498.{number}" for number in range(8)], []),
        ([f"{number}.dcm" for number in range(3)], []),
        ([f"{number}.dcm" for number in range(8)], ["LICENSE.txt"]),
    ],
    ids=["IMA", "UID", "three", "with a text"],
)
def test_dropped_slices_are_one_volume(viewer, series, names, others):
    client = Client(viewer)
    errors = client.uploaded({**series(*names), **dict.fromkeys(others, b"nothing")})
    assert all(name in errors for name in others) and bool(errors) == bool(others)
    _, source = viewer.document
    assert source.item.shape == (len(names), 5, 6)
    assert source.name == f"{names[0]} and {len(names) - 1} more"
    assert f"read_volume({source.name!r})" in source.expression(None, (4, 3))
    client.close()


def test_two_dropped_series_are_two_volumes(viewer, series):
    files = {
        **series("a1", "a2", "a3"),
        **series("b1", "b2", "b3", series="1.2.3.5"),
        **series("c.dcm", series="1.2.3.6"),
    }
    client = Client(viewer)
    errors = client.uploaded(files)
    names = [source.name for source in viewer.document][1:]
    assert not errors
    assert names == ["a1 and 2 more", "b1 and 2 more", "c.dcm"]
    client.close()
