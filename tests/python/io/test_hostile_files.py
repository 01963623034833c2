"""Damaged files, and paths that are not files: either an error that names them, or their contents."""

import base64
import os
import shutil
import socket
import stat
import subprocess
import sys

import numpy as np
import pytest

import isospline
from isospline import read_mesh, read_volume
from isospline.io import isolated

meshio = pytest.importorskip("meshio")
nibabel = pytest.importorskip("nibabel")
nrrd = pytest.importorskip("nrrd")
pyvista = pytest.importorskip("pyvista")
SimpleITK = pytest.importorskip("SimpleITK")
tifffile = pytest.importorskip("tifffile")
trimesh = pytest.importorskip("trimesh")

from placed_images import write_slices


@pytest.fixture
def data(rng):
    return rng.integers(0, 90, (8, 9, 10)).astype(np.int16)


@pytest.fixture
def short_limit(monkeypatch):
    """Less time for readers that search without end."""
    monkeypatch.setattr(isolated, "SECONDS", 2.0)


def write_packed(folder, data):
    """Files whose samples have a checksum, by name."""
    image = SimpleITK.GetImageFromArray(data)
    for name in ("a.mha", "a.mhd", "a.nrrd", "b.nhdr"):
        SimpleITK.WriteImage(image, folder / name, True)
    nibabel.save(nibabel.Nifti1Image(data.T, np.eye(4)), folder / "a.nii.gz")
    nrrd.write(str(folder / "bz.nrrd"), data.T, {"encoding": "bzip2"})
    detached = {"a.mhd": "a.zraw", "b.nhdr": "b.raw.gz"}
    names = ("a.mha", "a.mhd", "a.nrrd", "b.nhdr", "a.nii.gz", "bz.nrrd")
    return {folder / name: folder / detached.get(name, name) for name in names}


def test_a_flipped_bit_in_compressed_samples_is_an_error(tmp_path, data):
    for path, packed in write_packed(tmp_path, data).items():
        np.testing.assert_array_equal(read_volume(path).data, data)
        content = packed.read_bytes()
        for at in range(len(content) // 2, len(content) - 1, 97):
            changed = bytearray(content)
            changed[at] ^= 4
            packed.write_bytes(changed)
            try:
                np.testing.assert_array_equal(read_volume(path).data, data)
            except ValueError as error:
                assert str(error).startswith(f"{path}: cannot be read as ")
        packed.write_bytes(content)


def test_samples_may_be_in_several_files(tmp_path, data):
    for number, slice_ in enumerate(data):
        (tmp_path / f"s{number:02d}.raw").write_bytes(slice_.astype("<i2").tobytes())
    header = "NRRD0004\ntype: short\ndimension: 3\nsizes: 10 9 8\nencoding: raw\nendian: little\ndata file: "
    (tmp_path / "a.nhdr").write_text(header + "s%02d.raw 0 7 1\n", encoding="utf-8")
    names = "".join(f"s{number:02d}.raw\n" for number in range(8))
    (tmp_path / "b.nhdr").write_text(header + "LIST\n" + names, encoding="utf-8")
    header = "ObjectType = Image\nNDims = 3\nDimSize = 10 9 8\nElementType = MET_SHORT\nElementDataFile = "
    (tmp_path / "a.mhd").write_text(header + "s%02d.raw 0 7 1\n", encoding="utf-8")
    (tmp_path / "b.mhd").write_text(header + "LIST\n" + names, encoding="utf-8")
    for name in ("a.nhdr", "b.nhdr", "a.mhd", "b.mhd"):
        np.testing.assert_array_equal(read_volume(tmp_path / name).data, data)


@pytest.mark.parametrize("skips", [(0, 0), (2, 0), (0, 5), (2, 5), (0, -1)])
def test_lines_and_bytes_before_samples_are_left_out(tmp_path, data, skips):
    lines, skipped = skips
    (tmp_path / "a.raw").write_bytes(b"one\n" * lines + b"x" * max(skipped, 3 if skipped else 0) + data.tobytes())
    (tmp_path / "a.nhdr").write_text(
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 10 9 8\nencoding: raw\nendian: little\n"
        f"line skip: {lines}\nbyte skip: {skipped}\ndata file: a.raw\n",
        encoding="utf-8",
    )
    np.testing.assert_array_equal(read_volume(tmp_path / "a.nhdr").data, data)


def test_big_endian_samples_of_metaimage(tmp_path, data):
    header = "ObjectType = Image\nNDims = 3\nDimSize = 10 9 8\nElementType = MET_SHORT\n"
    header += "BinaryDataByteOrderMSB = True\nHeaderSize = -1\nElementDataFile = a.raw\n"
    (tmp_path / "a.mhd").write_text(header, encoding="utf-8")
    (tmp_path / "a.raw").write_bytes(b"before" + data.astype(">i2").tobytes())
    np.testing.assert_array_equal(read_volume(tmp_path / "a.mhd").data, data)


HEADERS = {
    "dims.mha": (
        "ObjectType = Image\nNDims = 2147483647\nDimSize = 8 7 6\nElementType = MET_SHORT\nElementDataFile = LOCAL\n",
        "NDims from 1 to 10",
    ),
    "twice.mha": (
        "NDims = 3\nNDims = 9\nDimSize = 8 7 6\nElementType = MET_SHORT\nElementDataFile = LOCAL\n",
        "NDims once",
    ),
    "matrix.mha": (
        "NDims = 3\nTransformMatrix = 1 0\nDimSize = 8 7 6\nElementType = MET_SHORT\nElementDataFile = LOCAL\n",
        "TransformMatrix of 9 numbers",
    ),
    "line.mha": ("NDims = 3\nComment = " + "a" * 5000 + "\n", "lines of at most 4000 bytes"),
    "line.nhdr": ("NRRD0004\ntype: short\nsizes: " + "a" * 5000 + "\n", "lines of at most 1000"),
    "dimension.nrrd": ("NRRD0004\ntype: short\ndimension: 1000\nsizes: 1\nencoding: raw\n\n", "dimension from 1 to 16"),
    "axes.nrrd": (  # 16 axes end SimpleITK's process
        "NRRD0004\ntype: uint8\ndimension: 16\nsizes:" + 16 * " 2" + "\nencoding: raw\n\n" + "A" * 2**16,
        "(the reader crashed|expected)",
    ),
    "sizes.nrrd": ("NRRD0004\ntype: short\ndimension: 3\nsizes: 8 7 -6\nencoding: raw\n\n", "sizes of 3 whole numbers"),
}


@pytest.mark.parametrize("name", HEADERS)
def test_headers_that_would_lead_a_reader_astray_are_refused(tmp_path, name):
    header, message = HEADERS[name]
    (tmp_path / name).write_bytes(header.encode() + bytes(1000))
    with pytest.raises(ValueError, match=f"{name}: cannot be read as .*{message}"):
        read_volume(tmp_path / name)


def test_tiff_that_counts_more_tags_than_it_holds_is_refused(tmp_path):
    (tmp_path / "a.tif").write_bytes(b"II+\0\x08\0\0\0" + b"\x10" + bytes(7) + b"\0\0\0\x40" + bytes(68))
    with pytest.raises(ValueError, match="expected 1073741824 tags within the file"):
        read_volume(tmp_path / "a.tif")


def test_bad_offset_of_nifti_names_the_file(tmp_path, data):
    path = tmp_path / "a.nii"
    nibabel.save(nibabel.Nifti1Image(data.T, np.eye(4)), path)
    content = bytearray(path.read_bytes())
    for offset in (-1000.0, -1.0, 1e9, 3e38, np.inf, np.nan):
        content[108:112] = np.float32(offset).tobytes()
        path.write_bytes(content)
        with pytest.raises((ValueError, MemoryError), match=r"a\.nii: "):
            read_volume(path)


# DICOM


def test_a_broken_slice_is_named(tmp_path, data):
    write_slices(tmp_path / "whole", data)
    names = sorted(os.listdir(tmp_path / "whole"))
    assert read_volume(tmp_path / "whole").data.shape == data.shape
    for size in (0, 100, 300, -20):
        shutil.copytree(tmp_path / "whole", tmp_path / "damaged")
        broken = tmp_path / "damaged" / names[-1]
        broken.write_bytes(broken.read_bytes()[:size])
        with pytest.raises(ValueError, match=names[-1]):
            read_volume(tmp_path / "damaged")
        shutil.rmtree(tmp_path / "damaged")


def test_an_unreadable_slice_is_named(tmp_path, data):
    write_slices(tmp_path / "series", data)
    slices = sorted((tmp_path / "series").iterdir())
    target = slices[2].rename(tmp_path / "elsewhere")
    slices[2].symlink_to(tmp_path / "nowhere")
    with pytest.raises(FileNotFoundError, match=slices[2].name):
        read_volume(tmp_path / "series")
    slices[2].unlink()
    os.mkfifo(slices[2])
    with pytest.raises(ValueError, match=f"{slices[2].name}: expected a file, got a pipe"):
        read_volume(tmp_path / "series")
    slices[2].unlink()
    target.rename(slices[2])
    (tmp_path / "series" / "notes.txt").write_text("no slice", encoding="utf-8")
    assert read_volume(tmp_path / "series").data.shape == data.shape


@pytest.mark.parametrize("kind", [b"UN", b"OB"])
def test_lengths_beyond_a_dicom_file_are_refused(tmp_path, data, kind):
    write_slices(tmp_path / "series", data[:1])
    path = next((tmp_path / "series").iterdir())
    content = path.read_bytes()
    at = content.index(b"\x20\x00\x0d\x00UI")
    path.write_bytes(content[: at + 4] + kind + b"\0\0\xff\xff\xff\x7f" + content[at + 12 :])
    with pytest.raises(ValueError, match=r"element \(0020,000D\)"):
        read_volume(path)


# Paths


@pytest.mark.parametrize("suffix", ["nii", "npy", "tif"])
def test_paths_that_are_not_utf8_are_read(tmp_path, data, suffix):
    plain = tmp_path / f"plain.{suffix}"
    if suffix == "nii":
        nibabel.save(nibabel.Nifti1Image(data.T, np.eye(4)), plain)
    elif suffix == "npy":
        np.save(plain, data)
    else:
        tifffile.imwrite(plain, data)
    path = plain.rename(os.fsdecode(os.fsencode(tmp_path) + b"/n\xe9." + suffix.encode()))
    np.testing.assert_array_equal(read_volume(path).data, data)


@pytest.mark.slow
def test_paths_that_are_not_utf8_do_not_abort(tmp_path):
    """In one process, which would end at the first path with which a library aborts it."""
    folder = os.fsencode(tmp_path)
    suffixes = {"read_volume": ["mha", "mhd", "nrrd", "dcm", "vti"], "read_mesh": ["stl", "vtp", "msh"]}
    script = "import os, sys, isospline\n"
    for read, names in suffixes.items():
        for path in (folder + b"/n\xe9." + name.encode() for name in names):
            with open(path, "wb") as file:
                file.write(b"something else")
            script += f"try: isospline.{read}(os.fsdecode({path!r}))\n"
            script += "except ValueError as error: print(ascii(str(error)))\n"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, encoding="utf-8", timeout=300)
    assert (run.returncode, run.stderr) == (0, "")
    lines = run.stdout.splitlines()
    assert len(lines) == 8 and all("\\\\xe9" in line or "\\\\udce9" in line for line in lines), lines


def test_dicom_needs_no_path_in_utf8(tmp_path, data):
    folder = os.fsencode(tmp_path) + b"/d\xe9"
    write_slices(tmp_path / "series", data)
    expected = read_volume(tmp_path / "series").data
    first = min(os.listdir(tmp_path / "series"))
    os.rename(tmp_path / "series" / first, os.fsencode(tmp_path / "series") + b"/s\xe9.dcm")
    os.rename(tmp_path / "series", folder)
    np.testing.assert_array_equal(read_volume(os.fsdecode(folder)).data, expected)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".mha", ".dcm", ".tif", ".vtk", ".npy", ".raw", ""])
def test_what_is_no_file_is_no_volume(tmp_path, suffix):
    path = tmp_path / f"pipe{suffix}"
    os.mkfifo(path)
    with pytest.raises(ValueError, match=f"{path}: expected a file, got a pipe"):
        read_volume(path)
    link = tmp_path / f"device{suffix}"
    link.symlink_to("/dev/zero")
    with pytest.raises(ValueError, match="expected a file, got a device"):
        read_volume(link)


def test_what_is_no_file_is_no_mesh(tmp_path):
    for suffix in (".stl", ".ply", ".vtk", ".msh", ".obj"):
        os.mkfifo(tmp_path / f"pipe{suffix}")
        with pytest.raises(ValueError, match="expected a file, got a pipe"):
            read_mesh(tmp_path / f"pipe{suffix}")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "s.stl"))
        with pytest.raises(ValueError, match="expected a file, got a socket"):
            read_mesh(tmp_path / "s.stl")
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(IsADirectoryError):
        read_mesh(tmp_path / "folder.stl")


@pytest.mark.parametrize("name", ["a.mhd", "a.nhdr"])
@pytest.mark.parametrize("target", ["pipe", "/dev/zero"])
def test_detached_samples_are_in_a_file(tmp_path, name, target):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "a.mhd").write_text(
        f"NDims = 3\nDimSize = 8 7 6\nElementType = MET_SHORT\nElementDataFile = {target}\n", encoding="utf-8"
    )
    (tmp_path / "a.nhdr").write_text(
        f"NRRD0004\ntype: short\ndimension: 3\nsizes: 8 7 6\nencoding: raw\nendian: little\ndata file: {target}\n",
        encoding="utf-8",
    )
    with pytest.raises(ValueError, match="expected a file, got a (pipe|device)"):
        read_volume(tmp_path / name)


@pytest.mark.parametrize("path", [None, 3, b"bytes.nii", ["a.nii"]])
def test_paths_are_text(path):
    for read in (read_volume, read_mesh):
        with pytest.raises(TypeError, match="path: expected a str or path-like"):
            read(path)


def test_null_characters_in_paths_are_refused():
    for read in (read_volume, read_mesh):
        with pytest.raises(ValueError, match="path: expected a name without null characters"):
            read("a\0b.nii")


# Meshes

POINTS = np.random.default_rng(1).random((8, 3))
VTK = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\nPOLYGONS 1 5\n"


@pytest.mark.parametrize("kind", ["triangle", "quad", "tetra"])
@pytest.mark.parametrize("wrong", [8, 10**9, 2**62, -1, -5])
def test_vertex_indices_out_of_range_are_refused(kind, wrong):
    count = {"triangle": 3, "quad": 4, "tetra": 4}[kind]
    cell = [*range(count - 1), wrong]
    message = f"mesh: expected vertex indices from 0 to 8 - 1, got {wrong}"
    with pytest.raises(ValueError, match=message):
        isospline.Mesh.from_meshio(meshio.Mesh(POINTS, [(kind, [cell])]))
    if kind == "tetra":
        grid = pyvista.UnstructuredGrid([count, *range(count)], [10], POINTS)
        grid.GetCells().GetConnectivityArray().SetValue(count - 1, wrong)
    else:
        grid = pyvista.PolyData(POINTS, faces=[count, *range(count)])
        grid.GetPolys().GetConnectivityArray().SetValue(count - 1, wrong)
    with pytest.raises(ValueError, match=message):
        isospline.Mesh.from_pyvista(grid)


def test_cells_with_too_few_vertices_are_refused():
    with pytest.raises(ValueError, match="expected 4 indices of a vtkTetra, got 3"):
        isospline.Mesh.from_pyvista(pyvista.UnstructuredGrid([3, 0, 1, 2], [10], POINTS))


@pytest.mark.parametrize(
    "cell", ["4 0 1 2 999999999", "4 0 1 2 -1", "3 0 1 2 3", "-4 0 1 2 3", "5 0 1 2 3", "2000000000 0 1 2 3"]
)
def test_bad_cells_in_vtk_files_are_refused(tmp_path, cell):
    (tmp_path / "a.vtk").write_text(VTK + cell + "\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"a\.vtk: cannot be read as a mesh"):
        read_mesh(tmp_path / "a.vtk")


@pytest.mark.parametrize(
    "suffix, options",
    [
        ("ply", {"encoding": "ascii"}),
        ("ply", {}),
        ("stl", {}),
        ("stl_ascii", {}),
        ("off", {}),
        ("glb", {}),
    ],
)
def test_truncated_meshes_are_refused(tmp_path, suffix, options):
    content = trimesh.creation.icosphere(1).export(file_type=suffix, **options)
    content = content.encode() if isinstance(content, str) else content
    path = tmp_path / f"a.{suffix[:3]}"
    path.write_bytes(content)
    assert len(read_mesh(path).faces) == 80
    for part in (0.2, 0.5, 0.7, 0.9, 0.98):
        path.write_bytes(content[: int(part * len(content))])
        with pytest.raises(ValueError, match=f"{path}: cannot be read as a mesh"):
            read_mesh(path)


@pytest.mark.parametrize("kind", ["gmsh", "gmsh22", "ansys"])
def test_truncated_msh_is_refused(tmp_path, kind):
    path = tmp_path / "a.msh"
    meshio.Mesh(POINTS, [("tetra", [[0, 1, 2, 3], [4, 5, 6, 7]])]).write(path, file_format=kind)
    content = path.read_bytes()
    assert len(read_mesh(path).faces) == 8
    for part in (0.3, 0.6, 0.9):
        path.write_bytes(content[: int(part * len(content))])
        with pytest.raises(ValueError, match=f"{path}: cannot be read as a mesh"):
            read_mesh(path)


@pytest.mark.sweep(1)
@pytest.mark.slow
@pytest.mark.parametrize("content", [b"(1", b"(0 ", b"(10 (0 1 8 0 3)\n(10 (1 1 8 1 3)(", b"(2 3"])
def test_ansys_reader_does_not_wait_for_an_end(tmp_path, content, short_limit):
    (tmp_path / "a.msh").write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.msh: cannot be read as a mesh"):
        read_mesh(tmp_path / "a.msh")


@pytest.mark.parametrize("count", ["999999999999999999", "-1", "x"])
def test_vtk_xml_that_counts_more_than_it_holds_is_refused(tmp_path, count):
    path = tmp_path / "a.vtp"
    pyvista.Sphere(theta_resolution=5, phi_resolution=5).save(path)
    content = path.read_bytes()
    at = content.index(b'NumberOfPoints="')
    end = content.index(b'"', at + 16)
    path.write_bytes(content[: at + 16] + count.encode() + content[end:])
    with pytest.raises(ValueError, match=r"a\.vtp: cannot be read as a mesh: "):
        read_mesh(path)


# Files that are written


@pytest.fixture(scope="module")
def image():
    camera = isospline.PerspectiveCamera((0, -1, 0), (0, 0, 0))
    return isospline.render(isospline.Scene(), camera, size=(16, 12), light="phong")


@pytest.fixture(params=["exr", "png", "mp4"])
def write(request, image):
    if request.param == "mp4":
        pytest.importorskip("imageio_ffmpeg")
        return lambda path: isospline.write_video(path, [image] * 2)
    return image.write


@pytest.fixture
def suffix(request, write):
    return request.node.callspec.params["write"]


def test_a_file_that_is_replaced_leaves_its_mode(tmp_path, write, suffix):
    path = tmp_path / f"a.{suffix}"
    write(path)
    fresh = stat.S_IMODE(path.stat().st_mode)
    (tmp_path / "plain").touch()
    assert fresh == stat.S_IMODE((tmp_path / "plain").stat().st_mode)
    for mode in (0o600, 0o640, 0o666, 0o755):
        path.chmod(mode)
        write(path)
        assert stat.S_IMODE(path.stat().st_mode) == mode
    assert os.listdir(tmp_path) == [path.name, "plain"] or sorted(os.listdir(tmp_path)) == [path.name, "plain"]


def test_symbolic_links_are_followed(tmp_path, write, suffix):
    (tmp_path / "there").mkdir()
    target = tmp_path / "there" / f"target.{suffix}"
    link, chain = tmp_path / f"link.{suffix}", tmp_path / f"chain.{suffix}"
    link.symlink_to(f"there/target.{suffix}")
    chain.symlink_to(link.name)
    for _ in range(2):  # of a target that is not there yet, and of one that is
        write(chain)
        assert chain.is_symlink() and link.is_symlink() and target.stat().st_size > 0
    assert os.listdir(tmp_path / "there") == [target.name]
    circle = tmp_path / f"circle.{suffix}"
    circle.symlink_to(circle.name)
    with pytest.raises(OSError, match="symbolic links"):
        write(circle)


def test_names_may_be_as_long_as_the_system_lets_them(tmp_path, write, suffix):
    write(tmp_path / ("n" * (251 - len(suffix) + 3) + f".{suffix}"))
    with pytest.raises(OSError, match="File name too long"):
        write(tmp_path / ("n" * 256 + f".{suffix}"))
    assert len(os.listdir(tmp_path)) == 1


def test_what_is_no_file_is_not_replaced(tmp_path, write, suffix):
    path = tmp_path / f"a.{suffix}"
    os.mkfifo(path)
    with pytest.raises(ValueError, match="path: expected the name of a file"):
        write(path)
    assert stat.S_ISFIFO(path.stat().st_mode)
    path.unlink()
    path.mkdir()
    with pytest.raises(IsADirectoryError):
        write(path)
    with pytest.raises(FileNotFoundError):
        write(tmp_path / "missing" / f"a.{suffix}")


def test_paths_of_outputs_may_be_any_bytes(tmp_path, write, suffix):
    name = os.fsdecode(b"n\xe9." + suffix.encode())
    write(str(tmp_path / name))
    assert os.listdir(tmp_path) == [name]
    with pytest.raises(OSError) as caught:
        write(str(tmp_path / os.fsdecode(b"missing\xe9") / name))
    assert caught.value.filename == str(tmp_path / os.fsdecode(b"missing\xe9") / name)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["exr", "png"])
def test_the_system_s_own_error_is_told(tmp_path, suffix):
    program = (
        "import resource, sys, isospline\n"
        "camera = isospline.PerspectiveCamera((0, -1, 0), (0, 0, 0))\n"
        "image = isospline.render(isospline.Scene(), camera, size=(64, 64))\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (50, 50))\n"
        "try: image.write(sys.argv[1])\n"
        "except OSError as error: print(error.filename, error.strerror)"
    )
    path = tmp_path / f"a.{suffix}"
    run = subprocess.run([sys.executable, "-c", program, path], capture_output=True, encoding="utf-8", check=True)
    assert run.stdout == f"{path} File too large\n"
    assert os.listdir(tmp_path) == []


def test_errors_of_the_images_are_not_taken_for_those_of_the_video(tmp_path):
    pytest.importorskip("imageio_ffmpeg")

    def images():
        with open(tmp_path / "missing", encoding="utf-8"):
            yield

    with pytest.raises(FileNotFoundError, match="missing"):
        isospline.write_video(tmp_path / "a.mp4", images())


@pytest.mark.slow
@pytest.mark.parametrize(
    "suffix, change",
    [
        ("vtp", (b'NumberOfComponents="3"', b'NumberOfComponents="-1"')),
        ("vtp", (b"AQAAAACAAA", b"aaaaaaaaaaaaaaaa")),
    ],
)
def test_vtk_xml_arrays_longer_than_the_file_are_refused(tmp_path, suffix, change, short_limit):
    path = tmp_path / f"a.{suffix}"
    pyvista.Sphere(theta_resolution=5, phi_resolution=5).save(path)
    content = path.read_bytes()
    assert change[0] in content
    path.write_bytes(content.replace(*change))
    with pytest.raises(ValueError, match=r"a\.vtp: cannot be read as a mesh: "):
        read_mesh(path)


@pytest.mark.parametrize("version", ["0", "nan", "inf", "3.0"])
def test_cells_of_another_version_of_vtk_files_are_refused(tmp_path, version):
    path = tmp_path / "a.vtk"
    pyvista.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid().save(path)
    content = path.read_bytes()
    assert content.startswith(b"# vtk DataFile Version 5.1")
    path.write_bytes(content.replace(b"5.1", version.encode(), 1))
    with pytest.raises(ValueError, match="version"):
        read_mesh(path)


@pytest.mark.parametrize("encoding", ["ascii", "txt", "hex", "raw"])
def test_nrrd_of_any_encoding_is_its_samples(tmp_path, encoding):
    data = np.arange(24, dtype="<i2").reshape(2, 3, 4) - 7
    header = f"NRRD0004\ntype: int16\ndimension: 3\nsizes: 4 3 2\nendian: little\nencoding: {encoding}\n\n".encode()
    content = {"hex": data.tobytes().hex(" ").encode(), "raw": data.tobytes()}.get(
        encoding, "\n".join(map(str, data.ravel())).encode()
    )
    path = tmp_path / "a.nrrd"
    path.write_bytes(header + content)
    np.testing.assert_array_equal(isospline.read_volume(path).data, data)
    path.write_bytes(header + content[:-3])
    with pytest.raises(ValueError, match=r"a\.nrrd: .*(truncated|damaged)"):
        isospline.read_volume(path)


def test_offsets_of_cells_beyond_a_file_are_refused(tmp_path):
    (tmp_path / "grid.vtu").write_text(
        '<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="1">'
        '<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray>'
        '</Points><Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray>'
        '<DataArray type="Int64" Name="offsets" format="ascii">2147483648</DataArray>'
        '<DataArray type="UInt8" Name="types" format="ascii">10</DataArray></Cells>'
        "</Piece></UnstructuredGrid></VTKFile>",
        encoding="utf-8",
    )
    with pytest.raises(ValueError, match=r"grid\.vtu: cannot be read as a mesh: "):
        isospline.read_mesh(tmp_path / "grid.vtu")
    whole = (tmp_path / "grid.vtu").read_text(encoding="utf-8").replace("2147483648", "4")
    (tmp_path / "grid.vtu").write_text(whole, encoding="utf-8")
    assert len(isospline.read_mesh(tmp_path / "grid.vtu").faces) == 4


def test_offsets_whose_differences_overflow_are_refused(tmp_path):
    offsets = np.array([0, 3, 0x38CD7B29AF590602, -0x666D4CCED552FF7F, 12], ">i8")
    content = b"# vtk DataFile Version 5.1\nt\nBINARY\nDATASET POLYDATA\nPOINTS 4 float\n" + bytes(48)
    content += b"\nPOLYGONS 5 12\nOFFSETS vtktypeint64\n" + offsets.tobytes()
    content += b"\nCONNECTIVITY vtktypeint64\n" + bytes(96) + b"\n"
    (tmp_path / "mesh.vtk").write_bytes(content)
    with pytest.raises(ValueError, match=r"mesh\.vtk: cannot be read as a mesh: "):
        isospline.read_mesh(tmp_path / "mesh.vtk")


def test_extents_and_blocks_that_do_not_agree_are_refused(tmp_path):
    image = (
        '<VTKFile type="ImageData" version="1.0" compressor="vtkZLibDataCompressor">'
        '<ImageData WholeExtent="0 1 0 1 0 1"><Piece Extent="{} 1 0 1 0 1"><PointData>'
        '<DataArray type="UInt8" format="binary">{}</DataArray></PointData></Piece></ImageData></VTKFile>'
    )
    header = base64.b64encode(np.array([0, 32768, 8], "<u4").tobytes()).decode()
    for first, text in ((-2147483648, ""), (-1, ""), (0, header)):
        (tmp_path / "a.vti").write_text(image.format(first, text), encoding="utf-8")
        with pytest.raises(ValueError, match=r"a\.vti: cannot be read as VTK XML: "):
            read_volume(tmp_path / "a.vti")


@pytest.mark.slow
def test_cells_of_no_type_and_data_that_never_come_are_refused(tmp_path, short_limit):
    grid = "# vtk DataFile Version 4.2\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
    (tmp_path / "grid.vtk").write_text(grid + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n715820698\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"grid\.vtk: cannot be read as a mesh: "):
        isospline.read_mesh(tmp_path / "grid.vtk")
    (tmp_path / "a.bdf").write_text("BEGIN BULK\n$ nothing\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"a\.bdf: cannot be read as a mesh: .*no end in"):
        isospline.read_mesh(tmp_path / "a.bdf")
