"""The unit and the patient of a file reach the volume, its copies, its store, and the marks in pictures."""

import copy
import json
import pickle

import numpy as np
import pytest
from placed_images import write_slices

import isospline
from isospline import Volume, VolumeData, read_volume
from isospline.cli.main import main

DATA = np.random.default_rng(3).integers(0, 90, (6, 7, 8)).astype(np.int16)


def about(item):
    return item.unit, item.patient


def test_a_volume_keeps_its_unit_and_patient():
    assert about(Volume(DATA)) == ("", False)
    volume = Volume(DATA, unit="µm", patient=True)
    assert about(volume) == ("µm", True)
    for other in (copy.copy(volume), copy.deepcopy(volume), pickle.loads(pickle.dumps(volume))):
        assert about(other) == ("µm", True)
    surface = isospline.Isosurface(Volume(DATA, unit="mm"), 40)
    assert about(surface.volume) == ("mm", False)


def test_volume_data_gives_its_unit_to_the_volume():
    assert about(VolumeData(DATA).to_volume()) == ("", False)
    assert about(VolumeData(DATA, patient=True).to_volume()) == ("mm", True)
    assert about(VolumeData(DATA).replace(patient=True).to_volume()) == ("mm", True)
    assert about(VolumeData(DATA, unit="m", patient=True).to_volume()) == ("m", True)
    assert about(VolumeData(DATA, patient=True).to_volume(unit="cm", patient=False)) == ("cm", False)


@pytest.mark.parametrize("name, unit", [("mm", "mm"), ("meter", "m"), ("micron", "µm"), ("unknown", "")])
def test_units_of_nifti(tmp_path, name, unit):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(DATA.T, None)
    image.header.set_xyzt_units(name)
    image.set_sform(np.eye(4), code=0)
    image.set_qform(np.eye(4), code=0)
    nibabel.save(image, tmp_path / "a.nii")
    assert about(read_volume(tmp_path / "a.nii").to_volume()) == (unit, False)
    image.set_sform(np.eye(4), code=1)
    assert about(Volume.from_nibabel(image)) == (unit or "mm", True)


def test_units_of_tiff(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    place = {"PhysicalSizeX": 2, "PhysicalSizeY": 2, "PhysicalSizeZ": 3}
    units = {f"PhysicalSize{axis}Unit": "nm" for axis in "XYZ"}
    for metadata, unit in ((place | units, "nm"), (place, "µm"), ({}, "")):
        tifffile.imwrite(tmp_path / "a.ome.tif", DATA, metadata={"axes": "ZYX", **metadata})
        assert about(read_volume(tmp_path / "a.ome.tif").to_volume()) == (unit, False)
    for name, unit in (("micron", "µm"), ("mm", "mm")):
        metadata = {"axes": "ZYX", "spacing": 3, "unit": name}
        tifffile.imwrite(tmp_path / "a.tif", DATA, imagej=True, resolution=(0.5, 0.5), metadata=metadata)
        assert about(read_volume(tmp_path / "a.tif").to_volume()) == (unit, False)


def test_units_of_nrrd_and_dicom(tmp_path):
    pytest.importorskip("SimpleITK")
    header = "NRRD0004\ntype: short\ndimension: 3\nspace dimension: 3\nsizes: 8 7 6\nencoding: raw\nendian: little\n"
    header += 'space directions: (1,0,0) (0,1,0) (0,0,1)\nspace units: "um" "um" "um"\n\n'
    (tmp_path / "a.nrrd").write_bytes(header.encode() + DATA.tobytes())
    assert about(read_volume(tmp_path / "a.nrrd").to_volume()) == ("um", False)
    mixed = header.replace('"um" "um" "um"', '"mm" "mm" "um"')
    (tmp_path / "b.nrrd").write_bytes(mixed.encode() + DATA.tobytes())
    with pytest.raises(ValueError, match=r"b\.nrrd.*expected one unit along all axes, got mm, mm, um"):
        read_volume(tmp_path / "b.nrrd")
    pytest.importorskip("pydicom")
    write_slices(tmp_path / "series", DATA)
    assert about(read_volume(tmp_path / "series").to_volume()) == ("mm", True)


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("name, unit", [("um", "um"), ("cm", "cm"), ("?", "mm")])
def test_units_of_metaimage(tmp_path, name, unit, binary):
    pytest.importorskip("SimpleITK")
    header = f"NDims = 3\nDimSize = 8 7 6\nElementType = MET_SHORT\nDistanceUnits = {name}\nBinaryData = {binary}\n"
    samples = DATA.tobytes() if binary else ("\n".join(map(str, DATA.ravel().tolist())) + "\n").encode()
    for orientation in ("AnatomicalOrientation = RAI\n", ""):
        content = f"ObjectType = Image\n{header}{orientation}ElementDataFile = LOCAL\n".encode()
        (tmp_path / "a.mha").write_bytes(content + samples)
        volume = read_volume(tmp_path / "a.mha").to_volume()
        assert about(volume) == (unit if orientation or name != "?" else "", bool(orientation))


def test_a_store_keeps_the_patient(tmp_path):
    pytest.importorskip("zarr")
    data = VolumeData(isospline.volumes.torus().values(40), patient=True)
    store = isospline.convert(data, tmp_path / "a.zarr")
    volume = isospline.open_volume(store)
    assert about(volume) == ("mm", True)
    assert about(pickle.loads(pickle.dumps(volume))) == ("mm", True)


@pytest.mark.parametrize("unit", ["", "µm", "cm", "Å", "parsec"])
def test_a_store_of_a_volume_without_a_patient_keeps_the_unit(tmp_path, unit):
    zarr = pytest.importorskip("zarr")
    data = VolumeData(isospline.volumes.torus().values(40), unit=unit)
    store = isospline.convert(data, tmp_path / "a.zarr")
    assert about(isospline.open_volume(store)) == (unit, False)
    assert about(isospline.open_volume(isospline.convert(store, tmp_path / "b.zarr", degree=3))) == (unit, False)
    axes = zarr.open_group(store, mode="r").attrs["ome"]["multiscales"][0]["axes"]
    names = {"µm": "micrometer", "cm": "centimeter", "Å": "angstrom", "parsec": "parsec"}
    assert [axis.get("unit") for axis in axes] == 3 * [names.get(unit)]


@pytest.mark.slow
@pytest.mark.parametrize("unit, area, volume", [("mm", "mm²", "mm³"), ("", "unit^2", "unit^3")])
@pytest.mark.parametrize("of_store", [False, True])
def test_tables_of_info_and_measure_have_the_unit(tmp_path, capsys, unit, area, volume, of_store):
    nibabel = pytest.importorskip("nibabel")
    samples, path = isospline.volumes.torus().values(20).astype(np.float32), tmp_path / "a.npy"
    np.save(path, samples)
    if unit:
        image = nibabel.Nifti1Image(samples.T, np.eye(4))
        image.header.set_xyzt_units(unit)
        path = tmp_path / "a.nii"
        nibabel.save(image, path)
    if of_store:
        pytest.importorskip("zarr")
        path = isospline.convert(path, tmp_path / "a.zarr")
    assert main(["info", str(path)]) == 0
    ends = [line.split()[-1] for line in capsys.readouterr().out.splitlines() if line.split()[:1] == ["spacing"]]
    assert ends == [unit or "1"]
    assert main(["info", str(path), "--json"]) == 0 and json.loads(capsys.readouterr().out)["unit"] == unit
    measure = ["measure", str(path), "-l", "0", "--quiet"]
    assert main(measure) == 0
    lines = capsys.readouterr().out.splitlines()
    ends = {line[:20].strip(): line.split()[-1] for line in lines}
    assert ends["enclosed volume"] == volume and ends["area"] == area and ends["mean curvature"] == (unit or "unit")
    assert f"volume, {volume}" in lines[-2] and f"area, {area}" in lines[-2] and f"box, {unit or 'unit'}" in lines[-2]
    assert main([*measure, "--json"]) == 0 and json.loads(capsys.readouterr().out)["unit"] == unit


def test_the_scale_bar_has_the_unit_of_the_volumes():
    field = isospline.volumes.torus()

    def surface(unit):
        return isospline.Isosurface(field.volume(24, unit=unit), field.level)

    def picture(*units, **options):
        scene = isospline.Scene([surface(unit) for unit in units])
        return isospline.render(scene, size=(160, 120), annotate=("scale_bar",), **options).color

    with_unit, without = picture("mm"), picture("")
    assert (with_unit != without).any()
    np.testing.assert_array_equal(with_unit, picture("", unit="mm"))
    np.testing.assert_array_equal(without, picture("mm", unit=""))
    np.testing.assert_array_equal(picture("mm", "mm"), picture("", "", unit="mm"))
    np.testing.assert_array_equal(picture("mm", "µm"), picture("", ""))
