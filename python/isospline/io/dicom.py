"""DICOM, a series of slices or one file of several frames: by SimpleITK, which uses GDCM."""

from __future__ import annotations

import numpy as np

from . import itk

# Part of the distance of slices that a slice may be away from its place in an even series. Positions are stored as
# decimal text, often rounded to 1/100 mm.
TOLERANCE = 0.02


def read_file(path):
    """Read a single file: an enhanced one of several frames, or one slice."""
    with itk.quiet():
        reader = itk.open_header(path, "GDCMImageIO")
        itk.check_header(reader)
        return itk.to_volume_data(reader.Execute())


def read_folder(path, name=None):
    """Read the only series of a folder, or the one whose Series Instance UID is `name`."""
    import SimpleITK

    with itk.quiet():
        series = SimpleITK.ImageSeriesReader.GetGDCMSeriesIDs(str(path))
        if not series:
            raise ValueError("expected a folder that holds a DICOM series or TIFF slices, got one without any")
        if name is None and len(series) > 1:
            raise ValueError(f"expected one series, or its UID as name, got {len(series)}: {', '.join(series)}")
        if name is not None and name not in series:
            raise ValueError(f"expected name to be the UID of a series, {', '.join(series)}, got {name}")
        files = SimpleITK.ImageSeriesReader.GetGDCMSeriesFileNames(str(path), name or series[0])
        if len(files) == 1:
            return read_file(files[0])

        headers = [itk.open_header(file, "GDCMImageIO") for file in files]
        itk.check_header(headers[0], slices=len(files))
        step = _check_slices(headers)
        reader = SimpleITK.ImageSeriesReader()
        reader.SetImageIO("GDCMImageIO")
        reader.SetFileNames(files)
        volume = itk.to_volume_data(reader.Execute())

    # The third axis runs along the slices' positions, which a tilted gantry moves off their normal.
    first = headers[0]
    distance = float(np.linalg.norm(step))
    direction = np.reshape(first.GetDirection(), (3, 3)).copy()
    direction[:, 2] = step / distance
    return volume.replace(spacing=(*first.GetSpacing()[:2], distance), origin=first.GetOrigin(), direction=direction)


def _check_slices(headers):
    """Check that slices lie evenly along a line, and return the vector from one to the next."""
    first = headers[0]
    for header in headers[1:]:
        for what in ("Size", "Spacing", "Direction"):
            expected, got = getattr(first, f"Get{what}")(), getattr(header, f"Get{what}")()
            if what == "Spacing":
                expected, got = expected[:2], got[:2]
            if not np.allclose(expected, got, rtol=1e-4, atol=1e-4):
                raise ValueError(
                    f"expected slices of the same {what.lower()}, got {expected} in {first.GetFileName()} "
                    f"and {got} in {header.GetFileName()}"
                )

    positions = np.array([header.GetOrigin() for header in headers])
    step = (positions[-1] - positions[0]) / (len(positions) - 1)
    even = positions[0] + np.arange(len(positions))[:, None] * step
    off = np.linalg.norm(positions - even, axis=1)
    distance = np.linalg.norm(step)
    if not (off <= TOLERANCE * distance).all() or distance == 0:
        gaps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
        raise ValueError(
            f"expected evenly spaced slices, got distances from {gaps.min():g} to {gaps.max():g} "
            "(slices missing, or a time series?)"
        )
    return step
