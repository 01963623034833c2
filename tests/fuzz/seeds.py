"""Small valid files of every format, which the mutators change."""

import gzip
import struct
from dataclasses import dataclass, field
from pathlib import Path

import meshio
import nibabel
import nrrd
import numpy as np
import pydicom
import pyvista
import SimpleITK
import tifffile
import trimesh
from pydicom.dataset import Dataset, FileMetaDataset

import isospline

SHAPE = (6, 7, 8)  # z, y, x


@dataclass
class Seed:
    """A valid file or folder, and the file to change."""

    name: str
    changed: str
    read: object
    options: dict = field(default_factory=dict)
    #: First byte of the samples, if they have a checksum and extend to the end of the file.
    checked_from: int | None = None


def write_all(folder):
    """Write the files into a folder; returns a list of `Seed`."""
    folder = Path(folder)
    rng = np.random.default_rng(7)
    data = rng.integers(0, 60, SHAPE).astype(np.int16)
    seeds = [*_volumes(folder, data), *_meshes(folder)]
    for seed in seeds:
        seed.read(folder / seed.name, **seed.options)
    return seeds


def _volumes(folder, data):
    def volume(name, changed=None, checked_from=None, **options):
        return Seed(name, changed or name, isospline.read_volume, options, checked_from)

    # NIfTI.
    nifti = nibabel.Nifti1Image(data.T, np.diag([0.5, 0.6, 0.7, 1]))
    for name in ("a.nii", "b.nii.gz"):
        nibabel.save(nifti, folder / name)
    nibabel.save(nibabel.Nifti2Image(data.T, np.eye(4)), folder / "c.nii")
    yield volume("a.nii")
    yield volume("b.nii.gz", checked_from=10)
    yield volume("c.nii")
    # The same, changed before it is compressed.
    yield volume("inside.nii.gz", "inside.nii.gz")
    (folder / "inside.nii.gz").write_bytes(gzip.compress((folder / "a.nii").read_bytes(), mtime=0))

    # NRRD and MetaImage.
    image = SimpleITK.GetImageFromArray(data)
    image.SetSpacing((0.5, 0.6, 0.7))
    for name, packed in (
        ("a.nrrd", False),
        ("b.nrrd", True),
        ("a.nhdr", False),
        ("b.nhdr", True),
        ("a.mha", False),
        ("b.mha", True),
        ("a.mhd", False),
        ("b.mhd", True),
    ):
        SimpleITK.WriteImage(image, folder / name, packed)
    nrrd.write(str(folder / "ascii.nrrd"), data.T, {"encoding": "ascii"})
    nrrd.write(str(folder / "bz.nrrd"), data.T, {"encoding": "bzip2"})
    for name in ("a.nrrd", "a.nhdr", "a.mha", "a.mhd", "b.mhd", "b.nhdr", "ascii.nrrd"):
        yield volume(name)
    yield volume("a.nhdr", "a.raw")
    yield volume("b.mhd", "b.zraw", 0)
    yield volume("b.nhdr", "b.raw.gz", 10)
    for name, end in (("b.nrrd", b"\n\n"), ("bz.nrrd", b"\n\n"), ("b.mha", b"= LOCAL\n")):
        yield volume(name)
        header = (folder / name).read_bytes().index(end) + len(end)
        yield volume(name, checked_from=header + (0 if name == "b.mha" else 10))

    # DICOM.
    _write_dicom(folder / "series", data)
    middle = f"series/s{SHAPE[0] // 2}.dcm"
    yield volume("series", middle)
    yield volume(middle)
    _write_frames(folder / "frames.dcm", data)
    yield volume("frames.dcm")

    # TIFF.
    kinds = {
        "a": {},
        "big": {"bigtiff": True},
        "zlib": {"compression": "zlib"},
        "lzw": {"compression": "lzw"},
        "imagej": {"imagej": True, "metadata": {"axes": "ZYX"}},
        "ome": {"ome": True, "metadata": {"axes": "ZYX"}},
        "tiled": {"tile": (16, 16)},
    }
    for kind, options in kinds.items():
        tifffile.imwrite(folder / f"{kind}.tif", data, photometric="minisblack", **options)
        yield volume(f"{kind}.tif")
    (folder / "slices").mkdir(exist_ok=True)
    for number, slice_ in enumerate(data):
        tifffile.imwrite(folder / f"slices/{number}.tif", slice_)
    yield volume("slices", "slices/2.tif")

    # VTK.
    grid = pyvista.ImageData(dimensions=SHAPE[::-1], spacing=(0.5, 0.6, 0.7))
    grid["density"] = data.ravel()
    grid.save(folder / "binary.vtk", binary=True)
    grid.save(folder / "ascii.vtk", binary=False)
    grid.save(folder / "binary.vti", binary=True)
    grid.save(folder / "ascii.vti", binary=False)
    for name in ("binary.vtk", "ascii.vtk", "binary.vti", "ascii.vti"):
        yield volume(name)

    # Arrays.
    np.save(folder / "a.npy", data)
    data.tofile(folder / "a.raw16")
    yield volume("a.npy")
    yield volume("a.raw16", shape=SHAPE, dtype="<i2")


def _meshes(folder):
    def mesh(name, changed=None):
        return Seed(name, changed or name, isospline.read_mesh)

    ball = trimesh.creation.icosphere(1)
    for name, options in (
        ("binary.ply", {}),
        ("ascii.ply", {"encoding": "ascii"}),
        ("binary.stl", {}),
        ("a.obj", {}),
        ("a.off", {}),
        ("a.glb", {}),
    ):
        ball.export(str(folder / name), **options)
        yield mesh(name)
    ball.export(str(folder / "ascii.stl"), file_type="stl_ascii")
    yield mesh("ascii.stl")

    surface = pyvista.Sphere(theta_resolution=7, phi_resolution=7)
    grid = pyvista.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid()
    for name, data, binary in (
        ("mesh.vtk", surface, True),
        ("meshascii.vtk", surface, False),
        ("a.vtp", surface, True),
        ("ascii.vtp", surface, False),
        ("grid.vtk", grid, True),
        ("gridascii.vtk", grid, False),
        ("a.vtu", grid, True),
        ("ascii.vtu", grid, False),
    ):
        data.save(folder / name, binary=binary)
        yield mesh(name)
    _write_old_vtk(folder / "old.vtk", ball, b"ASCII")
    _write_old_vtk(folder / "oldbinary.vtk", ball, b"BINARY")
    yield mesh("old.vtk")
    yield mesh("oldbinary.vtk")

    points = np.random.default_rng(1).random((8, 3))
    cells = meshio.Mesh(points, [("tetra", [[0, 1, 2, 3], [4, 5, 6, 7]]), ("triangle", [[0, 1, 2], [1, 2, 3]])])
    for name, kind in (
        ("gmsh.msh", "gmsh"),
        ("gmsh22.msh", "gmsh22"),
        ("a.inp", "abaqus"),
        ("a.mesh", "medit"),
        ("a.bdf", "nastran"),
    ):
        mesh_of_kind = meshio.Mesh(points, cells.cells[:1]) if kind == "gmsh" else cells
        mesh_of_kind.write(folder / name, file_format=kind)
        yield mesh(name)
    meshio.Mesh(points, cells.cells[:1]).write(folder / "ansys.msh", file_format="ansys")
    yield mesh("ansys.msh")


def _write_dicom(folder, data):
    folder.mkdir(exist_ok=True)
    series, study, frame = (pydicom.uid.generate_uid(entropy_srcs=[name]) for name in ("series", "study", "frame"))
    for number, slice_ in enumerate(data):
        file = Dataset()
        file.file_meta = FileMetaDataset()
        file.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        file.file_meta.MediaStorageSOPClassUID = file.SOPClassUID = pydicom.uid.CTImageStorage
        uid = pydicom.uid.generate_uid(entropy_srcs=[str(number)])
        file.file_meta.MediaStorageSOPInstanceUID = file.SOPInstanceUID = uid
        file.SeriesInstanceUID, file.StudyInstanceUID, file.FrameOfReferenceUID = series, study, frame
        file.Modality, file.InstanceNumber = "CT", number + 1
        file.ImagePositionPatient, file.ImageOrientationPatient = [1, 2, 0.7 * number], [1, 0, 0, 0, 1, 0]
        file.PixelSpacing, file.SliceThickness = [0.6, 0.5], 0.7
        file.Rows, file.Columns, file.SamplesPerPixel = *slice_.shape, 1
        file.PhotometricInterpretation = "MONOCHROME2"
        file.BitsAllocated = file.BitsStored = 16
        file.HighBit, file.PixelRepresentation = 15, 1
        file.PixelData = slice_.tobytes()
        file.save_as(folder / f"s{number}.dcm", enforce_file_format=True)


def _write_frames(path, data):
    """A multi-frame file, with a place and a slope of each frame."""
    file = pydicom.dcmread(path.parent / "series" / "s0.dcm")
    file.NumberOfFrames, file.PixelData = len(data), data.tobytes()
    file.PerFrameFunctionalGroupsSequence = [Dataset() for _ in data]
    for number, group in enumerate(file.PerFrameFunctionalGroupsSequence):
        place, scaling = Dataset(), Dataset()
        place.ImagePositionPatient = [1, 2, 0.7 * number]
        scaling.RescaleSlope, scaling.RescaleIntercept = number + 1, 0
        group.PlanePositionSequence, group.PixelValueTransformationSequence = [place], [scaling]
    file.save_as(path, enforce_file_format=True)


def _write_old_vtk(path, mesh, kind):
    """Version 3, whose cells are lists of lengths and indices."""
    points, faces = mesh.vertices.astype(">f4"), np.insert(mesh.faces, 0, 3, axis=1).astype(">i4")
    head = b"# vtk DataFile Version 3.0\nold\n" + kind + b"\nDATASET POLYDATA\n"
    head += b"POINTS %d float\n" % len(points)
    middle = b"\nPOLYGONS %d %d\n" % (len(faces), faces.size)
    if kind == b"ASCII":
        text = [" ".join(map(str, array.ravel().tolist())).encode() for array in (points, faces)]
    else:
        text = [points.tobytes(), struct.pack(f">{faces.size}i", *faces.ravel().tolist())]
    path.write_bytes(head + text[0] + middle + text[1] + b"\n")
