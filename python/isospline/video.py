"""Videos of rendered images."""

from __future__ import annotations

import itertools
import os

import numpy as np

from .colors import linear_to_srgb
from .image import whole_file


def write_video(path, images, *, fps=30.0, quality=8.0):
    """Write images to a video as they come; the file appears whole or not at all.

    The encoder is FFmpeg's H.264, from the package imageio-ffmpeg (``pip install isospline[video]``). Transparent parts
    of the images become black.

    Parameters
    ----------
    path : str or path-like
        Ends in ``.mp4``.
    images : iterable of Image
        All of one size, of even width and height. A generator that renders them keeps one at a time in memory.
    fps : float
        Images a second.
    quality : float
        From 0 to 10, the best.

    Raises
    ------
    ValueError
        For no images, images of different or odd sizes, another suffix, an `fps` or a `quality` out of range.
    ImportError
        Without imageio-ffmpeg.
    OSError
        Where the file cannot be written.

    Examples
    --------
    >>> import isospline
    >>> def turn(scene, path):
    ...     cameras = isospline.turntable(scene, 120, size=(640, 480))
    ...     isospline.write_video(path, (isospline.render(scene, camera, size=(640, 480)) for camera in cameras))
    """
    if os.path.splitext(os.fspath(path))[1].lower() != ".mp4":
        raise ValueError(f"path: expected a name that ends in .mp4, got {os.fspath(path)!r}")
    if not 0 <= quality <= 10:
        raise ValueError(f"quality: expected a number from 0 to 10, got {quality!r}")
    images = iter(images)
    first = next(images, None)
    if first is None:
        raise ValueError("images: expected at least one, got none")
    height, width = first.depth.shape
    encoder = check((width, height), fps)

    with whole_file(path) as temporary:
        writer = encoder.write_frames(
            temporary, (width, height), fps=fps, quality=quality, codec="libx264", macro_block_size=1,
            # Colours of BT.709, said so in the file: players guess otherwise.
            output_params=["-vf", "scale=out_color_matrix=bt709", "-colorspace", "bt709", "-color_primaries", "bt709",
                           "-color_trc", "bt709", "-movflags", "+faststart"],
        )  # fmt: skip
        try:
            writer.send(None)
            for image in itertools.chain([first], images):
                if image.depth.shape != (height, width):
                    raise ValueError(f"images: expected all of one size, got {(height, width)} and {image.depth.shape}")
                # Premultiplied colour is colour over black.
                srgb = linear_to_srgb(image.color[..., :3])
                writer.send(np.rint(255 * srgb).astype(np.uint8))
        finally:
            writer.close()


def check(size, fps):
    """Find the encoder, and out whether it takes images of this (width, height) and rate."""
    try:
        import imageio_ffmpeg
    except ImportError:
        message = "writing a video needs the package imageio-ffmpeg: pip install isospline[video]"
        raise ImportError(message) from None
    if size[0] % 2 or size[1] % 2:
        raise ValueError(f"size: expected an even width and height for a video, got {size[0]}x{size[1]}")
    if not 0 < fps < float("inf"):
        raise ValueError(f"fps: expected a positive number of images a second, got {fps!r}")
    return imageio_ffmpeg
