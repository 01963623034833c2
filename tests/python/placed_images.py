"""Images and files that other libraries place in the world: any direction, different spacings, an origin."""

import numpy as np
import pytest

SHAPE = (5, 6, 7)  # z, y, x


def rotation(x, y, z):
    matrix = np.eye(3)
    for axis, angle in enumerate((x, y, z)):
        turn = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[[i, j, i, j], [i, j, j, i]] = np.cos(angle), np.cos(angle), -np.sin(angle), np.sin(angle)
        matrix = turn @ matrix
    return matrix


STRAIGHT = np.eye(3)
DIRECTIONS = {
    "straight": STRAIGHT,
    "oblique": rotation(0.3, -0.5, 1.1),
    "mirrored": np.diag([-1.0, 1.0, -1.0]) @ np.diag([1.0, 1.0, -1.0]),
    "oblique and mirrored": rotation(-0.2, 0.4, 0.9) @ np.diag([1.0, -1.0, 1.0]),
    "permuted": np.eye(3)[[1, 2, 0]],
}
SPACING, ORIGIN = (0.5, 0.75, 2.5), (-10.0, 20.5, 3.25)

directions = pytest.mark.parametrize("direction", list(DIRECTIONS.values()), ids=list(DIRECTIONS))


def itk_image(data, direction=STRAIGHT):
    SimpleITK = pytest.importorskip("SimpleITK")
    image = SimpleITK.GetImageFromArray(data)
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirection(direction.ravel().tolist())
    return image


def write_slices(folder, data, direction=STRAIGHT, uid="1.2.3.4", step=None, order=None, skip=()):
    """A CT series of data[z, y, x] by pydicom, HU = 2 stored - 1000; returns the position of each slice."""
    pydicom = pytest.importorskip("pydicom")
    folder.mkdir(exist_ok=True)
    step = direction[:, 2] * SPACING[2] if step is None else np.asarray(step)
    positions = np.array(ORIGIN) + np.arange(len(data))[:, None] * step
    for index in range(len(data)) if order is None else order:
        if index in skip:
            continue
        meta = pydicom.dataset.FileMetaDataset()
        meta.MediaStorageSOPClassUID = pydicom.uid.CTImageStorage
        meta.MediaStorageSOPInstanceUID = f"{uid}.{index + 1}"
        meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        dataset = pydicom.dataset.FileDataset(None, {}, file_meta=meta, preamble=b"\0" * 128)
        dataset.SOPClassUID, dataset.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        dataset.Modality, dataset.SeriesInstanceUID, dataset.StudyInstanceUID = "CT", uid, "1.2.3"
        dataset.InstanceNumber = 100 - index
        dataset.Rows, dataset.Columns = data.shape[1:]
        dataset.SamplesPerPixel, dataset.PhotometricInterpretation = 1, "MONOCHROME2"
        dataset.BitsAllocated, dataset.BitsStored, dataset.HighBit, dataset.PixelRepresentation = 16, 16, 15, 0
        dataset.RescaleSlope, dataset.RescaleIntercept = "2", "-1000"
        dataset.PixelSpacing = [str(SPACING[1]), str(SPACING[0])]
        dataset.SliceThickness = "9"  # not the distance of slices
        dataset.ImagePositionPatient = [f"{value:.8f}" for value in positions[index]]
        dataset.ImageOrientationPatient = [f"{value:.10f}" for value in direction[:, :2].T.ravel()]
        dataset.PixelData = data[index].astype("<u2").tobytes()
        # Names in an order that is not that of the positions.
        dataset.save_as(folder / f"{(index * 7) % 11:02}-{uid}", enforce_file_format=True)
    return positions


def vtk_image(data, direction=STRAIGHT, extent=None, cells=False):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData

    image = vtkImageData()
    size = np.array(data.shape[::-1]) + (1 if cells else 0)
    image.SetExtent(*(np.stack([np.zeros(3, int), size - 1], axis=1).ravel() if extent is None else extent))
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirectionMatrix(*direction.ravel())
    array = numpy_to_vtk(data.ravel(), deep=True)
    array.SetName("density")
    (image.GetCellData() if cells else image.GetPointData()).SetScalars(array)
    return image
