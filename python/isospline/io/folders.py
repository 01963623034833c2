"""Which files of a folder are the slices of a volume."""

from __future__ import annotations

from pathlib import Path

from ..base.parameters import printable
from . import dicom, tiff


def tiff_slices(folder: Path) -> list[Path]:
    """The TIFF slices of a folder; none if it holds DICOM. Beside DICOM, one TIFF file is a stray picture."""
    slices = tiff.slices_of(folder)
    others = [file for file in dicom.slices_of(folder) if file not in slices] if slices else []
    if others and len(slices) > 1:
        dicoms = f"{printable(others[0].name)} and {len(others) - 1} more"
        tiffs = f"{printable(slices[0].name)} and {len(slices) - 1} more"
        raise ValueError(
            f"{printable(folder)}: expected a DICOM series or TIFF slices, got both: DICOM, {dicoms}, and TIFF, {tiffs}"
        )
    return [] if others else slices
