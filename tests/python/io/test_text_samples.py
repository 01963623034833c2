"""Samples as text in MetaImage and NRRD: exact, within their type, and all of them."""

import numpy as np
import pytest

from isospline import read_volume

pytest.importorskip("SimpleITK")

META = "ObjectType = Image\nNDims = 3\nBinaryData = False\nDimSize = 5 4 3\nElementType = {}\nElementDataFile = LOCAL\n"
NRRD = "NRRD0004\ntype: {}\ndimension: 3\nsizes: 5 4 3\nencoding: ascii\n\n"
TYPES = {"int64": "MET_LONG_LONG", "uint64": "MET_ULONG_LONG", "int16": "MET_SHORT", "uint8": "MET_UCHAR"}


def read(folder, kind, suffix, text):
    header = META.format(TYPES[kind]) if suffix == ".mha" else NRRD.format(kind)
    (folder / f"a{suffix}").write_text(header + text, encoding="ascii")
    return read_volume(folder / f"a{suffix}").data


@pytest.mark.parametrize("suffix", [".mha", ".nrrd"])
@pytest.mark.parametrize("kind, first", [("int64", 2**53), ("uint64", 2**64 - 60), ("int64", -(2**63))])
def test_large_whole_numbers_are_not_rounded(tmp_path, kind, first, suffix):
    samples = np.array([first + number for number in range(60)], kind).reshape(3, 4, 5)
    read_samples = read(tmp_path, kind, suffix, " ".join(map(str, samples.ravel().tolist())))
    assert read_samples.dtype == kind
    np.testing.assert_array_equal(read_samples, samples)


@pytest.mark.parametrize("suffix", [".mha", ".nrrd"])
@pytest.mark.parametrize(
    "text, expected",
    [
        ("300 " * 60, "expected samples of uint8, got others"),
        ("-1 " * 60, "expected samples of uint8, got others"),
        ("1.5 " * 60, "expected samples of uint8, got others"),
        ("nan " * 60, "expected samples of uint8, got others"),
        ("1 " * 59, "expected 60 samples, got 59"),
        ("1 " * 61, "expected 60 samples, got 61"),
    ],
)
def test_samples_that_the_type_does_not_hold_are_refused(tmp_path, text, expected, suffix):
    with pytest.raises(ValueError, match=expected):
        read(tmp_path, "uint8", suffix, text)


@pytest.mark.parametrize("suffix", [".mha", ".nrrd"])
def test_whole_numbers_with_an_exponent_are_whole_numbers(tmp_path, suffix):
    assert (read(tmp_path, "int16", suffix, "1.2e+04 " * 60) == 12000).all()


@pytest.mark.parametrize("names", ["LIST\na 0.txt\na 1.txt\na 2.txt\n", "a%d.txt 0 2 1\n"])
def test_metaimage_with_a_text_file_for_each_slice(tmp_path, names):
    samples = np.arange(60).reshape(3, 4, 5)
    for number, each in enumerate(samples):
        name = f"a {number}.txt" if "LIST" in names else f"a{number}.txt"
        (tmp_path / name).write_text(" ".join(map(str, each.ravel().tolist())) + "\n", encoding="ascii")
    header = META.format("MET_SHORT").replace("LOCAL\n", names)
    (tmp_path / "a.mhd").write_text(header, encoding="ascii")
    np.testing.assert_array_equal(read_volume(tmp_path / "a.mhd").data, samples)
    lists = header.replace(names, "LIST\nb\nb\n")
    (tmp_path / "a.mhd").write_text(lists, encoding="ascii")
    (tmp_path / "b").write_text("1 " * 30, encoding="ascii")
    with pytest.raises(ValueError, match="expected files of whole slices, got 2 for 3 slices"):
        read_volume(tmp_path / "a.mhd")
