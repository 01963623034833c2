"""Samples of DICOM frames, decoded by pydicom, and JPEG of any kind by imagecodecs. Runs in the reader's process."""

from __future__ import annotations

from typing import Any

import numpy as np

from .checks import check_samples, errors_name_slice, size_text
from .dicom_frames import read_dataset

_PIXELS = ("PixelData", "FloatPixelData", "DoubleFloatPixelData")


def read_samples(frames, dtype):
    """The samples of frames, [z, y, x]. Each file is read once."""
    columns, rows = frames[0].size
    shape = (len(frames), rows, columns)
    check_samples(shape, dtype)
    data = np.empty(shape, dtype)
    files: dict[str, dict[int, int]] = {}
    for z, frame in enumerate(frames):
        files.setdefault(frame.file, {})[frame.number] = z
    for file, slices in files.items():
        with errors_name_slice(file):
            for number, samples in enumerate(_stored_samples(file, len(slices))):
                z = slices[number]
                if samples.shape != shape[1:]:
                    raise ValueError(f"expected {size_text(shape[1:])} samples, got {size_text(samples.shape)}")
                data[z] = frames[z].scaled(_without_unused_bits(samples, frames[z]), dtype)
    return data


def _stored_samples(file, count):
    """The stored numbers of each frame of a file."""
    from pydicom.pixels.utils import iter_pixels, pixel_array

    dataset = read_dataset(file)
    if not any(name in dataset for name in _PIXELS):
        raise ValueError("expected pixels, got none: the file is truncated or damaged")
    decoded: Any
    decode = _codec(_transfer_syntax(dataset))
    if decode is not None:
        decoded = map(decode, _encoded_frames(dataset, count))
    elif dataset.BitsAllocated == 1:  # frames may begin within a byte, which iter_pixels does not know
        frames = pixel_array(dataset, raw=True, correct_unused_bits=False)
        decoded = iter(frames.reshape(-1, dataset.Rows, dataset.Columns))
    else:
        decoded = iter_pixels(dataset, raw=True, correct_unused_bits=False)
    for number in range(count):
        samples = next(decoded, None)
        if samples is None:
            raise ValueError(f"expected pixels of {count} frames, got {number}: the file is truncated or damaged")
        yield samples


def _codec(syntax):
    """The function that decodes a frame of a transfer syntax; None for those that pydicom decodes itself."""
    from pydicom import uid

    if syntax in uid.JPEGTransferSyntaxes:
        return _decode_jpeg
    if syntax in uid.JPEGLSTransferSyntaxes:
        import imagecodecs

        return imagecodecs.jpegls_decode
    if syntax in uid.JPEG2000TransferSyntaxes:
        import imagecodecs

        return imagecodecs.jpeg2k_decode
    return None


def _decode_jpeg(content):
    import imagecodecs

    # The decoder would fill up what is missing. No marker can occur within samples, and few bytes may follow the last.
    if b"\xff\xd9" not in content[-16:]:
        raise ValueError("expected the end of a JPEG image: the file is truncated or damaged")
    return imagecodecs.jpeg_decode(content)


def _encoded_frames(dataset, count):
    from pydicom.encaps import generate_frames

    tables = (dataset.get("ExtendedOffsetTable"), dataset.get("ExtendedOffsetTableLengths"))
    offsets = tables if all(tables) else None
    return generate_frames(dataset.PixelData, number_of_frames=count, extended_offsets=offsets)


def _transfer_syntax(dataset):
    """How the pixels are encoded; files without a header do not tell it and are uncompressed."""
    from pydicom import uid

    if "TransferSyntaxUID" not in dataset.file_meta:
        is_implicit, is_little = dataset.original_encoding
        explicit = uid.ExplicitVRLittleEndian if is_little else uid.ExplicitVRBigEndian
        dataset.file_meta.TransferSyntaxUID = uid.ImplicitVRLittleEndian if is_implicit else explicit
    return dataset.file_meta.TransferSyntaxUID


def _without_unused_bits(samples, frame):
    """Stored numbers without the bits beside them, which old files use for overlays."""
    if (samples.dtype.kind == "f") != (frame.stored.kind == "f"):
        raise ValueError(f"expected stored numbers of {frame.stored}, got {samples.dtype}")
    samples = samples.astype(frame.stored, copy=False)  # decoders need not know the sign
    allocated = 8 * frame.stored.itemsize
    if frame.stored.kind == "f" or frame.bits == allocated:
        return samples
    return (samples << (allocated - 1 - frame.high_bit)) >> (allocated - frame.bits)
