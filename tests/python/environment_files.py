"""Files of environments that other writers make."""

import numpy as np
import pytest


def write_exr(path, channels, **attributes):
    """By the reference library; channels by their names."""
    OpenEXR = pytest.importorskip("OpenEXR")
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION, **attributes}
    with OpenEXR.File(header, {name: np.ascontiguousarray(each) for name, each in channels.items()}) as file:
        file.write(str(path))


def write_hdr(path, image):
    """Radiance's format without compression: three bytes and a common exponent (G. Ward, Graphics Gems II, 1991)."""
    largest = image.max(axis=-1)
    mantissa, exponent = np.frexp(largest)
    scale = np.where(largest > 1e-32, 256 * mantissa / np.where(largest > 0, largest, 1), 0)
    rgbe = np.concatenate([image * scale[..., None], np.where(largest > 1e-32, exponent + 128, 0)[..., None]], axis=-1)
    height, width, _ = image.shape
    path.write_bytes(
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
        + f"-Y {height} +X {width}\n".encode()
        + rgbe.astype(np.uint8).tobytes()
    )
