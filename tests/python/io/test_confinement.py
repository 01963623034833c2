"""Files that refer to other files, read within a folder: nothing outside of it is read."""

import base64
import gc
import gzip
import json
import os
import warnings
import zipfile

import numpy as np
import pytest
from placed_images import write_slices

import isospline
from isospline import convert, open_volume, read_mesh, read_volume

pytest.importorskip("SimpleITK")
tifffile = pytest.importorskip("tifffile")
trimesh = pytest.importorskip("trimesh")

SHAPE = (3, 4, 5)
SAMPLES = np.arange(60, dtype="<i2").reshape(SHAPE)
METAIMAGE = "NDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\n{}ElementDataFile = {}\n"
NRRD = "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: {}\n{}: {}\n"


@pytest.fixture
def folders(tmp_path):
    """A folder for uploads, and one with secret samples: whole, in slices, compressed."""
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    for folder in (inside, outside):
        folder.mkdir()
    (outside / "s.raw").write_bytes(SAMPLES.tobytes())
    (outside / "s.raw.gz").write_bytes(gzip.compress(SAMPLES.tobytes()))
    for number, samples in enumerate(SAMPLES):
        (outside / f"s{number}.raw").write_bytes(samples.tobytes())
    for name in os.listdir(outside):
        (inside / f"link_{name}").symlink_to(outside / name)
    return inside, outside


def references(outside):
    """Names of the secret file: absolute, upwards, by a link, and by a folder that does not exist."""
    return [f"{outside}/", "../outside/", "link_", "../inside/../outside/", f"/proc/self/root{outside}/"]


def check_refused(read, path, within, message="expected files of samples within"):
    """The file can be read, but not within the folder."""
    read(path)
    with pytest.raises(ValueError, match=f"{path.name}: cannot be read as .*{message} {within}"):
        read(path, within=within)


@pytest.mark.parametrize("number", range(5))
def test_samples_of_metaimage_and_nrrd(folders, number):
    inside, outside = folders
    to = references(outside)[number]
    slices = "\n".join(f"{to}s{number}.raw" for number in range(3))
    headers = {
        "a.mhd": METAIMAGE.format("", f"{to}s.raw"),
        "list.mhd": METAIMAGE.format("", f"LIST\n{slices}"),
        "pattern.mhd": METAIMAGE.format("", f"{to}s%d.raw 0 2 1"),
        "packed.mhd": METAIMAGE.format("CompressedData = True\n", f"{to}s.raw.gz"),
        "a.mha": METAIMAGE.format("", f"{to}s.raw"),
        "a.nhdr": NRRD.format("raw", "data file", f"{to}s.raw"),
        "a.nrrd": NRRD.format("raw", "datafile", f"{to}s.raw"),
        "list.nhdr": NRRD.format("raw", "data file", f"LIST\n{slices}"),
        "pattern.nhdr": NRRD.format("raw", "data file", f"{to}s%d.raw 0 2 1"),
        "packed.nhdr": NRRD.format("gzip", "datafile", f"{to}s.raw.gz"),
    }
    for name, header in headers.items():
        (inside / name).write_text(header, encoding="utf-8")
        np.testing.assert_array_equal(read_volume(inside / name).data, SAMPLES)
        check_refused(read_volume, inside / name, inside)


def test_samples_as_text(folders):
    inside, outside = folders
    (outside / "text").write_text(" ".join(map(str, SAMPLES.ravel())), encoding="utf-8")
    (inside / "a.nhdr").write_text(NRRD.format("ascii", "data file", "../outside/text"), encoding="utf-8")
    (inside / "hex.nhdr").write_text(NRRD.format("hex", "data file", "../outside/hex"), encoding="utf-8")
    (outside / "hex").write_text(SAMPLES.tobytes().hex(), encoding="utf-8")
    for name in ("a.nhdr", "hex.nhdr"):
        check_refused(read_volume, inside / name, inside)


def test_missing_files_outside_are_refused_in_the_same_words(folders):
    inside, outside = folders
    (inside / "a.mhd").write_text(METAIMAGE.format("", f"{outside}/missing"), encoding="utf-8")
    with pytest.raises(ValueError, match="expected files of samples within"):
        read_volume(inside / "a.mhd", within=inside)


@pytest.mark.parametrize("within", [True, False])
def test_errors_of_missing_samples_name_the_header(folders, within):
    inside, _ = folders
    (inside / "a.mhd").write_text(METAIMAGE.format("", "missing.raw"), encoding="utf-8")
    (inside / "a.nhdr").write_text(NRRD.format("raw", "data file", "missing.raw"), encoding="utf-8")
    for name in ("a.mhd", "a.nhdr"):
        with pytest.raises(FileNotFoundError, match=rf"for a file that {name} names: '.*missing\.raw'"):
            read_volume(inside / name, within=inside if within else None)


def test_references_inside_are_read(folders):
    inside, _ = folders
    (inside / "deep").mkdir()
    (inside / "deep" / "s.raw").write_bytes(SAMPLES.tobytes())
    (inside / "link").symlink_to("deep/s.raw")
    for name in ("deep/s.raw", str(inside / "deep" / "s.raw"), "deep/../deep/s.raw", "link"):
        (inside / "a.mhd").write_text(METAIMAGE.format("", name), encoding="utf-8")
        (inside / "a.nhdr").write_text(NRRD.format("raw", "data file", name), encoding="utf-8")
        for header in ("a.mhd", "a.nhdr"):
            np.testing.assert_array_equal(read_volume(inside / header, within=inside).data, SAMPLES)
            np.testing.assert_array_equal(read_volume(inside / header, within=f"{inside}/deep/..").data, SAMPLES)


def test_the_path_itself_is_within(folders):
    inside, outside = folders
    np.save(outside / "a.npy", SAMPLES)
    trimesh.creation.box().export(str(outside / "a.stl"))
    for name, read in (("a.npy", read_volume), ("a.stl", read_mesh)):
        (inside / name).symlink_to(outside / name)
        for path in (outside / name, inside / name, inside / ".." / "outside" / name):
            with pytest.raises(ValueError, match=f"expected a path within {inside}, got {path}"):
                read(path, within=inside)
        read(outside / name, within=outside)
    with pytest.raises(ValueError, match="expected a path within"):
        read_volume(outside, within=inside)
    # A folder whose name begins alike is another one.
    beside = inside.with_name("inside2")
    outside.rename(beside)
    with pytest.raises(ValueError, match="expected a path within"):
        read_volume(beside / "a.npy", within=inside)


def test_nifti_is_one_file(folders):
    inside, _ = folders
    nibabel = pytest.importorskip("nibabel")
    nibabel.save(nibabel.Nifti1Pair(SAMPLES.T, np.eye(4)), inside / "a.hdr")
    (inside / "a.hdr").rename(inside / "a.nii")
    for name in ("a.nii", "a.img"):
        with pytest.raises(ValueError, match=f"{name}: "):
            read_volume(inside / name, within=inside)


def test_entries_of_a_folder_of_dicom(folders):
    pytest.importorskip("pydicom")

    inside, outside = folders
    write_slices(outside / "series", SAMPLES)
    slices = sorted(os.listdir(outside / "series"))
    (inside / "series").mkdir()
    for name in slices:
        (inside / "series" / name).symlink_to(outside / "series" / name)
    check_refused(read_volume, inside / "series", inside, "expected files within")
    (inside / "whole").mkdir()
    for name in slices:
        (inside / "whole" / name).write_bytes((outside / "series" / name).read_bytes())
    expected = read_volume(outside / "series").data
    np.testing.assert_array_equal(read_volume(inside / "whole", within=inside).data, expected)
    # Every entry of a folder must be within, also one that is not read.
    (inside / "whole" / ".notes").symlink_to(outside / "series" / slices[0])
    with pytest.raises(ValueError, match="expected files within"):
        read_volume(inside / "whole", within=inside)


def test_a_directory_of_dicom_is_no_way_to_its_files(folders):
    pydicom = pytest.importorskip("pydicom")
    from pydicom.fileset import FileSet

    inside, outside = folders
    write_slices(outside / "series", SAMPLES)
    files = FileSet()
    for name in sorted(os.listdir(outside / "series")):
        dataset = pydicom.dcmread(outside / "series" / name)
        dataset.StudyDate, dataset.StudyTime, dataset.StudyID, dataset.PatientID = "20200101", "120000", "1", "1"
        dataset.PatientName, dataset.SeriesNumber = "A", 1
        files.add(dataset)
    files.write(outside / "set")
    del files
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pydicom leaves its temporary folder to the collector
        gc.collect()
    (inside / "DICOMDIR").write_bytes((outside / "set" / "DICOMDIR").read_bytes())
    for path in (inside, inside / "DICOMDIR"):
        with pytest.raises(ValueError, match="cannot be read as|expected"):
            read_volume(path, within=inside)


def test_slices_and_metadata_of_tiff(folders):
    inside, outside = folders
    for number, samples in enumerate(SAMPLES):
        tifffile.imwrite(outside / f"t{number}.tif", samples)
    (inside / "stack").mkdir()
    for number in range(3):
        (inside / "stack" / f"t{number}.tif").symlink_to(outside / f"t{number}.tif")
    check_refused(read_volume, inside / "stack", inside, "expected files within")

    pixels = (
        '<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06" UUID="urn:uuid:0"><Image ID="Image:0">'
        '<Pixels DimensionOrder="XYZCT" Type="int16" SizeX="5" SizeY="4" SizeZ="2" SizeC="1" SizeT="1">'
        '<TiffData IFD="0" FirstZ="0" PlaneCount="1"><UUID FileName="a.ome.tif">urn:uuid:0</UUID></TiffData>'
        '<TiffData IFD="0" FirstZ="1" PlaneCount="1"><UUID FileName="{}">urn:uuid:1</UUID></TiffData>'
        "</Pixels></Image></OME>"
    )
    for name in (f"{outside}/t1.tif", "../outside/t1.tif"):
        tifffile.imwrite(inside / "a.ome.tif", SAMPLES[0], description=pixels.format(name), metadata=None)
        assert read_volume(inside / "a.ome.tif").data[1].max() == SAMPLES[1].max()
        check_refused(read_volume, inside / "a.ome.tif", inside, "expected files within")
    (inside / "t1.tif").write_bytes((outside / "t1.tif").read_bytes())
    tifffile.imwrite(inside / "a.ome.tif", SAMPLES[0], description=pixels.format("t1.tif"), metadata=None)
    np.testing.assert_array_equal(read_volume(inside / "a.ome.tif", within=inside).data, SAMPLES[:2])


# Meshes


def write_gltf(path, uri):
    """A triangle whose positions are in a buffer of its own."""
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12}],
        "buffers": [{"byteLength": 48, "uri": uri}],
    }
    path.write_text(json.dumps(tree), encoding="utf-8")


BUFFER = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], "<f4").tobytes() + np.arange(3, dtype="<u4").tobytes()


def test_buffers_of_gltf(folders):
    inside, outside = folders
    (outside / "b.bin").write_bytes(BUFFER)
    (inside / "link.bin").symlink_to(outside / "b.bin")
    for uri in (f"{outside}/b.bin", "../outside/b.bin", "link.bin", "../outside/missing"):
        write_gltf(inside / "a.gltf", uri)
        with pytest.raises(ValueError, match=r"a\.gltf: cannot be read as a mesh: expected files of a mesh within"):
            read_mesh(inside / "a.gltf", within=inside)
    for uri in (f"file://{outside}/b.bin", "http://127.0.0.1:1/b.bin"):
        write_gltf(inside / "a.gltf", uri)
        with pytest.raises(ValueError, match=f"expected the name of a file, got {uri}"):
            read_mesh(inside / "a.gltf", within=inside)
    (inside / "b.bin").write_bytes(BUFFER)
    for uri in ("b.bin", "data:application/octet-stream;base64," + base64.b64encode(BUFFER).decode()):
        write_gltf(inside / "a.gltf", uri)
        assert len(read_mesh(inside / "a.gltf", within=inside).faces) == 1


def test_materials_of_obj_and_textures_of_ply_are_not_opened(folders):
    inside, outside = folders
    os.mkfifo(outside / "pipe")
    triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n"
    (inside / "a.obj").write_text(f"mtllib {outside}/pipe\n{triangle}", encoding="utf-8")
    (inside / "a.ply").write_text(
        f"ply\nformat ascii 1.0\ncomment TextureFile {outside}/pipe\nelement vertex 3\nproperty float x\n"
        "property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        encoding="utf-8",
    )
    for name in ("a.obj", "a.ply"):
        for within in (None, inside):
            assert len(read_mesh(inside / name, within=within).faces) == 1


def test_includes_of_abaqus(folders):
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("pyvista")
    inside, outside = folders
    triangle = meshio.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [("triangle", [(0, 1, 2)])])
    triangle.write(outside / "t.inp")
    triangle.write(inside / "t.inp")
    (inside / "link.inp").write_text("*INCLUDE, INPUT=deep.inp\n", encoding="utf-8")
    (inside / "deep.inp").symlink_to(outside / "t.inp")
    for name in (f"{outside}/t.inp", "../outside/t.inp", "link.inp"):
        (inside / "a.inp").write_text(f" *Include, INPUT={name}\n", encoding="utf-8")
        with pytest.raises(ValueError, match=r"a\.inp: cannot be read as a mesh: expected included files within"):
            read_mesh(inside / "a.inp", within=inside)
    assert len(read_mesh(inside / "t.inp", within=inside).faces) == 1
    (inside / "a.inp").write_text("*INCLUDE, INPUT=a.inp\n", encoding="utf-8")
    with pytest.raises(ValueError, match="does not include itself"):
        read_mesh(inside / "a.inp", within=inside)


def test_entities_in_xml_of_meshes(folders):
    inside, outside = folders
    (outside / "secret").write_text("0 0 0", encoding="utf-8")
    evil = f'<!DOCTYPE x [<!ENTITY e SYSTEM "file://{outside}/secret">]><COLLADA>&e;</COLLADA>'
    for encoding in ("utf-8", "utf-16"):
        text = f'<?xml version="1.0" encoding="{encoding}"?>{evil}'.encode(encoding)
        (inside / "a.dae").write_bytes(text)
        with zipfile.ZipFile(inside / "a.3mf", "w") as archive:
            archive.writestr("3D/3dmodel.model", text)
        for name in ("a.dae", "a.3mf"):
            with pytest.raises(ValueError, match="without a document type declaration"):
                read_mesh(inside / name, within=inside)


@pytest.mark.parametrize("suffix", [".xdmf", ".med", ".cgns", ".e", ".h5m", ".hmf", ".xml", ".ele", ".node"])
def test_formats_of_several_files_are_refused(folders, suffix):
    pytest.importorskip("meshio")
    inside, _ = folders
    (inside / f"a{suffix}").write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(ValueError, match="expected a format that cannot refer to files outside"):
        read_mesh(inside / f"a{suffix}", within=inside)


@pytest.mark.parametrize("suffix", [".pvti", ".pvtu", ".pvtp", ".vtm", ".pvd", ".pvtk"])
def test_files_that_list_pieces_are_no_volumes_or_meshes(folders, suffix):
    pytest.importorskip("meshio")
    inside, _ = folders
    (inside / f"a{suffix}").write_text('<VTKFile><Piece Source="/etc/passwd"/></VTKFile>', encoding="utf-8")
    for read in (read_volume, read_mesh):
        with pytest.raises(ValueError, match="expected a name that ends in"):
            read(inside / f"a{suffix}", within=inside)


# Stores


def test_links_of_stores(folders):
    pytest.importorskip("zarr")
    inside, outside = folders
    samples = isospline.volumes.torus().values(40)
    convert(samples, outside / "s.zarr")
    convert(samples, inside / "s.zarr")
    assert open_volume(inside / "s.zarr", within=inside).shape == (40, 40, 40)
    (inside / "link.zarr").symlink_to(outside / "s.zarr")
    for path in (outside / "s.zarr", inside / "link.zarr"):
        with pytest.raises(ValueError, match="expected a path within"):
            open_volume(path, within=inside)
    chunk = next(path for path in (inside / "s.zarr" / "0").rglob("*") if path.name == "0" and path.is_file())
    chunk.unlink()
    chunk.symlink_to(outside / "s.zarr" / chunk.relative_to(inside / "s.zarr"))
    with pytest.raises(ValueError, match="expected no link that leaves the store"):
        open_volume(inside / "s.zarr", within=inside)
